"""Disturbances as growing vibration: ``D(lambda) = I + A(lambda + i k omega) J(lambda)`` (THEORY.md (13.5)).

A disturbance ``e^(lambda t) sum_k d_k e^(i k tau)`` sustains itself where ``det D = 0``. The tangent J of the contacts
is in closed form; lambda enters it through the memory that each stick begins with, one vector a stick.

Of structures known by receptances alone growing disturbances are counted on the imaginary axis (THEORY.md (13.8)): the
turns of the phase of ``det D`` over frequency count its zeros at growing disturbances, less its poles there. A
structure that takes up power at all its ports has no such poles. Where one gives power, dampers in place of the
contacts tell how many poles there are at least.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics
from slipstick.analysis.stability.linear_systems import FrictionPorts
from slipstick.contact.forces import element_intervals
from slipstick.contact.kernel.tuples import SEPARATION, SLIP_PLUS, STICK
from slipstick.structure.receptance import Receptance
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import AnyArray, Array, ComplexArray, IntArray

Answers = Callable[[complex], ComplexArray]
"""Receptances (2 H + 1, n_ports, n_ports) of the structure at ``lambda + i k omega``, k = -H..H."""

_MOST_SECANTS, _FIRST_SECANT, _SECANT_TOLERANCE, _FARTHEST_EXPONENT = 12, 1e-4, 1e-10, 0.5
"""Secants for one exponent: most of them, and over omega the first, the last, and the distance that is another zero."""

_ORDER_TOLERANCE = 1e-6
"""Difference of receptances between orders, over their size, that is rounding of the interpolation."""

_POWER_TOLERANCE = 1e-3
"""Power over the apparent power, from which a structure gives it: less is noise of a measurement."""

FIRST_NODES, _NODES_PER_OMEGA, _TOP_FACTOR = 33, 8, 30.0
"""Equidistant frequencies at first; those per omega along the whole axis; and how far above the structure it ends."""

_LARGEST_STEP, _FINEST_STEP, _MOST_VALUES = pi / 3.0, 1e-9, 10_000
"""Turn of the phase in a step that is halved, the shortest step over the highest frequency, and the most values."""

WHOLE_TOLERANCE = 0.1
"""Distance from a whole number beyond which a count is not valid."""

_DAMPERS = (0.03, 1.0, 30.0)
"""Dampers over the inverse of the largest mobility, soft to hard: each may reveal other poles."""


class StickTerm(NamedTuple):
    """One stick: it begins at ``start``, lasts ``length`` (rad), and begins with the memory ``-kt dx + factor dy``."""

    contact: int
    start: float
    length: float
    factor: float


@dataclass(frozen=True, kw_only=True, eq=False)
class HarmonicForm:
    """The form at one point.

    Attributes
    ----------
    fixed
        Part of J that does not depend on lambda, (n_ports, K, n_ports, K) with K = 2 H + 1.
    sticks
        All stick intervals that begin within the period.
    """

    omega: float
    orders: Array
    """-H..H."""
    contacts: FrictionPorts
    fixed: ComplexArray
    sticks: tuple[StickTerm, ...]
    answers: Answers
    neutral: int
    """Contacts stuck all period."""

    def contact_answer(self, exponent: complex) -> ComplexArray:
        """``J(lambda)`` (n_ports, K, n_ports, K) (THEORY.md (13.7))."""
        out, c = self.fixed.copy(), self.contacts
        for stick in self.sticks:
            rate = exponent / self.omega + 1j * self.orders
            h = np.exp(-1j * self.orders * stick.start) * _decay(rate, stick.length) / (2.0 * np.pi)
            memory = h[:, None] * np.exp(1j * self.orders * stick.start)[None, :]
            x, y = c.tangential[stick.contact], c.normal[stick.contact]
            if x < 0:
                continue
            out[x, :, x, :] -= c.kt[stick.contact] * memory
            if y >= 0:
                out[x, :, y, :] += stick.factor * memory
        return out

    def matrix(self, exponent: complex) -> ComplexArray:
        """``D(lambda)`` (n_ports K, n_ports K)."""
        J, A = self.contact_answer(exponent), self.answers(exponent)
        n, K = J.shape[:2]
        product: ComplexArray = np.einsum("kpq,qkrl->pkrl", A, J, optimize=True).reshape(n * K, n * K)
        product[np.diag_indices(n * K)] += 1.0
        return product

    def sign(self, exponent: complex) -> complex:
        """Phase of ``det D(lambda)``, a number of magnitude 1 (0 where it is singular)."""
        return complex(np.linalg.slogdet(self.matrix(exponent))[0])

    def damped(self, exponent: complex, damping: float) -> complex:
        """Phase of ``det D(lambda)`` with dampers at all ports in place of the contacts."""
        A, n = self.answers(exponent), self.contacts.n_ports
        s = exponent + 1j * self.orders * self.omega
        return complex(np.prod(np.linalg.slogdet(np.eye(n) + damping * s[:, None, None] * A)[0]))

    def feeding(self, exponent: complex) -> bool:
        """Whether the structure gives power to some motion of the ports at an imaginary exponent."""
        A, w = self.answers(exponent), exponent.imag + self.orders * self.omega
        power = np.linalg.eigvalsh((A - A.conj().transpose(0, 2, 1)) / 2j)
        gain = np.where(w > 0.0, power.max(axis=1), np.where(w < 0.0, -power.min(axis=1), 0.0))
        return bool(np.any(gain > _POWER_TOLERANCE * np.abs(A).max(axis=(1, 2))))

    def exponent(self, start: complex) -> complex | None:
        """The zero of ``det D`` nearest to ``start``, by secants on the bordered matrix; None if they diverge."""
        D, size = self.matrix(start), abs(self.omega)
        left, right = _null_vectors(D)
        known = [start, start + _FIRST_SECANT * size]
        values = [_border(D, left, right), _border(self.matrix(known[1]), left, right)]
        for _ in range(_MOST_SECANTS):
            slope = (values[-1] - values[-2]) / (known[-1] - known[-2])
            if not abs(slope) > 0.0:
                return None
            known.append(known[-1] - values[-1] / slope)
            if abs(known[-1] - start) > _FARTHEST_EXPONENT * size:
                return None
            if abs(known[-1] - known[-2]) < _SECANT_TOLERANCE * size:
                return known[-1]
            values.append(_border(self.matrix(known[-1]), left, right))
        return None


def harmonic_form(
    harmonics: Harmonics, motion: tuple[Array, Array], values: dict[str, Array], contacts: FrictionPorts,
    answers: Answers, omega: float,
) -> HarmonicForm:  # fmt: skip
    """The form at a motion (n, L) of the contacts, the rubbing motion included, with all orders up to the highest.

    ``values`` are the parameters as ``element_forces`` takes them.
    """
    X, Y = motion
    intervals = element_intervals(harmonics, X, Y, **values)
    orders = np.arange(-harmonics.highest, harmonics.highest + 1, dtype=float)
    n, K = contacts.n_ports, orders.size
    fixed, sticks, neutral = np.zeros((n, K, n, K), dtype=complex), [], 0
    for i, total in enumerate(intervals.totals.tolist()):
        at, code = intervals.at[i, :total], intervals.code[i, :total]
        x, y = contacts.tangential[i], contacts.normal[i]
        stick, slip, closed = _windows(at, code[:, 0], harmonics.highest)
        whole = total == 1 and code[0, 0] == STICK
        if x >= 0:
            fixed[x, :, x, :] += contacts.kt[i] * (np.eye(K) if whole else stick)
        if x >= 0 and y >= 0:
            fixed[x, :, y, :] += contacts.mu[i] * contacts.kn[i] * slip
        if y >= 0:
            fixed[y, :, y, :] += contacts.kn[i] * closed
        neutral += int(whole and contacts.kt[i] > 0)
        if not whole:
            sticks += [
                StickTerm(i, a, b - a, _factor(i, a, int(origin), harmonics, (X[i], Y[i]), values))
                for (a, b, _), (state, origin) in zip(at.tolist(), code, strict=True)
                if state == STICK
            ]
    return HarmonicForm(
        omega=omega, orders=orders, contacts=contacts, fixed=fixed, sticks=tuple(sticks), answers=answers,
        neutral=neutral,
    )  # fmt: skip


def _windows(at: Array, states: IntArray, highest: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """``W`` (K, K) of stick, of slip with its sign, and of contact (THEORY.md (13.6))."""
    k = np.arange(-2 * highest, 2 * highest + 1)
    parts = np.zeros((3, k.size), dtype=complex)
    divisor = np.where(k == 0, 1, k)
    for (a, b, _), state in zip(at, states, strict=True):
        if state == SEPARATION:
            continue
        window = np.where(k == 0, b - a, (np.exp(1j * k * b) - np.exp(1j * k * a)) / (1j * divisor)) / (2.0 * np.pi)
        parts[2] += window
        if state == STICK:
            parts[0] += window
        else:
            parts[1] += window if state == SLIP_PLUS else -window
    place = np.subtract.outer(np.arange(2 * highest + 1), np.arange(2 * highest + 1))
    stick, slip, closed = (part[2 * highest - place] for part in parts)
    return stick, slip, closed


def _factor(
    i: int, time: float, origin: int, harmonics: Harmonics, motion: tuple[Array, Array], values: dict[str, Array]
) -> float:
    """``fac`` of a stick that begins, as in the tangent of the element (THEORY.md (13.2))."""
    if origin != SEPARATION:
        return float(values["mu"][i] * values["kn"][i]) * (1.0 if origin == SLIP_PLUS else -1.0)
    slope = harmonics.derivative(np.array(motion)) @ harmonics.H_minus(time)
    return float(values["kt"][i] * (slope[0] + values["v"][i]) / slope[1]) if slope[1] > 0.0 else 0.0


def _decay(rate: AnyArray, length: float) -> ComplexArray:
    """``(1 - e^(-rate length)) / rate``, without loss of digits."""
    small = np.abs(rate) * length < 1e-8
    safe = np.where(small, 1.0, rate)
    return np.asarray(np.where(small, length * (1.0 - 0.5 * rate * length), -np.expm1(-safe * length) / safe))


def _null_vectors(D: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Approximate left and right null vectors of a nearly singular matrix, by two steps of inverse iteration."""
    from scipy.linalg import lu_factor, lu_solve

    factors = lu_factor(D, check_finite=False)
    left = right = np.exp(1j * np.arange(len(D)))  # every direction has a share
    for _ in range(2):
        left, right = lu_solve(factors, left, trans=2), lu_solve(factors, right)
        left, right = left / np.linalg.norm(left), right / np.linalg.norm(right)
    return left, right


