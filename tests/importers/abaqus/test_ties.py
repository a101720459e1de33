"""Surfaces glued together and sectors: frequencies as CalculiX has them of the same deck."""

import re

import numpy as np
import pytest
from helpers.abaqus import needs_ccx, run
from helpers.coupled import STEEL, calculix, frequencies, lines_of
from helpers.input_file import write

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh
from slipstick.importers.import_model import read_model
from slipstick.io.model_file import load_model, save_model
from slipstick.models.reduced_sector import reduced_sector
from slipstick.solve.linear.lanczos import modes

COUNT = 6


def two(at: str = "2.000000000000e+01", count: int = 0) -> str:
    """Two bodies end to end, with ``count`` of the nodes at the joint put elsewhere."""
    one = lines_of(box((20.0, 10.0, 8.0), (2, 2, 1), "hex20"), "A")
    other = lines_of(box((20.0, 10.0, 8.0), (2, 3, 2), "hex20"), "B", 500, (20.0, 0.0, 0.0))
    other = other.replace(", 2.000000000000e+01,", f", {at},", count)
    return STEEL + one + other + "*BOUNDARY\nAx0, 1, 3\n"


TWO = two()
TIE = "*TIE, NAME=T, POSITION TOLERANCE=0.1{more}\nSBx0, SAx1\n"


@needs_ccx
def test_glued_bodies_have_the_frequencies_of_calculix(tmp_path):
    text = TWO + TIE.format(more="")
    model = read_model(write(tmp_path, text))
    np.testing.assert_allclose(frequencies(model, COUNT), calculix(write(tmp_path, text), COUNT), rtol=1e-6)
    apart = read_model(write(tmp_path, TWO))
    assert (
        len(model.dependent)
        == apart.n_dofs - model.n_dofs
        == 3 * len(box((1, 1, 1), (2, 3, 2), "hex20").surfaces["x0"].nodes)
    )


@needs_ccx
@pytest.mark.parametrize("adjust", [True, False])
def test_a_gap_is_closed_unless_the_file_forbids_it(tmp_path, adjust):
    gap = two("2.001000000000e+01", 3) + TIE.format(more="" if adjust else ", ADJUST=NO")
    model = read_model(write(tmp_path, gap))
    np.testing.assert_allclose(frequencies(model, COUNT), calculix(write(tmp_path, gap), COUNT), rtol=2e-6)
    assert any("moves" in note and "(ADJUST)" in note for note in model.notes) == adjust


def test_nodes_too_far_away_are_told(tmp_path):
    far = two("2.050000000000e+01", 1) + TIE.format(more=", ADJUST=NO")
    with pytest.warns(SlipstickWarning, match=r"\*TIE: 1 of \d+ nodes \(\d+, ...\) are too far from SAX1"):
        read_model(write(tmp_path, far))
    with pytest.raises(InputError, match=r"\*TIE: no node of SBX1 lies near enough to SAX1"):
        read_model(write(tmp_path, TWO + "*TIE, NAME=T, POSITION TOLERANCE=0.1\nSBx1, SAx1\n"), quiet=True)


def test_a_surface_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match=r"names the surface NOWHERE"):
        read_model(write(tmp_path, TWO + "*TIE, NAME=T\nSBx0, NOWHERE\n"))


def sector(count: int) -> Mesh:
    """A sector of a ring about x, thicker on one side."""
    flat = box((2.0, 1.0, 1.0), (2, 3, 2), "hex20")
    x, radius, angle = flat.nodes[:, 0], 10.0 + 3.0 * flat.nodes[:, 2], 2.0 * np.pi / count * flat.nodes[:, 1]
    x = x * (1.0 + 0.2 * flat.nodes[:, 2])
    nodes = np.stack([x, radius * np.sin(angle), radius * np.cos(angle)], axis=1)
    return Mesh(nodes=nodes, blocks=flat.blocks, surfaces=flat.surfaces)


