"""Sparse symmetric matrices condensed to a few rows: the others are eliminated once, whatever is added to these rows.

Fronts by nested dissection (A. George, SIAM J. Numer. Anal. 10, 345, 1973; I. S. Duff, J. K. Reid, ACM Trans. Math.
Softw. 9, 302, 1983), each by Cholesky or, where it is indefinite, ``L D L^T`` with pivots from within it. The Schur
complement of the rows kept and the part eliminated together have as many negative eigenvalues as the whole matrix
(E. V. Haynsworth, Linear Algebra Appl. 1, 73, 1968).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import csgraph

from slipstick.solve.linear.factorisation import SingularMatrixError, one_blas_thread
from slipstick.trig.compiled import compiled
from slipstick.typing import AnyArray, Array, IntArray, Sparse

_LEAF = 60
"""Largest number of groups of equal rows that are not dissected further."""
_BLOCK = 512
"""Rows or columns of a front that are computed and stored together."""
_ZERO_PIVOT = 1e-14
"""Pivot over the size of its front that counts as zero."""


@dataclass
class _Front:
    """Rows ``first`` to ``last`` of the elimination, and those above that they touch."""

    first: int
    last: int
    children: list[int]
    above: IntArray


@dataclass(frozen=True)
class Dissection:
    """The elimination of all rows of a pattern but those kept, which come last: ``order[i]`` is the i-th row."""

    order: IntArray
    fronts: list[_Front]
    n_kept: int


def dissect(pattern: Sparse, kept: IntArray) -> Dissection:
    """The elimination of all rows but ``kept`` of a structurally symmetric pattern (n, n), its diagonal stored."""
    A = sparse.csr_array(pattern)
    ones = sparse.csr_array((np.ones(A.nnz, dtype=np.uint64), A.indices, A.indptr), shape=A.shape)
    marks = np.random.default_rng(0).integers(1, 2**62, A.shape[0], dtype=np.uint64)
    marks = ones @ marks  # equal for rows that touch the same, as those of a node do
    is_kept = np.zeros(A.shape[0], dtype=bool)
    is_kept[kept] = True
    inner = np.flatnonzero(~is_kept)
    _, firsts, group = np.unique(marks[inner], return_index=True, return_inverse=True)
    weight = np.bincount(group, minlength=len(firsts))
    parts: list[tuple[IntArray, list[int]]] = []
    if len(inner):
        graph = sparse.csr_array(ones.astype(np.int8)[inner[firsts]][:, inner[firsts]])
        _bisect(graph, weight, np.arange(len(firsts)), parts)
    members = np.split(inner[np.argsort(group, kind="stable")], np.cumsum(weight)[:-1])
    rows = [np.concatenate([members[v] for v in part]) for part, _ in parts]
    order = np.concatenate([*rows, kept]).astype(np.int64)
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    fronts: list[_Front] = []
    for (part, children), own in zip(parts, rows, strict=True):
        first = fronts[-1].last if fronts else 0
        last = first + len(own)
        touched = [fronts[c].above for c in children]
        touched.append(place[np.unique(A[inner[firsts[part]]].indices)])
        every = np.unique(np.concatenate(touched))
        fronts.append(_Front(first, last, children, every[every >= last]))
    return Dissection(order, fronts, len(kept))


def _bisect(graph: Any, weight: IntArray, nodes: IntArray, parts: list[tuple[IntArray, list[int]]]) -> list[int]:
    """Append the fronts of a part of a graph, children first; those of them that nothing of the part comes after."""
    if len(nodes) <= _LEAF:
        parts.append((nodes, []))
        return [len(parts) - 1]
    side = _separated(graph, weight[nodes])
    roots = []
    for one in (0, 1):
        at = np.flatnonzero(side == one)
        if len(at):
            roots += _bisect(sparse.csr_array(graph[at][:, at]), weight, nodes[at], parts)
    between = nodes[side == 2]
    if not len(between):
        return roots
    parts.append((between, roots))
    return [len(parts) - 1]


def _separated(graph: Any, weight: IntArray) -> IntArray:
    """Sides 0 and 1 of a graph, and 2 for what is between them."""
    count, label = csgraph.connected_components(graph, directed=False)
    if count > 1:
        size = np.cumsum(np.bincount(label, weights=weight))
        right = size > 0.5 * size[-1]
        right[0], right[-1] = False, True
        return right[label].astype(np.int64)
    one = _breadth_first(graph, _breadth_first(graph, 0)[-1])
    ranks = []
    for end in (one, _breadth_first(graph, one[-1])):
        rank = np.empty(len(end))
        rank[end] = np.arange(len(end))
        ranks.append(rank)
    best, least = np.zeros(0, dtype=np.int64), np.inf
    for key in (ranks[0] - ranks[1], ranks[1]):
        order = np.argsort(key, kind="stable")
        up_to = np.cumsum(weight[order])
        left = np.zeros(len(order), dtype=bool)
        left[order[: np.searchsorted(up_to, 0.5 * up_to[-1]) + 1]] = True
        side = np.where(left, 0, 1)
        side[_cover(graph, left)] = 2
        size = weight[side == 2].sum()
        if size < least:
            best, least = side, size
    return best


def _breadth_first(graph: Any, start: int) -> IntArray:
    return np.asarray(csgraph.breadth_first_order(graph, int(start), directed=True, return_predecessors=False))


def _cover(graph: Any, left: Any) -> IntArray:
    """The fewest nodes that touch every edge between the left ones and the others (D. König)."""
    a, b = np.flatnonzero(left), np.flatnonzero(~left)
    cut = sparse.csr_array(graph[a][:, b])
    near = np.flatnonzero(np.diff(cut.indptr))
    a, cut = a[near], sparse.csr_array(cut[near])
    match = csgraph.maximum_bipartite_matching(cut, perm_type="column")
    reached = match < 0  # of the left side, by alternating paths from what is not matched
    met = np.zeros(len(b), dtype=bool)
    back = np.full(len(b), -1)
    back[match[match >= 0]] = np.flatnonzero(match >= 0)
    new = np.flatnonzero(reached)
    while len(new):
        to = np.unique(cut[new].indices)
        to = to[~met[to]]
        met[to] = True
        new = back[to]
        new = new[(new >= 0) & ~reached[new]]
        reached[new] = True
    return np.concatenate([a[~reached], b[met]])


def negative_eigenvalues(A: AnyArray) -> int:
    """How many a dense Hermitian matrix has, of which the lower triangle is read; A may be overwritten.

    Raises SingularMatrixError where a pivot is zero to working accuracy.
    """
    if not len(A):
        return 0
    name = "hetrf" if np.iscomplexobj(A) else "sytrf"
    largest = np.abs(A.diagonal()).max()
    trf, work = linalg.get_lapack_funcs((name, f"{name}_lwork"), (A,))
    LD, pivots, bad = trf(A, lwork=int(work(len(A), lower=1)[0].real), lower=1, overwrite_a=1)
    beside, k = np.zeros(len(A) - 1), 0
    while k < len(A):
        if pivots[k] < 0:  # of two rows
            beside[k] = abs(LD[k + 1, k])
            k += 1
        k += 1
    values = linalg.eigvalsh_tridiagonal(LD.diagonal().real, beside)
    if bad or not np.abs(values).min() > _ZERO_PIVOT * largest:
        raise SingularMatrixError("the matrix is singular: a pivot is zero")
    return int(np.count_nonzero(values < 0.0))


class DenseFactors:
    """A dense Hermitian matrix (n, n), of which the lower triangle is read, as ``L L^H`` or ``L D L^H``.

    Raises
    ------
    SingularMatrixError
        Where a pivot is zero to working accuracy.
    """

    def __init__(self, A: AnyArray) -> None:
        self._middle: tuple[AnyArray, IntArray] | None = None
        self.negative = 0
        self.L, bad = linalg.get_lapack_funcs(("potrf",), (A,))[0](A, lower=1, clean=1)
        if not bad:
            return
        outer, D, rows = linalg.ldl(A, lower=True, hermitian=True, check_finite=False)
        self.L = np.asfortranarray(outer[rows])
        beside = np.diagonal(D, -1)
        values = linalg.eigvalsh_tridiagonal(D.diagonal().real, np.abs(beside))
        if not np.abs(values).min() > _ZERO_PIVOT * np.abs(A.diagonal()).max():
            raise SingularMatrixError("the matrix is singular: a pivot is zero")
        self.negative = int(np.count_nonzero(values < 0.0))
        bands = np.zeros((3, len(D)), dtype=D.dtype)
        bands[0, 1:], bands[1], bands[2, :-1] = beside.conj(), D.diagonal(), beside
        self._middle = bands, rows

    @property
    def definite(self) -> bool:
        """Whether D is the identity."""
        return self._middle is None

    def lower(self, B: AnyArray) -> AnyArray:
        """``L^-1 B``, rows of B taken as they were eliminated."""
        B = B if self._middle is None else B[self._middle[1]]
        return self._triangular(B, 0)

    def middle(self, Z: AnyArray) -> AnyArray:
        """``D^-1 Z``."""
        if self._middle is None:
            return Z
        return np.asarray(linalg.solve_banded((1, 1), self._middle[0], Z, check_finite=False))

    def upper(self, Z: AnyArray) -> AnyArray:
        """``L^-H Z``, rows put back in their places."""
        Z = self._triangular(Z, 2)
        if self._middle is None:
            return Z
        X = np.empty_like(Z)
        X[self._middle[1]] = Z
        return X

    def solve(self, B: AnyArray) -> AnyArray:
        """Solution X of ``A X = B``, B (n, n_columns)."""
        return self.upper(self.middle(self.lower(B)))

    def _triangular(self, B: AnyArray, transposed: int) -> AnyArray:
        dtype = np.result_type(self.L, B)
        trsm = linalg.get_blas_funcs("trsm", dtype=dtype)
        return np.asarray(trsm(1.0, np.asarray(self.L, dtype=dtype), B, lower=1, trans_a=transposed))


class Condensed:
    """A real sparse symmetric matrix (n, n), condensed to the rows that its dissection keeps.

    Attributes
    ----------
    negative
        Number of negative eigenvalues of the part eliminated.
    memory
        Bytes held by the factors: none unless they are to ``solve``.
    """

    def __init__(self, ordering: Dissection) -> None:
        self.ordering, self.negative, self.memory = ordering, 0, 0
        self._factors: list[tuple[DenseFactors, Array]] = []

    @classmethod
    def of(cls, A: Sparse, ordering: Dissection, *, solve: bool) -> tuple[Condensed, Array]:
        """Also the Schur complement of the rows kept, (n_kept, n_kept). Raises SingularMatrixError."""
        new, order, n_kept = cls(ordering), ordering.order, ordering.n_kept
        matrix = sparse.csr_array(sparse.csr_array(A)[order][:, order])
        del A
        updates: dict[int, Array] = {}
        last = len(order) - n_kept
        with one_blas_thread(), ThreadPoolExecutor(min(4, os.cpu_count() or 1)) as pool:
            for k, front in enumerate(ordering.fronts):
                children = [(ordering.fronts[c].above, updates.pop(c)) for c in front.children]
                run = pool.map if len(front.above) > 2 * _BLOCK else map
                updates[k], factors, side = _eliminate(front, matrix, children, run)
                new.negative += factors.negative
                if solve:
                    new._factors.append((factors, side))
                    new.memory += factors.L.nbytes + side.nbytes
        schur = matrix[last:][:, last:].toarray()
        for k in sorted(updates):
            at = ordering.fronts[k].above - last
            for start, rows in _blocks(updates.pop(k), len(at)):
                schur[np.ix_(at[start : start + len(rows)], at[start:])] += rows
        for j in range(0, n_kept, _BLOCK):
            block = slice(j, j + _BLOCK)
            own = np.triu(schur[block, block])
            schur[block, block] = own + np.triu(own, 1).T
            schur[block.stop :, block] = schur[block, block.stop :].T
        return new, schur

    def forward(self, X: Array) -> None:
        """Eliminate in right-hand sides X (n, n_columns), in the order of the elimination, in place."""
        for front, (factors, side) in zip(self.ordering.fronts, self._factors, strict=True):
            z = factors.lower(X[front.first : front.last])
            X[front.above] -= side.T @ z
            X[front.first : front.last] = factors.middle(z)

    def backward(self, X: Array) -> None:
        """From solutions in the rows kept those in all others, in place."""
        for front, (factors, side) in zip(reversed(self.ordering.fronts), reversed(self._factors), strict=True):
            z = X[front.first : front.last] - side @ X[front.above]
            X[front.first : front.last] = factors.upper(z)


def _eliminate(
    front: _Front, matrix: Any, children: list[tuple[IntArray, Array]], run: Callable[..., Any]
) -> tuple[Array, DenseFactors, Array]:
    """Take the rows of a front out: what that changes above (upper triangle), its factors, ``D^-1 L^-1`` of its side.

    ``run`` maps the work over blocks, in threads where that pays.
    """
    first, p, m = front.first, front.last - front.first, len(front.above)
    part = slice(matrix.indptr[first], matrix.indptr[front.last])
    columns, values = matrix.indices[part], matrix.data[part]
    rows = np.repeat(np.arange(p), np.diff(matrix.indptr[first : front.last + 1]))
    later = columns >= first
    panel = np.zeros((p, p + m))
    panel[rows[later], _local(front, columns[later])] = values[later]
    update = np.zeros(int(_block_ends(m)[-1]))
    while children:
        _add(run, panel, update, _local(front, children[-1][0]), children[-1][1])
        children.pop()
    factors = DenseFactors(panel[:, :p].T)
    outer = np.empty((p, m))
    side = outer if factors.definite else np.empty((p, m))

    def eliminated(block: tuple[int, Array]) -> None:
        own = slice(block[0], block[0] + len(block[1]))
        outer[:, own] = factors.lower(panel[:, p + own.start : p + own.stop])
        if side is not outer:
            side[:, own] = factors.middle(outer[:, own])

    def changed(block: tuple[int, Array]) -> None:
        start, rows = block
        rows -= side[:, start : start + len(rows)].T @ outer[:, start:]

    for work in (eliminated, changed):
        list(run(work, _blocks(update, m)))
    return update, factors, side


def _local(front: _Front, rows: IntArray) -> IntArray:
    """Places of rows of the elimination within a front."""
    p = front.last - front.first
    return np.where(rows < front.last, rows - front.first, p + np.searchsorted(front.above, rows))


def _block_ends(m: int) -> IntArray:
    """Where the blocks of rows of the upper triangle of an (m, m) matrix begin and end, one after the other."""
    starts = np.arange(0, m, _BLOCK)
    return np.concatenate([[0], np.cumsum(np.minimum(_BLOCK, m - starts) * (m - starts))]).astype(np.int64)


def _blocks(upper: Array, m: int) -> list[tuple[int, Array]]:
    """These blocks: the first row, and rows from that column on."""
    ends, starts = _block_ends(m), range(0, m, _BLOCK)
    return [(j, upper[ends[b] : ends[b + 1]].reshape(-1, m - j)) for b, j in enumerate(starts)]


def _add(run: Callable[..., Any], panel: Array, update: Array, at: IntArray, change: Array) -> None:
    """Add the upper triangle of a change at places ``at``, ascending: the first are rows of the panel."""
    starts = np.flatnonzero(np.diff(at, prepend=-2) != 1)
    ends = np.append(starts[1:], len(at))
    block_ends = _block_ends(panel.shape[1] - panel.shape[0])

    def rows(block: tuple[int, Array]) -> None:
        _add_rows(panel, update, block_ends, at, starts, ends, *block)

    list(run(rows, _blocks(change, len(at))))


@compiled(allocates=True, nogil=True)
def _add_rows(
    panel: Array, update: Array, block_ends: IntArray, at: IntArray, starts: IntArray, ends: IntArray,
    first: int, rows: Array,
) -> None:  # fmt: skip
    """Of a block of rows of the change; places from each start to its end follow each other."""
    p, m = panel.shape[0], panel.shape[1] - panel.shape[0]
    for i in range(first, first + len(rows)):
        if at[i] < p:
            row, before = panel[at[i]], 0
        else:
            block = (at[i] - p) // _BLOCK
            width, within = m - block * _BLOCK, at[i] - p - block * _BLOCK
            row, before = update[block_ends[block] + within * width :][:width], p + block * _BLOCK
        for r in range(len(starts)):
            if ends[r] > i:
                begin = max(starts[r], i)
                into = row[at[begin] - before : at[begin] - before + ends[r] - begin]
                into += rows[i - first, begin - first : ends[r] - first]
