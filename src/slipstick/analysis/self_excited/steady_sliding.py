"""Steady sliding: a structure at rest on surfaces that rub, and whether its disturbances grow.

Every contact stays in one state, and the structure with the contacts linearised there has constant coefficients. Its
eigenvalues tell stability; where a complex pair crosses the imaginary axis (Hopf) vibration begins by itself.

A travelling wave begins from a sector at rest [THEORY.md (24.8)]. A disturbance of the phase ``2 pi d / N`` from sector
to sector vibrates with the stiffness of its nodal diameter, the gas, and the contacts as they are at rest. Only the
disturbance with the wave's own phase becomes the wave.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from slipstick.analysis.stability.floquet import StabilityWatch, unstable
from slipstick.analysis.stability.laws_along import VELOCITIES_JUMP, LawsAlong
from slipstick.analysis.stability.linear_systems import LinearSystems
from slipstick.analysis.stability.refined_motion import Iteration
from slipstick.analysis.stability.state_sequence import timeline
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail, ParameterSystem
from slipstick.balance.parameters import parameter_path
from slipstick.balance.start import FirstPoint
from slipstick.errors import InputError
from slipstick.results.stability import EIGENVALUES, UNKNOWN, PointStability
from slipstick.solve.newton import NewtonOptions, newton_at
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray, IntArray

ROUNDING = 1e-9
"""Rate over the largest magnitude of an exponent, up to which it is rounding."""

_AT_END = 1e-5
"""Distance of a crossing from a neighbour over the distance of both, up to which it is at the neighbour."""

_EXACT = NewtonOptions(tolerance=1e-14)
"""Options of Newton's method for steady sliding, which is solved to rounding as its eigenvalues are."""

_SAME_FREQUENCY = 1e-12
"""Relative difference up to which two frequencies are the same."""

_ROUNDS, _NEIGHBOURS = 30, 3
"""Number of iterations for the frequency of the damping, and of values around the Hopf point that each one visits."""

