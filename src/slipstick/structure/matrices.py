"""Structure given by its mass, damping and stiffness matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_array

from slipstick.errors import Fault, InputError
from slipstick.structure.checks import (
    array_faults,
    checked_names,
    directions,
    known_shapes,
    named_shapes,
    number_faults,
    real,
)
from slipstick.structure.dynamic import DynamicStiffness, checked_values
from slipstick.structure.matrix_checks import energy_fed, fed_modes, system_matrices
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.protocol import Receptance, TimeEquations
from slipstick.structure.receptance import ModalReceptance, PoleReceptance, SolvedReceptance
from slipstick.typing import Array, Matrix, MatrixLike, Reals

DENSE_LIMIT = 1500
"""Largest number of dofs treated densely: all modes are computed."""

_LISTED_FREQUENCIES = 20
_POLE_LIMIT = 200
_SMALL = 10_000
_POLE_ERROR = 1e-10


class MatrixStructure:
    """``M x'' + C x' + K x = forces``; hysteretic damping makes it ``K (1 + i loss_factor)`` at nonzero harmonics.

    Parameters
    ----------
    M, C, K
        Mass, damping (None: zero) and stiffness, (n_dofs, n_dofs), dense or scipy sparse; real and symmetric; M and K
        positive definite (a grounded structure). C that is not positive semidefinite feeds energy in: a problem with it
        warns.
    dofs
        A name for each degree of freedom, in the order of the matrices.
    loss_factor
        Structural (hysteretic) loss factor, >= 0.
    load_shapes
        Distributed loads: name -> forces on all dofs (n_dofs,).
    damping
        Factor on C, >= 0: the parameter "damping".

    Raises
    ------
    InputError
        With one sentence for each fault of the matrices, names and values.

    Examples
    --------
    >>> s = MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> s.natural_frequencies.round(4)
    array([6.3246])
    >>> value, slope = s.project([[1.0]], [[1.0]]).at([1], 6.0)
    >>> complex(value[0, 0, 0].round(4))
    (0.1838-0.1103j)
    """

    def __init__(
        self,
        *,
        M: MatrixLike,
        K: MatrixLike,
        dofs: Iterable[str],
        C: MatrixLike | None = None,
        loss_factor: float = 0.0,
        load_shapes: Mapping[str, Reals] | None = None,
        damping: float = 1.0,
    ) -> None:
        self._dofs, faults = checked_names(dofs)
        n = len(self._dofs)
        if not n:
            raise InputError(faults)
        arguments = {"M": M, "K": K} | ({} if C is None else {"C": C})
        self._dense = n <= DENSE_LIMIT
        matrices, wrong = system_matrices(arguments, n, dense=self._dense)
        faults += wrong
        self._shapes: dict[str, Array] = {}
        for name, value in named_shapes(load_shapes, faults).items():
            where = ("load shape", name)
            wrong = number_faults(where, value)
            self._shapes[name] = np.zeros(n) if wrong else real(value)
            faults += wrong or array_faults(where, self._shapes[name], (n,))
        for name, number in (("loss_factor", loss_factor), ("damping", damping)):
            faults += number_faults(name, number) or array_faults(name, real(number), (), non_negative=True)
        if faults:
            raise InputError(faults)
        self.loss_factor, self.damping = float(real(loss_factor)), float(real(damping))
        self.M, self.K, self._viscous = matrices["M"], matrices["K"], matrices.get("C")

    @property
    def C(self) -> Any:
        """Viscous damping (n_dofs, n_dofs), the factor ``damping`` included, or None."""
        return self._viscous if self._viscous is None or self.damping == 1.0 else self.damping * self._viscous

    @property
    def values(self) -> dict[str, float]:
        """Named parameters: ``loss_factor``, and ``damping``, a factor on the viscous damping, where there is any."""
        return {"loss_factor": self.loss_factor} | ({} if self._viscous is None else {"damping": self.damping})

    def changed(self, **values: float) -> MatrixStructure:
        """A copy with another ``loss_factor`` or factor ``damping``; InputError below 0."""
        new, checked = copy(self), checked_values(self.values, values)
        for known in ("_poles", "energy_fed"):
            new.__dict__.pop(known, None)
        new.loss_factor = checked.get("loss_factor", self.loss_factor)
        new.damping = checked.get("damping", self.damping)
        return new

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self._dofs

    @property
    def arguments(self) -> dict[str, Any]:
        """What an equal structure is made from; matrices that are mostly zeros as sparse ones."""
        matrices = {"M": self.M, "C": self._viscous, "K": self.K}
        matrices = {name: _thin(matrix) for name, matrix in matrices.items() if matrix is not None}
        numbers = {"loss_factor": self.loss_factor, "damping": self.damping}
        return {**matrices, **numbers, "dofs": self._dofs, "load_shapes": self._shapes}

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Names of the distributed loads."""
        return tuple(self._shapes)

    @property
    def natural_frequencies(self) -> Array:
        """Undamped natural frequencies, rad/s, ascending: all of them, or the lowest 20 of a large sparse structure."""
        return self._natural_frequencies

    @cached_property
    def _natural_frequencies(self) -> Array:
        return np.sqrt(self._modes[0] if self._dense else self._lowest[0])

    @property
    def damping_ratios(self) -> Array:
        """Damping ratio of each of the ``natural_frequencies``: viscous, with half the loss factor."""
        return self.damping * self._viscous_ratios + 0.5 * self.loss_factor

    @cached_property
    def _viscous_ratios(self) -> Array:
        squared, modes = self._modes if self._dense else self._lowest
        if self._viscous is None:
            return np.zeros(squared.size)
        return np.asarray(np.einsum("ir,ir->r", modes, self._viscous @ modes) / (2.0 * np.sqrt(squared)))

    @cached_property
    def energy_fed(self) -> str:
        """Where viscous damping feeds energy in, in words; empty where it takes it out of every motion."""
        where = "" if self._viscous is None or self.damping == 0.0 else energy_fed(self._viscous, self.M)
        return (fed_modes(self.natural_frequencies, self._viscous_ratios) or where) if where and self._dense else where

    @cached_property
    def _lowest(self) -> tuple[Array, Array]:
        """The lowest 20 modes of a large sparse structure, as ``_modes``."""
        from scipy.sparse.linalg import eigsh

        values, modes = eigsh(self.K, k=_LISTED_FREQUENCIES, M=self.M, sigma=0.0)
        order = np.argsort(values)
        return values[order], modes[:, order]

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        """Squared frequencies (n,) and mass-normalised modes (n, n)."""
        from scipy.linalg import eigh

        values, modes = eigh(self.K, self.M)
        return np.maximum(values, 0.0), modes

    @cached_property
    def _modal_damping(self) -> Array | None:
        """Viscous damping of each mode, without the factor on it, if the modes diagonalise it, else None."""
        squared, modes = self._modes
        if self._viscous is None:
            return np.zeros(squared.size)
        projected = modes.T @ self._viscous @ modes
        diagonal = np.diag(projected).copy()
        rest = np.abs(projected - np.diag(diagonal)).max()
        return diagonal if rest <= 1e-12 * max(np.abs(diagonal).max(), 1e-300) else None

    @cached_property
    def _poles(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]] | None:
        """Poles (2 n,) and complex modes (n, 2 n) with ``mode^T (2 pole M + C) mode = 1``, or None.

        They are not good where two poles meet (critical damping), so they are tried against direct solutions.
        """
        n = len(self._dofs)
        if not self._dense or self.C is None or n > _POLE_LIMIT:
            return None
        inverse = np.linalg.inv(self.M)
        stiffness = self.K * (1.0 + 1j * self.loss_factor)
        companion = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ self.C]])
        poles, vectors = np.linalg.eig(companion)
        modes = vectors[:n]
        weights = 2.0 * poles * np.einsum("ik,ij,jk->k", modes, self.M, modes)
        weights += np.einsum("ik,ij,jk->k", modes, self.C, modes)
        if np.any(weights == 0.0):
            return None
        modes = modes / np.sqrt(weights)
        for w in np.quantile(self.natural_frequencies, (0.0, 0.5, 1.0)) * (1.0, 1.1, 3.0):
            exact = np.linalg.inv(self._stiffness(float(w))[0])
            if not np.abs((modes / (1j * w - poles)) @ modes.T - exact).max() <= _POLE_ERROR * np.abs(exact).max():
                return None
        return poles, modes

    def by_modes(self) -> ModalStructure:
        """The same by all of its modes; InputError where these do not exist, or are too many."""
        if not self._dense:
            raise InputError(f"the structure has {len(self._dofs)} dofs, too many for all of its modes: reduce it")
        if self._modal_damping is None:
            raise InputError("the viscous damping couples the modes: give damping ratios of the modes instead")
        squared, modes = self._modes
        omega = np.sqrt(squared)
        shapes = {
            name: LoadShape(participation=modes.T @ load, static_response=self._static_solve(load))
            for name, load in self._shapes.items()
        }
        return ModalStructure(
            omega=omega, mode_shapes=modes, dofs=self._dofs, static_compliance=self._static_solve(np.eye(omega.size)),
            loss_factor=self.loss_factor, damping_ratio=self._modal_damping / (2.0 * omega), load_shapes=shapes,
            damping=self.damping,
        )  # fmt: skip

    def _columns(self, columns: ArrayLike, shapes: Sequence[str]) -> Array:
        known_shapes(shapes, self._shapes)
        cosines = directions("columns", columns, len(self._dofs))
        return np.column_stack([cosines, *(self._shapes[s] for s in shapes)]) if shapes else cosines

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between directions ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) and load shapes.

        Summed over all modes (exact) where these diagonalise the damping, over the poles where it is small enough for
        that, and solved at each frequency otherwise.
        """
        left, right = directions("rows", rows, len(self._dofs)), self._columns(columns, shapes)
        static = left.T @ self._static_solve(right)
        if self._dense and self._modal_damping is not None:
            squared, modes = self._modes
            return ModalReceptance(
                left=left.T @ modes,
                right=right.T @ modes,
                stiffness=squared * (1.0 + 1j * self.loss_factor),
                damping=self._modal_damping,
                factor=self.damping,
                static=static,
            )
        solved = SolvedReceptance(stiffness=self._stiffness, rows=left, columns=right, static=static)
        if self._poles is None:
            return solved
        poles, shapes_at_poles = self._poles
        return PoleReceptance(
            left=left.T @ shapes_at_poles, right=right.T @ shapes_at_poles, poles=poles, static=static, solved=solved
        )

    def _static_solve(self, right: Array) -> Array:
        return np.asarray(self._static_factors(right), dtype=float)

    @cached_property
    def _static_factors(self) -> Callable[[Array], Array]:
        """``K^-1`` applied to columns; the factors are kept, for a problem is projected more than once."""
        if self._dense:
            from scipy.linalg import cho_factor, cho_solve

            return partial(cho_solve, cho_factor(self.K))
        from scipy.sparse.linalg import splu

        return splu(self.K).solve

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the factors, which cannot be pickled."""
        return {name: value for name, value in self.__dict__.items() if name != "_static_factors"}

    @property
    def _stiffness(self) -> DynamicStiffness:
        return DynamicStiffness(M=self.M, C=self._viscous, K=self.K, loss_factor=self.loss_factor, damping=self.damping)

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Equations of motion in time; hysteretic damping becomes viscous, equal at each natural frequency or at one.

        ``damping_at`` is that frequency, rad/s.
        """
        n = len(self._dofs)
        if not self._dense:
            raise InputError(
                Fault(
                    "time integration",
                    f"the structure has {n} dofs, too many for dense matrices",
                    remedy="reduce it to modes first",
                )
            )
        damping = np.zeros((n, n)) if self.C is None else self.C
        if damping_at is not None:
            damping = damping + self.loss_factor / damping_at * self.K
        elif self.loss_factor:
            squared, modes = self._modes
            weighted = self.M @ modes
            damping = damping + (weighted * (self.loss_factor * np.sqrt(squared))) @ weighted.T
        left, right = directions("rows", rows, n), self._columns(columns, shapes)
        return TimeEquations(
            M=self.M,
            C=damping,
            K=self.K,
            rows=left.T.copy(),
            columns=right,
            feedthrough=np.zeros((left.shape[1], right.shape[1])),
        )

    def __repr__(self) -> str:
        return f"MatrixStructure({len(self._dofs)} dofs, {'dense' if self._dense else 'sparse'})"


def _thin(matrix: Matrix) -> Matrix:
    """A large dense matrix of mostly zeros as a sparse one, others as they are."""
    if isinstance(matrix, np.ndarray) and matrix.size > _SMALL and 4 * np.count_nonzero(matrix) < matrix.size:
        return csc_array(matrix)
    return matrix
