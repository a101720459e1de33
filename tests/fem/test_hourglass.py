"""Elements with reduced integration: which motions they leave free, alone, in rows and in blocks."""

import numpy as np
import pytest

from slipstick.fem.assembly import assemble
from slipstick.fem.box import box
from slipstick.fem.hourglass import hourglass_warnings
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh

SOLID = Material(young=1.0, poisson=0.3, density=1.0)


def free_motions(mesh: Mesh) -> int:
    squares = np.linalg.eigvalsh(assemble(mesh, SOLID).stiffness.toarray())
    return int((squares < 1e-10 * squares[-1]).sum())


@pytest.mark.parametrize(
    ("divisions", "more", "said"),
    [((1, 1, 1), 6, 1), ((3, 1, 1), 4, 3), ((1, 1, 2), 3, 2), ((2, 2, 1), 0, 0), ((1, 2, 3), 0, 0), ((2, 2, 2), 0, 0)],
)
def test_rows_of_single_elements_are_named_and_those_alone(divisions, more, said):
    """Motions without stiffness besides the six rigid ones, of bricks in line."""
    mesh = box(tuple(map(float, divisions)), divisions, "hex20r")
    assert free_motions(mesh) == 6 + more
    warnings = list(hourglass_warnings(mesh, "m"))
    assert len(warnings) == (said > 0)
    assert all(text.startswith(f"m: {said} hex20r elements, as 1, have") for text in warnings)
    full = Mesh(nodes=mesh.nodes, blocks={"hex20": mesh.blocks["hex20r"]})
    assert free_motions(full) == 6
    assert list(hourglass_warnings(full, "m")) == []


def test_neighbours_of_any_type_count():
    """A fin of two bricks on a block is named, one brick between two of another type in two directions is not."""
    mesh = box((4.0, 2.0, 2.0), (4, 2, 2), "hex20r")
    block = mesh.blocks["hex20r"]
    middles = mesh.nodes[block].mean(axis=1)
    fin = (middles[:, 0] > 2.0) & ((middles[:, 1] > 1.0) | (middles[:, 2] > 1.0))
    (said,) = hourglass_warnings(Mesh(nodes=mesh.nodes, blocks={"hex20r": block[~fin]}), "m")
    assert said.startswith("m: 2 hex20r elements")
    plate = box((2.0, 2.0, 1.0), (2, 2, 1), "hex20r")
    one, others = plate.blocks["hex20r"][:1], plate.blocks["hex20r"][1:]
    assert list(hourglass_warnings(Mesh(nodes=plate.nodes, blocks={"hex20r": one, "hex20": others}), "m")) == []


def test_a_row_that_is_bent_hides_motions_of_hardly_any_stiffness():
    """Not singular, and a natural frequency 80 % below that of full integration: the number of the warning."""
    from scipy.linalg import eigh

    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    nodes = mesh.nodes + 0.05 * np.sin(3.0 * mesh.nodes[:, [1, 2, 0]] + 1.0)
    free = np.setdiff1d(np.arange(3 * mesh.n_nodes), (3 * mesh.surface("x0").nodes[:, None] + np.arange(3)).ravel())
    first = {}
    for kind in ("hex20", "hex20r"):
        matrices = assemble(Mesh(nodes=nodes, blocks={kind: mesh.blocks["hex20"]}), SOLID)
        K, M = (matrix[free][:, free].toarray() for matrix in (matrices.stiffness, matrices.mass))
        first[kind] = np.sqrt(eigh(K, M, eigvals_only=True)[0])
    assert 0.15 < first["hex20r"] / first["hex20"] < 0.25
