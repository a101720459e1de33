"""Every row of the verification table holds; the table itself says so when one does not."""

import pytest

from slipstick import InputError, verify
from slipstick.verify.table import Check, all_checks

CHECKS = all_checks()
LONG = {"order", "CF9", "C16", "C9", "C10", "C11", "C13", "C14: v = 10", "belt: bSTAB"}
"""Rows of whole curves, by their beginning; what C9 to C13 say is in test_examples.py too."""


def is_long(check):
    return any(f"{check.name}: {check.what}".startswith(f"{name}:") for name in LONG)


@pytest.mark.parametrize("check", [c for c in CHECKS if not is_long(c)], ids=lambda c: f"{c.name}: {c.what}")
def test_row(check):
    row = check.row()
    assert row.ok, row


@pytest.mark.verify
@pytest.mark.parametrize("check", [c for c in CHECKS if is_long(c)], ids=lambda c: f"{c.name}: {c.what}")
def test_long_row(check):
    row = check.row()
    assert row.ok, row


def test_every_closed_form_and_claim_has_a_row():
    names = {check.name for check in CHECKS}
    assert names >= {f"CF{k}" for k in range(1, 11)}
    assert names >= {f"C{k}" for k in range(1, 17) if k != 8}
    assert len({(c.name, c.what) for c in CHECKS}) == len(CHECKS)


def test_rows_are_chosen_by_name_or_description():
    assert [row.name for row in verify.run("masing")] == ["CF1", "CF1"]
    assert {row.name for row in verify.run(["CF3", "CF5"])} == {"CF3", "CF5"}
    assert {row.name for row in verify.run("cf1")} == {"CF1"}  # and not CF10
    assert {row.name for row in verify.run("CF")} == {f"CF{k}" for k in range(1, 11)}


def test_unknown_name_is_an_input_error():
    with pytest.raises(InputError, match="no check is called CF99; there are CF1"):
        verify.run("CF99")


def broken():
    raise ValueError("no such luck")


@pytest.mark.parametrize(
    ("expected", "found", "relation", "tolerance", "ok"),
    [
        (1.0, 1.1, "=", 0.2, True), (1.0, 1.3, "=", 0.2, False), (1.0, float("nan"), "=", 0.2, False),
        (1.0, 0.9, "<", 0.0, True), (1.0, 1.0, "<", 0.0, False), (1.0, 1.1, ">", 0.0, True),
        (1.0, 0.9, ">", 0.0, False),
    ],
)  # fmt: skip
def test_verdicts(expected, found, relation, tolerance, ok):
    check = Check(name="x", what="y", compute=lambda: (expected, found), relation=relation, tolerance=tolerance)
    assert check.row().ok is ok
    assert check.row().verdict == ("ok" if ok else "failed")


def test_an_error_is_a_failed_row_and_not_the_end():
    row = Check(name="x", what="y", compute=broken).row()
    assert not row.ok
    assert row.verdict == "error: no such luck"
