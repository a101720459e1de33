"""Centrifugal states against closed forms; what cannot turn."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from slipstick.errors import InputError
from slipstick.fem.axis import Axis
from slipstick.fem.box import box
from slipstick.fem.equations import NodalEquation
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.rotation import centrifugal
from slipstick.importers.mesh_model import MeshModel, assemble_mesh

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