def _border(D: ComplexArray, left: ComplexArray, right: ComplexArray) -> complex:
    """``1 / (right^H D^-1 left)`` with approximate null vectors: smooth, and zero where ``D`` is singular."""
    try:
        return complex(1.0 / (right.conj() @ np.linalg.solve(D, left)))
    except np.linalg.LinAlgError:
        return 0.0


def depends_on_order(receptance: Receptance, orders: IntArray, omega: float) -> bool:
    """Whether receptances at one frequency differ from order to order."""
    n, highest = receptance.static.shape[0], int(max(orders, default=1))
    frequency = highest * omega
    answers = np.array([receptance.at(np.array([float(m)]), frequency / m)[0][0][:, :n] for m in (1, *orders.tolist())])
    return bool(np.abs(answers - answers[0]).max(initial=0.0) > _ORDER_TOLERANCE * np.abs(answers).max(initial=0.0))


def measured_answers(receptance: Receptance, orders: Array, omega: float, *, by_order: bool = False) -> Answers:
    """Receptances known at real frequencies alone, for imaginary exponents below ``omega``.

    ``by_order``: harmonic m of a disturbance meets the receptance of its own order at its own frequency. That of order
    0 away from rest is ``receptance.of_order(0, frequency)`` then.
    """
    n, known = receptance.static.shape[0], {}

    def one(order: int, w: float) -> ComplexArray:
        if w == 0.0:
            return receptance.static[:, :n].astype(complex)
        met = abs(order) if by_order else 1
        if met:
            answer = receptance.at(np.array([float(met)]), abs(w) / met)[0][0][:, :n]
        else:
            answer = np.asarray(receptance.of_order(0, abs(w)))[:, :n]
        return answer if w > 0.0 else answer.conj()

    def at(exponent: complex) -> ComplexArray:
        if exponent not in known:
            frequencies = exponent.imag + orders * omega
            each = zip(orders.tolist(), frequencies.tolist(), strict=True)
            known[exponent] = np.array([one(int(order), w) for order, w in each])
        return known[exponent]

    return at


