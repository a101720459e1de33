"""Models at speed: arguments, notes, matrices between speeds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.imported import STEEL
from scipy.linalg import eigh

import slipstick as ss
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem import rotation
from slipstick.fem.axis import Axis
from slipstick.fem.box import box
from slipstick.fem.equations import NodalEquation
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel
from slipstick.fem.rotation import at_speed, centrifugal, kept_centrifugal
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

ABOUT = {"direction": (0, 0, 1)}


@pytest.fixture(scope="module")
def blade() -> ImportedModel:
    mesh = box((0.3, 0.03, 0.01), (3, 1, 1), "hex20")
    return assemble_mesh(MeshModel(mesh=mesh), source="blade", material=STEEL, fixed=["x0"])


def test_the_note_says_what_was_done(blade):
    found = at_speed(blade, 500.0, axis={"point": (-0.1, 0, 0), "direction": [0, 0, 2]})
    assert found.speed == 500.0
    assert "at 500 rad/s about (0, 0, 1) through (-0.1, 0, 0): largest static displacement" in found.notes[-1]
    assert "Coriolis forces are left out" in found.notes[-1]
    assert blade.speed == 0.0
    with raises_fault("speed", says="blade is a model at 500 rad/s already"):
        at_speed(found, 600.0, axis=ABOUT)


def test_speeds_survive_a_model_file(blade, tmp_path):
    from slipstick.io.model_file import load_model, save_model

    save_model(at_speed(blade, 500.0, axis=ABOUT), tmp_path / "m.h5")
    assert load_model(tmp_path / "m.h5").speed == 500.0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"speed": 1.0}, "axis.*found None.*expected a table"),
        ({"speed": 1.0, "axis": {"direction": (0, 0, 1)}, "others": {1.0: None}}, "axis.*together with others"),
        ({"speed": -1.0}, "speed.*found -1.0.*expected a speed >= 0"),
        ({"speed": "fast"}, "speed.*found 'fast'"),
        ({"speed": 1.0, "axis": {"direction": (0, 0)}}, "axis, direction"),
        ({"speed": 1.0, "axis": {"direction": (0, 0, 0)}}, "axis, direction"),
        ({"speed": 1.0, "axis": {"direction": (0, 0, 1), "point": "here"}}, "axis, point"),
        ({"speed": 1.0, "others": {}}, "others.*expected"),
        ({"speed": 1.0, "others": {"a": 1}}, "others.*expected"),
        ({"speed": 1.0, "others": {0.0: None}}, "others.*expected"),
    ],
)
def test_wrong_arguments(blade, arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        at_speed(blade, **arguments)


def test_matrices_between_speeds(blade):
    """Linear in the square of the speed; rows in another order are found by name."""
    at = {speed: replace(blade, K=(1.0 + speed**2 / 1e4) * blade.K) for speed in (50.0, 100.0)}
    turned = np.arange(blade.n_dofs)[::-1]
    other = at[100.0]
    at[100.0] = replace(
        other,
        K=other.K[turned][:, turned],
        M=other.M[turned][:, turned],
        dof_nodes=other.dof_nodes[turned],
        dof_components=other.dof_components[turned],
    )
    for speed in (0.0, 20.0, 50.0, 80.0, 100.0):
        found = at_speed(blade, speed, others=at)
        assert abs(found.K - (1.0 + speed**2 / 1e4) * blade.K).max() < 1e-12 * abs(blade.K).max()
    with raises_fault("speed", found="101", expected="at most 100, the highest speed with matrices"):
        at_speed(blade, 101.0, others=at)
    with pytest.raises(InputError, match="have different mass"):
        at_speed(blade, 10.0, others={100.0: replace(blade, M=2.0 * blade.M)})
    with pytest.raises(InputError, match="have different dofs"):
        at_speed(blade, 10.0, others={100.0: replace(blade, dof_nodes=blade.dof_nodes + 1)})


def test_what_looks_wrong_is_warned_of(blade):
    with pytest.warns(SlipstickWarning, match=r"the strain at speed is 0\.\d+"):
        at_speed(blade, 9000.0, axis=ABOUT)
    heavy = replace(blade, M=1.5 * blade.M)
    with pytest.warns(SlipstickWarning, match="centrifugal forces are those of the mesh"):
        at_speed(heavy, 100.0, axis=ABOUT)


def test_a_blade_at_speed_is_a_structure(blade):
    """Stiffer in bending out of the plane of rotation, in a reduction too."""
    tip = next(name for name in blade.dofs[::-1] if name.endswith("z"))
    first = [
        ss.reduced_body(model, keep=[tip], modes=4).structure.natural_frequencies[0]
        for model in (blade, at_speed(blade, 1000.0, axis=ABOUT))
    ]
    assert first[1] > 1.1 * first[0]


ROD = Material(young=100.0, poisson=0.0, density=2.0)


def rod():
    mesh = MeshModel(mesh=box((3.0, 0.1, 0.1), (6, 1, 1), "hex20"))
    return assemble_mesh(mesh, source="rod", material=ROD, fixed=["x0"])


def test_a_rod_stretches_as_it_should():
    """u = rho s^2 (L^2 x / 2 - x^3 / 6 + r (L x - x^2 / 2)) / E, r the radius of the root."""
    model, speed = rod(), 1e-2
    x = model.mesh.nodes[:, 0]
    for radius in (0.0, 5.0):
        found = centrifugal(model, speed, Axis(point=(-radius, 0.05, 0.05)))
        exact = 2.0 * speed**2 / 100.0 * (4.5 * x - x**3 / 6.0 + radius * (3.0 * x - x**2 / 2.0))
        np.testing.assert_allclose(found.displacement[:, 0], exact, atol=2e-4 * exact.max())
        slope = 2.0 * speed**2 / 100.0 * (4.5 + 3.0 * radius)
        assert found.strain == pytest.approx(slope, rel=2e-2)
    ones = np.ones(model.n_dofs)
    assert found.mass == pytest.approx(float(ones @ (model.M @ ones)) / 3.0)


def test_about_its_own_axis_a_rod_only_softens():
    """No stretch worth the name; across the axis the mass takes away s^2, along it nothing."""
    model, speed = rod(), 0.1
    found = centrifugal(model, speed, Axis(point=(0.0, 0.05, 0.05), direction=(1, 0, 0)))
    along = (model.dof_components == 0).astype(float)
    across = (model.dof_components == 1).astype(float)
    assert across @ (found.stiffness @ across) == pytest.approx(-(speed**2) * (across @ (model.M @ across)), rel=1e-2)
    assert abs(along @ (found.stiffness @ along)) < 1e-4 * speed**2 * (along @ (model.M @ along))


def test_at_rest_nothing_changes():
    found = centrifugal(rod(), 0.0, Axis())
    assert found.strain == 0.0
    assert abs(found.stiffness).max() == 0.0


def test_small_speeds_add_their_square():
    first, second = (centrifugal(rod(), speed, Axis()).stiffness / speed**2 for speed in (3e-4, 6e-4))
    assert abs(first - second).max() < 1e-4 * abs(first).max()


def test_what_cannot_turn_is_refused():
    model = rod()
    for changed, sentence in (
        (replace(model, mesh=None), "forces of rotation need the mesh; import it too, or give matrices at two speeds"),
        (replace(model, materials={}), "forces of rotation need the material of its mesh"),
        (replace(model, dof_nodes=model.dof_nodes + 100), "is not in the mesh"),
    ):
        with pytest.raises(InputError, match=sentence):
            centrifugal(changed, 1.0, Axis())
    free = assemble_mesh(MeshModel(mesh=box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")), source="cube", material=ROD)
    with pytest.raises(InputError, match="has rigid-body motion"):
        centrifugal(free, 1.0, Axis())
    with pytest.raises(InputError, match=r"finds no static state at 100 rad/s"):
        centrifugal(model, 100.0, Axis())


@pytest.mark.verify
def test_tied_parts_turn_as_one_piece():
    """Two halves that share no node, their faces tied by equations, against the whole."""
    whole = box((3.0, 0.1, 0.1), (6, 1, 1), "hex20")
    cells = whole.blocks["hex20"]
    right = np.unique(cells[3:])
    own = np.full(whole.n_nodes, -1)
    own[right] = whole.n_nodes + np.arange(len(right))
    halves = Mesh(
        nodes=np.vstack([whole.nodes, whole.nodes[right]]),
        blocks={"hex20": np.vstack([cells[:3], own[cells[3:]]])},
        node_sets={"root": whole.node_set("x0")},
    )
    apart = assemble_mesh(MeshModel(mesh=halves), source="halves", material=ROD, fixed=["root"])
    face = np.intersect1d(cells[:3], cells[3:])
    equations = [
        NodalEquation(terms=((int(own[n]) + 1, axis, 1.0), (int(n) + 1, axis, -1.0))) for n in face for axis in range(3)
    ]
    tied = apart.constrain(equations)
    one = assemble_mesh(MeshModel(mesh=whole), source="whole", material=ROD, fixed=["x0"])
    assert tied.n_dofs == one.n_dofs
    axis = Axis(point=(-1.0, 0.02, 0.05), direction=(0.1, 0.0, 1.0))
    ours, theirs = (centrifugal(model, 0.3, axis) for model in (tied, one))
    values = [
        eigh((m.K + c.stiffness).toarray(), m.M.toarray(), eigvals_only=True)[:6]
        for m, c in ((tied, ours), (one, theirs))
    ]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-7)
    np.testing.assert_allclose(ours.displacement[whole.n_nodes :], theirs.displacement[right], atol=1e-9)


def test_states_are_kept_and_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = box((0.3, 0.03, 0.01), (2, 1, 1), "hex8")
    model = assemble_mesh(MeshModel(mesh=mesh), source="blade", material=STEEL, fixed=["x0"])
    made: list[float] = []

    def counted(*given):
        made.append(given[1])
        return centrifugal(*given)

    monkeypatch.setattr(rotation, "centrifugal", counted)
    first, second = (kept_centrifugal(model, 300.0, Axis(), tmp_path) for _ in range(2))
    assert made == [300.0]
    assert abs(first.stiffness - second.stiffness).max() == 0.0
    np.testing.assert_array_equal(first.displacement, second.displacement)
    assert (first.strain, first.mass) == (second.strain, second.mass)
    light = replace(model, materials={"all": Material(young=2e11, poisson=0.3, density=7000.0)})
    for other in ((model, 301.0, Axis()), (model, 300.0, Axis(point=(1, 0, 0))), (light, 300.0, Axis())):
        kept_centrifugal(*other, tmp_path)
    assert len(made) == 4
    assert len(list(tmp_path.iterdir())) == 4
    for path in tmp_path.iterdir():
        path.write_bytes(path.read_bytes()[:200])
    kept_centrifugal(model, 300.0, Axis(), tmp_path)
    assert len(made) == 5
    kept_centrifugal(model, 300.0, Axis(), None)
    assert len(made) == 6


def test_coriolis_forces_make_a_shaft_whirl_at_its_frequencies_less_and_more_the_speed():
    """A square shaft along its axis: in the frame that stands still it is the shaft at rest but for rotary inertia."""
    from slipstick.structure.complex_modes import complex_modes

    L, side, speed = 0.3, 0.01, 150.0
    shaft = assemble_mesh(
        MeshModel(mesh=box((L, side, side), (4, 1, 1), "hex20")), source="shaft", material=STEEL, fixed=["x0"]
    )
    first = np.sqrt(eigh(shaft.K.toarray(), shaft.M.toarray(), eigvals_only=True, subset_by_index=(0, 1)))
    assert first[1] == pytest.approx(first[0], rel=1e-6)
    middle = (0.0, 0.5 * side, 0.5 * side)
    axis = {"point": middle, "direction": (1.0, 0.0, 0.0)}
    found = at_speed(shaft, speed, axis=axis, coriolis=True)
    assert "Coriolis forces are in C" in found.notes[-1]
    poles = complex_modes(found.M.toarray(), found.C.toarray(), found.K.toarray()).upper.poles
    inertia = (1.875 / L) ** 2 * side**2 / 12.0
    assert np.abs(poles.real).max() < 1e-6 * first[0]
    assert poles.imag[:2] == pytest.approx([first[0] - speed, first[0] + speed], rel=4.0 * inertia)
    structure = ss.MatrixStructure(M=found.M, C=found.C, K=found.K, dofs=found.dofs)
    assert structure.natural_frequencies[:2] == pytest.approx(poles.imag[:2], rel=1e-6)


def test_the_coriolis_matrix_is_that_of_a_rigid_body(blade):
    """``e1 G e2 = 2 m e1 (a x e2)`` for a blade that moves as a whole."""
    free = assemble_mesh(MeshModel(mesh=box((0.3, 0.03, 0.01), (3, 1, 1), "hex20")), source="free", material=STEEL)
    direction = np.array([0.0, 0.6, 0.8])
    G = rotation.coriolis_matrix(free, Axis.of({"direction": tuple(direction)}))
    along = (free.dof_components == np.arange(3)[:, None]).astype(float)
    mass = STEEL.density * 0.3 * 0.03 * 0.01
    for i, e in enumerate(np.eye(3)):
        assert along @ (G @ along[i]) == pytest.approx(2.0 * mass * np.cross(direction, e), abs=1e-12)
    assert abs(G + G.T).max() == pytest.approx(0.0, abs=1e-15)
    with raises_fault("coriolis", says="comes from a mesh"):
        at_speed(blade, 10.0, others={50.0: blade}, coriolis=True)
