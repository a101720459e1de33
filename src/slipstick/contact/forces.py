"""Multiharmonic contact forces, tangents and sensitivities of friction contact elements under rubbing motion."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from slipstick.contact.law import Interval, Placed
from slipstick.errors import SlipstickError
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, IntArray, Numbers

if TYPE_CHECKING:
    from slipstick.contact.kernel.tuples import States

_T = TypeVar("_T")
SERIAL = 64
"""Number of elements from which threads are faster."""


def _vector(row: int, text: str) -> Any:
    return property(lambda f: f._vectors[..., row, :], doc=text)


def _matrix(number: int, text: str) -> Any:
    return property(lambda f: f._matrices[..., number, :, :], doc=text)


def _scalar(column: int | slice, text: str) -> Any:
    return property(lambda f: f._scalars[..., column], doc=text)


class ContactForces:
    """Forces of ``n`` elements with all first derivatives; a single element's arrays have no leading axis.

    ``Fx, Fy`` (..., L) act ON the left-hand side of the structure's equations: they resist the relative motion.
    Derivatives are at fixed other arguments; ``dFx_dU`` equals ``dFx_dX`` because only ``X + U`` enters.

    Examples
    --------
    Stuck all period, the contact is the spring kt.

    >>> import slipstick as ss
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=800.0)
    >>> h = ss.Harmonics([0, 1])
    >>> forces = ss.contact_forces(law, h, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0], omega=2.0)
    >>> forces.Fx.round(9).tolist(), float(forces.dFx_dX[2, 2].round(9)), float(forces.stick_fraction)
    ([0.0, 0.0, 100.0], 100.0, 1.0)
    """

    Fx: Array = _vector(0, "Tangential force coefficients (..., L), force [THEORY.md (4.1)].")
    Fy: Array = _vector(1, "Normal force coefficients (..., L), force [THEORY.md (4.1)].")
    dFx_dX: Array = _matrix(0, "(..., L, L), force/length [THEORY.md (5.1), (5.2)].")
    dFx_dY: Array = _matrix(1, "(..., L, L), force/length.")
    dFy_dY: Array = _matrix(2, "(..., L, L), force/length.")
    dFx_dv: Array = _vector(2, "By ``v = velocity / omega`` (..., L) [THEORY.md (6.1)].")
    dFx_dmu: Array = _vector(3, "(..., L), force.")
    dFx_dkt: Array = _vector(4, "(..., L), length.")
    dFx_dkn: Array = _vector(5, "(..., L), length.")
    dFy_dkn: Array = _vector(6, "(..., L), length.")
    work: Array = _scalar(0, "Dissipated energy a period divided by 2 pi, (...), force x length [THEORY.md (7.1)].")
    stick_fraction: Array = _scalar(1, "Fraction of the period in stick, (...).")
    slip_fraction: Array = _scalar(2, "Fraction of the period in slip, (...).")
    separation_fraction: Array = _scalar(3, "Fraction of the period in separation, (...).")
    residual_traction: Array = _scalar(
        slice(4, None),
        "Interval (..., 2) of admissible mean friction forces: its ends differ only for a contact stuck all period "
        "with no constant rubbing velocity, where ``Fx`` holds the middle (THEORY.md section 3).",
    )

    def __init__(self, vectors: Array, matrices: Array, scalars: Array, inputs: tuple[Harmonics, Array, Array]) -> None:
        self._vectors, self._matrices, self._scalars = vectors, matrices, scalars
        self.omega: float | None = None
        self._inputs = inputs
        self._v: Numbers = inputs[2][..., 0]

    def single(self) -> ContactForces:
        """Those of the first element, without a leading axis."""
        harmonics, motion, parameters = self._inputs
        inputs = harmonics, motion[0], parameters[0]
        return ContactForces(self._vectors[0], self._matrices[0], self._scalars[0], inputs)

    @property
    def of_batch(self) -> tuple[Array, ...]:
        """Fx, Fy, dFx_dX, dFx_dY, dFy_dY, dFx_dv and work of a batch, faster than one by one."""
        vectors, matrices = self._vectors, self._matrices
        return (
            vectors[:, 0], vectors[:, 1], matrices[:, 0], matrices[:, 1], matrices[:, 2], vectors[:, 2],
            self._scalars[:, 0],
        )  # fmt: skip

    def __repr__(self) -> str:
        many = f"{len(self.Fx)} elements" if self.Fx.ndim > 1 else "1 element"
        return f"ContactForces({many}, {self.Fx.shape[-1]} coefficients)"

    @property
    def dFx_dU(self) -> Array:
        """By the periodic rubbing motion, equal to ``dFx_dX``."""
        return self.dFx_dX

    @property
    def dFx_dgap(self) -> Array:
        """By the gap (..., L): only ``Y - gap e1`` enters."""
        return -self.dFx_dY[..., 0]

    @property
    def dFy_dgap(self) -> Array:
        """By the gap (..., L)."""
        return -self.dFy_dY[..., 0]

    @property
    def dFx_domega(self) -> Array:
        """By frequency: ``-(v / omega) dFx/dv``, with the part of v whose velocity is constant [THEORY.md (6.1)]."""
        return -(np.asarray(self._v)[..., None] / self._frequency) * self.dFx_dv

    @property
    def dFx_dvelocity(self) -> Array:
        """By the rubbing velocity in length/time."""
        return self.dFx_dv / self._frequency

    @property
    def power(self) -> Array:
        """Dissipated power (...), force x length / time [THEORY.md (7.2)]."""
        return self._frequency * self.work

    @property
    def _frequency(self) -> float:
        if self.omega is None:
            raise AttributeError("omega was not given to these contact forces; use contact_forces(..., omega=...)")
        return self.omega

    @cached_property
    def states(self) -> Any:
        """Intervals (start, end, "stick" | "slip+" | "slip-" | "separation") of one period, in rad, for each element.

        They follow one another cyclically; the last may end beyond ``2 pi``. A single element gives one list; of motion
        or parameters that are no numbers it is empty, as their forces are nan.
        """
        harmonics, motion, parameters = self._inputs
        X, Y = motion[..., 0, :], motion[..., 1, :]
        if motion.ndim == 2:
            return _all_states(harmonics, X[None], Y[None], tuple(parameters[:, None]))[0]
        return _all_states(harmonics, X, Y, tuple(parameters.T))


def _all_states(harmonics: Harmonics, X: Array, Y: Array, parameters: tuple[Array, ...]) -> list[list[Interval]]:
    """States of a few hundred elements at a time: arrays of intervals have the size of the worst case."""
    parts = (slice(i, i + 512) for i in range(0, len(X), 512))
    each = tuple(np.broadcast_to(value, len(X)) for value in parameters)
    return [states for part in parts for states in _states(harmonics, X[part], Y[part], tuple(p[part] for p in each))]


def _states(harmonics: Harmonics, X: Array, Y: Array, parameters: tuple[Array, ...]) -> list[list[Interval]]:
    from slipstick.contact.kernel.tuples import NAMES

    totals, at, code = _evaluate(harmonics, X, Y, parameters, states=True)[1]
    return [
        [(float(a), float(b), NAMES[c]) for (a, b, _f), (c, _o) in zip(at[e, :n], code[e, :n], strict=True)]
        for e, n in enumerate(totals)
    ]


def _evaluate(
    harmonics: Harmonics, X: Array, Y: Array, parameters: tuple[Array, ...], states: bool = False
) -> tuple[ContactForces, tuple[IntArray, Array, IntArray]]:
    """Results of a batch whose motion is given element by element, and with ``states`` its intervals."""
    n, L = X.shape
    rubbing, velocity, values = np.empty((2, n, L)), np.zeros((2, 2, n)), np.empty((n, 4))
    rubbing[0], rubbing[1] = X, Y
    velocity[1, 0] = parameters[0]
    for i, value in enumerate(parameters[1:]):
        values[:, i] = value
    none = np.empty((2, 1, 0, L))
    placed = Placed(none[0], np.full((2, n), -1), rubbing, velocity[0], velocity[1], np.ones(1), values)
    return _run(harmonics, placed, none, states)


def _run(
    harmonics: Harmonics, placed: Placed, on_ports: Array, states: bool = False
) -> tuple[ContactForces, tuple[IntArray, Array, IntArray]]:
    kernel, count, L = _kernel(), len(placed.values), harmonics.size
    tables = kernel.grid(harmonics)
    computed = 0 if states else count
    vectors, matrices, scalars = np.empty((computed, 7, L)), np.empty((computed, 3, L, L)), np.empty((computed, 6))
    motion, parameters = np.empty((count, 2, L)), np.empty((count, 5))
    intervals = _interval_arrays(count, kernel.most_intervals(tables.top)) if states else kernel.no_intervals
    outputs = (vectors, matrices, scalars, motion, parameters, on_ports)
    for e in run_in_threads(count, SERIAL, kernel.run_elements, tuple(placed), tuple(tables), outputs, intervals):
        if e != kernel.done:
            raise SlipstickError(f"contact element {e}: " + kernel.too_many.format(orders=list(harmonics.orders)))
    return ContactForces(vectors, matrices, scalars, (harmonics, motion, parameters)), intervals


def forces_on_ports(harmonics: Harmonics, placed: Placed, on_ports: Array) -> ContactForces:
    """Forces of elements on the ports of a balance, see ``Law.respond_on_ports``."""
    return _run(harmonics, placed, on_ports)[0]


def _interval_arrays(count: int, most: int) -> tuple[IntArray, Array, IntArray]:
    """Arrays for the intervals of ``count`` elements."""
    return np.empty(count, np.int64), np.empty((count, most, 3)), np.empty((count, most, 2), np.int64)


class _Kernel(NamedTuple):
    """Compiled functions and their constants."""

    run_elements: Callable[..., int]
    grid: Callable[[Harmonics], Any]
    most_intervals: Callable[[int], int]
    no_intervals: tuple[IntArray, Array, IntArray]
    done: int
    too_many: str


@cache
def _kernel() -> _Kernel:
    """The kernel, imported at the first evaluation because its import is slow."""
    from slipstick.contact.kernel.batch import ALL_DONE, most_intervals, run_elements
    from slipstick.trig.basis import grid
    from slipstick.trig.roots import TOO_MANY

    return _Kernel(run_elements, grid, most_intervals, _interval_arrays(0, 0), ALL_DONE, TOO_MANY)


def _threads() -> int:
    """NUMBA_NUM_THREADS, or the number of processors; numba's own threads do not survive a fork and are not started."""
    import numba

    config: Any = numba.config
    return int(config.NUMBA_NUM_THREADS)


