"""Contact pairs and bolts of bulk data: kept by name as those of other codes are, and told."""

import numpy as np
import pytest
from helpers.bulk import MATERIAL, card, lines_of, write

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.interfaces import SurfacePair
from slipstick.fem.load_steps import LoadStep, StepLoad
from slipstick.fem.mesh import together
from slipstick.fem.pretension import cut_sections
from slipstick.importers.import_model import read_model

LOW = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
MESH = together({"low": LOW, "high": box((1.0, 1.0, 1.0), (2, 2, 1), "hex8", at=(0.0, 0.0, 1.0))})
BODY = lines_of(MESH) + "".join(
    card("SPC1", 1, 123, n + 1) for name in ("low.z0", "high.z1") for n in MESH.surfaces[name].nodes.tolist()
)
HEAD = "SOL 103\nCEND\nSPC = 1\n"


def faces(number, name):
    """A BSURFS of all faces of a surface."""
    words = ["BSURFS", number, "", "", ""]
    (rows,) = MESH.surfaces[name].faces.values()
    for row in rows.tolist():
        element = next(i for i, nodes in enumerate(MESH.blocks["hex8"].tolist(), 1) if {*row} <= {*nodes})
        words += [element, *(n + 1 for n in row[:3])]
    return card(*words)


REGIONS = faces(3, "low.z1") + faces(4, "high.z0")
APART = (
    "is kept as model.contact_pairs: nothing joins its surfaces until contacts are put there ([[joint]] of a case, "
    "ss.surface_pair)"
)


def read(folder, text, head=HEAD):
    return read_model(write(folder, BODY + text, head), quiet=True)


def test_regions_of_faces_are_pairs(tmp_path):
    text = REGIONS + card("BCTSET", 9, 3, 4, 0.2, 0.0, 0.1, "", "", "", 4, 3)
    model = read(tmp_path, text)
    assert model.contact_pairs == {
        "region 3/region 4": SurfacePair(dependent="region 3", independent="region 4", mu=0.2, interaction="BCTSET 9"),
        "region 4/region 3": SurfacePair(dependent="region 4", independent="region 3", interaction="BCTSET 9"),
    }
    for name, own in (("region 3", "low.z1"), ("region 4", "high.z0")):
        assert sorted(model.mesh.surface(name).nodes) == sorted(MESH.surfaces[own].nodes)
    assert any(APART in sentence and "BCTSET" in sentence for sentence in model.warnings)


@pytest.mark.parametrize(("wanted", "pairs"), [(9, 1), (10, 1), (20, 2), (None, 2)])
def test_the_case_control_chooses_sets(tmp_path, wanted, pairs):
    text = REGIONS + card("BCTSET", 9, 3, 4) + card("BCTSET", 10, 4, 3) + card("BCTADD", 20, 9, 10)
    model = read(tmp_path, text, HEAD + (f"BCSET = {wanted}\n" if wanted else ""))
    assert len(model.contact_pairs) == pairs
    assert any("not asked for by BCSET" in note for note in model.notes) == (pairs == 1)


@pytest.mark.parametrize(
    ("own", "row", "mu"), [(("", ""), 0.15, 0.15), ((0.3, 0.2), "", 0.2), (("", 0.25), "", 0.25), (("", ""), "", None)]
)
def test_bodies_of_elements_touch_by_their_outer_faces(tmp_path, own, row, mu):
    text = card("BSURF", 11, 1) + card("BSURF", 12, 2, "THRU", 5)
    text += card("BCBODY", 1, "3D", "DEFORM", 11, 0, own[0]) + card("BCBODY", 2, "", "", 12, 0, own[1])
    text += card("BCTABLE", 0, "", "", 1, "", "", "", "", "SLAVE", 1, "", "", row, "", 0, "", "MASTERS", 2)
    model = read(tmp_path, text)
    (pair,) = model.contact_pairs.values()
    assert (pair.dependent, pair.independent, pair.mu) == ("region 11", "region 12", mu)
    assert [model.mesh.surface(name).n_faces for name in ("region 11", "region 12")] == [6, 16]


def test_regions_of_properties(tmp_path):
    """All solids are of property 7: the region is all that lies outside."""
    model = read(tmp_path, REGIONS + card("BCPROPS", 8, 7) + card("BCTSET", 1, 3, 8))
    assert model.mesh.surface("region 8").n_faces == 6 + 16


