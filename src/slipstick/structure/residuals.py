"""Residuals of a receptance, by the modes left out: products, entries of single contacts, bounds.

They are written out as matrices, or applied by solutions with the factorised stiffness. With ``B`` the directions kept
in the full model, ``phi_r`` and ``w_r`` the modes and ``a_r = B^T phi_r``, the residuals are

    R_0 = B^T K^-1 B - sum_r a_r a_r^T / w_r^2,      R_1 = B^T K^-1 M K^-1 B - sum_r a_r a_r^T / w_r^4

(THEORY.md (10.1)). A product with both takes two solutions, of all harmonics together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import InitVar, dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from slipstick.solve.linear.factorisation import Factorisation, factorise, one_blas_thread
from slipstick.typing import Array, ComplexArray, Matrix, Sparse


class Residuals(Protocol):
    """Real matrices ``R_p`` (n_rows, n_columns) and products with their weighted sums.

    Weights are (n_parts, k), one for each matrix and each of the k columns of what is multiplied.
    """

    def __len__(self) -> int:
        """Number of matrices."""

    def times(self, x: ComplexArray, weight: ComplexArray) -> ComplexArray | float:
        """``sum_p weight_p R_p x`` (n_rows, k) for numbers on the first columns, (any, k); 0 of no matrices."""

    def times_transposed(self, z: ComplexArray, weight: ComplexArray) -> ComplexArray | float:
        """``sum_p weight_p R_p^T z`` (n_columns, k) for numbers on the rows, (n_rows, k)."""

    def reach(self, sizes: Array, weight: Array) -> Array | float:
        """``sum_p weight_p |R_p| sizes`` (n_rows, k), or more, for sizes on the first columns, (any, k)."""

    def entries(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> list[Array]:
        """Entries of each matrix between ports of one contact, of the shape of ``rows`` and ``columns`` together."""


_CACHE_ENTRIES, _TILE = 2**18, 200
"""Entries of a matrix that fits into the cache as a whole; rows and columns of a tile that does (measured)."""


def symmetric_product(matrix: Array, x: Array, out: Array | None = None) -> Array:
    """``matrix @ x`` (n, k) for a symmetric matrix, added to ``out``: of a large one half is read, in tiles."""
    n = len(matrix)
    if n * n <= _CACHE_ENTRIES and out is None:
        return np.asarray(matrix @ x)
    out = np.zeros(x.shape) if out is None else out
    for i in range(0, n, _TILE):
        below = slice(i, min(i + _TILE, n))
        out[below] += matrix[below, below] @ x[below]
        for j in range(0, i, _TILE):
            before = slice(j, j + _TILE)
            tile = matrix[below, before]
            out[below] += tile @ x[before]
            out[before] += tile.T @ x[below]
    return out


class WrittenResiduals:
    """Matrices (n_rows, n_columns) that are written out; ``symmetric``: the first columns are the rows, as of one body.

    Of large symmetric ones one half is read, in tiles that fit into the cache: reading takes most of the time.
    """

    def __init__(self, matrices: Sequence[Array], *, symmetric: bool = False) -> None:
        self.matrices, self._symmetric = tuple(matrices), symmetric
        self._last: tuple[ComplexArray | None, dict[int, ComplexArray]] = None, {}

    def __len__(self) -> int:
        """Number of matrices."""
        return len(self.matrices)

    def times(self, x: ComplexArray, weight: ComplexArray) -> ComplexArray | float:
        """``sum_p weight_p R_p x``; real matrices times pairs of real and imaginary parts.

        The products with the last ``x`` are stored, because residual and slope need the same.
        """
        if self._last[0] is not x:
            self._last = x, {}
        products, pairs, out = self._last[1], np.ascontiguousarray(x).view(float), 0.0
        for p, (matrix, share) in enumerate(zip(self.matrices, weight, strict=True)):
            if share.any():
                if p not in products:
                    products[p] = self._product(matrix, pairs).view(complex)
                out = out + products[p] * share
        return out

    def _product(self, matrix: Array, x: Array) -> Array:
        """``R x`` for numbers (any, k) on the first columns."""
        n = len(matrix)
        if not self._symmetric or n * n <= _CACHE_ENTRIES or len(x) < n:
            return np.asarray(matrix[:, : len(x)] @ x)
        return symmetric_product(matrix[:, :n], x[:n], np.asarray(matrix[:, n : len(x)] @ x[n:]))

    def times_transposed(self, z: ComplexArray, weight: ComplexArray) -> ComplexArray | float:
        """``sum_p weight_p R_p^T z``."""
        pairs, out = np.ascontiguousarray(z).view(float), 0.0
        for matrix, share in zip(self.matrices, weight, strict=True):
            out = out + (matrix.T @ pairs).view(complex) * share
        return out

    def reach(self, sizes: Array, weight: Array) -> Array | float:
        """``sum_p weight_p |R_p| sizes``."""
        out = 0.0
        for matrix, share in zip(self.matrices, weight, strict=True):
            out = out + (np.abs(matrix[:, : len(sizes)]) @ sizes) * share
        return out

    def entries(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> list[Array]:
        """Entries of each matrix."""
        return [matrix[rows, columns] for matrix in self.matrices]


@dataclass(frozen=True, kw_only=True)
class FullModel:
    """A full model whose residuals are applied by solutions; K is factorised when one is first asked for.

    Attributes
    ----------
    K, M
        Stiffness and mass, sparse by rows, (n, n).
    directions
        Directions kept, sparse, (n, n_keep).
    solver
        Name of the sparse solver, the one that the modes were found with; None: the best there is.
    triangles
        Whether K and M are given by their lower triangles, as they are stored.
    """

    K: Sparse
    M: Sparse
    directions: Sparse
    solver: str | None = None
    triangles: InitVar[bool] = False

    def __post_init__(self, triangles: bool) -> None:
        for name in ("K", "M"):
            matrix = getattr(self, name)
            object.__setattr__(self, name, _mirrored(matrix) if triangles else sparse.csr_array(matrix))

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal model: matrices, not their factors."""
        lower = {name: sparse.tril(getattr(self, name), format="csc") for name in ("K", "M")}
        return {**lower, "directions": self.directions, "solver": self.solver, "triangles": True}

    @cached_property
    def factors(self) -> Factorisation:
        """Factors of the stiffness; files and pickles do not hold them."""
        return factorise(self.K, solver=self.solver, check=False)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "factors"}

    def solutions(self, forces: Array, second: NDArray[np.bool_]) -> tuple[Array, Array]:
        """``K^-1 F`` (n, k) for forces F (n, k), and ``K^-1 M K^-1 F`` of the columns marked by ``second``."""
        with one_blas_thread():
            U = self.factors.solve(np.asfortranarray(forces))
            return U, self.factors.solve(np.asfortranarray(self.M @ (U if second.all() else U[:, second])))


