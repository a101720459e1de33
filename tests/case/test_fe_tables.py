"""Values of tables of a finite element structure."""

from __future__ import annotations

from typing import Any

import pytest

from slipstick.case.fe import MOST_CONTACTS, _contacts
from slipstick.errors import InputError


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (1, 1),
        (MOST_CONTACTS, MOST_CONTACTS),
        ([3, 7], [3, 7]),
        ([[0, 1, 2.5]], [[0.0, 1.0, 2.5]]),
        ([[0.0, 1.0, 2.0], [3, 4, 5]], [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]),
    ],
)
def test_contacts_are_a_number_labels_or_positions(given: Any, expected: Any) -> None:
    assert _contacts(given) == expected


@pytest.mark.parametrize(
    "given", [0, -1, 1.5, [], [1.5, 2.0], [[1.0, 2.0]], [[1, 2, "a"]], [[1, 2, 3], 4], "all", True]
)
def test_what_is_none_of_them(given: Any) -> None:
    with pytest.raises(InputError, match="a number of contacts such as 8"):
        _contacts(given)


@pytest.mark.parametrize("given", [MOST_CONTACTS + 1, [1] * (MOST_CONTACTS + 1), [[0, 0, 0]] * (MOST_CONTACTS + 1)])
def test_too_many(given: Any) -> None:
    with pytest.raises(InputError, match=f"at most {MOST_CONTACTS} contacts"):
        _contacts(given)
