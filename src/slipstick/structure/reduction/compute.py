"""The computation behind a reduction: static solutions, modes, and how many of them the accuracy needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from slipstick.errors import InputError
from slipstick.solve.linear.factorisation import SingularMatrixError, factorise, shifted
from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.solve.linear.modes import EigenError, Modes, StageListener, StageProgress
from slipstick.structure.matrix_checks import matrix_faults, name_of, scaled, smallest_pivot
from slipstick.structure.receptance import undamped
from slipstick.structure.reduction.request import Accuracy
from slipstick.structure.reduction.solved import ALWAYS_WRITTEN, ANSWERS, SolvedData, cheaper_solved, compute_solved
from slipstick.structure.truncation import ReceptanceSize, Truncation, band_error
from slipstick.typing import AnyArray, Array, Sparse

MOST_BY_DEFAULT = 128
MOST_MODES = 512
BAND_BY_DEFAULT = 10.0
"""Without a range the modes serve frequencies up to this many times the first natural one."""

_TOGETHER = 256
"""Columns solved and multiplied at a time."""

_HELD, _SLICE = 1024, 32
"""Columns whose solutions are held together; more are solved for in slices."""

_STORED = ("omega", "amplitudes", "static", "second", "residuals")
_SEEN = ("seen_modes", "seen_static", "seen_second")
"""Arrays of the store that are the fields of their name; those at rows seen as a skin and strains hold them."""


@dataclass(frozen=True, kw_only=True)
class ReducedData:
    """What is computed and stored: everything but names and damping. Loads are the columns after the kept ones."""

    omega: Array
    amplitudes: AnyArray
    """``[B, P]^H phi``, (n_keep + n_loads, n_modes)."""
    static: AnyArray
    """``[B, P]^H K^-1 [B, P]``."""
    second: AnyArray
    """``[B, P]^H K^-1 M K^-1 [B, P]``, not yet less its modal part."""
    residuals: Array
    solver: str
    complete: bool | None = None
    error_estimate: float | None = None
    seen_modes: AnyArray | None = None
    """Modes at the rows seen, (n_seen, n_modes)."""
    seen_static: Array | None = None
    """``K^-1 [B, P]`` at the rows seen."""
    seen_second: Array | None = None
    """``K^-1 M K^-1 [B, P]`` at the last rows seen, those of strains, less its modal part."""
    seconds: Mapping[str, float] = field(default_factory=dict)

    def arrays(self) -> dict[str, Any]:
        """For the store."""
        return {
            **{name: getattr(self, name) for name in _STORED},
            **{name: np.asarray(value, np.float32) for name in _SEEN if (value := getattr(self, name)) is not None},
            "solver": np.array(self.solver),
            "complete": np.array(ANSWERS[self.complete]),
            "error_estimate": np.array(np.nan if self.error_estimate is None else self.error_estimate),
        }

    @classmethod
    def of(
        cls, arrays: Mapping[str, Any], n_keep: int, n_loads: int, n_seen: int = 0, n_strains: int = 0
    ) -> ReducedData | None:
        """From the store; None where they do not fit, or a KeyError, TypeError or ValueError."""
        n, modes, estimate = n_keep + n_loads, arrays["omega"].size, float(arrays["error_estimate"])
        sizes: dict[str, tuple[int, ...]] = {
            "amplitudes": (n, modes), "static": (n, n), "second": (n, n), "residuals": (modes,), "omega": (modes,),
        }  # fmt: skip
        sizes |= {"seen_modes": (n_seen, modes), "seen_static": (n_seen, n)} if n_seen else {}
        sizes |= {"seen_second": (n_strains, n)} if n_strains else {}
        if any(arrays[name].shape != size for name, size in sizes.items()):
            return None
        return cls(
            **{name: arrays[name] for name in sizes},
            solver=str(arrays["solver"]),
            complete={word: answer for answer, word in ANSWERS.items()}[str(arrays["complete"])],
            error_estimate=None if np.isnan(estimate) else estimate,
        )

    @property
    def second_residual(self) -> AnyArray:
        """``second`` less its modal part, symmetric or Hermitian."""
        a = self.amplitudes
        left = self.second - (a / self.omega**4) @ a.conj().T
        return np.asarray(0.5 * (left + left.conj().T))

    def receptance(self, omega: float) -> Array:
        """Undamped, between the kept directions and loads, both residual terms included."""
        modal = undamped(self.omega, self.amplitudes, self.static, self.second_residual)
        return np.asarray(modal.at([1], omega)[0][0].real)

    def band_error(self, n_keep: int, top: float, exact: Array) -> float:
        """Largest relative error of the receptance up to ``top`` (rad/s), where the full model has ``exact``."""
        a = self.amplitudes
        residual = self.static[:n_keep] - (a[:n_keep] / self.omega**2) @ a.T
        size = ReceptanceSize(self.omega, a[:n_keep], residual[:, :n_keep], a[n_keep:], residual[:, n_keep:])
        missing = exact - self.receptance(top)
        return band_error(size, self.omega, n_keep, top=top, missing=missing, second=self.second_residual)

    def left_out(self, n_keep: int) -> Truncation:
        """What the modes leave out, as the residuals tell it."""
        a, second, kept, loads = self.amplitudes, self.second_residual, slice(n_keep), slice(n_keep, None)
        return Truncation(
            omega=self.omega, mode_shapes=a[kept], static_compliance=self.static[kept, kept],
            second_residual=second[kept, kept], participation=a[loads].conj(),
            load_response=self.static[kept, loads], second_load_response=second[kept, loads],
        )  # fmt: skip

    def estimate(self, n_keep: int, top: float) -> float:
        """Largest relative error of the receptance up to ``top`` (rad/s)."""
        return float(self.left_out(n_keep).error(top * np.linspace(0.02, 1.0, 50)).max())


class Columns(NamedTuple):
    """What is asked of a model: kept directions (n, n_keep), loads (n, n_loads), rows seen besides (n, n_seen).

    Of the last ``n_strains`` of these, strains, the second residual is kept too: there what modes leave out counts.
    """

    directions: Sparse
    loads: Array
    seen: Sparse | None = None
    n_strains: int = 0

    def of(self, arrays: Mapping[str, AnyArray]) -> ReducedData | SolvedData | None:
        """What was computed of these, as it is stored; None where it does not fit."""
        n_seen = 0 if self.seen is None else self.seen.shape[1]
        sizes = self.directions.shape[1], self.loads.shape[1], n_seen, self.n_strains
        return (SolvedData if "near_indices" in arrays else ReducedData).of(arrays, *sizes)


def compute(
    K: Sparse,
    M: Sparse,
    columns: Columns,
    *,
    dofs: Sequence[str] | None,
    want: Accuracy,
    solver: str | None,
    residuals: str = "auto",
    listener: StageListener | None,
) -> ReducedData | SolvedData:
    """All of :class:`ReducedData`, or of :class:`SolvedData` with what it is solved by; the matrices are checked first.

    ``residuals`` is the kind: "written", "solved", or "auto", the one that costs less.
    """
    faults = matrix_faults(K, M, dofs)
    if faults:
        raise InputError(faults)
    clock, (directions, loads, *_) = _Clock(listener), columns
    n_keep, iteration = directions.shape[1], None
    if residuals == "solved" or (residuals == "auto" and n_keep > ALWAYS_WRITTEN):
        clock.start("factorisation")
        iteration = _iteration(K, M, solver, dofs, listener, None)
        assert iteration.solve.factors is not None
        if residuals == "solved" or cheaper_solved(n_keep, iteration.solve.factors.memory):
            limits = MOST_BY_DEFAULT, MOST_MODES, BAND_BY_DEFAULT
            solved = compute_solved(
                iteration, M, directions, loads, want, limits, clock.start, columns.seen, columns.n_strains
            )
            _require_positive(solved)
            return replace(solved, seconds=clock.stop(), factors=iteration.solve.factors)
    B = sparse.csc_array(sparse.hstack([directions, sparse.csc_array(loads)]))
    probe = None
    if want.modes is None and want.highest is not None:
        clock.start("direct solution at the highest frequency")
        probe = direct_receptance(K, M, B, want.highest, solver)
    if iteration is None:
        clock.start("factorisation")
        iteration = _iteration(K, M, solver, dofs, listener, None if probe is None else probe.ordering)
    data = written_data(iteration, M, columns, want, probe=probe, stage=clock.start)
    _require_positive(data)
    return replace(data, seconds=clock.stop())


def written_data(
    iteration: BlockLanczos,
    M: Sparse,
    columns: Columns,
    want: Accuracy,
    *,
    probe: Probe | None = None,
    stage: Callable[[str], None] = lambda name: None,
) -> ReducedData:
    """Modes and residuals written out, of symmetric or Hermitian matrices whose factors ``iteration`` holds."""
    n_keep = columns.directions.shape[1]
    B = sparse.csc_array(sparse.hstack([columns.directions, sparse.csc_array(columns.loads)]))
    stage("static solutions")
    static, second, seen, seen_second = _static_solutions(iteration, M, B, columns)
    stage("modes")
    partial = ReducedData(
        omega=np.empty(0),
        amplitudes=np.empty((B.shape[1], 0)),
        static=0.5 * (static + static.conj().T),
        second=0.5 * (second + second.conj().T),
        residuals=np.empty(0),
        solver=iteration.solver,
        seen_static=seen,
    )
    if want.modes is not None:
        modes = iteration.modes(min(want.modes, iteration.n), last=True)
        data = _with_modes(partial, modes, B)
    elif probe is None:
        data, modes = _grow_by_estimate(iteration, partial, B, n_keep, want)
    else:
        data, modes = _grow(iteration, partial, B, n_keep, want, probe)
    if columns.seen is not None:
        data = replace(data, seen_modes=np.asarray(columns.seen.conj().T @ modes.shapes))
        assert data.seen_modes is not None
        if seen_second is not None:
            modal = (data.seen_modes[-columns.n_strains :] / data.omega**4) @ data.amplitudes.conj().T
            data = replace(data, seen_second=seen_second - modal)
    return data


def _static_solutions(
    iteration: BlockLanczos, M: Sparse, B: Sparse, columns: Columns
) -> tuple[AnyArray, AnyArray, AnyArray | None, AnyArray | None]:
    """``B^H U``, ``U^H M U`` for ``U = K^-1 B``, ``U`` at the rows seen and ``K^-1 M U`` at those of strains.

    Of many columns U is not held: slices of them are solved for once more, ``B^H K^-1 M U``.
    """
    rows = columns.seen
    strains = None if rows is None or not columns.n_strains else rows.tocsc()[:, -columns.n_strains :]
    adjoint = B.conj().T
    held, width = B.shape[1] <= _HELD, _TOGETHER if B.shape[1] <= _HELD else _SLICE
    U: AnyArray = np.empty((0, 0))
    parts = list[tuple[AnyArray | None, ...]]()
    for first in range(0, B.shape[1], width):
        u = iteration.solve(B[:, first : first + width].toarray())
        if held:
            U = u if u.shape == B.shape else np.empty(B.shape, dtype=u.dtype) if not first else U
            U[:, first : first + width] = u
        V = None if held and strains is None else iteration.solve(np.asfortranarray(M @ u))
        parts.append((
            adjoint @ u,
            None if held else adjoint @ V,
            None if rows is None else rows.conj().T @ u,
            None if strains is None else strains.conj().T @ V,
        ))  # fmt: skip
    static, second, seen, seen_second = (
        None if each[0] is None else np.hstack(each) for each in zip(*parts, strict=True)
    )
    if held:
        second = np.hstack([U.conj().T @ (M @ U[:, i : i + width]) for i in range(0, B.shape[1], width)])
    assert static is not None
    assert second is not None
    return static, second, seen, seen_second


def _grow(
    iteration: BlockLanczos,
    partial: ReducedData,
    B: Sparse,
    n_keep: int,
    want: Accuracy,
    probe: Probe,
) -> tuple[ReducedData, Modes]:
    """Take more modes until the receptance up to the highest frequency is right to half the error allowed."""
    assert want.highest is not None
    n_modes, limit = max(8, (probe.below or 0) + 4), min(MOST_MODES, iteration.n)
    while True:
        n_modes = min(n_modes, limit)
        last = n_modes == limit
        data = _with_modes(partial, iteration.modes(n_modes, count=False), B)
        error = data.band_error(n_keep, want.highest, probe.exact)
        if error <= (1.0 if last else 0.5) * want.relative or n_modes == iteration.n:
            break
        if last:
            raise EigenError(
                f"{n_modes} modes leave a relative error of {error:.1e} up to {want.highest:g} rad/s where "
                f"{want.relative:.1e} was asked; ask for less accuracy or a lower highest frequency"
            )
        n_modes = max(n_modes + 8, int(n_modes * min(2.0, (error / (0.5 * want.relative)) ** (1 / 3) + 0.05)))
    modes = iteration.modes(n_modes, last=True)
    return replace(_with_modes(partial, modes, B), error_estimate=error), modes


def _grow_by_estimate(
    iteration: BlockLanczos, partial: ReducedData, B: Sparse, n_keep: int, want: Accuracy
) -> tuple[ReducedData, Modes]:
    """Take more modes until what is left out is estimated to be as little as wanted, at most ``MOST_BY_DEFAULT``.

    The estimate stands above the error (THEORY.md (10.3)) and costs no solution of the full model.
    """
    limit = min(MOST_BY_DEFAULT, iteration.n)
    n_modes = min(16, limit)
    while n_modes < limit:
        omega, amplitudes = iteration.participations(n_modes, B)
        data = replace(partial, omega=omega, amplitudes=amplitudes)
        if data.estimate(n_keep, reached(omega, want)) <= want.relative:
            break
        n_modes = min(max(n_modes + 8, n_modes + n_modes // 4), limit)
    modes = iteration.modes(n_modes, last=True)
    return _with_modes(partial, modes, B), modes


def reached(omega: Array, want: Accuracy) -> float:
    """Up to which frequency (rad/s) the modes are to serve, where their number is left to the estimate."""
    return max(BAND_BY_DEFAULT * float(omega[0]), want.reach)


def _with_modes(partial: ReducedData, modes: Modes, B: Sparse) -> ReducedData:
    amplitudes = B.conj().T @ modes.shapes
    return replace(
        partial, omega=modes.omega, amplitudes=amplitudes, residuals=modes.residuals, complete=modes.complete
    )


def _iteration(
    K: Sparse,
    M: Sparse,
    solver: str | None,
    dofs: Sequence[str] | None,
    listener: StageListener | None,
    ordering: Any,
) -> BlockLanczos:
    try:
        iteration = BlockLanczos(K, M, solver=solver, listener=listener, ordering=ordering)
    except SingularMatrixError as error:
        raise InputError(_singular_sentence(error, dofs)) from error
    inertia = iteration.inertia
    negative = inertia.negative if inertia is not None else int(_is_indefinite(K))
    if negative:
        count = f"{negative} negative eigenvalues" if inertia is not None else "negative eigenvalues"
        raise InputError(
            f"the stiffness matrix has {count}, so the structure is unstable at rest; "
            "check signs, material data and any prestress"
        )
    return iteration


def _is_indefinite(K: Sparse) -> bool:
    """Whether a regular K has negative eigenvalues, for solvers that do not tell."""
    diagonal = K.diagonal()
    return bool(diagonal.min() <= 0.0) or smallest_pivot(scaled(K, diagonal)) <= 0.0


def _singular_sentence(error: SingularMatrixError, dofs: Sequence[str] | None) -> str:
    where = ""
    if error.null_vector is not None:
        largest = np.argsort(-np.abs(error.null_vector), kind="stable")[:3]
        where = "; it moves most at dofs " + ", ".join(name_of(dofs, int(index)) for index in largest)
    return (
        "the stiffness matrix is singular: some motion meets no resistance, a mechanism or a rigid-body motion"
        f"{where}; a reduction needs it removed: constrain the structure or ground it with weak springs"
    )


def _require_positive(data: ReducedData | SolvedData) -> None:
    if not (data.omega > 0.0).all():
        raise InputError("the structure has modes of zero or negative stiffness; constrain it and check its matrices")


class Probe(NamedTuple):
    """The full model at one frequency."""

    exact: Array
    """Undamped receptance between the directions."""
    below: int | None
    """Number of modes below the frequency, where the solver tells."""
    ordering: Any
    """Of the factors."""


def direct_receptance(K: Sparse, M: Sparse, directions: Sparse, omega: float, solver: str | None) -> Probe:
    """The full model between directions at a frequency (rad/s), by one factorisation."""
    try:
        factors = factorise(shifted(K, M, omega**2), solver=solver)
    except SingularMatrixError as error:
        raise InputError(f"{omega:g} rad/s is a natural frequency to working accuracy; choose one beside it") from error
    exact = directions.T @ factors.solve(directions.toarray())
    below = None if factors.inertia is None else factors.inertia.negative
    return Probe(np.asarray(exact), below, factors.ordering)


def modes_below(K: Sparse, M: Sparse, omega: float, solver: str | None = None) -> int | None:
    """How many modes lie below a frequency (rad/s), by one factorisation; None where the solver does not tell."""
    try:
        inertia = factorise(shifted(K, M, omega**2), solver=solver).inertia
    except SingularMatrixError:
        return None
    return None if inertia is None else inertia.negative


class _Clock:
    """Seconds by stage, each announced to the listener when it begins."""

    def __init__(self, listener: StageListener | None) -> None:
        self._listener, self._seconds, self._stage, self._began = listener, dict[str, float](), "", perf_counter()

    def start(self, stage: str) -> None:
        self.stop()
        self._stage, self._began = stage, perf_counter()
        if self._listener is not None:
            self._listener(StageProgress(stage=stage, done=0, total=1))

    def stop(self) -> dict[str, float]:
        if self._stage:
            self._seconds[self._stage] = perf_counter() - self._began
            self._stage = ""
        return self._seconds
