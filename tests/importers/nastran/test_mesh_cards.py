"""Cards of a mesh: each is read, or has one verdict."""

import pytest

from slipstick.importers.findings import Findings, Verdict
from slipstick.importers.nastran.mesh import (
    LUMPS,
    MATERIALS,
    MESH_CARDS,
    POINTS,
    SOLIDS,
    SYSTEMS,
    classify_mesh_card,
    is_other_element,
)


def test_no_card_has_two_fates():
    read = {name for name, entry in MESH_CARDS.items() if entry.verdict is Verdict.READ}
    assert read == {*SOLIDS, *LUMPS, *MATERIALS, *POINTS, *SYSTEMS}
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
        ("MATT1", "warnings"),
        ("WHATEVER", "warnings"),
    ],
)
def test_verdicts(name, fate):
    findings = Findings(source="m.bdf")
    classify_mesh_card(findings, name, 3)
    assert {kind for kind in ("notes", "couplings", "warnings") if getattr(findings, kind)} == {fate}
    assert name in str(getattr(findings, fate))
