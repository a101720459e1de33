"""Quadratic elements without some middle nodes: edges that stay straight, between elements too."""

import numpy as np
import pytest
from helpers.ansys import archive_text

from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.importers.import_model import read_model

pytest.importorskip("mapdl_archive")


def write(folder, rows, places):
    path = folder / "m.cdb"
    text = archive_text(rows, 186, [tuple(x) for x in places.tolist()])
    held = "".join(f"D,{n},ALL,0.\n" for n in np.flatnonzero(places[:, 0] < 1e-9) + 1)
    path.write_text(text + held)
    return path


def test_all_middles_missing_is_the_linear_brick_integrated_as_quadratic(tmp_path):
    """Against the quadratic element whose middles are tied by hand: u = T q."""
    whole = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    corners = box((2.0, 1.0, 1.0), (2, 1, 1), "hex8")
    rows = [[*(row + 1), *[0] * 12] for row in corners.blocks["hex8"].tolist() and corners.blocks["hex8"]]
    rows = [[int(n) for n in row] for row in rows]
    model = read_model(write(tmp_path, rows, corners.nodes), quiet=True)
    steel = Material(young=3.0e7, poisson=0.3, density=7.3e-4)
    K = assemble(whole, steel).stiffness.toarray()
    T = np.zeros((whole.n_nodes, corners.n_nodes))
    for big, small in zip(whole.blocks["hex20"], corners.blocks["hex8"], strict=True):
        T[big[:8], small] = 1.0
        for place, (a, b) in enumerate(ELEMENTS["hex20"].edges, 8):
            T[big[place]] = 0.0
            T[big[place], small[[a, b]]] = 0.5
    T3 = np.kron(T, np.eye(3))
    exact = T3.T @ K @ T3
    labels = {f"n{i + 1}{axis}": 3 * i + a for i in range(corners.n_nodes) for a, axis in enumerate("xyz")}
    at = [labels[name] for name in model.dofs]
    assert not set(model.dofs) - set(labels)
    np.testing.assert_allclose(model.K.toarray(), exact[np.ix_(at, at)], atol=1e-8 * np.abs(exact).max())
    assert any("20 edges have no middle node: they stay straight" in note for note in model.notes)


def test_one_missing_middle_between_two_elements_is_one_node(tmp_path):
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    block = mesh.blocks["hex20"].copy()
    shared = np.intersect1d(block[0], block[1])
    middle = next(n for n in shared.tolist() if n in block[0][8:])
    rows = [[0 if n == middle else n + 1 for n in row] for row in block.tolist()]
    model = read_model(write(tmp_path, rows, mesh.nodes), quiet=True)
    assert isinstance(model.mesh, Mesh)
    assert model.mesh.n_nodes == mesh.n_nodes + 1
    assert len(model.dependent) == 3
    assert {node for node, _ in model.dependent.tolist()} == {mesh.n_nodes + 1}
    assert any("1 edges have no middle node" in note for note in model.notes)
