"""Stability of periodic motion, point after point of a branch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from slipstick.analysis.stability.harmonic_form import (
    HarmonicForm,
    axis,
    count_unstable,
    depends_on_order,
    harmonic_form,
    measured_answers,
    modal_answers,
    strip,
)
from slipstick.analysis.stability.linear_systems import Combinations, LinearSystems
from slipstick.analysis.stability.monodromy import (
    Monodromy,
    monodromy,
    monodromy_stick_slip,
    monodromy_with_laws,
    multipliers_of_each,
)
from slipstick.analysis.stability.orbit import Orbit, is_affordable, nearest_orbit
from slipstick.analysis.stability.refined_motion import Iteration, SmoothMotion
from slipstick.analysis.stability.state_sequence import StickStarts, Timeline, timeline, timelines
from slipstick.analysis.stability.wave_numbers import WaveDisturbances, wave_answers
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail
from slipstick.contact.friction_law import is_friction
from slipstick.contact.law import Law
from slipstick.errors import Fault, InputError
from slipstick.faults import warn
from slipstick.results.stability import COUNT, ORDER_COUNT, PIECES, SHOOTING, UNKNOWN, WAVE_COUNT, PointStability
from slipstick.typing import Array, ComplexArray

BEYOND = 1e-6
"""Magnitude above 1 from which a multiplier counts as unstable: rounding of a product over a period stays below."""

REAL = 1e-7
"""Imaginary part over the magnitude, below which a multiplier is real."""

COARSE = 0.05
"""Change of multipliers by one iteration of the motion, above which they are those of another motion."""

_SAFETY, _LEAST_SAFETY = 5.0, 2.0
"""Distance from the unit circle over the error, from which the side of a multiplier is certain.

