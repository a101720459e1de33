"""Tables of a case that a verb of their own computes: each is named once in the command line and once among tables."""

from operator import attrgetter

import slipstick as ss
from slipstick.case.sections import REQUESTS
from slipstick.cli.main import app
from slipstick.cli.verbs.requests import REQUESTS as ALIKE


def test_every_table_has_a_verb_and_a_function_of_the_library() -> None:
    verbs = {command.callback.__name__ if command.name is None else command.name for command in app.registered_commands}
    assert {name.replace("_", "-") for name in REQUESTS} <= verbs
    assert set(ALIKE) <= set(REQUESTS)
    for table in REQUESTS.values():
        assert callable(attrgetter(table.verb)(ss))
