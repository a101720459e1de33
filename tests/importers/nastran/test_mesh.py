"""Solids of bulk data assembled here: the same matrices as the mesh they were written from, and what is refused."""

import numpy as np
import pytest
from helpers.bulk import MATERIAL, card, lines_of, write
from helpers.coupled import beam
from helpers.nastran import write_text

from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.importers.import_model import import_model, read_model
from slipstick.importers.roles import ImportOptions

STEEL = Material(young=2.1e5, poisson=0.3, density=7.8e-9)
MESH = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
HELD = "".join(card("SPC1", 1, 123, n + 1) for n in MESH.surfaces["x0"].nodes.tolist())


@pytest.mark.parametrize("kind", ["hex8", "hex20", "wedge6", "wedge15", "tet4", "tet10"])
def test_every_solid_has_the_matrices_of_its_mesh(tmp_path, kind):
    mesh = box((2.0, 1.2, 0.8), (2, 1, 1), kind)
    held = "".join(card("SPC1", 1, 123, n + 1) for n in mesh.surfaces["x0"].nodes.tolist())
    model = read_model(write(tmp_path, lines_of(mesh) + held), quiet=True)
    whole = assemble(mesh, STEEL)
    at = np.array([3 * (n - 1) + c for n, c in zip(model.dof_nodes, model.dof_components, strict=True)])
    assert len(at) == 3 * (mesh.n_nodes - len(mesh.surfaces["x0"].nodes))
    for ours, theirs in ((model.K, whole.stiffness), (model.M, whole.mass)):
        assert abs(ours - theirs[at][:, at]).max() < 1e-9 * abs(theirs).max()
    assert model.materials == {"property 7": STEEL}
    same = not any("fully integrated" in warning for warning in model.warnings)
    assert same == kind.startswith("tet")


def test_the_case_control_or_the_user_says_which_supports_hold(tmp_path):
    text = lines_of(MESH) + HELD + card("SPC1", 2, 123, 1)
    with pytest.raises(InputError, match=r"holds the constraint sets \[1, 2\]"):
        read_model(write(tmp_path, text), quiet=True)
    by_case = read_model(write(tmp_path, text, "SOL 103\nCEND\nSPC = 1\n"), quiet=True)
    with pytest.warns(SlipstickWarning, match="CHEXA of 20 nodes are computed as fully integrated hex20"):
        by_hand = import_model(write(tmp_path, text), constraints=2)
    assert (len(by_case.constrained), len(by_hand.constrained)) == (3 * len(MESH.surfaces["x0"].nodes), 3)


def test_points_in_a_cylindrical_system_and_supports_along_own_directions(tmp_path):
    """The same beam with its points given by radius, angle and height, held along radial directions at one end."""
    mesh = beam((2, 1, 1))
    shifted = mesh.nodes + np.array([0.0, 20.0, 3.0])
    angle, radius = np.degrees(np.arctan2(shifted[:, 1], shifted[:, 0])), np.hypot(shifted[:, 0], shifted[:, 1])
    plain = lines_of(mesh).split("CHEXA", 1)
    points = "".join(
        card("GRID", i, 4, f"{r:.14e}", f"{a:.14e}", f"{z:.14e}", 4)
        for i, (r, a, z) in enumerate(zip(radius, angle, shifted[:, 2], strict=True), 1)
    )
    system = card("CORD2C", 4, "", 0.0, -20.0, -3.0, 0.0, -20.0, 7.0, 5.0, -20.0, -3.0)
    ends = [mesh.surfaces[face].nodes.tolist() for face in ("x0", "x1")]
    held = "".join(card("SPC1", 1, 123, n + 1) for n in ends[0]) + "".join(card("SPC1", 1, 1, n + 1) for n in ends[1])
    model = read_model(write(tmp_path, system + points + "CHEXA" + plain[1] + held), quiet=True)
    np.testing.assert_allclose(model.coordinates, mesh.nodes, atol=1e-9)
    motion = {f"n{n + 1}{axis}": None for n in ends[1] for axis in "xy"}
    for name in motion:
        motion[name] = model.directions([name]).toarray()[:, 0] if name in {*model.dofs, *model.dependent_dofs} else 0.0
    for n in ends[1]:
        radial = shifted[n, :2] / radius[n]
        left = radial[0] * motion[f"n{n + 1}x"] + radial[1] * motion[f"n{n + 1}y"]
        np.testing.assert_allclose(left, 0.0, atol=1e-12)
    assert model.n_dofs == 3 * (mesh.n_nodes - len(ends[0])) - len(ends[1])


def test_poisson_may_follow_from_the_shear_modulus_and_masses_are_scaled(tmp_path):
    text = lines_of(MESH).replace(MATERIAL, "PSOLID,7,3\nMAT1,3,2.6+5,1.+5,,3.\nPARAM,WTMASS,.5\nPARAM,GRDPNT,0\n")
    model = read_model(write(tmp_path, text + HELD), quiet=True)
    assert model.materials["property 7"].poisson == pytest.approx(0.3)
    assert model.materials["property 7"].density == pytest.approx(1.5)
    assert any("multiplied by PARAM,WTMASS = 0.5" in note for note in model.notes)


