"""Deformed solids: rigid rotations, energies, derivatives of the forces."""

from dataclasses import replace

import numpy as np
import pytest

from slipstick.fem.assembly import assemble, pattern_of
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import quadratic
from slipstick.fem.rotation import deformed

SOLID = Material(young=2.0, poisson=0.3, density=1.0)
KINDS = {"hex8": "hex8", "hex20": "hex8", "tet4": "tet4", "tet10": "tet4", "wedge6": "wedge6", "wedge15": "wedge6"}


def solid(kind: str) -> Mesh:
    mesh = box((1.0, 1.2, 0.9), (1, 1, 1), KINDS[kind])
    x, y, z = mesh.nodes.T
    mesh = replace(mesh, nodes=np.stack([x + 0.1 * y, y + 0.1 * x * z, z], axis=1))
    return quadratic(mesh) if KINDS[kind] != kind else mesh


@pytest.mark.parametrize("kind", KINDS)
def test_the_stiffness_is_the_derivative_of_the_forces(kind):
    mesh, rng = solid(kind), np.random.default_rng(3)
    pattern, K = pattern_of(mesh), assemble(mesh, SOLID).stiffness
    u, v = 0.1 * rng.normal(size=(2, mesh.n_nodes, 3))

    def forces(at: np.ndarray) -> np.ndarray:
        return K @ at.ravel() + deformed(mesh, SOLID, pattern, at).force.ravel()

    slope = (forces(u + 1e-5 * v) - forces(u - 1e-5 * v)) / 2e-5
    tangent = K + pattern.vector_matrix(deformed(mesh, SOLID, pattern, u).stiffness)
    np.testing.assert_allclose(tangent @ v.ravel(), slope, atol=1e-8 * np.abs(slope).max())
    assert abs(tangent - tangent.T).max() == pytest.approx(0.0, abs=1e-15)


def test_rigid_motions_of_any_size_bring_no_forces():
    mesh = solid("hex20")
    pattern, K = pattern_of(mesh), assemble(mesh, SOLID).stiffness
    turn, _ = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    u = mesh.nodes @ (turn - np.eye(3)).T + [1.0, 2.0, 3.0]
    found = deformed(mesh, SOLID, pattern, u)
    np.testing.assert_allclose(K @ u.ravel() + found.force.ravel(), 0.0, atol=1e-13)
    assert found.strain < 1e-13
    still = deformed(mesh, SOLID, pattern, np.zeros_like(u))
    assert still.strain == 0.0
    assert not still.force.any()
    assert not still.stiffness.any()


def test_forces_are_the_slope_of_the_energy_of_a_stretched_bar():
    """Uniaxial, no lateral contraction: S = E e with e = s + s^2 / 2, force (1 + s) S on the area."""
    mesh = box((2.0, 1.0, 1.0), (1, 1, 1), "hex8")
    bar = Material(young=3.0, poisson=0.0)
    stretch = 0.2
    u = mesh.nodes * [stretch, 0.0, 0.0]
    K = assemble(mesh, bar).stiffness
    total = (K @ u.ravel()).reshape(-1, 3) + deformed(mesh, bar, pattern_of(mesh), u).force
    end = mesh.surface("x1").nodes
    assert total[end, 0].sum() == pytest.approx((1.0 + stretch) * 3.0 * (stretch + stretch**2 / 2))
    np.testing.assert_allclose(total[:, 1:], 0.0, atol=1e-15)
