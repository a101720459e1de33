"""A refusal asserted by the data of its faults; their sentences may be reworded."""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import contextmanager

import pytest

from slipstick.errors import InputError


@contextmanager
def raises_fault(*where: str | int, says: str = "", **data: str) -> Generator[pytest.ExceptionInfo[InputError]]:
    """One of the faults has this path, if any is given, these fields (``found``, ...) and ``says`` in its words."""
    with pytest.raises(InputError) as caught:
        yield caught
    assert any(
        where in ((), fault.where)
        and all(getattr(fault, name) == value for name, value in data.items())
        and re.search(says, sentence)
        for fault, sentence in zip(caught.value.faults, caught.value.sentences, strict=True)
    ), caught.value.faults
