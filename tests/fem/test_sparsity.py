"""The pattern of couplings: complete, symmetric, and the same matrix as adding element by element."""

import numpy as np
import pytest

from slipstick.fem.box import box
from slipstick.fem.sparsity import pattern_of


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
