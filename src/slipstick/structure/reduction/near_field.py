"""Near field of residuals that are not written out: entries between neighbours, by products with many columns at once.

Residuals decay with distance. Directions that are far from each other share a *colour*. A product with all of one
colour, each with a random sign, has in every row the entry of the nearest of them (T. F. Coleman, J. J. More, SIAM J.
Numer. Anal. 20, 187, 1983; J. M. Tang, Y. Saad, Numer. Linear Algebra Appl. 19, 485, 2012). A sample of exact columns
gives the mean size of the entries beyond.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.structure.reduction.data import ReducedData
from slipstick.structure.residuals import NearField
from slipstick.typing import Array, IntArray, Sparse

SAMPLE = 48
"""Columns that are solved for exactly."""

_HOPS = 8
"""Half the distance between neighbouring directions, in rows of the matrix, at most."""

_RINGS = 2
"""Rings of neighbours that are near: neighbours of neighbours."""

_SPREAD = 256
"""Neighbours above which a direction counts as spread over all others (compact ones have 80, three at each node)."""

_SEED = 20120602
"""Of the random signs and of the sample: a reduction is reproducible."""
_TOGETHER = 32
"""Colours of one product."""


class Neighbours(NamedTuple):
    """Pattern of near directions, sparse (n, n) with the diagonal, and the colour of each direction (n,)."""

    near: Any
    colours: IntArray


def neighbours(K: Sparse, directions: Sparse) -> Neighbours:
    """Neighbours by the pattern of a matrix: each direction has a cell of nearest rows, and cells that touch are near.

    Directions that are spread over many others, such as a whole face, have no neighbours and a colour each: their
    residuals do not decay.
    """
    pattern, B = sparse.csr_array(K), sparse.csc_array(directions)
    touching = _touching(pattern, B)
    spread = np.flatnonzero(np.diff(touching.indptr) > _SPREAD)
    if spread.size:
        compact = np.ones(B.shape[1])
        compact[spread] = 0.0
        B = sparse.csc_array(B * compact)
        B.eliminate_zeros()
        touching = _touching(pattern, B)
    near = touching
    for _ in range(_RINGS - 1):
        near = _pattern(near @ near)
    colours = _coloured(_pattern(near @ near))
    colours[spread] = int(colours.max()) + 1 + np.arange(spread.size)
    return Neighbours(near, colours)


def _touching(K: Any, B: Any) -> Any:
    """Pattern of directions whose cells touch, or which share rows, and the diagonal."""
    touching = _cells(K, B)
    own = sparse.csr_array(abs(B).T @ abs(B)) + sparse.eye_array(B.shape[1], format="csr")
    return _pattern(touching + touching.T + own)


def _pattern(matrix: Any) -> Any:
    found = sparse.csr_array(matrix)
    found.data = np.ones(found.nnz, dtype=np.float32)
    found.sort_indices()
    return found


def _cells(K: Any, B: Any) -> Any:
    """Cells that touch, (n, n): each row of K belongs to the nearest direction."""
    cell = np.full(K.shape[0], -1)
    rows = np.diff(B.indptr)
    widest = np.argsort(-np.repeat(rows, rows), kind="stable")  # a row of two directions belongs to the smaller one
    cell[B.indices[widest]] = np.repeat(np.arange(B.shape[1]), rows)[widest]
    for _ in range(_HOPS):
        lengths = np.diff(K.indptr)
        free = np.flatnonzero((cell < 0) & (lengths > 0))
        if not free.size:
            break
        part = K[free]
        nearest = np.maximum.reduceat(cell[part.indices], part.indptr[:-1])
        if nearest.max() < 0:
            break
        cell[free] = nearest
    held = np.flatnonzero(cell >= 0)
    owner = sparse.csr_array((np.ones(held.size, dtype=np.float32), (held, cell[held])), shape=(K.shape[0], B.shape[1]))
    pattern = sparse.csr_array((np.ones(K.nnz, dtype=np.float32), K.indices, K.indptr), shape=K.shape)
    return owner.T @ (pattern @ owner)


def _coloured(conflicts: Any) -> IntArray:
    """Greedy colouring: each direction in turn gets the first colour that no conflicting one has."""
    colours = np.full(conflicts.shape[0], -1)
    for i, (first, last) in enumerate(zip(conflicts.indptr[:-1], conflicts.indptr[1:], strict=True)):
        taken = np.zeros(last - first + 1, dtype=bool)
        other = colours[conflicts.indices[first:last]]
        taken[other[(other >= 0) & (other < taken.size)]] = True
        colours[i] = int(np.argmin(taken))
    return colours


def sampled(n: int) -> IntArray:
    """Random sample of directions, sorted; all of them where they are few."""
    return np.sort(np.random.default_rng(_SEED).permutation(n)[: min(SAMPLE, n)])


def near_fields(
    apply: Callable[[Array], Array], known: Neighbours, sample: IntArray, columns: Array
) -> tuple[NearField, NearField]:
    """Near fields of both residuals.

    ``apply`` gives both (2, n, k) for directions (n, k); ``columns`` (2, n, n_sample) are exact ones.
    """
    near, colours = known
    n, rows = near.shape[0], np.repeat(np.arange(near.shape[0]), np.diff(near.indptr))
    sign = np.random.default_rng(_SEED).choice([-1.0, 1.0], n)
    entries = np.empty((2, near.nnz))
    of_entry = colours[near.indices]
    for first in range(0, int(colours.max()) + 1, _TOGETHER):
        here = np.flatnonzero((colours >= first) & (colours < first + _TOGETHER))
        x = np.zeros((n, min(_TOGETHER, int(colours.max()) + 1 - first)))
        x[here, colours[here] - first] = sign[here]
        y = apply(x)
        rows_here = np.flatnonzero((of_entry >= first) & (of_entry < first + _TOGETHER))
        entries[:, rows_here] = y[:, rows[rows_here], of_entry[rows_here] - first] * sign[near.indices[rows_here]]
    return tuple(_near_field(near, entry, sample, exact) for entry, exact in zip(entries, columns, strict=True))  # type: ignore[return-value]


def _near_field(near: Any, entries: Array, sample: IntArray, exact: Array) -> NearField:
    found = sparse.csr_array((entries, near.indices.copy(), near.indptr.copy()), shape=near.shape)
    found = sparse.csr_array(0.5 * (found + found.T))
    size = np.sqrt(np.maximum(found.diagonal(), 0.0))
    far, least = np.abs(exact), 0.0
    for place, column in zip(far.T, sample, strict=True):
        place[near.indices[near.indptr[column] : near.indptr[column + 1]]] = 0.0
        least += size[column] * (size.sum() - size[near.indices[near.indptr[column] : near.indptr[column + 1]]].sum())
    return NearField(entries=found, share=float(far.sum() / least) if least > 0.0 else 0.0)


def near_residuals(
    iteration: BlockLanczos, M: Sparse, directions: Any, data: ReducedData
) -> tuple[NearField, NearField]:
    """Near fields of both residuals of ``data`` between directions (n, n_keep), by a few solutions."""
    n, omega, sample = directions.shape[1], data.omega, data.sample
    assert sample is not None
    kept, s = data.amplitudes[:n], len(sample)

    def residual(x: Array) -> Array:
        U = iteration.solve(np.asfortranarray(directions @ x))
        modal, out = kept.T @ x, np.empty((2, *x.shape))
        out[0] = directions.T @ U - kept @ (modal / omega[:, None] ** 2)
        out[1] = directions.T @ iteration.solve(np.asfortranarray(M @ U)) - kept @ (modal / omega[:, None] ** 4)
        return out

    exact = np.array([data.left_over(data.static, 2), data.left_over(data.second, 4)])
    return near_fields(residual, neighbours(iteration.K, directions), sample, exact[:, :n, :s])
