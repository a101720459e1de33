"""Assembly does not depend on how the work is cut or on the order of nodes and elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipstick.fem import assembly
from slipstick.fem.assembly import assemble, conduction, pattern_of
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh

SOLID = Material(young=2.0, poisson=0.3, density=3.0, conductivity=1.5)
NAMES = ("stiffness", "mass", "conduction")


@pytest.mark.parametrize("kind", sorted(ELEMENTS))
def test_pieces_of_work_make_no_difference(kind, monkeypatch):
    mesh = box((1.0, 1.2, 0.9), (2, 2, 2), kind)
    whole = assemble(mesh, SOLID)
    monkeypatch.setattr(assembly, "_CHUNK_BYTES", 1.0)
    parts = assemble(mesh, SOLID)
    for name in NAMES:
        a, b = getattr(whole, name), getattr(parts, name)
        assert abs(a - b).max() <= 1e-14 * abs(a).max()
        assert abs(a - a.T).max() == 0.0
    assert abs(conduction(mesh, SOLID) - whole.conduction).max() < 1e-14


def test_numbers_of_nodes_and_elements_do_not_matter():
    mesh = box((1.0, 1.2, 0.9), (2, 2, 1), "hex20")
    rng = np.random.default_rng(0)
    order, rows = rng.permutation(mesh.n_nodes), rng.permutation(mesh.n_elements)
    place = np.argsort(order)
    mixed = Mesh(nodes=mesh.nodes[order], blocks={"hex20": place[mesh.blocks["hex20"][rows]]})
    dofs = (3 * order[:, None] + np.arange(3)).ravel()
    for name, index in zip(NAMES, (dofs, dofs, order), strict=True):
        a = getattr(assemble(mesh, SOLID), name).toarray()[np.ix_(index, index)]
        np.testing.assert_allclose(getattr(assemble(mixed, SOLID), name).toarray(), a, atol=1e-13)


def test_matrices_are_linear_in_the_materials_numbers():
    mesh = box((1.0, 1.2, 0.9), (1, 2, 1), "wedge15")
    one = assemble(mesh, SOLID)
    other = assemble(mesh, replace(SOLID, young=4.0, density=9.0, conductivity=0.5))
    for name, factor in zip(NAMES, (2.0, 3.0, 1 / 3), strict=True):
        a, b = getattr(one, name), getattr(other, name)
        assert abs(factor * a - b).max() < 1e-14 * abs(b).max()


def test_a_body_twice_as_large_is_twice_as_stiff_and_eight_times_as_heavy():
    mesh = box((1.0, 1.2, 0.9), (1, 2, 1), "tet10")
    one, two = assemble(mesh, SOLID), assemble(replace(mesh, nodes=2.0 * mesh.nodes), SOLID)
    for name, factor in zip(NAMES, (2.0, 8.0, 2.0), strict=True):
        np.testing.assert_allclose(getattr(two, name).toarray(), factor * getattr(one, name).toarray(), atol=1e-12)


@pytest.mark.parametrize("kind", ["hex8", "tet10", "pyramid5"])
def test_against_adding_element_by_element(kind):
    mesh = box((1.0, 1.0, 1.0), (2, 2, 1), kind)
    pattern = pattern_of(mesh)
    block = mesh.blocks[kind]
    parts = np.random.default_rng(0).normal(size=pattern.slots[kind].shape)
    dense = np.zeros((mesh.n_nodes, mesh.n_nodes))
    for row, part in zip(block, parts, strict=True):
        dense[np.ix_(row, row)] += part
    values = np.bincount(pattern.slots[kind].ravel(), parts.ravel(), minlength=pattern.n_couplings)
    np.testing.assert_allclose(pattern.scalar_matrix(values).toarray(), dense, atol=1e-14)
    np.testing.assert_allclose(pattern.repeated_matrix(values).toarray(), np.kron(dense, np.eye(3)), atol=1e-14)
    blocks = values[:, None, None] * np.arange(9.0).reshape(3, 3)
    expected = np.kron(dense, np.arange(9.0).reshape(3, 3))
    np.testing.assert_allclose(pattern.vector_matrix(blocks).toarray(), expected, atol=1e-13)
    coupled = np.zeros((mesh.n_nodes, mesh.n_nodes), dtype=bool)
    for row in block:
        coupled[np.ix_(row, row)] = True
    assert pattern.n_couplings == coupled.sum()
