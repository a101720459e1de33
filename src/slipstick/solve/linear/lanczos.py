"""Lowest modes of sparse ``K phi = lambda M phi``: shift-invert block Lanczos with a proof of completeness.

K and M are real and symmetric; or complex and Hermitian, for those who bring factors of them.

The operator ``(K - s M)^-1 M`` is symmetric in the M inner product; a block of vectors finds repeated eigenvalues. The
number of eigenvalues below a shift is the number of negative ones of ``K - shift M`` (Sylvester's law of inertia).
Where a second factorisation would cost much, a search from random vectors takes the place of this count. Full
reorthogonalisation keeps the basis clean (R. G. Grimes, J. G. Lewis, H. D. Simon, SIAM J. Sparse Anal. Appl. 15, 228,
1994), thick restarts bound the memory (K. Wu, H. Simon, SIAM J. Sparse Anal. Appl. 22, 602, 2000).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from slipstick.errors import InputError
from slipstick.solve.linear.factorisation import (
    Factorisation,
    SingularMatrixError,
    factorise,
    one_blas_thread,
    require_regular,
    shifted,
)
from slipstick.solve.linear.modes import (
    WRONG,
    EigenError,
    EigenOptions,
    Modes,
    StageListener,
    StageProgress,
    backward_errors,
)
from slipstick.typing import Array, BoolArray, Sparse

# Proof of completeness: a count by a second factorisation, or a search from random vectors.
_COUNT_RANGE = 2.0
"""Where factors are shared, eigenvalues are counted up to this multiple of the last one wanted."""
_COUNT_MEMORY = 256e6
"""Bytes of factors up to which eigenvalues are counted, which is a proof; with more they are searched for."""
_MISS_PROBABILITY = 1e-12
"""Probability with which a search may miss a mode."""
_SEARCH_VECTORS = 8
"""Random vectors of a search: a solution of some columns takes hardly longer than of one."""
_MASS_CONDITION = 1e3
"""Condition number of a mass matrix with unit diagonal: of finite elements some tens (A. J. Wathen, IMA J. Numer. Anal.
7, 449, 1987). The search depends on its logarithm only."""

_STEPS, _MOST_STEPS = 16, 60
"""Steps of a search above which the basis is widened first, and above which eigenvalues are too close for a search."""

_ALMOST_CONVERGED = 1e-4
"""Relative residual of a Ritz value that has nearly converged."""

_BASIS_MEMORY = 0.75e9
"""Bytes of a basis above which it is restarted sooner."""


def modes(
    K: Sparse,
    M: Sparse,
    n_modes: int,
    *,
    shift: float = 0.0,
    solver: str | None = None,
    options: EigenOptions | None = None,
    start: Array | None = None,
    listener: StageListener | None = None,
) -> Modes:
    """The ``n_modes`` lowest modes of sparse symmetric K, M (n, n), M positive definite.

    ``shift`` must lie below the lowest eigenvalue; zero asks for a K without free motions, a negative one serves free
    bodies. ``start`` (n, block) overrides the random first block. Raises InputError for a singular ``K - shift M`` or
    an impossible number, EigenError without convergence.

    >>> from scipy import sparse
    >>> modes(sparse.diags_array([4.0, 1.0, 9.0]), sparse.eye_array(3), 2).omega
    array([1., 2.])
    """
    iteration = BlockLanczos(K, M, shift=shift, solver=solver, options=options, start=start, listener=listener)
    if iteration.inertia is not None and iteration.inertia.negative:
        raise InputError(f"{iteration.inertia.negative} eigenvalues lie below the shift {shift:g}; give a lower one")
    return iteration.modes(n_modes)


def factorise_shifted(
    K: Sparse, M: Sparse, shift: float, *, solver: str | None = None, ordering: Any = None
) -> Factorisation:
    """Factors of ``K - shift M``; a singular K is explained."""
    matrix = K if shift == 0.0 else shifted(K, M, shift)
    if np.iscomplexobj(matrix.data):
        raise InputError("the matrices are complex: give factors of them that are Hermitian")
    try:
        return factorise(matrix, solver=solver, ordering=ordering)
    except SingularMatrixError as error:
        size = -1e-6 * float(K.diagonal().real.sum() / M.diagonal().real.sum())
        remedy = f"constrain the body or, for its free modes, give a negative shift such as {size:.0e}"
        what = "the stiffness matrix is singular (a mechanism or an unconstrained body)"
        if shift != 0.0:
            what, remedy = f"K - {shift:g} M is singular", "the shift is an eigenvalue: move it"
        raise SingularMatrixError(f"{what}: {remedy}", error.null_vector) from error


class Factors(Protocol):
    """Factors of ``K - shift M`` by shift, made by who knows more of K and M than their entries."""

    @property
    def counted(self) -> float | None:
        """A shift for which the inertia costs little."""

    def at(self, shift: float, solve: bool = True) -> Factorisation:
        """Without ``solve`` they only have to tell the inertia."""


class _Inverse:
    """``(K - s M)^-1``, apart from the iteration: together they would be a circle, which is freed late."""

    def __init__(self, K: Sparse, M: Sparse, shift: float, factors: Factorisation) -> None:
        self._matrices, self._shift, self._name, self._ordering = (K, M), shift, factors.name, factors.ordering
        self.factors: Factorisation | None = factors

    def __call__(self, B: Array) -> Array:
        """Times B (n, n_columns); factors dropped to save memory are made again."""
        if self.factors is None:
            self.factors = factorise_shifted(*self._matrices, self._shift, solver=self._name, ordering=self._ordering)
        return self.factors.solve(B)


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
        factors: Factors | None = None,
    ) -> None:
        self.K, self.M, self.shift = K.tocsr(), M.tocsr(), shift
        self.options = options or EigenOptions()
        self.listener = listener
        self.n = K.shape[0]
        self._report("factorising", 0, 1)
        self._made = factors
        if factors is None:
            made = factorise_shifted(K, M, shift, solver=solver, ordering=ordering)
        else:
            made = factors.at(shift)
            require_regular(self.K, made)
        self.solver, self.inertia, self.ordering = made.name, made.inertia, made.ordering
        self._memory = made.memory
        self.solve = _Inverse(self.K, self.M, shift, made)
        dtype = np.result_type(self.K.dtype, self.M.dtype, float)
        self.basis = KrylovBasis(self.solve, self.M, self.options.block, start, dtype)

    def modes(self, n_modes: int, *, count: bool = True, last: bool = False) -> Modes:
        """The lowest ``n_modes``, converged; with ``count``, made sure that none is missing.

        ``last``: nothing is solved for afterwards, so that the factors need not stay beside the modes.
        """
        if not 1 <= n_modes <= self.n:
            raise InputError(f"n_modes = {n_modes} is not to be had from {self.n} dofs; ask for 1 to {self.n}")
        with one_blas_thread():
            complete = self._search(n_modes, count)
            if last:
                self.solve.factors = None
            return self._result(n_modes, complete)

    def participations(self, n_modes: int, B: Sparse) -> tuple[Array, Array]:
        """Of the lowest modes, converged but not counted, frequencies (rad/s) and ``B^H phi``, B (n, n_columns) sparse.

        The modes themselves are not formed: it costs little beside them.
        """
        with one_blas_thread():
            self._converge(n_modes)
            theta, Y, _ = self.basis.ritz()
            omega = np.sqrt(np.maximum(self.shift + 1.0 / theta[:n_modes], 0.0))
            return omega, (B.conj().T @ self.basis.V[:, : self.basis.m]) @ Y[:, :n_modes]

    def _search(self, n_modes: int, count: bool) -> bool | None:
        """Converge, count below a shift or search, and add random blocks for what is missing; whether it is all."""
        self._converge(n_modes)
        if not count:
            return None
        at = self._gap_near(n_modes)
        if at is None:
            return True
        if self._made is None and (self.inertia is None or self._memory > _COUNT_MEMORY) and self._searched(n_modes):
            return True
        self._report("counting modes", n_modes, n_modes)
        if self._made is not None:
            at = self._counting_shift(self._made.counted, n_modes, at)
            inertia = self._made.at(at, solve=False).inertia
        else:
            self.solve.factors = None  # two sets of factors would double the memory
            moved = shifted(self.K, self.M, at)
            inertia = factorise(moved, solver=self.solver, check=False, ordering=self.ordering).inertia
        if inertia is None:
            return None
        self._complete(at, inertia.negative, n_modes)
        return True

    def _searched(self, n_modes: int) -> bool:
        """Search from random vectors until no mode is missing; False where eigenvalues are too close.

        A mode that the basis lacks is found but for a probability of ``_MISS_PROBABILITY`` (J. Kuczynski,
        H. Wozniakowski, SIAM J. Matrix Anal. Appl. 13, 1094, 1992, theorem 4.2, applied to the operator without the
        modes found).
        """
        for _ in range(40 + 8 * n_modes // self.options.block):
            self._report("searching for missing modes", n_modes, n_modes)
            level, steps = self._search_level(n_modes)
            limit = self._limit(n_modes)
            while steps > _STEPS and self.basis.m < self.n and self.basis.m + self.basis.Q.shape[1] <= limit:
                self._make_room(n_modes)
                self.basis.step()
                level, steps = self._search_level(n_modes)
            if self.basis.m == self.n:
                return True
            if steps > _MOST_STEPS:
                return False
            keep = _first(self.basis.ritz()[2] <= _ALMOST_CONVERGED) + self.options.block
            if keep < self.basis.m - self.basis.coupling.shape[1]:
                self.basis.restart(keep)  # its room is for the search
            if not self.basis.lacks(level, int(steps), _SEARCH_VECTORS):
                return True
            self._report("modes were missing, searching on", 0, n_modes)
            self.basis.add_random()
            for _ in range(4):
                self._make_room(n_modes)
                self.basis.step()
            self._converge(n_modes)
        return False

    def _search_level(self, n_modes: int) -> tuple[float, float]:
        """A value below the Ritz values wanted, and the steps that a search for others above it takes.

        It stands in a gap between modes that have nearly converged; the further away, the fewer steps.
        """
        theta, _, error = self.basis.ritz()
        last = _first(error <= _ALMOST_CONVERGED)
        gaps = theta[n_modes - 1 : last - 1] - theta[n_modes:last]
        clear = np.flatnonzero(gaps > 1e-3 * theta[n_modes - 1 : last - 1])
        if not clear.size:
            return 0.0, np.inf
        place = n_modes - 1 + int(clear[-1])
        level = 0.5 * (theta[place] + theta[place + 1])
        share = 1.0 - level / theta[n_modes - 1]
        doubt = np.log(1.648 * np.sqrt(_MASS_CONDITION * self.n)) - np.log(_MISS_PROBABILITY) / _SEARCH_VECTORS
        return float(level), float(np.ceil(0.5 * (1.0 + doubt / np.sqrt(share))))

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
        block = self.options.block
        fits = max(n_modes + 6 * block, int(_BASIS_MEMORY / (8 * self.n)))
        wanted = self.options.subspace or min(3 * n_modes + 16 * block, fits)
        return min(self.n, max(wanted, n_modes + 2 * self.options.block + 2 * self.basis.Q.shape[1]))

    def _make_room(self, n_modes: int) -> None:
        self.basis.make_room(self._limit(n_modes), n_modes + 2 * self.options.block)

    def _converged(self, n_modes: int) -> int:
        if self.basis.m == 0:
            return 0
        return _first(self.basis.ritz()[2][:n_modes] <= self.options.tolerance)

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

    def _counting_shift(self, counted: float | None, n_modes: int, near: float) -> float:
        """The shift counted at before if it serves, else one well above, which may serve others; else ``near``."""
        theta = self.basis.ritz()[0]
        found = self.shift + 1.0 / theta[theta > 0.0]
        for at in (counted, self.shift + _COUNT_RANGE * (found[n_modes - 1] - self.shift)):
            if at is not None and at >= near and np.abs(found - at).min() > 1e-4 * (at - self.shift):
                return float(at)
        return near

    def _result(self, n_modes: int, complete: bool | None) -> Modes:
        theta, Y, _ = self.basis.ritz()
        eigenvalues = self.shift + 1.0 / theta[:n_modes]
        shapes = np.asfortranarray(self.basis.V[:, : self.basis.m] @ Y[:, :n_modes])
        rows = np.argmax(np.abs(shapes) > (1.0 - 1e-6) * np.abs(shapes).max(axis=0), axis=0)
        largest = shapes[rows, np.arange(n_modes)]
        shapes *= largest.conj() / np.abs(largest)
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


def _first(true: BoolArray) -> int:
    """How many are true before the first that is not."""
    return len(true) if true.all() else int(np.argmin(true))


class KrylovBasis:
    """A block Krylov basis of ``A^-1 M``, and the projection of the operator on it.

    Columns ``V`` (n, m) with ``V^H M V = 1``, ``H = V^H M A^-1 M V``, and the block ``Q`` that comes after them.

    Always ``A^-1 M V = V H + Q coupling E^T``, E picking the last columns of V: what is left of a Ritz vector is
    ``coupling`` times its last entries.
    """

    def __init__(
        self, solve: Callable[[Array], Array], M: Sparse, block: int, start: Array | None = None, dtype: Any = float
    ) -> None:
        self.solve, self.M, self.n = solve, M, M.shape[0]
        self.block = min(block, self.n)
        self.random, self.dtype = np.random.default_rng(20120101), dtype
        self.V = np.zeros((self.n, 0), dtype=dtype, order="F")
        self.H = np.zeros((0, 0), dtype=dtype)
        self.m = 0
        first = self._random_block() if start is None else np.array(start, dtype=dtype)
        self.Q, self.MQ, _ = self._orthonormalise(first)
        self.coupling = np.zeros((self.Q.shape[1], 0))

    def step(self) -> None:
        """Take the next block into the basis and make the one after it."""
        m, width = self.m, self.Q.shape[1]
        self.V[:, m : m + width] = self.Q
        self.m = m + width
        blocks = [self.solve(self.MQ)]
        self.Q = self.MQ = np.zeros((self.n, 0))  # memory that the next block takes
        C = self._remove(blocks[0], self.M @ blocks[0])
        H = np.zeros((self.m, self.m), dtype=self.dtype)
        H[:m, :m] = self.H
        H[:, m:] = C
        H[m:, :m] = C[:m].conj().T
        H[m:, m:] = 0.5 * (C[m:] + C[m:].conj().T)
        self.H = H
        self.Q, self.MQ, self.coupling = self._orthonormalise(blocks.pop())

    def ritz(self) -> tuple[Array, Array, Array]:
        """Ritz values (largest first), vectors in the basis, and relative residuals."""
        theta, Y = np.linalg.eigh(self.H)
        theta, Y = theta[::-1], Y[:, ::-1]
        last = self.coupling.shape[1]
        error = np.linalg.norm(self.coupling @ Y[self.m - last :], axis=0) if self.m < self.n else np.zeros(self.m)
        return theta, Y, error / np.maximum(np.abs(theta), np.finfo(float).tiny)

    def make_room(self, limit: int, keep: int) -> None:
        """Room for the next block: a restart, or columns that take memory only when they are written."""
        if self.m + self.Q.shape[1] > limit:
            self.restart(keep)
        columns = limit + _SEARCH_VECTORS * _MOST_STEPS  # those of a search
        if columns > self.V.shape[1]:
            grown = np.zeros((self.n, columns), dtype=self.dtype, order="F")
            grown[:, : self.m] = self.V[:, : self.m]
            self.V = grown

    def restart(self, keep: int) -> None:
        """Keep the best Ritz vectors and the next block: the invariants of the iteration still hold."""
        theta, Y, _ = self.ritz()
        keep = min(keep, self.m - self.coupling.shape[1])
        for rows in np.array_split(np.arange(self.n), max(1, self.n // 8192)):
            part = slice(rows[0], rows[-1] + 1)
            self.V[part, :keep] = self.V[part, : self.m] @ Y[:, :keep]
        self.m, self.H = keep, np.diag(theta[:keep])

    def add_random(self) -> None:
        """Widen the next block by random directions: for modes the start had no part of."""
        width = self.Q.shape[1]
        Q, MQ, R = self._orthonormalise(np.hstack([self.Q, self._random_block()]))
        self.Q, self.MQ, self.coupling = Q, MQ, R[:, :width] @ self.coupling

    def lacks(self, level: float, steps: int, width: int) -> bool:
        """Whether Krylov vectors of random ones hold Ritz values above a level that the basis does not have.

        The basis is as before then: they stand in columns beyond it for a while.
        """
        kept = self.m, self.H, self.Q, self.MQ, self.coupling
        known = int(np.count_nonzero(self.ritz()[0] > level))
        mass = self.M.diagonal().real
        self.Q, self.MQ, _ = self._orthonormalise(self._random(width) / np.sqrt(mass)[:, None])
        for _ in range(steps):
            if self.Q.shape[1]:
                self.step()
        found = int(np.count_nonzero(np.linalg.eigvalsh(self.H) > level))
        self.m, self.H, self.Q, self.MQ, self.coupling = kept
        return found > known

    def _random_block(self) -> Array:
        """Random unit vectors; one application of the operator damps what the high modes put into them."""
        block = self.solve(self.M @ self._random(self.block))
        self._remove(block, self.M @ block)
        energy = np.abs(np.einsum("ij,ij->j", block.conj(), self.M @ block))
        return np.asarray(block / np.sqrt(np.maximum(energy, np.finfo(float).tiny)))

    def _random(self, width: int) -> Array:
        """Normally distributed vectors (n, width)."""
        drawn: Any = self.random.standard_normal((self.n, width))
        if np.issubdtype(self.dtype, np.complexfloating):
            drawn = drawn + 1j * self.random.standard_normal((self.n, width))
        return np.asarray(drawn)

    def _remove(self, W: Array, MW: Array) -> Array:
        """Take the basis out of W (n, width) in place, ``MW`` being ``M W``; the coefficients (m, width)."""
        V = self.V[:, : self.m]
        C = (MW.conj().T @ V).conj().T  # so that only the few columns are conjugated
        W -= V @ C
        return np.asarray(C)

    def _orthonormalise(self, W: Array) -> tuple[Array, Array, Array]:
        """M-orthonormal block Q outside the basis, ``M Q``, and R with ``W = Q R``; dead directions become random ones.

        Normalised through the eigenvectors of the Gram matrix, whose small eigenvalues are noise and held up (A.
        Stathopoulos, K. Wu, SIAM J. Sci. Comput. 23, 2165, 2002); the basis is taken out again after each scaling.
        """
        room = min(W.shape[1], self.n - self.m)
        R, MW = np.eye(W.shape[1]), self.M @ W
        for turn in range(10 if room else 0):
            values, vectors = self._gram(W, MW)
            values, vectors = values[-room:], vectors[:, -room:]
            floor = max(1e-14 * values[-1], np.finfo(float).tiny)
            root = np.sqrt(np.maximum(values, floor))
            R = (root[:, None] * vectors.conj().T) @ R
            W = W @ (vectors / root)
            MW = MW @ (vectors / root)
            if turn and values[0] > 0.25:  # unit vectors that lost less than half to the basis
                return W, MW, R
            dead = values <= floor
            if turn and dead.any():
                W[:, dead] = self._random(int(dead.sum()))
                R[dead] = 0.0
                self._remove(W, self.M @ W)
            else:
                self._remove(W, MW)
            MW = self.M @ W
        return W[:, :room], MW[:, :room], R[:room]

    def _gram(self, Q: Array, MQ: Array) -> tuple[Array, Array]:
        G = Q.conj().T @ MQ
        values, vectors = np.linalg.eigh(0.5 * (G + G.conj().T))
        if values[0] < -1e-8 * max(values[-1], np.finfo(float).tiny):
            raise InputError("the mass matrix is indefinite: a motion has negative kinetic energy")
        return values, vectors
