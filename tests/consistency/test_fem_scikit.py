"""Matrices against scikit-fem, another code, on small distorted meshes: equal to rounding."""

import numpy as np
import pytest

from slipstick.fem.assembly import assemble
from slipstick.fem.boundary import boundary
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.loads import film_matrix
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.refine import quadratic

skfem = pytest.importorskip("skfem")

SOLID = Material(young=2.0, poisson=0.3, density=3.0, conductivity=1.5)
PAIRS = {
    "hex8": ("MeshHex1", "ElementHex1", "hex8"),
    "hex20": ("MeshHex1", "ElementHexS2", "hex8"),
    "tet4": ("MeshTet1", "ElementTetP1", "tet4"),
    "tet10": ("MeshTet1", "ElementTetP2", "tet4"),
    "wedge6": ("MeshWedge1", "ElementWedge1", "wedge6"),
}


def meshes(kind: str):
    """Our mesh and scikit-fem's, of the same straight-sided cells with inner nodes moved."""
    mesh_class, element_class, linear = PAIRS[kind]
    ours = box((1.0, 1.2, 0.9), (2, 2, 2), linear)
    nodes, inside = ours.nodes.copy(), np.setdiff1d(np.arange(ours.n_nodes), boundary(ours).nodes)
    nodes[inside] += np.random.default_rng(3).uniform(-0.1, 0.1, (len(inside), 3))
    block = ours.blocks[linear]
    order = {"hex8": [0, 4, 3, 1, 7, 5, 2, 6], "tet4": [0, 1, 2, 3], "wedge6": [0, 1, 2, 3, 4, 5]}[linear]
    theirs = getattr(skfem, mesh_class)(nodes.T, np.ascontiguousarray(block[:, order].T))
    ours = Mesh(nodes=nodes, blocks=ours.blocks, surfaces=ours.surfaces)
    return (quadratic(ours) if kind != linear else ours), theirs, getattr(skfem, element_class)()


def matched(ours: Mesh, basis) -> np.ndarray:
    """For each of our nodes, the number of scikit-fem's scalar degree of freedom at the same place."""
    places = basis.doflocs.T
    distance = np.linalg.norm(ours.nodes[:, None] - places[None], axis=2)
    assert distance.min(axis=1).max() < 1e-12
    return distance.argmin(axis=1)


@pytest.mark.parametrize("kind", sorted(PAIRS))
def test_stiffness_mass_and_conduction(kind):
    from skfem.helpers import ddot, dot, grad, sym_grad, trace

    ours, theirs, scalar = meshes(kind)
    element = ELEMENTS[kind]
    rules = []
    for rule in (element.rule, element.mass_rule):
        points = (rule.points + 1) / 2 if kind.startswith("hex") else rule.points.copy()
        scale = 8.0 if kind.startswith("hex") else 1.0
        if kind == "wedge6":
            points[:, 2], scale = (points[:, 2] + 1) / 2, 2.0
        rules.append((points.T, rule.weights / scale))

    @skfem.BilinearForm
    def elasticity(u, v, _):
        return SOLID.lame * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * SOLID.shear_modulus * ddot(
            sym_grad(u), sym_grad(v)
        )

    @skfem.BilinearForm
    def conduction(u, v, _):
        return SOLID.conductivity * dot(grad(u), grad(v))

    @skfem.BilinearForm
    def inertia(u, v, _):
        return SOLID.density * u * v

    flat = skfem.Basis(theirs, scalar, quadrature=rules[0])
    solid = skfem.Basis(theirs, skfem.ElementVector(scalar), quadrature=rules[0])
    heavy = skfem.Basis(theirs, scalar, quadrature=rules[1])
    node = matched(ours, flat)
    dof = np.ravel(3 * node[:, None] + np.arange(3))
    assert np.allclose(solid.doflocs[:, 3 * node], ours.nodes.T)
    matrices = assemble(ours, SOLID)
    for A, B, index in (
        (matrices.stiffness, elasticity.assemble(solid), dof),
        (matrices.conduction, conduction.assemble(flat), node),
        (matrices.mass[::3][:, ::3], inertia.assemble(heavy), node),
    ):
        reference = B.toarray()[np.ix_(index, index)]
        assert np.abs(A.toarray() - reference).max() < 1e-13 * np.abs(reference).max()


@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet4", "tet10"])
def test_surface_matrices(kind):
    ours, theirs, scalar = meshes(kind)
    sides = theirs.facets_satisfying(lambda x: x[2] > 0.9 - 1e-9)
    facets = skfem.FacetBasis(theirs, scalar, facets=sides, intorder=6)
    node = matched(ours, skfem.Basis(theirs, scalar))
    film = skfem.BilinearForm(lambda u, v, _: 5.0 * u * v).assemble(facets).toarray()[np.ix_(node, node)]
    flux = skfem.LinearForm(lambda v, _: 2.0 * v).assemble(facets)[node]
    top = ours.surface("z1")
    np.testing.assert_allclose(film_matrix(ours, top, 5.0).toarray(), film, atol=1e-13)
    np.testing.assert_allclose(film_matrix(ours, top, 2.0).sum(axis=1), flux, atol=1e-13)
