"""Commands of an archive: what is a command, what it becomes, which supports it gives."""

import pytest

from slipstick.errors import InputError
from slipstick.importers.ansys.commands import classify_commands, commands
from slipstick.importers.findings import Findings


def classified(text):
    findings = Findings(source="a.cdb")
    return classify_commands(findings, text), findings


def test_supports_add_up():
    held, findings = classified("D,      1,UX  , 0.0, 0.0\nD,2,ALL,0.\nd,3,UY,,,,,UZ\nD,4,TEMP,0.0\n")
    assert held == {(1, 0), (3, 1), (3, 2)} | {(2, axis) for axis in range(6)}
    assert findings.couplings == ()


@pytest.mark.parametrize(("zero", "other"), [("OMEGA,0.,0.,0.", "OMEGA,0.,0.,1."), ("ALPHAD,0.0", "ALPHAD,1D-3")])
def test_commands_with_zeros_have_no_effect(zero, other):
    assert classified(zero + "\n")[1].warnings == ()
    assert len(classified(other + "\n")[1].warnings) == 1


def test_numbers_of_blocks_and_comments_are_no_commands():
    text = "NBLOCK,6,SOLID\n        1        0\n-1\n! D,1,ALL\nFINISH ! CE,1\n(3i9,6e21.13)\n"
    assert [(line, name) for line, name, _ in commands(text)] == [(1, "NBLOCK"), (5, "FINISH")]


def test_every_command_has_a_fate():
    """Known and harmless: listed with its count; known to couple: refused; not known: warned of, never lost."""
    _, findings = classified("SAVE\nSAVE\nCERIG,1,2\nNOSUCH,1\n")
    assert findings.notes == ("a.cdb: without effect here: SAVE (2)",)
    assert [str(coupling.where) for coupling in findings.couplings] == ["a.cdb, line 3: CERIG"]
    assert findings.warnings == ("a.cdb, line 4: NOSUCH is not understood: it has no effect here",)


def test_a_support_that_cannot_be_read_names_its_line():
    with pytest.raises(InputError, match=r"a\.cdb, line 2: D cannot be read"):
        classified("\nD," + "9" * 50 + ",ALL,0.\n")
