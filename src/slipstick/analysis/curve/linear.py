"""Linear limits of a response curve: without contacts, and with all contacts stuck."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.balance import Balance
from slipstick.balance.inputs import Inputs
from slipstick.balance.layout import Batch
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import SMALLEST, frequency, in_radians, numbers, wrong
from slipstick.quantities import WithUnit
from slipstick.results.measures import amplitude
from slipstick.results.record import Outputs
from slipstick.results.schema import attributes_of, layout_of, make_table
from slipstick.results.solutions import Solutions
from slipstick.typing import Array
from slipstick.units import Units


def frequencies_of(omega: Any, units: Units | None) -> Array:
    """Frequencies (n,) in rad/s from numbers, or from texts in the units of a problem."""
    expected = "frequencies > 0 in rad/s, one or a list"
    if isinstance(omega, str):
        omega = frequency("omega", omega, units)
    elif isinstance(omega, list | tuple):
        omega = [in_radians(("omega", i), value, units) for i, value in enumerate(omega)]
    w = np.atleast_1d(numbers("omega", omega, expected))
    if w.ndim > 1 or w.size == 0 or np.any(w < SMALLEST):
        raise wrong("omega", omega, expected)
    return w


def ends_of(omega: Any, w: Array) -> tuple[float, float]:
    """The lowest and highest of frequencies ``w`` (n,), with a unit where all given values have one."""
    given = [omega] if isinstance(omega, str) else omega
    stated = isinstance(given, list | tuple) and all(isinstance(value, str) for value in given)
    kind = WithUnit if stated else float
    return kind(w.min()), kind(w.max())


class LinearLimit:
    """The linear system of a problem with contacts "free" or "stuck", for any frequencies."""

    def __init__(self, balance: Balance, state: str) -> None:
        self.balance, self.state, self._P = balance, state, balance.problem.inputs.P
        self._outputs = Outputs(balance, balance.problem.outputs or ())
        self.stiffness, self.constant = _held(balance, balance.problem.inputs, state)

    def ports(self, w: Array) -> Array:
        """Coefficients of the motion of the contact ports (n, n_ports, L) at frequencies (n,)."""
        balance = self.balance
        x = np.empty((w.size, balance.n_ports, balance.L))
        slices = max(1, int(2e6 / max(1, balance.orders.size * balance.receptance.static.size)))
        for first in range(0, w.size, slices):
            chosen = slice(first, first + slices)
            x[chosen] = _ports(balance, w[chosen], self.stiffness, self.constant, self._P)
        return x

    def motion(self, w: Array) -> Array:
        """Coefficients of the outputs (n, n_outputs, L) at frequencies (n,)."""
        x = self.ports(w)
        force = np.einsum("pq,nql->npl", self.stiffness, x) + self.constant
        P = np.broadcast_to(self._P, (w.size, *self._P.shape))
        return self._outputs.motion(x.reshape(w.size, -1), force, P, w, [{}] * w.size)

    def solutions(self, w: Array, motion: Array, warnings: Sequence[str] = ()) -> Solutions:
        """Solutions at frequencies (n,) with their motion (n, n_outputs, L)."""
        problem = self.balance.problem
        values = {
            "omega": w,
            "displacement": motion,
            "amplitude": amplitude(problem.harmonics, motion).value,
            "mean": motion[:, :, 0],
        }
        message = f"linear response, contacts {self.state}"
        attributes = attributes_of(problem, Outcome.COMPLETED, message, warnings, analysis="linear")
        layout = layout_of(problem, only=tuple(values))
        return Solutions(make_table(layout, values, attributes), Outcome.COMPLETED, problem)


def _held(balance: Balance, inputs: Inputs, state: str) -> tuple[Array, Array]:
    """Stiffness (n_ports, n_ports) and force at rest (n_ports, L) of all contacts held in one state."""
    stiffness, constant = np.zeros((balance.n_ports, balance.n_ports)), np.zeros((balance.n_ports, balance.L))
    for batch, values in zip(balance.batches, inputs.batches, strict=True):
        held = batch.law.linear(state, values.values, np.zeros_like(values.velocity))
        if held is None:
            continue
        rows = rows_of(balance, batch)
        for (i, j), k in held.stiffness.items():
            both = (rows[i] >= 0) & (rows[j] >= 0)
            np.add.at(stiffness, (rows[i, both], rows[j, both]), k[both])
            np.add.at(constant, rows[i, rows[i] >= 0], (k[:, None] * values.motion[j])[rows[i] >= 0])
        for i, c in held.constant.items():
            np.add.at(constant, (rows[i, rows[i] >= 0], 0), c[rows[i] >= 0])
    return stiffness, constant


def rows_of(balance: Balance, batch: Batch) -> NDArray[np.intp]:
    """Rows among the ports of all contacts, (ports, n) of a batch; -1 where a contact lacks the port."""
    rows = np.full((len(batch.ports), batch.count), -1)
    for i, port in enumerate(batch.ports):
        rows[i, port.members] = np.arange(balance.n_ports)[port.rows]
    return rows


def _ports(balance: Balance, w: Array, stiffness: Array, c: Array, P: Array) -> Array:
    """Motion of the ports (n, n_ports, L) with springs and constant forces c (n_ports, L), harmonic by harmonic."""
    p = balance.n_ports
    unit, x = np.eye(p), np.empty((w.size, p, balance.L))
    push = np.concatenate([-c, P])
    receptance = balance.receptance.written()
    static = receptance.static
    still = stiffness if balance.support_springs is None else stiffness - np.diag(balance.support_springs)
    if balance.is_unsupported(stiffness):
        raise InputError(
            Fault("state", "nothing holds the structure in harmonic 0", remedy="take ss.models.free_structure")
        )
    x[:, :, 0] = np.linalg.solve(unit + static[:, :p] @ still, static @ push[:, 0])
    if balance.orders.size:
        A = receptance.at(balance.orders, w)[0]
        hat = (push[:, 1::2] - 1j * push[:, 2::2]).T[:, :, None]
        moved = np.linalg.solve(unit + A[..., :p] @ stiffness, A @ hat)[..., 0].transpose(0, 2, 1)
        x[:, :, 1::2], x[:, :, 2::2] = moved.real, -moved.imag
    return x


_MOST, _LEAST = 401, 61
"""Largest and smallest number of equally spaced frequencies of a reference curve."""
_SECONDS = 2.0
"""Processor time that they may take."""
_PEAK_DOFS, _PEAKS, _PEAK_ROUNDS, _PEAK_POINTS = 3, 3, 6, 9
"""Refinement of peaks: number of first outputs, of their highest peaks, of rounds, and of points in each round."""


def linear_references(
    balance: Balance, omega: tuple[float, float], *, seconds: float = _SECONDS
) -> Iterator[tuple[str, Solutions]]:
    """Label and response of each limit over a range of frequencies; a limit that cannot be computed is left out.

    The number of frequencies is what ``seconds`` allow. Natural frequencies and points around the highest peaks are
    added, so that peaks do not depend on that number. Where no contact can stick there is one limit.
    """
    known: LinearLimit | None = None
    for state, label in (("free", "without contact"), ("stuck", "stuck")):
        try:
            limit = LinearLimit(balance, state)
            if known is not None and all(
                np.array_equal(own, other)
                for own, other in ((limit.stiffness, known.stiffness), (limit.constant, known.constant))
            ):
                continue
            known = limit
            yield label, limit.solutions(*_with_peaks(limit, *_over(limit, min(omega), max(omega), seconds)))
        except InputError:
            continue


def _over(limit: LinearLimit, low: float, high: float, seconds: float) -> tuple[Array, Array]:
    """Frequencies and motion over the range, as many as the processor time allows."""
    first = np.linspace(low, high, _LEAST)
    limit.motion(first[:1])  # without the cost of the first call
    begin = time.process_time()  # other programs do not change it: the same curve each time
    motion = limit.motion(first)
    count = int(np.clip(_LEAST * seconds / max(time.process_time() - begin, 1e-6), _LEAST, _MOST))
    known = np.asarray(limit.balance.problem.structure.natural_frequencies, dtype=float)
    more = np.concatenate([np.linspace(low, high, count), known[(known > low) & (known < high)]])
    return _joined(limit, first, motion, more)


def _with_peaks(limit: LinearLimit, w: Array, motion: Array) -> tuple[Array, Array]:
    """Frequencies and motion with closer and closer frequencies around the highest peaks of the first outputs."""
    for _ in range(_PEAK_ROUNDS):
        sizes = amplitude(limit.balance.problem.harmonics, motion[:, :_PEAK_DOFS]).value
        highest = {int(at) for size in sizes.T for at in tops(size)}
        near = [np.linspace(w[max(k - 1, 0)], w[min(k + 1, w.size - 1)], _PEAK_POINTS) for k in sorted(highest)]
        w, motion = _joined(limit, w, motion, np.concatenate([w[:0], *near]))
    return w, motion


def tops(size: Array) -> NDArray[np.intp]:
    """Indices of the highest local maxima, ends included."""
    padded = np.concatenate([[-np.inf], size, [-np.inf]])
    maxima = np.flatnonzero((size >= padded[:-2]) & (size >= padded[2:]))
    return maxima[np.argsort(-size[maxima], kind="stable")[:_PEAKS]]


def _joined(limit: LinearLimit, w: Array, motion: Array, more: Array) -> tuple[Array, Array]:
    """Frequencies (n,) and motion, ``more`` frequencies added in order where the motion is bounded."""
    new = np.setdiff1d(more, w)
    if not new.size:
        return w, motion
    with np.errstate(divide="ignore", invalid="ignore"):  # an undamped structure at its natural frequencies
        response = limit.motion(new)
    bounded = np.all(np.isfinite(response), axis=(1, 2))
    together = np.concatenate([w, new[bounded]])
    order = np.argsort(together)
    return together[order], np.concatenate([motion, response[bounded]])[order]
