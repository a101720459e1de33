"""Tables of a case that a verb of their own computes: each is named once in the command line and once among tables."""

from operator import attrgetter

from typer.main import get_command

import slipstick as ss
from slipstick.case.sections import REQUESTS
from slipstick.cli.main import app
from slipstick.cli.verbs.requests import REQUESTS as ALIKE


def test_every_table_has_a_verb_and_a_function_of_the_library() -> None:
    assert {name.replace("_", "-") for name in REQUESTS} <= set(get_command(app).commands)  # type: ignore[attr-defined]
    assert set(ALIKE) <= set(REQUESTS)
    for table in REQUESTS.values():
        assert callable(attrgetter(table.verb)(ss))