def test_edges_without_middle_node_stay_straight(tmp_path):
    text = lines_of(MESH) + HELD
    middle = int(MESH.blocks["hex20"][0][8]) + 1
    lines = [line if line.startswith("GRID") else line.replace(f",{middle},", ",,") for line in text.split("\n")]
    model = read_model(write(tmp_path, "\n".join(lines)), quiet=True)
    assert any("1 edges have no middle node" in note for note in model.notes)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("CQUAD4,99,8,1,2,3,4\n", "CQUAD4 shares nodes with solids: the stiffness and mass it adds are not read"),
        ("CBUSH,99,8,1,2\n", "CBUSH shares nodes with solids"),
        ("CONM1,99,1\n", "CONM1 adds stiffness, mass or damping, which is not read"),
        ("RBE1,9,1,123456\n,UM,2,123\n", "RBE1 couples nodes rigidly"),
        ("CYJOIN,1,,1,2\n", "CYJOIN ties the two sides"),
        ("SPC,1,3,4,.5\n", "SPC prescribes a displacement that is not 0"),
        ("SPCD,1,3,5,.5\n", "SPCD prescribes a displacement that is not 0"),
        ("INCLUDE 'x.bdf'\n", "INCLUDE is not read"),
        ("CHEXA,77,8,1,2,3,4,5,6\n,7,8\n", "property 8 has no PSOLID"),
        ("CHEXA,77,8,1,2,3,4,5,6\n,7,8\nPSOLID,8,9\nMAT9,9,1.\n", "property 8 names material 9, which is no MAT1"),
        ("CTETRA,77,7,1,2,3\n", "element 77 lacks a corner node"),
        ("CTETRA,77,7,1,2,3,999\n", "uses node 999, which is not in the mesh"),
        ("CHEXA,x,7,1\n", "CHEXA cannot be read"),
    ],
)
def test_what_is_refused_by_name(tmp_path, more, said):
    with pytest.raises(InputError) as caught:
        read_model(write(tmp_path, lines_of(MESH) + HELD + more), quiet=True)
    assert said in str(caught.value)
    assert "m.bdf" in str(caught.value)


def test_elements_that_stand_alone_and_cards_without_effect_are_listed(tmp_path):
    far = card("GRID", 901, "", 9.0, 9.0, 9.0) + card("GRID", 902, "", 9.0, 9.0, 8.0)
    text = lines_of(MESH) + HELD + far + "CBAR,99,8,901,902\nEIGRL,1,,,10\nFORCE,1,3,,1.,0.,0.,1.\nODDCARD,1\n"
    model = read_model(write(tmp_path, text), quiet=True)
    assert any("elements that are no solids were left out: 1 CBAR" in note for note in model.notes)
    assert any("without effect here: EIGRL, FORCE" in note for note in model.notes)
    assert any("ODDCARD is not understood" in warning for warning in model.warnings)


def test_shells_alone_are_no_mesh(tmp_path):
    points = "".join(card("GRID", i, "", float(i), 0.0, 0.0) for i in range(1, 5))
    with pytest.raises(InputError, match="has no solid element"):
        read_model(write(tmp_path, points + "CQUAD4,1,1,1,2,3,4\n"), ImportOptions(material=STEEL))


def test_the_solids_beside_matrices_have_their_mass(tmp_path):
    path = write(tmp_path, lines_of(MESH) + HELD)
    whole = assemble(MESH, STEEL)
    at = 6 * (np.arange(3 * MESH.n_nodes) // 3) + np.arange(3 * MESH.n_nodes) % 3
    K, M = (np.zeros((6 * MESH.n_nodes, 6 * MESH.n_nodes)) for _ in "KM")
    K[np.ix_(at, at)], M[np.ix_(at, at)] = whole.stiffness.toarray(), whole.mass.toarray()
    op4 = tmp_path / "job.op4"
    op4.write_text(write_text({"KGG": K, "MGG": M}, "dense"))
    assert read_model([op4, path]).warnings == ()
    op4.write_text(write_text({"KGG": K, "MGG": 1.1 * M}, "dense"))
    with pytest.warns(SlipstickWarning, match=r"the mesh beside them .*, 10 % apart"):
        read_model([op4, path])
    with pytest.warns(SlipstickWarning) as told:
        read_model([op4, path], ImportOptions(units="N, m, s"))
    assert any("property 7: E = " in str(one.message) and "in the units stated" in str(one.message) for one in told)
    op4.write_text(write_text({"KGG": K, "MGG": 1e6 * M}, "dense"))
    with pytest.raises(InputError, match="in the same units"):
        read_model([op4, path])