@pytest.mark.parametrize("direction", [3, 2])
def test_a_bolt_is_whole(tmp_path, direction):
    """Grid points across it, and a coordinate system whose second axis is z."""
    mesh = box((1.0, 1.0, 3.0), (1, 1, 3), "hex8")
    cut = [i + 1 for i, x in enumerate(mesh.nodes) if x[2] == 1.0]
    held = "".join(card("SPC1", 1, 123, n + 1) for n in mesh.surfaces["z0"].nodes.tolist())
    system = card("CORD2R", 6, "", 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0) if direction == 2 else ""
    text = lines_of(mesh) + held + system
    bolt = card("BOLT", 5, 2, 6 if system else 0, direction, *cut) + card("BOLTFOR", 1, 5000.0, 5)
    model = read_model(write(tmp_path, text + bolt, HEAD), quiet=True)
    assert [*model.pretension_sections] == ["bolt 5"]
    section = model.pretension_sections["bolt 5"]
    assert section.node == 0
    load = StepLoad(kind="bolt force", where="bolt 5", value=5000.0)
    assert model.load_steps == {"BOLTFOR 1": LoadStep(procedure="static", loads=(load,))}
    np.testing.assert_allclose(section.normal, (0.0, 0.0, 1.0), atol=1e-15)
    surface = model.mesh.surface("bolt 5")
    assert surface.n_faces == 1
    from slipstick.fem.geometry import nodal_normals

    np.testing.assert_allclose(nodal_normals(model.mesh, surface)[surface.nodes], [[0.0, 0.0, 1.0]] * 4, atol=1e-12)
    assert any("BOLT is kept as model.pretension_sections" in sentence for sentence in model.warnings)
    plain = read_model(write(tmp_path, text, HEAD), quiet=True)
    assert abs(model.K - plain.K).max() == 0.0
    parted, (part,) = cut_sections(model, ["bolt 5"])
    assert part.dof == f"n{mesh.n_nodes + 1}x"
    assert abs(parted.fix(part.dof).K - plain.K).max() == 0.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (card("BCTSET", 9, 3, 7), "BCTSET names region 7, which no BSURFS, BSURF or BCPROPS of solids makes"),
        (card("BCTSET", 9, 3, 4, -0.2), "BCTSET cannot be read (a coefficient of friction of -0.2)"),
        (card("BCTSET", 9, 3, "four"), "BCTSET cannot be read"),
        (faces(3, "low.z1"), "BSURFS gives region 3 twice"),
        (card("BSURFS", 5, "", "", "", 99, 1, 2, 3), "BSURFS names element 99, which is no solid of the file"),
        (card("BSURFS", 5, "", "", "", 1, 1, 2, 9), "no corners of a face of element 1"),
        (card("BSURFS", 5), "BSURFS names no face"),
        (card("BSURF", 5, 70, 71), "BSURF names elements (70, ...) with no outer face of a solid"),
        (card("BSURF", 5, 1, "THRU", 900000000), "is too long"),
        (card("BCTSET", 9, 3, 4) + card("BCTPARA", 9, "TIED", 1), "BCTPARA glues surfaces together (TIED)"),
        (card("BGSET", 9, 3, 4), "BGSET glues surfaces together"),
        (card("BCBODY", 1, "3D", "RIGID", 3), "BCBODY touches with a body that is not meshed (RIGID)"),
        (card("BCTABLE", 0, *[""] * 7, "SLAVE", 1, *[""] * 6, "MASTERS", 2), "BCTABLE names body 1"),
        (card("BOLT", 5, 2, 0, 3, 1, 2, 990), "BOLT names grid point 990, which the file does not have"),
        (card("BOLT", 5, 2, 0, 3, 1, 2), "BOLT has grid points that form no face of a solid element"),
        (card("BOLT", 5, 2, 0, 4, 1, 2), "BOLT cannot be read (direction 4; expected 1 to 3)"),
        (card("BOLT", 5, 2, 77, 3, 1, 2), "coordinate system 77"),
        (card("BLSEG", 5, 1, 2), "BLSEG holds lines in contact"),
    ],
)
def test_faults(tmp_path, text, said):
    with pytest.raises(InputError) as caught:
        read(tmp_path, REGIONS + text)
    assert said in str(caught.value)
    assert str(caught.value).startswith("m.bdf")


def test_a_bolt_of_elements_is_told(tmp_path):
    model = read(tmp_path, card("BOLT", 5, 3, 0, 3, "", "", "", "", 1))
    assert not model.pretension_sections
    assert any("BOLT names elements but no section across them" in sentence for sentence in model.warnings)
    assert MATERIAL in BODY