def _mirrored(lower: Matrix) -> Any:
    """A symmetric matrix of its lower triangle, entries that are zero kept.

    Rounding of the factors depends on the pattern. The residual is a small difference between response and modes: with
    other factors than those of the modes its error would exceed rounding.
    """
    entries = sparse.coo_array(lower)
    above = entries.row != entries.col
    values = np.concatenate([entries.data, entries.data[above]])
    rows = np.concatenate([entries.row, entries.col[above]])
    columns = np.concatenate([entries.col, entries.row[above]])
    return sparse.csr_array((values, (rows, columns)), shape=entries.shape)


@dataclass(frozen=True, kw_only=True)
class NearField:
    """Approximation of a residual (n, n) for bounds: entries between neighbours, a mean size beyond.

    Attributes
    ----------
    entries
        Sparse by rows, symmetric, (n, n): measured by a few products (``structure/reduction/near_field.py``).
    share
        Of ``sqrt(R_ii R_jj)``, mean size of the entries that are not held.
    """

    entries: Any
    share: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "entries", sparse.csr_array(self.entries))

    @property
    def own(self) -> Array:
        """The diagonal, not below zero, (n,)."""
        return np.maximum(self.entries.diagonal(), 0.0)

    def between(self, rows: Matrix, columns: Matrix) -> ProjectedNear:
        """The near field between directions (n, n_rows) and (n, n_columns)."""
        left, right = sparse.csc_array(rows), sparse.csc_array(columns)
        entries = sparse.csr_array(left.T @ self.entries @ right)
        sizes = [
            np.sqrt(np.maximum(np.asarray((side * (self.entries @ side)).sum(axis=0)).ravel(), 0.0))
            for side in (left, right)
        ]
        return ProjectedNear(entries, self.share, *sizes)


class ProjectedNear:
    """A near field between directions: entries (n_rows, n_columns), and sizes of the directions in themselves."""

    def __init__(self, entries: Any, share: float, left: Array, right: Array) -> None:
        self.entries, self._share, self._left, self._right = entries, share, left, right
        sizes = abs(entries)
        rows = np.repeat(np.arange(entries.shape[0]), np.diff(entries.indptr))
        sizes.data -= share * left[rows] * right[entries.indices]  # the far field counts these too
        self._sizes = sizes

    def reach(self, forces: Array) -> Array:
        """``|R| forces`` (n_rows, k) for sizes (n_columns, k)."""
        return np.asarray(self._sizes @ forces + self._share * np.outer(self._left, self._right @ forces))