def run_in_threads(count: int, serial: int, run: Callable[..., _T], *work: Any) -> list[_T]:
    """Results of ``run(first, last, *work)`` for parts of a batch, in threads from ``serial`` elements on."""
    parts = 1 if count < serial else _threads()
    if parts == 1:
        return [run(0, count, *work)]
    ends = [i * count // parts for i in range(parts + 1)]
    return list(_pool().map(lambda first, last: run(first, last, *work), ends[:-1], ends[1:]))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(_threads(), thread_name_prefix="slipstick")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_pool.cache_clear)  # threads do not exist in the child


def element_forces(
    harmonics: Harmonics, X: Array, Y: Array, *, v: Array, kt: Array, mu: Array, kn: Array, gap: Array
) -> ContactForces:
    """Forces of a batch without checks of the arguments, see ``contact_forces``.

    ``X`` (n, L) is the relative motion plus the periodic rubbing motion ``X + U``, ``Y`` (n, L); ``v = velocity/omega``
    and the parameters are (n,). ``omega`` is not known here: use ``dFx_dv`` and ``work``.
    """
    return _evaluate(harmonics, X, Y, (v, kt, mu, kn, gap))[0]


def one_element_forces(harmonics: Harmonics, X: Array, Y: Array, parameters: Array) -> ContactForces:
    """Forces of a single element: motion (L,), ``v, kt, mu, kn, gap`` (5,), results without a leading axis."""
    return _evaluate(harmonics, X[None], Y[None], tuple(parameters[:, None]))[0].single()


def element_states(
    harmonics: Harmonics, X: Array, Y: Array, *, v: Array, kt: Array, mu: Array, kn: Array, gap: Array
) -> list[list[Interval]]:
    """Intervals (start, end, state) of each element of a batch, as ``ContactForces.states``; arguments as above."""
    return _all_states(harmonics, X, Y, (v, kt, mu, kn, gap))


def element_intervals(
    harmonics: Harmonics, X: Array, Y: Array, *, v: Array, kt: Array, mu: Array, kn: Array, gap: Array
) -> States:
    """The intervals as arrays, with the state before each stick."""
    from slipstick.contact.kernel.tuples import States

    return States(*_evaluate(harmonics, X, Y, (v, kt, mu, kn, gap), states=True)[1])