def modal_answers(dynamics: Dynamics, orders: Array, omega: float) -> Answers:
    """Receptances of equations of motion, at any exponent."""
    squared, damping = np.diag(dynamics.K), np.diag(dynamics.C)
    modal = not np.any(dynamics.K - np.diag(squared)) and not np.any(dynamics.C - np.diag(damping))

    def at(exponent: complex) -> ComplexArray:
        s = exponent + 1j * orders * omega
        if modal:
            weights = 1.0 / (squared + s[:, None] * (damping + s[:, None]))
            return np.asarray((dynamics.rows * weights[:, None, :]) @ dynamics.columns + dynamics.R)
        each = s[:, None, None]
        Z = dynamics.K + each * dynamics.C + each * each * np.eye(dynamics.size)
        return np.asarray(dynamics.rows @ np.linalg.solve(Z, dynamics.columns.astype(complex)) + dynamics.R)

    return at


def folded(frequencies: Iterable[float], omega: float) -> Array:
    """Frequencies less multiples of ``omega``, folded into 0 to ``omega / 2``."""
    rest = np.mod(np.asarray(list(frequencies), dtype=float), omega)
    return np.minimum(rest, omega - rest)


def count_unstable(form: HarmonicForm, nodes: Array) -> int | None:
    """Number of growing disturbances of a harmonic form, from initial frequencies; None where it is not known.

    Of a structure that grows by itself the count is a lower bound, and 0 is not certain.
    """
    net = net_turns(lambda nu: form.sign(1j * nu), nodes)
    if net is None:
        return None
    if not any(form.feeding(1j * nu) for nu in nodes.tolist()):
        return net if net >= 0 else None
    s = np.abs(np.add.outer(nodes, form.orders * form.omega))[:, :, None, None]
    mobility = max(float((w * np.abs(form.answers(1j * nu))).max()) for nu, w in zip(nodes.tolist(), s, strict=True))
    unpaired = 0
    for size in _DAMPERS:
        turns = net_turns(lambda nu, c=size / mobility: form.damped(1j * nu, c), nodes)  # type: ignore[misc]
        unpaired = max(unpaired, 0 if turns is None else -turns)
    return net + unpaired if net + unpaired > 0 else None