The smaller factor holds where nothing better can be computed."""

_ROUNDING = 1e-9
"""Errors below are rounding: a multiplier stands where it is, on the circle too."""

_NEGLIGIBLE = 0.3
"""Magnitude of multipliers that stay far from the unit circle whatever their error."""

_SMALLEST_COMPARED = 1e-3
"""Magnitude of a multiplier below which its logarithm is inaccurate."""

_WITHOUT_ORDER_0 = (
    "stability: the receptance differs from order to order, and has no of_order(order, frequency) that gives "
    "it for order 0 away from rest: stability is not known"
)

NO_MULTIPLIERS: ComplexArray = np.zeros(0, dtype=complex)


class StabilityWatch:
    """Stability of the points of a branch; linear systems of contact states are stored from point to point.

    Multipliers by exact pieces where the structure has equations in time, else the number of growing disturbances.

    Parameters
    ----------
    balance
        Of the branch.
    full
        Whether all modes stay in motion; else those up to four times the highest harmonic do.
    damping_at
        Frequency (rad/s) at which hysteretic damping is as viscous; by default each natural frequency.

    Raises
    ------
    InputError
        If a contact follows a law that has no rate in time, or slides in a plane on a structure that has no
        equations in time.
    """

    def __init__(self, balance: Balance, *, full: bool = False, damping_at: float | None = None) -> None:
        if faults := [_unsupported(name, law) for name, law in _unsupported_contacts(balance)]:
            raise InputError(faults)
        self.balance, self._iterate = balance, Iteration(balance)
        self.systems = LinearSystems(balance, full=full, damping_at=damping_at)
        if faults := list(self._switching_faults()):
            raise InputError(faults)
        self._orders_differ: bool | None = None
        self._affordable: bool | None = None
        self._warned = False

    def _switching_faults(self) -> Iterator[Fault]:
        """Contacts whose law switches, where the structure has no equations in time."""
        names = self.balance.problem.elements
        switching = [b for b in self.balance.batches if b.law.regimes is not None]
        if self.systems.in_time:
            return
        for name in (names[e] for b in switching for e in b.numbers):
            yield Fault(
                "stability", f"contact '{name}' slides in a plane, and the structure has no equations in time",
                remedy="give the structure as matrices or as modes; or leave stability out",
            )  # fmt: skip

    def at(self, x: Array, detail: Detail, *, odd: bool | None = None, error: float | None = None) -> PointStability:
        """Stability at a solution (N,).

        ``odd`` says whether the number of real multipliers above 1 is odd, where the sign of the Jacobian shows it.
        ``error`` is the accuracy of the multipliers, where neighbouring points give it.
        """
        if not self.systems.in_time:
            return self._by_count(x, detail)
        motion, combinations = self._iterate(x, detail), self.systems.at(detail)
        if motion.laws.remembers_smoothly:
            return self._by_shooting(x, motion, combinations, detail)
        line, fine = self._pieces(motion, combinations, detail.omega)
        if fine is None or not fine.sound:
            multipliers = NO_MULTIPLIERS if fine is None else self.judged(fine.multipliers)
            method = "" if fine is None else PIECES
            return PointStability(
                multipliers=multipliers, unstable=UNKNOWN, method=method, neutral=len(line.neutral), error=np.inf
            )
        multipliers, method = self.judged(fine.multipliers), PIECES
        errors = np.full(multipliers.size, error)
        if error is None:
            _, coarse = self._pieces(self._iterate.truncated(x, detail), combinations, detail.omega)
            errors = _distances(multipliers, NO_MULTIPLIERS if coarse is None else self.judged(coarse.multipliers))
        error = float(errors.max(initial=0.0))
        count = unstable(multipliers)
        odd = None if line.neutral else odd
        if not _settled(multipliers, errors, odd):
            affordable = self._is_affordable(detail, motion, combinations)
            orbit = self._orbit(detail, motion, line, combinations) if affordable else None
            if not affordable and _settled(multipliers, errors, odd, most=np.inf, safety=_LEAST_SAFETY):
                pass  # a large model: these multipliers have to do, and their side of the circle is certain
            elif orbit is None:
                count = UNKNOWN
            else:
                multipliers, method = self.judged(orbit.multipliers), SHOOTING
                count = unstable(multipliers)
        return PointStability(
            multipliers=multipliers, unstable=count, method=method, neutral=len(line.neutral), error=error
        )

    def between(self, x: Array, details: Sequence[Detail], errors: Sequence[float]) -> list[PointStability | None]:
        """Stability at n interpolated solutions (n, N) together; None where each is to be judged alone.

        ``errors`` (n,) are the accuracies of the multipliers, from neighbouring points.
        """
        if not (self.systems.in_time and self._iterate.can_many):
            return [None] * len(x)
        motions, systems = self._iterate.many(x, details), [self.systems.at(detail) for detail in details]
        lines, each = timelines(motions), list[Monodromy | None]()
        for line, motion, combinations, detail in zip(lines, motions, systems, details, strict=True):
            each.append(monodromy(line, StickStarts(motion, combinations), combinations, detail.omega))
        sound = [fine for fine in each if fine is not None and fine.sound]
        if len(sound) < len(each):
            return [None] * len(x)
        out: list[PointStability | None] = []
        for line, found, error in zip(lines, multipliers_of_each([m.matrix for m in sound]), errors, strict=True):
            multipliers = self.judged(found)
            settled = _settled(multipliers, np.full(multipliers.size, error), None)
            stability = PointStability(
                multipliers=multipliers, unstable=unstable(multipliers), method=PIECES, neutral=len(line.neutral),
                error=error if multipliers.size else 0.0,
            )  # fmt: skip
            out.append(stability if settled else None)
        return out

    def _by_shooting(
        self, x: Array, motion: SmoothMotion, combinations: Combinations, detail: Detail
    ) -> PointStability:
        """Stability with contacts whose memory varies smoothly: by their sticks and slips, or by shooting."""
        line = timeline(motion)
        fine = monodromy_stick_slip(combinations, motion, self.systems.law_ports)
        if fine is not None:
            multipliers = self.judged(fine.multipliers)
            coarse = monodromy_stick_slip(combinations, self._iterate.truncated(x, detail), self.systems.law_ports)
            errors = _distances(multipliers, NO_MULTIPLIERS if coarse is None else self.judged(coarse.multipliers))
            settled = _settled(multipliers, errors, None, safety=_LEAST_SAFETY)
            return PointStability(
                multipliers=multipliers, unstable=unstable(multipliers) if settled else UNKNOWN, method=PIECES,
                neutral=0, error=float(errors.max(initial=0.0)),
            )  # fmt: skip
        affordable = self._is_affordable(detail, motion, combinations)
        orbit = self._orbit(detail, motion, line, combinations) if affordable else None
        if orbit is None:
            return PointStability(
                multipliers=NO_MULTIPLIERS, unstable=UNKNOWN, method="", neutral=len(line.neutral),
                error=np.inf,
            )  # fmt: skip
        multipliers = self.judged(orbit.multipliers)
        return PointStability(
            multipliers=multipliers, unstable=unstable(multipliers), method=SHOOTING, neutral=len(line.neutral)
        )

    def _orbit(self, detail: Detail, motion: SmoothMotion, line: Timeline, combinations: Combinations) -> Orbit | None:
        """The motion in time next to a point."""
        ports = self.systems.law_ports
        return nearest_orbit(self.balance, detail, motion, line, combinations, ports, free=self.free)

    def _is_affordable(self, detail: Detail, motion: SmoothMotion, combinations: Combinations) -> bool:
        """Whether shooting takes seconds at most; decided at the first point that needs it."""
        if self._affordable is None:
            self._affordable = is_affordable(self.balance, detail, motion, combinations, self.systems.law_ports)
        return self._affordable

    free = False
    """Whether nothing prescribes the frequency."""

    def judged(self, multipliers: ComplexArray) -> ComplexArray:
        """The multipliers that decide stability; a subclass leaves out those of a free phase."""
        return multipliers

    def _pieces(
        self, motion: SmoothMotion, combinations: Combinations, omega: float
    ) -> tuple[Timeline, Monodromy | None]:
        line = timeline(motion)
        starts = StickStarts(motion, combinations)
        if motion.laws:
            return line, monodromy_with_laws(line, starts, combinations, motion, self.systems.law_ports)
        return line, monodromy(line, starts, combinations, omega)

    def form(self, x: Array, detail: Detail) -> HarmonicForm:
        """The harmonic form at a solution, on the motion of the balance itself: its ``D(0)`` is the Jacobian."""
        balance, inputs = self.balance, detail.inputs
        orders = np.arange(-balance.harmonics.highest, balance.harmonics.highest + 1, dtype=float)
        contacts = self.systems.contacts(detail)
        if self.systems.in_time:
            answers = modal_answers(self.systems.at(detail).dynamics, orders, detail.omega)
        else:
            receptance = balance.receptance.adjusted(inputs.structure).turning_with(detail.omega)
            if receptance.waves is not None:
                answers = wave_answers(receptance.waves, orders, detail.omega, 0)
            else:
                answers = measured_answers(receptance, orders, detail.omega, by_order=self._by_order(detail.omega))
        motion = self._iterate.truncated(x, detail)
        ports = (motion.X, motion.Y)
        return harmonic_form(balance.harmonics, ports, motion.values, contacts, answers, detail.omega)

    def _by_order(self, omega: float) -> bool:
        """Whether receptances differ from order to order at one frequency, as those of a sector of a ring do."""
        if self._orders_differ is None:
            receptance = self.balance.receptance.turning_with(omega)
            self._orders_differ = depends_on_order(receptance, self.balance.harmonics.m, omega)
        return self._orders_differ

    def _by_count(self, x: Array, detail: Detail) -> PointStability:
        if self.systems.law_ports.size:  # the form is that of friction contacts
            return PointStability(multipliers=NO_MULTIPLIERS, unstable=UNKNOWN, method="", neutral=0)
        if self.balance.receptance.waves is not None:
            return self._of_wave(x, detail)
        by_order, form, count = self._by_order(detail.omega), self.form(x, detail), None
        if by_order and self.balance.receptance.of_order(0, detail.omega) is None:
            if not self._warned:
                warn([_WITHOUT_ORDER_0])
            self._warned = True
        else:
            natural, highest = self.balance.problem.structure.natural_frequencies, self.balance.harmonics.highest
            nodes = axis(natural, detail.omega, highest) if by_order else strip(natural, detail.omega)
            count = count_unstable(form, nodes)
        return PointStability(
            multipliers=NO_MULTIPLIERS,
            unstable=UNKNOWN if count is None else count,
            method="" if count is None else ORDER_COUNT if by_order else COUNT,
            neutral=form.neutral,
        )

    def _of_wave(self, x: Array, detail: Detail) -> PointStability:
        """Stability of a travelling wave against disturbances of every wave number."""
        ring = self._ring(x, detail)
        count = ring.count()
        fastest = ring.fastest() if count else None
        return PointStability(
            multipliers=NO_MULTIPLIERS, unstable=UNKNOWN if count is None else count,
            method="" if count is None else WAVE_COUNT, neutral=ring.neutral,
            wave_number=UNKNOWN if fastest is None else fastest.wave_number,
        )  # fmt: skip

    def growing(self, x: Array, detail: Detail) -> int:
        """Number of growing disturbances of a travelling wave, without their exponents; ``UNKNOWN`` if undecided."""
        count = self._ring(x, detail).count()
        return UNKNOWN if count is None else count

    def _ring(self, x: Array, detail: Detail) -> WaveDisturbances:
        waves = self.balance.receptance.adjusted(detail.inputs.structure).waves
        assert waves is not None
        return WaveDisturbances(self.form(x, detail), waves, BEYOND * detail.omega / (2.0 * np.pi))

    def difference(self, x: Array, detail: Detail, stability: PointStability) -> float:
        """Distance of the largest multiplier from that of the harmonic form; nan where the form has none near it."""
        multipliers = stability.multipliers
        if not multipliers.size or abs(multipliers[0]) < _SMALLEST_COMPARED or self.systems.law_ports.size:
            return np.nan
        period = 2.0 * np.pi / detail.omega
        exponent = self.form(x, detail).exponent(np.log(multipliers[0]) / period)
        return np.nan if exponent is None else float(abs(np.exp(exponent * period) - multipliers[0]))


def unstable(multipliers: ComplexArray) -> int:
    """Number of multipliers outside the unit circle."""
    return int(np.sum(np.abs(multipliers) > 1.0 + BEYOND))


def _distances(fine: ComplexArray, coarse: ComplexArray) -> Array:
    """Errors (n,) of multipliers: distances to and from the nearest of the other motion; 0 for negligible ones."""
    if not coarse.size:
        return np.full(fine.size, np.inf if fine.size else 0.0)
    between = np.abs(fine[:, None] - coarse)
    out = np.where(np.abs(fine) > _NEGLIGIBLE, between.min(axis=1), 0.0)
    if fine.size:
        np.maximum.at(out, between.argmin(axis=0), np.where(np.abs(coarse) > _NEGLIGIBLE, between.min(axis=0), 0.0))
    return out


def _settled(
    multipliers: ComplexArray, errors: Array, odd: bool | None, *, most: float = COARSE, safety: float = _SAFETY
) -> bool:
    """Whether each multiplier is further from the unit circle than its error (n,) times a safety factor."""
    if odd is not None and odd != bool(np.sum(real_part(multipliers) > 1.0) % 2):
        return False
    margins = np.abs(np.abs(multipliers) - 1.0)
    return bool(np.all((errors < _ROUNDING) | ((errors < most) & (safety * errors < margins))))


def real_part(multipliers: ComplexArray) -> Array:
    """The real ones among multipliers."""
    return np.asarray(multipliers.real[np.abs(multipliers.imag) <= REAL * np.abs(multipliers)])


def _unsupported_contacts(balance: Balance) -> list[tuple[str, Law]]:
    """Contacts whose law has no equations in time, by name."""
    names = balance.problem.elements
    in_time = [is_friction(b.law) or b.law.in_time for b in balance.batches]
    return [(names[e], b.law) for b, has in zip(balance.batches, in_time, strict=True) if not has for e in b.numbers]


def _unsupported(name: str, law: Law) -> Fault:
    return Fault(
        "stability", f"contact '{name}' follows a law that does not tell its rate in time",
        remedy=f"{law.rate_remedy}; or leave stability out",
    )  # fmt: skip
