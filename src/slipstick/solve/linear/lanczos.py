"""Shift-invert block Lanczos with a proof of completeness.

The operator ``(K - s M)^-1 M`` is symmetric in the M inner product; a block of vectors finds repeated eigenvalues. The
number of eigenvalues below a shift is the number of negative ones of ``K - shift M`` (Sylvester's law of inertia).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.errors import InputError
from slipstick.solve.linear.factorisation import factorise, shifted
from slipstick.solve.linear.factors import Factorisation, SingularMatrixError, one_blas_thread
from slipstick.solve.linear.krylov import KrylovBasis
from slipstick.solve.linear.modes import (
    WRONG,
    EigenError,
    EigenOptions,
    Modes,
    StageListener,
    StageProgress,
    backward_errors,
)
from slipstick.typing import Array, Sparse


def factorise_shifted(
    K: Sparse, M: Sparse, shift: float, *, solver: str | None = None, ordering: Any = None
) -> Factorisation:
    """Factors of ``K - shift M``; a singular K is explained."""
    try:
        return factorise(K if shift == 0.0 else shifted(K, M, shift), solver=solver, ordering=ordering)
    except SingularMatrixError as error:
        size = -1e-6 * K.diagonal().sum() / M.diagonal().sum()
        remedy = f"constrain the body or, for its free modes, give a negative shift such as {size:.0e}"
        what = "the stiffness matrix is singular (a mechanism or an unconstrained body)"
        if shift != 0.0:
            what, remedy = f"K - {shift:g} M is singular", "the shift is an eigenvalue: move it"
        raise SingularMatrixError(f"{what}: {remedy}", error.null_vector) from error


class BlockLanczos:
    """The iteration: ask for modes, then for more; the basis already made is kept."""

    def __init__(
        self,
        K: Sparse,
        M: Sparse,
        *,
        shift: float = 0.0,
        solver: str | None = None,
        options: EigenOptions | None = None,
        start: Array | None = None,
        listener: StageListener | None = None,
        ordering: Any = None,
    ) -> None:
        self.K, self.M, self.shift = K.tocsr(), M.tocsr(), shift
        self.options = options or EigenOptions()
        self.listener = listener
        self.n = K.shape[0]
        self._report("factorising", 0, 1)
        self._factors: Factorisation | None = factorise_shifted(K, M, shift, solver=solver, ordering=ordering)
        self.solver, self.inertia, self._ordering = self._factors.name, self._factors.inertia, self._factors.ordering
        self.basis = KrylovBasis(self.solve, self.M, self.options.block, start)

    def solve(self, B: Array) -> Array:
        """``(K - s M)^-1 B``, B (n, n_columns); factors dropped to save memory are made again."""
        if self._factors is None:
            self._factors = factorise_shifted(self.K, self.M, self.shift, solver=self.solver, ordering=self._ordering)
        return self._factors.solve(B)

    def modes(self, n_modes: int, *, count: bool = True) -> Modes:
        """The lowest ``n_modes``, converged; with ``count``, proven complete by inertia if the solver can."""
        if not 1 <= n_modes <= self.n:
            raise InputError(f"n_modes = {n_modes} is not to be had from {self.n} dofs; ask for 1 to {self.n}")
        with one_blas_thread():
            complete = self._search(n_modes, count)
            return self._result(n_modes, complete)

    def participations(self, n_modes: int, B: Sparse) -> tuple[Array, Array]:
        """Of the lowest modes, converged but not counted, frequencies (rad/s) and ``B^T phi``, B (n, n_columns) sparse.

        The modes themselves are not formed: it costs little beside them.
        """
        with one_blas_thread():
            self._converge(n_modes)
            theta, Y, _ = self.basis.ritz()
            omega = np.sqrt(np.maximum(self.shift + 1.0 / theta[:n_modes], 0.0))
            return omega, (B.T @ self.basis.V[:, : self.basis.m]) @ Y[:, :n_modes]

    def _search(self, n_modes: int, count: bool) -> bool | None:
        """Converge, count below a shift, and search with random blocks for what is missing; whether it is all."""
        self._converge(n_modes)
        if not count:
            return None
        at = self._gap_near(n_modes)
        if at is None:
            return True
        self._report("counting modes", n_modes, n_modes)
        self._factors = None  # two sets of factors would double the memory
        moved = shifted(self.K, self.M, at)
        inertia = factorise(moved, solver=self.solver, check=False, ordering=self._ordering).inertia
        if inertia is None:
            return None
        self._complete(at, inertia.negative, n_modes)
        return True

    def _complete(self, at: float, expected: int, n_modes: int) -> None:
        """Search until ``expected`` converged modes lie below ``at``.

        A block holds a repeated eigenvalue at most as often as it has columns, and its start may lack a mode: whenever
        what is seen has converged and the count is short, random vectors take the place of the next block.
        """
        fresh = 4
        for _ in range(40 + 8 * expected // self.options.block):
            theta = self.basis.ritz()[0][:expected]
            below = int(np.count_nonzero((theta > 0.0) & (theta * (at - self.shift) > 1.0)))
            converged = self._converged(expected)
            if min(below, converged) >= expected:
                return
            self._report("modes were missing, searching on", min(below, n_modes), n_modes)
            if fresh >= 4 and converged >= below:
                self.basis.add_random()
                fresh = 0
            self._make_room(max(n_modes, expected))
            self.basis.step()
            fresh += 1
        raise EigenError(
            f"{expected} eigenvalues lie below {at:g} but only {min(below, converged)} of them were found; "
            f"ask for more modes or give a larger block than {self.options.block}"
        )

    def _converge(self, n_modes: int) -> None:
        restarts = 0
        while True:
            converged = self._converged(n_modes)
            self._report("modes", converged, n_modes)
            if converged >= n_modes or self.basis.m == self.n:
                return
            if (
                self.basis.m + self.basis.Q.shape[1] > self._limit(n_modes)
                and (restarts := restarts + 1) > self.options.restarts
            ):
                raise EigenError(
                    f"only {converged} of {n_modes} modes converged after {restarts - 1} restarts with a basis of "
                    f"{self.basis.m} vectors; allow a larger subspace, a looser tolerance or a shift nearer to them"
                )
            self._make_room(n_modes)
            self.basis.step()

    def _limit(self, n_modes: int) -> int:
        """Largest basis: what the options say, but room for the modes, some more, and two blocks."""
        wanted = self.options.subspace or 3 * n_modes + 16 * self.options.block
        return min(self.n, max(wanted, n_modes + 2 * self.options.block + 2 * self.basis.Q.shape[1]))

    def _make_room(self, n_modes: int) -> None:
        self.basis.make_room(self._limit(n_modes), n_modes + 2 * self.options.block)

    def _converged(self, n_modes: int) -> int:
        if self.basis.m == 0:
            return 0
        error = self.basis.ritz()[2][:n_modes] <= self.options.tolerance
        return int(len(error) if error.all() else np.argmin(error))

    def _gap_near(self, n_modes: int) -> float | None:
        """A shift in a clear gap just above the modes wanted, or else below the cluster that the last one is in.

        None when the basis holds every mode there is.
        """
        theta = self.basis.ritz()[0]
        distances = 1.0 / theta[theta > 0.0][: n_modes + 8]
        if len(distances) <= n_modes:
            return None
        gaps = np.diff(distances) / distances[:-1]
        order = [*range(n_modes - 1, len(gaps)), *range(n_modes - 2, -1, -1)]
        clear = next((place for place in order if gaps[place] > 1e-4), None)
        if clear is None:
            return float(self.shift + distances[0] * (1.0 - 1e-4))
        return float(self.shift + 0.5 * (distances[clear] + distances[clear + 1]))

    def _result(self, n_modes: int, complete: bool | None) -> Modes:
        theta, Y, _ = self.basis.ritz()
        eigenvalues = self.shift + 1.0 / theta[:n_modes]
        shapes = np.asfortranarray(self.basis.V[:, : self.basis.m] @ Y[:, :n_modes])
        rows = np.argmax(np.abs(shapes) > (1.0 - 1e-6) * np.abs(shapes).max(axis=0), axis=0)
        shapes *= np.sign(shapes[rows, np.arange(n_modes)])
        residuals = backward_errors(self.K, self.M, eigenvalues, shapes)
        if residuals.max() > WRONG:
            raise EigenError(
                f"mode {int(np.argmax(residuals)) + 1} does not satisfy its equation (error {residuals.max():.0e}); "
                "stiffnesses or masses may be too far apart for double precision: check units and penalty springs"
            )
        return Modes(
            eigenvalues=eigenvalues,
            shapes=shapes,
            residuals=residuals,
            complete=complete,
            solver=self.solver,
        )

    def _report(self, stage: str, done: int, total: int) -> None:
        if self.listener is not None:
            self.listener(StageProgress(stage=stage, done=done, total=total))
