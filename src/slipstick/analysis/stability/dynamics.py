"""The structure in modes of unit mass: slow ones move, fast ones follow the contact forces statically."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from slipstick.errors import InputError
from slipstick.structure.matrix_checks import DAMPING_ROUNDING, semidefinite_to
from slipstick.structure.protocol import TimeEquations
from slipstick.typing import Array

FEWEST = 8
"""Fewest coordinates that stay in motion, whatever their frequencies."""

_SYMMETRY_TOLERANCE = 1e-12
"""Largest difference of a symmetric matrix from its transpose, over its largest entry: rounding of an assembly."""


@dataclass(frozen=True, kw_only=True)
class Dynamics:
    """``q'' + C q' + K q = loads p - columns f``, motion at the ports ``s = rows q + load_compliance p - R f``.

    C, K are (r, r), ``rows`` (n_ports, r), ``columns`` (r, n_ports), ``R`` (n_ports, n_ports), ``loads`` (r, n_loads),
    ``load_compliance`` (n_ports, n_loads).
    """

    K: Array
    C: Array
    rows: Array
    columns: Array
    R: Array
    loads: Array
    load_compliance: Array

    @property
    def size(self) -> int:
        """Coordinates in motion."""
        return len(self.K)

    @cached_property
    def _squared(self) -> Array | None:
        """Squared frequencies (r,) of modes; None where the coordinates are not modes."""
        squared = np.diag(self.K).copy()
        return None if np.any(self.K - np.diag(squared)) else squared

    def count_below(self, frequency: float) -> int:
        """Number of coordinates in motion: modes up to a frequency, rad/s, and all that may grow."""
        if self._squared is None:
            return self.size
        return min(self.size, max(FEWEST, self._growing, int(np.sum(self._squared <= frequency**2))))

    @cached_property
    def _growing(self) -> int:
        """Number of slowest modes that include all those into which damping feeds energy; all where it couples them."""
        assert self._squared is not None
        C, order = 0.5 * (self.C + self.C.T), np.argsort(self._squared, kind="stable")
        fed = np.flatnonzero(np.diag(C)[order] < 0.0)
        coupled = np.any(C - np.diag(np.diag(C))) and semidefinite_to(C, np.diag(C), DAMPING_ROUNDING) is not None
        return self.size if coupled else int(fed.max(initial=-1)) + 1

    def slowest(self, count: int) -> Dynamics:
        """The slowest modes alone in motion; the others add their compliance to ``R`` and cannot lose stability."""
        if self._squared is None or count >= self.size:
            return self
        order = np.argsort(self._squared, kind="stable")
        kept, still = order[:count], order[count:]
        compliance = self.rows[:, still] / self._squared[still]
        return Dynamics(
            K=self.K[np.ix_(kept, kept)],
            C=self.C[np.ix_(kept, kept)],
            rows=self.rows[:, kept],
            columns=self.columns[kept],
            R=self.R + compliance @ self.columns[still],
            loads=self.loads[kept],
            load_compliance=self.load_compliance + compliance @ self.loads[still],
        )


def dynamics(equations: TimeEquations) -> Dynamics:
    """The dynamics of equations of motion: rows are the contact ports, columns the same ports, then the loads.

    Coordinates are modes where the matrices are symmetric. Raises InputError if the mass matrix is singular.
    """
    M, C, K, n_ports = equations.M, equations.C, equations.K, len(equations.rows)
    through = {"R": equations.feedthrough[:, :n_ports], "load_compliance": equations.feedthrough[:, n_ports:]}
    if _is_diagonal(M) and _is_diagonal(K) and np.all(np.diag(M) == 1.0):
        return Dynamics(K=K, C=C, rows=equations.rows, **_columns(equations.columns, n_ports), **through)
    modes = _modes(M, K) if _is_symmetric(M) and _is_symmetric(K) else None
    if modes is not None:
        squared, shapes = modes
        return Dynamics(
            K=np.diag(squared), C=shapes.T @ C @ shapes, rows=equations.rows @ shapes,
            **_columns(shapes.T @ equations.columns, n_ports), **through,
        )  # fmt: skip
    try:
        stiffness, damping, columns = np.split(
            np.linalg.solve(M, np.hstack([K, C, equations.columns])), [len(M), 2 * len(M)], axis=1
        )
    except np.linalg.LinAlgError:
        raise InputError("stability: the mass matrix is singular; give every degree of freedom a mass") from None
    return Dynamics(K=stiffness, C=damping, rows=equations.rows, **_columns(columns, n_ports), **through)


def _columns(columns: Array, n_ports: int) -> dict[str, Array]:
    return {"columns": columns[:, :n_ports], "loads": columns[:, n_ports:]}


def _modes(M: Array, K: Array) -> tuple[Array, Array] | None:
    """Squared frequencies and mass-normalised modes, None where the mass matrix is not positive definite."""
    from scipy.linalg import eigh

    try:
        squared, shapes = eigh(K, M)
    except np.linalg.LinAlgError:
        return None
    return squared, shapes


def _is_diagonal(matrix: Array) -> bool:
    return not np.any(matrix - np.diag(np.diag(matrix)))


def _is_symmetric(matrix: Array) -> bool:
    return bool(np.abs(matrix - matrix.T).max(initial=0.0) <= _SYMMETRY_TOLERANCE * np.abs(matrix).max(initial=0.0))
