"""Matrices in files of their own or together, with the map of their rows."""

import numpy as np
import pytest
from helpers.plain import check
from scipy.io import mmwrite
from scipy.sparse import coo_array, save_npz, tril

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model


@pytest.mark.parametrize("symmetry", ["symmetric", "general"])
def test_matrix_market(plain, symmetry):
    folder, K, M = plain
    mmwrite(folder / "K.mtx", coo_array(K), symmetry=symmetry)
    mmwrite(folder / "M.mtx", coo_array(M), symmetry=symmetry)
    check(read_model([folder / "K.mtx", folder / "M.mtx", folder / "map.txt"]), K, M)


def test_scipy_npz_of_one_half(plain):
    folder, K, M = plain
    save_npz(folder / "stiffness.npz", tril(coo_array(K)).tocsr())
    save_npz(folder / "mass.npz", coo_array(M).tocsr())
    check(read_model([folder / "stiffness.npz", folder / "mass.npz", folder / "map.txt"]), K, M)
    with pytest.raises(InputError, match="no map from rows"):
        read_model([folder / "stiffness.npz", folder / "mass.npz"])


def test_npz_bundle(plain):
    folder, K, M = plain
    nodes = {"nodes": [2, 4], "coordinates": [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]}
    np.savez(folder / "b.npz", K=K, M=M, dof_nodes=[4] * 3 + [2] * 3, dof_components=[1, 2, 3] * 2, **nodes)
    model = read_model(folder / "b.npz")
    check(model, K, M)
    assert model.positions(np.array([4])).tolist() == [[3.0, 4.0, 5.0]]
    np.savez(folder / "c.npz", K=K, M=M)
    with pytest.raises(InputError, match="no dof_nodes and no dof_components"):
        read_model(folder / "c.npz")


def test_matrices_that_do_not_fit_each_other(plain):
    folder, K, M = plain
    mmwrite(folder / "K.mtx", coo_array(K))
    mmwrite(folder / "M.mtx", coo_array(M[:3, :3]))
    with pytest.raises(InputError, match=r"matrices of different size \(K is 6 x 6, M is 3 x 3\)"):
        read_model([folder / "K.mtx", folder / "M.mtx", folder / "map.txt"])
