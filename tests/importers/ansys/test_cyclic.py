"""CYCLIC of Ansys archives: sectors, axis and faces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.ansys import archive_text

import slipstick as ss
from slipstick.errors import InputError
from slipstick.importers.ansys.archive import read_cyclic
from slipstick.importers.findings import Findings

FACES = ("CYCLIC_M01L", "CYCLIC_M01H")
SYSTEM = "LOCAL,R5.0,LOC,  11,  1,  1.0, 2.0, 3.0\nLOCAL,R5.0,ANG,  11,  0.0, -90.0, 0.0\n"


def read(text: str, components: tuple[str, ...] = FACES) -> tuple[object, Findings]:
    findings = Findings(source="m.cdb")
    return read_cyclic(findings, text, components), findings


@pytest.mark.parametrize("words", ["36", "36,10.0,1,CYCLIC", ",10.0", "36.0, 10.0, 0, cyclic, 1"])
def test_a_number_of_sectors_or_their_angle(words: str) -> None:
    symmetry, findings = read(f"CYCLIC,{words}\n")
    assert symmetry is not None
    assert (symmetry.sectors, symmetry.low, symmetry.high) == (36, FACES[:1], FACES[1:])
    assert np.allclose(symmetry.axis.direction, [0, 0, 1])
    assert not findings.couplings


def test_the_axis_is_the_third_one_of_its_coordinate_system() -> None:
    symmetry, _ = read(SYSTEM + "CYCLIC,12,30.,11\n")
    assert symmetry is not None
    assert np.allclose(symmetry.axis.point, [1, 2, 3])
    assert np.allclose(symmetry.axis.direction, [0, 1, 0])  # z turned by -90 degrees about x


@pytest.mark.parametrize(
    ("text", "components", "said"),
    [
        ("CYCLIC,12,30.,12\n", FACES, "does not define coordinate system 12"),
        ("CYCLIC,12\n", ("TIP",), "expected the node components CYCLIC_M01L and CYCLIC_M01H"),
        ("CYCLIC\n", FACES, "expected a number of sectors"),
        ("CYCLIC,12,30.,0,ROTOR\n", FACES, "ROTOR_M01L"),
    ],
)
def test_what_is_not_understood_is_a_coupling(text: str, components: tuple[str, ...], said: str) -> None:
    symmetry, findings = read(text, components)
    assert symmetry is None
    assert said in str(findings.couplings[0].what)


def test_other_forms_are_not_a_sector() -> None:
    assert read("CYCLIC,STATUS\n")[0] is None
    assert read("CYCLIC,OFF\n")[0] is None


def component(name: str, nodes: list[int]) -> str:
    rows = "".join(f"{node:10d}" for node in nodes)
    return f"CMBLOCK,{name:8s},NODE,{len(nodes):8d}\n(8i10)\n{rows}\n"


def test_an_archive_is_reduced_without_more_arguments(tmp_path: Path) -> None:
    corners = [(r, a, z) for z in (0.0, 1.0) for r, a in ((1.0, 0.0), (3.0, 0.0), (3.0, 90.0), (1.0, 90.0))]
    points = [(r * np.cos(np.deg2rad(a)), r * np.sin(np.deg2rad(a)), z) for r, a, z in corners]
    text = archive_text([list(range(1, 9))], 185, points).split("D,1,UX")[0]
    text += component(FACES[0], [1, 2, 5, 6]) + component(FACES[1], [3, 4, 7, 8])
    text += "".join(f"D,{node},ALL,0.\n" for node in (1, 4, 5, 8)) + "CYCLIC,4,90.0,1,CYCLIC\n"
    (tmp_path / "m.cdb").write_text(text)
    with pytest.warns(ss.SlipstickWarning):  # of a linear brick
        model = ss.import_model(tmp_path / "m.cdb", material=ss.Material(young=2e11, poisson=0.3, density=7800.0))
    sector = ss.reduced_sector(model, keep=[model.dofs[0]], modes=2)
    assert sector.sectors == 4
    assert sector.n_dofs == 6
    assert sector.natural_frequencies(1).size == 2
    with pytest.raises(InputError, match="one of 4 sectors of a disc, and its faces are free"):
        ss.reduced_body(model, keep=[model.dofs[0]])