_REAL = 1e-9
"""Imaginary part over the largest magnitude, up to which an eigenvalue is real."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sliding:
    """Steady sliding at a value of a parameter.

    Attributes
    ----------
    x
        Constant relative motion at the ports, (n_ports,).
    exponents
        Eigenvalues (1/time) of disturbances, the fastest growing first.
    shapes
        Their motion at the ports, (n_ports, k).
    neutral
        Number of contacts that stick.
    elsewhere
        Of a travelling wave: number of growing disturbances with the phase of another wave.
    wave_number
        Of a travelling wave: wave number of a growing disturbance, preferably of another phase; None without one.
    """

    value: float
    x: Array
    exponents: ComplexArray
    shapes: ComplexArray
    neutral: int
    elsewhere: int = 0
    wave_number: int | None = None

    @property
    def pairs(self) -> IntArray:
        """Numbers of the exponents with a positive imaginary part, the fastest growing first."""
        return np.flatnonzero(self.exponents.imag > _REAL * np.abs(self.exponents).max(initial=0.0))

    @property
    def omega(self) -> float:
        """Frequency of the fastest growing pair; without a pair, the largest magnitude of an exponent."""
        pairs = self.pairs
        return float(self.exponents[pairs[0]].imag if pairs.size else np.abs(self.exponents).max(initial=0.0) or 1.0)

    @property
    def growing(self) -> int:
        """Number of growing disturbances."""
        return unstable(self._multipliers) + self.elsewhere

    def growth(self, rank: int) -> float:
        """Growth rate of the pair of a rank; negative without that pair."""
        pairs = self.pairs
        return float(self.exponents[pairs[rank]].real) if rank < pairs.size else -1.0

    @property
    def rounding(self) -> float:
        """Growth rate up to which it is rounding."""
        return ROUNDING * float(np.abs(self.exponents).max(initial=0.0))

    @property
    def stability(self) -> PointStability:
        """Stability as results have it: multipliers over a period of ``omega``."""
        multipliers = self._multipliers
        return PointStability(
            multipliers=multipliers, unstable=self.growing, method=EIGENVALUES, neutral=self.neutral,
            wave_number=UNKNOWN if self.wave_number is None else self.wave_number,
        )  # fmt: skip

    @property
    def _multipliers(self) -> ComplexArray:
        return np.asarray(np.exp(self.exponents * 2.0 * np.pi / self.omega))


class SteadySliding:
    """Steady sliding of a problem over a parameter: the balance with harmonic 0 only.

    Disturbances have viscous damping, equal to hysteretic damping at each natural frequency, or at ``damping_at``
    (rad/s).
    """

    def __init__(self, balance: Balance, parameter: str, damping_at: float | None = None) -> None:
        self.damping_at = damping_at
        self._balance = balance.narrowed(Harmonics([0]))
        self._path = parameter_path(self._balance.problem, parameter)
        self._reference = _reference(balance)
        self._system = ParameterSystem(self._balance, self._path, self._reference)
        self._systems = LinearSystems(self._balance, full=True, damping_at=damping_at)
        self._iteration = Iteration(self._balance)
        self._last: Array | None = None

    @property
    def in_time(self) -> bool:
        """Whether the structure has equations in time, from which disturbances are computed."""
        return self._systems.in_time

    def at(self, value: float) -> Sliding | None:
        """Steady sliding at a value, sought from the one before; None where no motion is found."""
        x = self._rest(value)
        if x is None:
            return None
        return self._sliding(value, x, self._system.evaluate(x, value).detail)

    def _sliding(self, value: float, x: Array, detail: Detail) -> Sliding:
        """Steady sliding with its disturbances."""
        motion = self._iteration.truncated(x, detail)
        line, combinations = timeline(motion), self._systems.at(detail)
        n, r, m, scale = len(motion.X), combinations.dynamics.size, motion.laws.n_memory, combinations.scale
        piece = combinations(line.cut[:n])
        whole = np.zeros((1, 2 * r + n + m, 2 * r + n + m))
        whole[0, :r, r : 2 * r] = scale * np.eye(r)
        whole[0, r : 2 * r, : 2 * r + n] = -piece.forces
        if motion.laws:
            along = LawsAlong.of(combinations, motion, self._systems.law_ports)
            if along is None or not along.add_to(whole, np.zeros(1), line.cut):
                raise InputError(VELOCITIES_JUMP)
        lasting = [k for k, own in enumerate(motion.laws.switching) if line.cut[n + k] not in own.regimes.neutral]
        remembered = motion.laws.remembered_by_switching(
            line.cut[n:], lasting
        )  # in sliding, other memory has no effect
        kept = [*range(2 * r), *(2 * r + n + row for row in remembered)]
        A = whole[0][np.ix_(kept, kept)]
        exponents, vectors = np.linalg.eig(A)
        vectors = vectors[: 2 * r]
        size = np.abs(exponents).max(initial=0.0) or 1.0
        order = np.lexsort((np.abs(exponents.imag), -(exponents.real / size).round(12)))
        return Sliding(
            value=value, x=x, exponents=exponents[order].astype(complex),
            shapes=(piece.motion[:, : 2 * r] @ vectors)[:, order].astype(complex),
            neutral=len(line.neutral),
        )  # fmt: skip

    def over(self, values: Sequence[float]) -> Iterator[Sliding]:
        """Steady sliding at all values at which it is found, in their order."""
        return (sliding for sliding in map(self.at, values) if sliding is not None)

    def hopf_points(self, known: Sequence[Sliding]) -> list[Sliding]:
        """Hopf points: a pair of eigenvalues crosses the imaginary axis between neighbours."""
        return [
            self._crossing(a, b, rank)
            for a, b in pairwise(known)
            for rank in range(max(a.pairs.size, b.pairs.size))
            if (a.growth(rank) > a.rounding) != (b.growth(rank) > b.rounding)
        ]

    def _crossing(self, a: Sliding, b: Sliding, rank: int) -> Sliding:
        """Steady sliding whose pair of a rank neither grows nor decays."""
        from scipy.optimize import brentq

        # without damping, decay is rounding: the crossing is where growth exceeds it
        least = max(a.rounding, b.rounding) if min(a.growth(rank), b.growth(rank)) > -a.rounding else 0.0

        def growth(value: float) -> float:
            sliding = self.at(value)
            return -1.0 if sliding is None else sliding.growth(rank) - least

        value = float(brentq(growth, a.value, b.value, xtol=1e-14 * abs(b.value - a.value), rtol=1e-15))
        if least:  # one of the two may be the crossing itself
            nearest = min((a.value, b.value), key=lambda end: abs(end - value))
            value = nearest if abs(nearest - value) < _AT_END * abs(b.value - a.value) else value
        sliding = self.at(value)
        assert sliding is not None
        return sliding

    def _rest(self, value: float) -> Array | None:
        """Constant motion (n_ports,), from the last one or from a first guess; None where none is found."""
        if self._last is not None:
            result = newton_at(self._system, self._last, value, options=_EXACT, scale=np.linalg.norm(self._last) or 1.0)
            if result.converged:
                self._last = result.x
                return result.x
        self._last = FirstPoint(self._balance, self._path.at(value)[0], self._reference).find()
        return self._last


def damped_as_vibrating(balance: Balance, parameter: str, values: Sequence[float]) -> SteadySliding:
    """Steady sliding with viscous damping equal to hysteretic at the frequency of its first Hopf point.

    Disturbances at that point are damped as in the balance: both have the same Hopf point. Without a Hopf point it is
    the frequency of the pair that grows fastest. ``values`` are sorted.
    """
    sliding, asked = SteadySliding(balance, parameter), values
    for _ in range(_ROUNDS):
        known = list(sliding.over(asked))
        hopf = sliding.hopf_points(known)
        if not hopf and asked is not values:
            asked = values  # the Hopf point has moved
            continue
        least = hopf[0] if hopf else max(known, key=lambda s: s.growth(0), default=None)
        if least is None or abs(least.omega - (sliding.damping_at or 0.0)) <= _SAME_FREQUENCY * least.omega:
            break
        sliding = SteadySliding(balance, parameter, damping_at=least.omega)
        asked = _around(least.value, values) if hopf else values
    return sliding


def _around(value: float, values: Sequence[float]) -> Sequence[float]:
    """Some of sorted values on both sides of one."""
    nearest = int(np.argmin(np.abs(np.asarray(values) - value)))
    return values[max(0, nearest - _NEIGHBOURS) : nearest + _NEIGHBOURS + 1]


def _reference(balance: Balance) -> float:
    """A frequency: nothing depends on it at rest."""
    natural = balance.problem.structure.natural_frequencies
    return float(natural[0]) if len(natural) and natural[0] > 0 else 1.0


class WaveAtRest(SteadySliding):
    """The sector at rest over a parameter, and disturbances of all phases from sector to sector.

    Hysteretic damping and the gas are those of motion at positive frequencies, as in the balance itself.
    """

    def __init__(self, balance: Balance, parameter: str) -> None:
        super().__init__(balance, parameter)
        self._watch = StabilityWatch(self._balance)

    @property
    def in_time(self) -> bool:
        """Disturbances are known by their phases."""
        return True

    def _sliding(self, value: float, x: Array, detail: Detail) -> Sliding:
        waves = self._balance.receptance.adjusted(detail.inputs.structure).waves
        assert waves is not None
        form = self._watch.form(x, detail)
        stiffness = form.fixed.reshape(x.size, x.size).real
        own = waves.phase_number(1)
        exponents, shapes = waves.vibration(own, stiffness)
        order = np.lexsort((exponents.imag, -exponents.real))
        exponents, shapes = exponents[order], shapes[:, order]
        size = np.abs(exponents).max(initial=0.0)
        growing = {
            d: int(np.sum(waves.vibration(d, stiffness)[0].real > ROUNDING * size)) for d in range(waves.wave_numbers)
        }
        others = [d for d in growing if growing[d] and d != own]
        return Sliding(
            value=value, x=x, exponents=np.concatenate([exponents, exponents.conj()]),
            shapes=np.concatenate([shapes, shapes.conj()], axis=1), neutral=form.neutral,
            elsewhere=2 * sum(growing[d] for d in others),
            wave_number=(others[0] - own) % waves.wave_numbers if others else 0 if growing[own] else None,
        )  # fmt: skip
