"""The computation behind a reduction: static solutions, modes, and how many of them the accuracy needs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from slipstick.errors import InputError
from slipstick.solve.linear.factorisation import Factorisation, SingularMatrixError, factorise, shifted
from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.solve.linear.modes import EigenError, StageListener, StageProgress
from slipstick.structure.matrix_checks import matrix_faults, name_of, scaled, smallest_pivot
from slipstick.structure.reduction.data import Columns, ReducedData
from slipstick.structure.reduction.near_field import near_residuals, sampled
from slipstick.structure.reduction.request import Accuracy
from slipstick.typing import AnyArray, Array, IntArray, Sparse

MOST_BY_DEFAULT = 128
MOST_MODES = 512
BAND_BY_DEFAULT = 10.0
"""Without a range the modes serve frequencies up to this many times the first natural one."""

_TOGETHER = 256
"""Columns solved and multiplied at a time."""

_HELD, _SLICE = 1024, 32
"""Columns whose solutions are held together; more are solved for in slices."""

_PRODUCTS = 1000
"""Products with a receptance in one curve, for the choice between written and solved residuals."""

_COLUMNS = 11
"""Columns of each product: the harmonics 0 to 5."""

ALWAYS_WRITTEN = 500
"""Directions up to which residuals are written out."""

MOST_WRITTEN_BYTES = 4e9
"""Memory that residuals written out may take."""


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
) -> ReducedData:
    """All of :class:`ReducedData`; the matrices are checked first.

    ``residuals`` is the kind: "written", "solved", or "auto", the one that costs less.
    """
    faults = matrix_faults(K, M, dofs)
    if faults:
        raise InputError(faults)
    clock, n_keep, iteration, written = _Clock(listener), columns.directions.shape[1], None, True
    if residuals == "solved" or (residuals == "auto" and n_keep > ALWAYS_WRITTEN):
        clock.start("factorisation")
        iteration = _iteration(K, M, solver, dofs, listener, None)
        assert iteration.solve.factors is not None
        written = residuals != "solved" and not cheaper_solved(n_keep, iteration.solve.factors.memory)
    probe = None
    if written and want.modes is None and want.highest is not None:
        clock.start("direct solution at the highest frequency")
        probe = direct_receptance(K, M, columns.all, want.highest, solver)
    if iteration is None:
        clock.start("factorisation")
        iteration = _iteration(K, M, solver, dofs, listener, None if probe is None else probe.ordering)
    data = reduced_data(iteration, M, columns, want, probe=probe, written=written, stage=clock.start)
    if not (data.omega > 0.0).all():
        raise InputError("the structure has modes of zero or negative stiffness; constrain it and check its matrices")
    return replace(data, seconds=clock.stop())


def cheaper_solved(n_keep: int, factors: int) -> bool:
    """Whether solutions cost less than matrices, over reduction and one curve, by operations.

    ``factors`` are the bytes of the factorised stiffness.
    """
    if n_keep <= ALWAYS_WRITTEN:
        return False
    if 16.0 * n_keep**2 > MOST_WRITTEN_BYTES:
        return True
    solution = 4.0 * factors / 12.0
    matrices = 2.0 * n_keep * solution + _PRODUCTS * _COLUMNS * 4.0 * n_keep**2
    return (2.0 * _COLUMNS * _PRODUCTS + 500.0) * solution < matrices


def reduced_data(
    iteration: BlockLanczos,
    M: Sparse,
    columns: Columns,
    want: Accuracy,
    *,
    probe: Probe | None = None,
    written: bool = True,
    stage: Callable[[str], None] = lambda name: None,
) -> ReducedData:
    """Modes and residuals of symmetric or Hermitian matrices whose factors ``iteration`` holds.

    Residuals are ``written`` out, or prepared to be solved for, of real matrices. With a range the error is measured
    against the full model at its upper end, ``probe``, made here where it is not given.
    """
    B, n_keep = columns.all, columns.directions.shape[1]
    sample = None if written else sampled(n_keep)
    stage("static solutions" if written else "static solutions of some directions")
    partial = _static_solutions(iteration, M, B, columns, sample)
    stage("modes")
    if not written and want.modes is None and want.highest is not None:
        probe = direct_receptance(iteration.K, M, B, want.highest, iteration.solver, B[:, partial.chosen])
    n_modes, error = wanted_modes(iteration, B, partial, n_keep, want, probe)
    modes = iteration.modes(n_modes, last=written)
    data = replace(
        partial, omega=modes.omega, amplitudes=B.conj().T @ modes.shapes, residuals=modes.residuals,
        complete=modes.complete, error_estimate=error,
    )  # fmt: skip
    if columns.seen is not None:
        data = replace(data, seen_modes=np.asarray(columns.seen.conj().T @ modes.shapes))
        assert data.seen_modes is not None
        if data.seen_second is not None:
            a = data.amplitudes if written else data.amplitudes[n_keep:]
            modal = (data.seen_modes[-columns.n_strains :] / data.omega**4) @ a.conj().T
            data = replace(data, seen_second=data.seen_second - modal)
    if written:
        return data
    iteration.basis = None  # type: ignore[assignment]
    del modes
    stage("near field of what the modes leave out")
    near = near_residuals(iteration, M, columns.directions, data)
    return replace(data, near=near, factors=iteration.solve.factors)


def _static_solutions(
    iteration: BlockLanczos, M: Sparse, B: Sparse, columns: Columns, sample: IntArray | None
) -> ReducedData:
    """``B^H U``, ``B^H K^-1 M U`` for ``U = K^-1 B``, ``U`` at the recovery rows and ``K^-1 M U`` at those of strains.

    Of many columns, and of a sample of them and the loads, U is not stored: slices take a second solution.
    """
    n, n_keep, rows = B.shape[1], columns.directions.shape[1], columns.seen
    partial = ReducedData(
        omega=np.empty(0), amplitudes=np.empty((n, 0)), residuals=np.empty(0), solver=iteration.solver, sample=sample,
        static=np.empty((n, n if sample is None else len(sample) + n - n_keep)), second=np.empty(0),
    )  # fmt: skip
    strains = None if rows is None or not columns.n_strains else rows.tocsc()[:, -columns.n_strains :]
    adjoint, right = B.conj().T, B[:, partial.chosen]
    held = sample is None and n <= _HELD
    width, U = _TOGETHER if held else _SLICE, np.empty((0, 0))
    parts = list[tuple[AnyArray | None, ...]]()
    for first in range(0, right.shape[1], width):
        u = iteration.solve(right[:, first : first + width].toarray())
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
        second = np.hstack([U.conj().T @ (M @ U[:, i : i + width]) for i in range(0, n, width)])
    assert static is not None
    assert second is not None
    if sample is None:
        static, second = 0.5 * (static + static.conj().T), 0.5 * (second + second.conj().T)
    else:
        seen, seen_second = (None if part is None else part[:, len(sample) :] for part in (seen, seen_second))
    return replace(partial, static=static, second=second, seen_static=seen, seen_second=seen_second)


def wanted_modes(
    iteration: BlockLanczos, B: Sparse, partial: ReducedData, n_keep: int, want: Accuracy, probe: Probe | None
) -> tuple[int, float | None]:
    """Number of modes, and the error of the receptance up to the highest frequency where it is measured.

    The number is given; or, with a range, the error measured by ``probe`` has to be half of the tolerance. Else the
    estimate has to reach the tolerance, with at most ``MOST_BY_DEFAULT`` modes. The estimate is above the error
    (THEORY.md (10.3)) and needs no solution of the full model.
    """
    if want.modes is not None:
        return min(want.modes, iteration.n), None
    limit, error = min(MOST_BY_DEFAULT if probe is None else MOST_MODES, iteration.n), 0.0
    n_modes = min(16 if probe is None else max(8, (probe.below or 0) + 4), limit)
    while probe is not None or n_modes < limit:
        omega, amplitudes = iteration.participations(n_modes, B)
        data, last = replace(partial, omega=omega, amplitudes=amplitudes), n_modes == limit
        if probe is None:
            if data.estimate(n_keep, reached(omega, want)) <= want.relative:
                break
        else:
            assert want.highest is not None
            if (omega == want.highest).any():
                raise InputError(at_resonance(want.highest))
            error = data.band_error(n_keep, want.highest, probe.exact)
            if error <= (1.0 if last else 0.5) * want.relative or n_modes == iteration.n:
                return n_modes, error
            if last:
                raise EigenError(
                    f"{n_modes} modes leave a relative error of {error:.1e} up to {want.highest:g} rad/s where "
                    f"{want.relative:.1e} was asked; ask for less accuracy or a lower highest frequency"
                )
        if probe is None or partial.sample is not None:  # with many directions modes cost more than the steps to fewer
            more = n_modes // 4
        else:
            more = int(n_modes * min(1.0, (error / (0.5 * want.relative)) ** (1 / 3) - 0.95))
        n_modes = min(n_modes + max(8, more), limit)
    return n_modes, None


def reached(omega: Array, want: Accuracy) -> float:
    """Frequency (rad/s) up to which the estimate has to be small."""
    return max(BAND_BY_DEFAULT * float(omega[0]), want.reach)


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
    """Whether a regular K has negative eigenvalues, for solvers without inertia."""
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


class Probe(NamedTuple):
    """The full model at one frequency."""

    exact: AnyArray
    """Undamped receptance between the directions, or from some of them to all."""
    below: int | None
    """Number of modes below the frequency; None: the solver has no inertia."""
    ordering: Any
    """Ordering of the factors."""


def direct_receptance(
    K: Sparse, M: Sparse, directions: Sparse, omega: float, solver: str | None, forces: Sparse | None = None
) -> Probe:
    """The full model between directions, or from ``forces`` to them, at a frequency (rad/s), by one factorisation."""
    try:
        factors = factorise(shifted(K, M, omega**2), solver=solver)
    except SingularMatrixError as error:
        raise InputError(at_resonance(omega)) from error
    return probed(factors, directions, forces)


def at_resonance(omega: float, where: str = "") -> str:
    """Why the full model has no receptance at a frequency (rad/s)."""
    return f"{omega:g} rad/s is a natural frequency to working accuracy{where}; choose one beside it"


def probed(factors: Factorisation, directions: Sparse, forces: Sparse | None = None) -> Probe:
    """``direct_receptance`` by factors of ``K - omega^2 M``."""
    exact = directions.conj().T @ factors.solve((directions if forces is None else forces).toarray())
    below = None if factors.inertia is None else factors.inertia.negative
    return Probe(np.asarray(exact), below, factors.ordering)


def modes_below(K: Sparse, M: Sparse, omega: float, solver: str | None = None) -> int | None:
    """Number of modes below a frequency (rad/s), by one factorisation; None where the solver has no inertia."""
    try:
        inertia = factorise(shifted(K, M, omega**2), solver=solver).inertia
    except SingularMatrixError:
        return None
    return None if inertia is None else inertia.negative


class _Clock:
    """Seconds by stage; each stage is announced to the listener when it begins."""

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