RING = sector(12)
BETWEEN = np.setdiff1d(RING.surfaces["z0"].nodes, [*RING.surfaces["y0"].nodes, *RING.surfaces["y1"].nodes]) + 1
HELD = "*BOUNDARY\n" + "".join(f"{node}, 1\n" for node in BETWEEN.tolist())  # CalculiX takes none on the sides
SECTOR = STEEL + lines_of(RING, "A") + HELD
SIDES = "*SURFACE, NAME=LEFT, TYPE=NODE\nAy0\n*SURFACE, NAME=RIGHT, TYPE=NODE\nAy1\n"
CYCLIC = "*TIE, CYCLIC SYMMETRY, POSITION TOLERANCE=0.1, NAME=T\n{}\n*CYCLIC SYMMETRY MODEL, N={}, NGRAPH=1, TIE=T\n"
AXIS = "0., 0., 0., 1., 0., 0.\n"
ASKED = "*STEP\n*FREQUENCY\n{}\n*SELECT CYCLIC SYMMETRY MODES, NMIN={}, NMAX={}\n*END STEP\n"


@needs_ccx
@pytest.mark.parametrize("sides", ["LEFT, RIGHT", "SAy0, SAy1", "SAy1, SAy0"])
def test_a_sector_has_the_frequencies_of_calculix(tmp_path, sides):
    text = SECTOR + SIDES + CYCLIC.format(sides, 12) + AXIS + ASKED.format(2 * COUNT, 0, 0)
    model = read_model(write(tmp_path, text))
    assert model.warnings == ()
    run(tmp_path / "m.inp")
    rows = [line.split() for line in (tmp_path / "m.dat").read_text().splitlines()]
    theirs = np.array([float(row[2]) for row in rows if len(row) == 6 and row[0] == "0"])[::2]  # each stands twice
    # the first is the free turning about the axis, 0
    np.testing.assert_allclose(frequencies(model, COUNT), theirs[:COUNT], rtol=2e-6, atol=10.0)


def test_a_body_of_other_nodal_diameters_than_0_is_told(tmp_path):
    text = SECTOR + SIDES + CYCLIC.format("LEFT, RIGHT", 12) + AXIS
    for more, said in (("", ""), (ASKED.format(4, 0, 3), "asks for 1 to 3 nodal diameters and ")):
        with pytest.warns(SlipstickWarning, match=f"{said}is as a body computed for 0 alone, .*; ss.reduced_sector"):
            read_model(write(tmp_path, text + more))


@pytest.mark.parametrize("sides", ["LEFT, RIGHT", "SAy1, SAy0"])
def test_a_sector_is_read_with_its_faces(tmp_path, sides):
    text = SECTOR.replace(HELD, HELD.replace(", 1\n", ", 1, 3\n"))
    path = write(tmp_path, text + SIDES + CYCLIC.format(sides, 12) + AXIS + ASKED.format(4, 0, 0))
    model = read_model(path)
    assert model.symmetry.sectors == 12
    sector = reduced_sector(model, keep=[model.symmetry.alone.dofs[0]], modes=4)
    assert "numbered with the turning sense" in sector.notes[-1]
    np.testing.assert_allclose(sector.natural_frequencies(0), np.sqrt(found_in(model, 4)), rtol=1e-9)
    save_model(model, tmp_path / "m.h5")
    again = reduced_sector(load_model(tmp_path / "m.h5"), keep=[model.symmetry.alone.dofs[0]], modes=4)
    np.testing.assert_array_equal(again.natural_frequencies(3), sector.natural_frequencies(3))


def test_a_sector_whose_sides_do_not_match_is_read_and_reduced(tmp_path):
    nodes = RING.nodes.copy()
    x, radius = nodes[:, 0], np.hypot(nodes[:, 1], nodes[:, 2])
    thick = 2.0 * (1.0 + 0.2 * (radius - 10.0) / 3.0)
    nodes[:, 0] = x + 0.4 * np.arctan2(nodes[:, 1], nodes[:, 2]) * x * (thick - x) / thick
    text = STEEL + lines_of(Mesh(nodes=nodes, blocks=RING.blocks, surfaces=RING.surfaces), "A")
    text += HELD.replace(", 1\n", ", 1, 3\n") + CYCLIC.format("SAy0, SAy1", 12) + AXIS + ASKED.format(4, 0, 0)
    with pytest.warns(SlipstickWarning, match="nodes of SAY0 lie between nodes of SAY1"):
        model = read_model(write(tmp_path, text))
    sector = reduced_sector(model, keep=[model.symmetry.alone.dofs[0]], modes=4)
    assert "meshed differently" in sector.notes[-1]
    np.testing.assert_allclose(sector.natural_frequencies(0), np.sqrt(found_in(model, 4)), rtol=1e-9)


def found_in(model, count):
    return modes(model.K, model.M, count).eigenvalues


