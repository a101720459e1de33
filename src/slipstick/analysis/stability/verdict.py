"""Whether the motion is stable, point after point of a branch."""

from __future__ import annotations

import numpy as np

from slipstick.analysis.stability.argument_principle import count_unstable, folded
from slipstick.analysis.stability.harmonic_form import HarmonicForm, harmonic_form, measured_answers, modal_answers
from slipstick.analysis.stability.intervals import StickStarts, timeline
from slipstick.analysis.stability.iterate import Iteration
from slipstick.analysis.stability.linear_systems import LinearSystems
from slipstick.analysis.stability.monodromy import Monodromy, monodromy
from slipstick.balance.ports import Balance
from slipstick.balance.residual import Detail
from slipstick.contact.friction_law import is_friction
from slipstick.errors import Fault, InputError
from slipstick.results.stability import UNKNOWN, PointStability
from slipstick.structure.dynamic import adjusted
from slipstick.typing import Array, ComplexArray

BEYOND = 1e-6
"""A multiplier counts as unstable where its magnitude is above 1 by more."""

_DEAD = 1e-3
"""Below that magnitude the logarithm of a multiplier says nothing."""


class StabilityWatch:
    """Judges points of a problem's branch; linear systems of contact states are kept from point to point.

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
        If a contact follows a law other than friction.
    """

    def __init__(self, balance: Balance, *, full: bool = False, damping_at: float | None = None) -> None:
        if faults := [_foreign(name) for name in _foreign_contacts(balance)]:
            raise InputError(faults)
        self.balance, self._iterate = balance, Iteration(balance)
        self.systems = LinearSystems(balance, full=full, damping_at=damping_at)

    def at(self, x: Array, detail: Detail) -> PointStability:
        """Stability at a solution (N,)."""
        if not self.systems.in_time:
            return self._counted(x, detail)
        motion = self._iterate(x, detail)
        line, known = timeline(motion), self.systems.at(detail)
        found = monodromy(line, StickStarts(motion, known.contacts, known), known, detail.omega)
        multipliers = np.zeros(0, dtype=complex) if found is None else found.multipliers
        return PointStability(
            multipliers=multipliers,
            unstable=_verdict(found, multipliers),
            method="" if found is None else "PW",
            neutral=len(line.neutral),
        )

    def form(self, x: Array, detail: Detail) -> HarmonicForm:
        """The harmonic form at a solution, on the motion of the balance itself: its ``D(0)`` is the Jacobian."""
        balance, inputs = self.balance, detail.inputs
        orders = np.arange(-balance.harmonics.highest, balance.harmonics.highest + 1, dtype=float)
        contacts = self.systems.contacts(detail)
        if self.systems.in_time:
            answers = modal_answers(self.systems.at(detail).dynamics, orders, detail.omega)
        else:
            answers = measured_answers(adjusted(balance.receptance, inputs.structure), orders, detail.omega)
        motion = balance.motion(0, x, detail.omega, inputs.batches[0])
        given = {**detail.responses[0].values, "v": motion.drift[0]}
        own = (motion.Q[0], motion.Q[1])
        return harmonic_form(balance.harmonics, own, given, contacts, answers, detail.omega)

    def _counted(self, x: Array, detail: Detail) -> PointStability:
        form = self.form(x, detail)
        near = folded(self.balance.problem.structure.natural_frequencies, detail.omega)
        count = count_unstable(lambda nu: form.sign(1j * nu), detail.omega, near)
        return PointStability(
            multipliers=np.zeros(0, dtype=complex),
            unstable=UNKNOWN if count is None else count,
            method="" if count is None else "count",
            neutral=form.neutral,
        )

    def difference(self, x: Array, detail: Detail, found: PointStability) -> float:
        """Distance of the largest multiplier from the harmonic form's; nan where there is none beside it."""
        multipliers = found.multipliers
        if not multipliers.size or abs(multipliers[0]) < _DEAD:
            return np.nan
        period = 2.0 * np.pi / detail.omega
        exponent = self.form(x, detail).exponent(np.log(multipliers[0]) / period)
        return np.nan if exponent is None else float(abs(np.exp(exponent * period) - multipliers[0]))


def unstable(multipliers: ComplexArray) -> int:
    """How many multipliers lie beyond the unit circle."""
    return int(np.sum(np.abs(multipliers) > 1.0 + BEYOND))


def _verdict(found: Monodromy | None, multipliers: ComplexArray) -> int:
    return UNKNOWN if found is None or not found.sound else unstable(multipliers)


def _foreign_contacts(balance: Balance) -> list[str]:
    """Names of contacts that are not friction contacts."""
    names = balance.problem.elements
    return [names[e] for b in balance.batches if not is_friction(b.law) for e in b.numbers]


def _foreign(name: str) -> Fault:
    return Fault(
        "stability", f"contact '{name}' follows a law of another kind, and only friction contacts are known",
        remedy="leave stability out, or integrate in time with a code of your own",
    )  # fmt: skip