def strip(natural: Iterable[float], omega: float) -> Array:
    """Initial frequencies where a disturbance repeats at every multiple of omega."""
    return np.unique(np.concatenate([np.linspace(0.0, 0.5 * omega, FIRST_NODES), folded(natural, omega)]))


def axis(natural: Iterable[float], omega: float, highest: int) -> Array:
    """Initial frequencies where each harmonic of a disturbance meets a receptance of its own.

    A disturbance whose frequency is shifted by omega is another one then, of another wave number. All frequencies are
    covered, up to where the receptances vanish.
    """
    frequencies = np.asarray(list(natural), dtype=float)
    near = np.abs(np.subtract.outer(frequencies, np.arange(-highest, highest + 1) * omega)).reshape(-1)
    top = highest * omega + 1.5 * max(frequencies.max(initial=0.0), omega)
    inside = np.linspace(0.0, top, int(_NODES_PER_OMEGA * top / omega))
    return np.unique(np.concatenate([inside, near, np.geomspace(top, _TOP_FACTOR * top, FIRST_NODES)]))


def net_turns(sign: Callable[[float], complex], nodes: Array) -> int | None:
    """Zeros less poles at growing disturbances by ``sign(nu)``, the phase of ``det D(i nu)``; None if unsettled.

    ``nodes`` are initial frequencies, among them those at which the phase may turn fast. The steps are halved
    until no phase step is above 60 degrees; a grid twice as fine has to give the same number.
    """
    known: dict[float, complex] = {}

    def at(nu: float) -> complex:
        if nu not in known:
            known[nu] = sign(nu)
        return known[nu]

    before: int | None = None
    finest = _FINEST_STEP * float(nodes[-1])
    while True:
        turned = refined(at, nodes.tolist(), finest, known)
        if turned is None:
            return None
        turns, nodes = turned
        number = round(-turns / pi)
        if before is not None and number == before:
            return number if abs(-turns / pi - number) < WHOLE_TOLERANCE else None
        before = number
        nodes = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))


def refined(
    at: Callable[[float], complex], nodes: list[float], finest: float, known: dict[float, complex]
) -> tuple[float, Array] | None:
    """Change of the phase over the nodes, and the nodes with steps halved where it turns fast.

    None at a zero, and where too many values would be needed.
    """
    turns, out, waiting = 0.0, [nodes[0]], nodes[:0:-1]
    while waiting:
        a, b = out[-1], waiting[-1]
        first, second = at(a), at(b)
        if not (abs(first) > 0.0 and abs(second) > 0.0) or len(known) > _MOST_VALUES:
            return None
        step = float(np.angle(second / first))
        if abs(step) > _LARGEST_STEP and b - a > finest:
            waiting.append(0.5 * (a + b))
            continue
        turns += step
        out.append(waiting.pop())
    return turns, np.array(out)