@needs_ccx
@pytest.mark.parametrize("diameter", [2, 3, 6])
def test_a_sector_has_the_frequencies_of_calculix_by_nodal_diameter(tmp_path, diameter):
    text = SECTOR + SIDES + CYCLIC.format("LEFT, RIGHT", 12) + AXIS + ASKED.format(2 * COUNT, diameter, diameter)
    model = read_model(write(tmp_path, text), quiet=True)
    run(tmp_path / "m.inp")
    rows = [line.split() for line in (tmp_path / "m.dat").read_text().splitlines()]
    theirs = np.array([float(row[3]) for row in rows if len(row) == 6 and row[0] == str(diameter)])
    found = reduced_sector(model, keep=[model.symmetry.alone.dofs[0]], modes=COUNT).natural_frequencies(diameter)
    np.testing.assert_allclose(np.repeat(found, 2)[: len(theirs)], theirs, rtol=1e-5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (CYCLIC.format("LEFT, RIGHT", 11) + AXIS, "check the number of sectors and the axis"),
        (CYCLIC.format("LEFT, RIGHT", 12) + "0., 0., 0., 0., 1., 0.\n", "check the number of sectors and the axis"),
        (CYCLIC.format("LEFT, RIGHT", 1) + AXIS, "expected N from 2 up"),
        (CYCLIC.format("LEFT, RIGHT", 12), "expected N from 2 up"),
        ("*CYCLIC SYMMETRY MODEL, N=12\n" + AXIS, "one .*TIE with CYCLIC SYMMETRY"),
        ("*TIE, MULTISTAGE, NAME=T\nLEFT, RIGHT\n", "joins stages with different numbers of sectors"),
        ("*TIE, NAME=T\nLEFT\n", "expected two surfaces on a line"),
    ],
)
def test_sectors_that_cannot_be_joined(tmp_path, text, said):
    with pytest.raises(InputError, match=said):
        read_model(write(tmp_path, SECTOR + SIDES + text), quiet=True)


def moved_side(way) -> str:
    """The sector with the nodes of its side y1 put elsewhere."""
    nodes = RING.nodes.copy()
    side = RING.surfaces["y1"].nodes
    nodes[side] = way(nodes[side])
    return STEEL + lines_of(Mesh(nodes=nodes, blocks=RING.blocks, surfaces=RING.surfaces), "A") + SIDES


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (moved_side(lambda x: x + np.array([0.01, 0.0, 0.0])), r"sides lie up to 0.01, .* of an edge, apart"),
        (moved_side(lambda x: x * [0.99, 1.0, 1.0]), r"\d+ of 21 nodes of LEFT lie between nodes of RIGHT"),
    ],
)
def test_sides_that_do_not_match_are_told(tmp_path, text, said):
    text += CYCLIC.format("SAy0, SAy1", 12) + AXIS + ASKED.format(4, 0, 0)
    with pytest.warns(SlipstickWarning) as told:
        read_model(write(tmp_path, text.replace("LEFT", "SAy0").replace("RIGHT", "SAy1")))
    said = said.replace("LEFT", "SAY0").replace("RIGHT", "SAY1")
    assert any(re.search(said, str(one.message)) for one in told)


def test_a_side_that_lacks_nodes_is_told(tmp_path):
    few = RING.surfaces["y0"].nodes[: len(RING.surfaces["y0"].nodes) // 2] + 1
    text = SECTOR + SIDES + "*NSET, NSET=FEW\n" + "".join(f"{node}\n" for node in few.tolist())
    text += CYCLIC.format("FEW, RIGHT", 12) + AXIS + ASKED.format(4, 0, 0)
    with pytest.warns(SlipstickWarning, match=r"nodes of RIGHT \(\d+, ...\) meet nothing of FEW"):
        read_model(write(tmp_path, text))


def test_surfaces_tied_across_a_gap_are_told(tmp_path):
    gap = two("2.020000000000e+01", 3) + "*TIE, NAME=T, POSITION TOLERANCE=1.0, ADJUST=NO\nSBx0, SAx1\n"
    with pytest.warns(SlipstickWarning, match=r"ties nodes that lie up to 0.2, 0.0\d+ of an edge, from SAX1"):
        read_model(write(tmp_path, gap))
    far = gap.replace(", ADJUST=NO", "").replace("2.020000000000e+01", "2.060000000000e+01")
    with pytest.warns(
        SlipstickWarning, match=r"moves 3 nodes onto .* \(ADJUST\): the elements there change their shape"
    ):
        read_model(write(tmp_path, far))
