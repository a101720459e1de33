"""Strains of motions whose strain is known, at the centroids and nodes of every element type."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.elements import ELEMENTS
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.strains import chosen_elements, strain_matrix

METAL = Material(young=3.0, poisson=0.25, density=1.0)
GRADIENT = np.array([[0.3, -0.2, 0.5], [0.7, 0.1, -0.4], [0.25, 0.6, -0.8]])
"""Of a motion: rotations and all six strains."""


def strain_of(gradient: np.ndarray) -> np.ndarray:
    """xx, yy, zz and the angles xy, yz, zx of motions with gradients (..., 3, 3)."""
    both = gradient + np.swapaxes(gradient, -1, -2)
    at = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)]
    return np.stack([both[..., i, j] * (0.5 if i == j else 1.0) for i, j in at], axis=-1)


def sheared(kind: str) -> Mesh:
    """A box turned into a parallelepiped and, where edges stay straight, with corners moved out of order."""
    mesh = box((1.0, 1.3, 0.8), (2, 2, 2), kind)
    nodes = mesh.nodes @ np.array([[1.0, 0.1, 0.0], [0.2, 1.0, -0.1], [0.0, 0.3, 1.0]])
    return replace(mesh, nodes=nodes)


def distorted(kind: str) -> Mesh:
    """A box whose inner nodes are moved: no element is a parallelepiped any more."""
    mesh = sheared(kind)
    moved = 0.04 * np.sin(7.0 * mesh.nodes[:, [1, 2, 0]] + 3.0 * mesh.nodes)
    return replace(mesh, nodes=mesh.nodes + moved)


@pytest.mark.parametrize("at", ["elements", "nodes"])
@pytest.mark.parametrize("kind", list(ELEMENTS))
def test_a_constant_strain_is_exact(kind: str, at: str) -> None:
    mesh = distorted(kind)
    places, matrix = strain_matrix(mesh, METAL, chosen_elements(mesh, "all"), at)
    found = (matrix.T @ (mesh.nodes @ GRADIENT.T).ravel()).reshape(-1, 6)
    assert len(found) == (mesh.n_elements if at == "elements" else len(mesh.used_nodes))
    np.testing.assert_allclose(found, np.broadcast_to(strain_of(GRADIENT), found.shape), atol=1e-12)
    stress = places.stress(found[:, :, None], np.arange(len(found)))[..., 0]
    E, nu = METAL.young, METAL.poisson
    e, D = strain_of(GRADIENT), np.zeros((6, 6))
    D[:3, :3] = nu + (1.0 - 2.0 * nu) * np.eye(3)
    D[3:, 3:] = 0.5 * (1.0 - 2.0 * nu) * np.eye(3)
    np.testing.assert_allclose(stress[0], E / (1.0 + nu) / (1.0 - 2.0 * nu) * D @ e, atol=1e-12)


@pytest.mark.parametrize("at", ["elements", "nodes"])
@pytest.mark.parametrize("kind", [kind for kind in ELEMENTS if kind.endswith(("20", "20r", "10", "15", "13"))])
def test_a_linear_strain_is_exact_in_straight_quadratic_elements(kind: str, at: str) -> None:
    """Motion ``x^T Q_i x``, gradient ``2 Q_i x``."""
    Q = np.array([[[0.3, 0.1, -0.2], [0.1, 0.5, 0.4], [-0.2, 0.4, 0.1]], np.diag([0.2, -0.7, 0.3]), np.ones((3, 3))])
    mesh = sheared(kind)
    places, matrix = strain_matrix(mesh, METAL, chosen_elements(mesh, "all"), at)
    motion = np.einsum("na,iab,nb->ni", mesh.nodes, Q, mesh.nodes)
    found = (matrix.T @ motion.ravel()).reshape(-1, 6)
    exact = strain_of(2.0 * np.einsum("iab,nb->nia", Q, places.positions))
    np.testing.assert_allclose(found, exact, atol=1e-12)


def test_elements_by_number_by_set_and_on_a_surface() -> None:
    mesh = box((3.0, 2.0, 1.0), (3, 2, 1), "hex20")
    mesh = replace(
        mesh, element_sets={"ROOT": {"hex20": np.array([0, 1])}}, element_labels={"hex20": np.arange(11, 17)}
    )
    for wanted, expected in (
        ("all", range(11, 17)), ("ROOT", [11, 12]), ("x1", [15, 16]), (12, [12]), ([16, "ROOT", 11], [11, 12, 16]),
        ("y0", [11, 13, 15]),
    ):  # fmt: skip
        chosen = chosen_elements(mesh, wanted)
        places, _ = strain_matrix(mesh, METAL, chosen)
        assert places.labels.tolist() == list(expected)
        corners = mesh.blocks["hex20"][places.labels - 11][:, :8]
        np.testing.assert_allclose(places.positions, mesh.nodes[corners].mean(axis=1), atol=1e-12)


def test_what_is_not_there_is_said() -> None:
    mesh = box((3.0, 2.0, 1.0), (3, 2, 1), "hex20")
    with raises_fault("stress", remedy="its elements have numbers from 1 to 6"):
        chosen_elements(mesh, [1, 7])
    with raises_fault("stress, element number", found="-1"):
        chosen_elements(mesh, -1)
    with pytest.raises(
        ss.InputError, match="2 of the elements asked for are not in the mesh, the first of them 7"
    ) as caught:
        chosen_elements(mesh, [1, 7, 9, "x2"])
    assert "there is no element set or surface 'x2' in the model; there are all, x0, x1" in str(caught.value)
    both = Mesh(
        nodes=np.vstack([mesh.nodes, box((1.0, 1.0, 1.0), (1, 1, 1), "tet10").nodes + 10.0]),
        blocks={
            "hex20": mesh.blocks["hex20"],
            "tet10": box((1.0, 1.0, 1.0), (1, 1, 1), "tet10").blocks["tet10"] + mesh.n_nodes,
        },
    )
    with raises_fault("stress", remedy="name an element set or a surface"):
        chosen_elements(both, 3)
    assert {kind: len(part) for kind, part in chosen_elements(both, "all").items()} == {"hex20": 6, "tet10": 6}


def test_a_node_between_two_materials_is_a_place_for_each() -> None:
    """Two cubes of unlike stiffness: their strains are not mixed."""
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    mesh = replace(mesh, element_sets={n: {"hex20": np.array([i])} for i, n in enumerate("ab")})
    parts = {"a": METAL, "b": Material(young=6.0, poisson=0.25, density=1.0)}
    places, matrix = strain_matrix(mesh, parts, chosen_elements(mesh, "all"), "nodes")
    assert len(places.labels) == 40
    assert mesh.n_nodes == 32
    motion = np.zeros((mesh.n_nodes, 3))
    x = mesh.nodes[:, 0]
    motion[:, 0] = np.where(x < 1.0, x, 1.0 + 0.5 * (x - 1.0))
    strain = (matrix.T @ motion.ravel()).reshape(-1, 6)[:, 0]
    np.testing.assert_allclose(strain, np.where(places.young == 3.0, 1.0, 0.5), atol=1e-12)
    assert sorted(places.cells) == ["hex8"]
    np.testing.assert_allclose(places.nodes[places.cells["hex8"]].mean(axis=1)[:, 0], [0.5, 1.5])


def test_types_with_the_same_corners_keep_their_order() -> None:
    """Of hex20, tet10, hex20r the cells that are drawn are in the order of the places."""
    first, last = (box((1.0, 1.0, 1.0), (2, 1, 1), kind) for kind in ("hex20", "hex20r"))
    tets = box((1.0, 1.0, 1.0), (1, 1, 1), "tet10")
    mesh = Mesh(
        nodes=np.vstack([first.nodes, tets.nodes + 5.0, last.nodes + 9.0]),
        blocks={
            "hex20": first.blocks["hex20"],
            "tet10": tets.blocks["tet10"] + first.n_nodes,
            "hex20r": last.blocks["hex20r"] + first.n_nodes + tets.n_nodes,
        },
    )
    places, _ = strain_matrix(mesh, METAL, chosen_elements(mesh, "all"))
    drawn = np.concatenate([places.nodes[block].mean(axis=1) for block in places.cells.values()])
    np.testing.assert_allclose(places.positions, drawn, atol=1e-12)
    kept = places.part(np.array([1, 3, 4, 9]))
    drawn = np.concatenate([kept.nodes[block].mean(axis=1) for block in kept.cells.values()])
    np.testing.assert_allclose(kept.positions, drawn, atol=1e-12)
    np.testing.assert_allclose(kept.positions, places.positions[[1, 3, 4, 9]])
