"""Findings: every entry of a file comes out once, under its verdict."""

import pytest

from slipstick.errors import Fault, InputError, Place
from slipstick.importers.findings import Findings, Table, Verdict, made_of

TABLE = Table(
    ("CE CP", Verdict.COUPLING, "ties"),
    ("SAVE", Verdict.HARMLESS, ""),
    ("LUMPM", Verdict.APPROXIMATED, "is left out"),
    ("CDREAD", Verdict.INCOMPLETE, "brings in more"),
)


def found(*names, of_the_model=True):
    findings = Findings(source="a.cdb")
    for line, name in enumerate(names, 1):
        findings.look_up(TABLE, name, name, line, of_the_model=of_the_model)
    return findings


def test_each_verdict_has_its_way_out():
    findings = found("CE", "SAVE", "LUMPM", "CP", "CE", "SAVE", "NOSUCH")
    assert [str(c.where) for c in findings.couplings] == ["a.cdb, line 1 and 1 more: CE", "a.cdb, line 4: CP"]
    assert findings.warnings == (
        "a.cdb, line 3: LUMPM is left out",
        "a.cdb, line 7: NOSUCH is not understood: it has no effect here",
    )
    assert findings.notes == ("a.cdb: without effect here: SAVE (2)",)
    findings.refuse_incomplete()


def test_what_is_not_understood_outside_of_the_model_is_listed():
    findings = found("NOSUCH", "NOSUCH", of_the_model=False)
    assert findings.warnings == ()
    assert findings.notes == ("a.cdb: not understood, without effect here: NOSUCH (2)",)


def test_all_that_is_incomplete_is_said_at_once():
    findings = found("CDREAD", "CE")
    findings.add(Verdict.INCOMPLETE, "/INPUT", "brings in more", 9)
    with pytest.raises(InputError) as caught:
        findings.refuse_incomplete()
    assert caught.value.sentences == ("a.cdb, line 1: CDREAD brings in more", "a.cdb, line 9: /INPUT brings in more")


def test_a_coupling_says_what_to_do_with_and_without_matrices():
    (coupling,) = found("CP").couplings
    assert str(coupling.refused).startswith("a.cdb, line 1: CP ties; ")
    assert coupling.refused.where == ("a.cdb", "line 1", "CP")
    assert "export the assembled matrices" in coupling.refused.remedy
    assert "the matrices must hold it" in coupling.beside_matrices


def test_what_is_made_of_a_file_is_at_fault_there_unless_it_says_where():
    faults = [Fault(statement="the mesh has no elements"), Fault(Place("b.cdb", "line 3"), "is cut off")]
    with pytest.raises(InputError) as caught, made_of("a.cdb"):
        raise InputError(faults)
    assert caught.value.sentences == ("a.cdb: the mesh has no elements", "b.cdb, line 3: is cut off")
