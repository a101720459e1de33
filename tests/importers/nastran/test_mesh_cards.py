"""Cards of a mesh: each is read, or has one verdict."""

import pytest

from slipstick.importers.findings import Findings, Verdict
from slipstick.importers.nastran.cards import CARDS, MATRIX_CARDS
from slipstick.importers.nastran.mesh import MESH_CARDS, classify_mesh_card, is_other_element


def test_no_card_has_two_fates():
    for table in (CARDS, MATRIX_CARDS, MESH_CARDS):
        assert all((entry.read is not None) == (entry.verdict is Verdict.READ) for entry in table.values())
    assert not CARDS.keys() & (MATRIX_CARDS.keys() | MESH_CARDS.keys())
    assert not any(map(is_other_element, MESH_CARDS))


@pytest.mark.parametrize(
    ("name", "fate"),
    [
        ("FORCE", "notes"),
        ("PSHELL", "notes"),
        ("EIGRL", "notes"),
        ("GENEL", "couplings"),
        ("CDAMP2", "couplings"),
        ("RFORCE", "warnings"),
        ("WHATEVER", "warnings"),
    ],
)
def test_verdicts(name, fate):
    findings = Findings(source="m.bdf")
    classify_mesh_card(findings, name, 3)
    assert {kind for kind in ("notes", "couplings", "warnings") if getattr(findings, kind)} == {fate}
    assert name in str(getattr(findings, fate))