class SolvedResiduals:
    """Both residuals between directions of a full model, applied by solutions with its stiffness.

    Parameters
    ----------
    full
        The model; ``rows`` (n_keep, n_rows) and ``columns`` (n_keep, n_ports) are directions on what it keeps.
    omega, left, right
        Modes that are not part of the residuals: frequencies, shapes at rows and at columns, loads last.
    loads
        Both residuals from the loads, (2, n_rows, n_loads).
    near
        Near fields of both residuals between the directions kept.
    """

    def __init__(
        self,
        full: FullModel,
        rows: Matrix,
        columns: Matrix,
        *,
        omega: Array,
        left: Array,
        right: Array,
        loads: Array,
        near: Sequence[NearField],
    ) -> None:
        self._full, self._omega, self._left, self._right, self._loads = full, omega, left, right, loads
        B = sparse.csr_array(full.directions)
        self._rows, self._columns = (sparse.csr_array(B @ sparse.csc_array(side)) for side in (rows, columns))
        self._n = columns.shape[1]
        self.shape = left.shape[0], right.shape[0]
        self.near = [one.between(rows, columns) for one in near]
        self._last: tuple[Any, ...] | None = None

    def __len__(self) -> int:
        """Two."""
        return 2

    def both(self, forces: Array, second: NDArray[np.bool_], *, transposed: bool = False) -> Array:
        """``R_0 F``, and ``R_1 F`` of the columns marked (zero else), (2, n_rows, k), for ports alone (n_ports, k).

        With the transposes forces are on the rows. The last result is stored: residual and slope need the same.
        """
        if self._last is not None:
            before, marked, turned, answer = self._last
            if turned == transposed and np.array_equal(marked, second) and np.array_equal(before, forces):
                return np.asarray(answer)
        onto, moved = (self._rows, self._columns) if transposed else (self._columns, self._rows)
        left, right = (self._right[: self._n], self._left) if transposed else (self._left, self._right[: self._n])
        modal = right.T @ forces
        out = np.zeros((2, len(left), forces.shape[1]))
        for begin in range(0, forces.shape[1], SOLVED):
            part, also = slice(begin, begin + SOLVED), begin + np.flatnonzero(second[begin : begin + SOLVED])
            first, then = self._full.solutions(onto @ forces[:, part], second[part])
            out[0][:, part] = moved.T @ first - left @ (modal[:, part] / self._omega[:, None] ** 2)
            out[1][:, also] = moved.T @ then - left @ (modal[:, also] / self._omega[:, None] ** 4)
        self._last = forces.copy(), second.copy(), transposed, out
        return out

    def nearly(self) -> SolvedResiduals:
        """The near field alone, without solutions: the residuals decay fast with distance."""
        return _NearResiduals(self)

    def _summed(self, x: ComplexArray, weight: ComplexArray, transposed: bool) -> ComplexArray:
        """Weighted sum of both products with complex numbers on ports or rows; columns of zeros take no solution."""
        pairs = np.ascontiguousarray(x).view(float)
        here = pairs.any(axis=0)
        answer = np.zeros((2, self._n if transposed else self.shape[0], pairs.shape[1]))
        if here.any():
            answer[:, :, here] = self.both(pairs[:, here], np.repeat(weight[1] != 0, 2)[here], transposed=transposed)
        return np.asarray(answer[0].view(complex) * weight[0] + answer[1].view(complex) * weight[1])

    def _on_ports(self, x: Any) -> Any:
        """Numbers on the ports (n_ports, k), from those on the first columns; zero on ports beyond these."""
        if len(x) >= self._n:
            return x[: self._n]
        return np.concatenate([x, np.zeros((self._n - len(x), x.shape[1]))])

    def times(self, x: ComplexArray, weight: ComplexArray) -> ComplexArray:
        """``sum_p weight_p R_p x``."""
        out = self._summed(self._on_ports(x), weight, transposed=False)
        for load, share in zip(self._loads, weight, strict=True):
            if len(x) > self._n:
                out += (load @ x[self._n :]) * share
        return out

    def times_transposed(self, z: ComplexArray, weight: ComplexArray) -> ComplexArray:
        """``sum_p weight_p R_p^T z``."""
        out = [self._summed(z, weight, transposed=True)]
        out.append(sum(((load.T @ z) * share for load, share in zip(self._loads, weight, strict=True))))
        return np.concatenate(out)

    def reach(self, sizes: Array, weight: Array) -> Array:
        """``sum_p weight_p |R_p| sizes``: by the entries of the near field, beyond by the mean size."""
        out = np.zeros((self.shape[0], sizes.shape[1]))
        for near, load, share in zip(self.near, self._loads, weight, strict=True):
            out += near.reach(self._on_ports(sizes)) * share
            if len(sizes) > self._n:
                out += (np.abs(load) @ sizes[self._n :]) * share
        return out

    def entries(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> list[Array]:
        """Entries of the near field."""
        i, j = np.broadcast_arrays(rows, columns)
        return [np.asarray(near.entries[i.ravel(), j.ravel()]).reshape(i.shape) for near in self.near]

    def written(self) -> tuple[Array, Array]:
        """Both matrices (n_rows, n_columns), by one solution for each row or port, whichever are fewer."""
        turned = self.shape[0] < self._n
        parts, unit = [], sparse.eye_array(min(self.shape[0], self._n), format="csc")
        for first in range(0, unit.shape[0], _TOGETHER):
            columns = unit[:, first : first + _TOGETHER].toarray()
            parts.append(self.both(columns, np.ones(columns.shape[1], dtype=bool), transposed=turned))
        ports = np.concatenate(parts, axis=2) if parts else np.zeros((2, max(self.shape[0], self._n), 0))
        ports = ports.transpose(0, 2, 1) if turned else ports
        both = np.concatenate([ports, self._loads], axis=2)
        return both[0], both[1]


class _NearResiduals(SolvedResiduals):
    """Residuals without a far field."""

    def __init__(self, of: SolvedResiduals) -> None:
        self.__dict__.update(of.__dict__)

    def nearly(self) -> SolvedResiduals:
        """Itself."""
        return self

    def both(self, forces: Array, second: NDArray[np.bool_], *, transposed: bool = False) -> Array:
        """By the entries of the near field."""
        first, then = (near.entries.T if transposed else near.entries for near in self.near)
        out = np.zeros((2, first.shape[0], forces.shape[1]))
        out[0], out[1][:, second] = first @ forces, then @ forces[:, second]
        return out


_TOGETHER = 32
"""Columns of a matrix that is written out at a time."""

SOLVED = 32
"""Columns solved at a time: with more the cost of each stays the same and memory grows."""


class SolvedStatic:
    """Static compliance (n_rows, n_columns) that is a product: modes and a residual that is solved for.

    Its entries are known for the ports along themselves (``own_compliance``) and for the loads (``load_compliance``).
    """

    ndim = 2

    def __init__(self, residuals: SolvedResiduals, left: Array, right: Array, omega: Array, factor: Any = 1.0) -> None:
        self.shape = residuals.shape
        self.size = self.shape[0] * self.shape[1]
        self._residuals, self._left, self._right, self._omega = residuals, left, right, omega
        self._factor = np.broadcast_to(np.asarray(factor, dtype=float), (self.shape[1],))

    def __array__(self, *_: Any, **__: Any) -> Any:
        raise TypeError("a static compliance that is solved for has no array")

    def __mul__(self, factor: Array) -> SolvedStatic:
        """With factors (n_columns,) on the columns."""
        return SolvedStatic(self._residuals, self._left, self._right, self._omega, self._factor * factor)

    def __matmul__(self, x: Array) -> Array:
        """Times numbers on the columns, (n_columns,) or (n_columns, k)."""
        columns = (x if x.ndim == 2 else x[:, None]) * self._factor[:, None]
        weight = np.array([np.ones(columns.shape[1]), np.zeros(columns.shape[1])], dtype=complex)
        out = self._left @ ((self._right.T @ columns) / self._omega[:, None] ** 2)
        out = out + self._residuals.times(columns + 0j, weight).real
        return out.reshape(-1, *x.shape[1:])

    @property
    def own(self) -> Array:
        """Compliances of the rows along themselves, (n_rows,), with the near field of the residual."""
        n = self.shape[0]
        modal = np.einsum("ir,ir->i", self._left / self._omega**2, self._right[:n])
        return np.asarray(modal + self._residuals.near[0].entries.diagonal()) * self._factor[:n]

    @property
    def loads(self) -> Array:
        """Compliances of the loads, exact, (n_rows, n_loads): of single dofs, then of shapes."""
        rows, ports = self.shape[0], self._residuals._n
        modal = (self._left / self._omega**2) @ self._right[ports:].T
        shapes = np.asarray(modal + self._residuals._loads[0]) * self._factor[ports:]
        if ports == rows:
            return shapes
        return np.column_stack([self @ np.eye(self.shape[1], ports - rows, -rows), shapes])


def own_compliance(static: Any) -> Array:
    """Static compliances of the ports, which are the first columns, along themselves, (n_rows,)."""
    return static.own if isinstance(static, SolvedStatic) else np.diag(static[:, : len(static)])


def load_compliance(static: Any) -> Array:
    """Static compliances of the loads, which are the columns after those of the rows, (n_rows, n_loads)."""
    return static.loads if isinstance(static, SolvedStatic) else static[:, len(static) :]
