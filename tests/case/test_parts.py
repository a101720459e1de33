"""Faults of contacts, said at the place in the case file that they come from."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from slipstick.case.contact import in_block
from slipstick.errors import Fault

PLACED: Any = [SimpleNamespace(name=f"c{i}", row=SimpleNamespace(where=("contact", 1 + i // 2))) for i in range(4)]
"""Two blocks of two contacts each."""


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        (("contact", "c2"), ("contact", 2)),
        (("contact", "c1", "kt"), ("contact", 1, "kt")),
        (("contact", "c3", "rubbing", "velocity"), ("contact", 2, "rubbing", "velocity")),
        (("contact", "another", "kt"), ("contact", "another", "kt")),
        (("load", "c1", "dof"), ("load", "c1", "dof")),
        ((), ()),
    ],
)
def test_a_fault_stands_at_the_block_of_its_contact(where: tuple[Any, ...], expected: tuple[Any, ...]) -> None:
    found = in_block(Fault(where, found="1", expected="2"), PLACED)
    assert found.where == expected
    assert (found.found, found.expected) == ("1", "2")
