"""Whether the motion is stable, point after point of a branch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics, dynamics
from slipstick.analysis.stability.intervals import StickStarts, timeline
from slipstick.analysis.stability.iterate import Iteration, SmoothMotion
from slipstick.analysis.stability.laws import Combinations, FrictionPorts
from slipstick.analysis.stability.monodromy import monodromy
from slipstick.balance.ports import Balance
from slipstick.balance.residual import Detail
from slipstick.contact.friction_law import FrictionLaw
from slipstick.contact.traits import kind
from slipstick.errors import Fault, InputError
from slipstick.faults import shown
from slipstick.results.stability import UNKNOWN, PointStability
from slipstick.typing import Array, ComplexArray

StabilityRequest = bool | Literal["full"]
"""What users ask for."""

IN_MOTION = 4.0
"""Modes stay in motion up to this times the highest harmonic."""

_BEYOND = 1e-6
"""A multiplier counts as unstable where its magnitude is above 1 by more."""


def stability_request(given: object) -> StabilityRequest:
    """Whether stability is asked for; InputError for anything but True, False, "full"."""
    if isinstance(given, bool) or (isinstance(given, str) and given == "full"):
        return given  # type: ignore[return-value]
    raise InputError(Fault("stability", found=shown(given), expected='True, False, or "full" (all modes in motion)'))


class StabilityWatch:
    """Judges points of a problem's branch; linear systems of contact states are kept from point to point.

    Parameters
    ----------
    balance
        Of the branch.
    full
        Whether all modes stay in motion; else those up to four times the highest harmonic do.

    Raises
    ------
    InputError
        If a contact follows a law other than friction, or the structure has no equations in time.
    """

    def __init__(self, balance: Balance, *, full: bool = False) -> None:
        faults = [_foreign(name) for name in _foreign_contacts(balance)]
        if faults:
            raise InputError(faults)
        self._balance, self._full = balance, full
        self._iterate = Iteration(balance)
        batch = balance.batches[0]
        numbers = np.arange(balance.n_ports)
        self._tangential, self._normal = np.full((2, batch.count), -1)
        for place, port in zip((self._tangential, self._normal), batch.ports, strict=True):
            place[port.members] = numbers[port.rows]
        self._structures: dict[tuple[tuple[str, float], ...], Dynamics] = {}
        self._key: object = None
        self._combinations: Combinations | None = None
        self._dynamics({})

    def at(self, x: Array, detail: Detail) -> PointStability:
        """Stability at a solution (N,)."""
        motion = self._iterate(x, detail)
        line, known = timeline(motion), self.combinations(motion, detail)
        found = monodromy(line, StickStarts(motion, known.contacts, known), known, detail.omega)
        multipliers = np.zeros(0, dtype=complex) if found is None else found.multipliers
        return PointStability(
            multipliers=multipliers,
            unstable=UNKNOWN if found is None or not found.sound else unstable(multipliers),
            method="" if found is None else "PW",
            neutral=len(line.neutral),
        )

    def combinations(self, motion: SmoothMotion, detail: Detail) -> Combinations:
        """Linear systems with the parameters and the modes of a point, those of the last point where they are equal."""
        given, structure = motion.given, self._dynamics(detail.inputs.structure)
        if not self._full:
            structure = structure.below(IN_MOTION * self._balance.harmonics.highest * detail.omega)
        parameters = [given[name] for name in ("kt", "mu", "kn")]
        key = (structure.size, *sorted(detail.inputs.structure.items()), *(p.tobytes() for p in parameters))
        if self._combinations is None or key != self._key:
            kt, mu, kn = parameters
            contacts = FrictionPorts(
                tangential=self._tangential, normal=self._normal, kt=kt, mu=mu, kn=kn, n_ports=self._balance.n_ports
            )
            self._key, self._combinations = key, Combinations(structure, contacts)
        return self._combinations

    def _dynamics(self, values: Mapping[str, float]) -> Dynamics:
        key = tuple(sorted(values.items()))
        if key not in self._structures:
            structure = self._balance.problem.structure
            own = structure.changed(**values) if values else structure  # type: ignore[attr-defined]
            directions = self._balance.directions
            self._structures = {key: dynamics(own.time_equations(directions, directions))}
        return self._structures[key]


def unstable(multipliers: ComplexArray) -> int:
    """How many multipliers lie beyond the unit circle."""
    return int(np.sum(np.abs(multipliers) > 1.0 + _BEYOND))


def _foreign_contacts(balance: Balance) -> list[str]:
    """Names of contacts that are not friction contacts."""
    names = balance.problem.elements
    return [names[e] for b in balance.batches if kind(b.law) != FrictionLaw.kind for e in b.numbers]


def _foreign(name: str) -> Fault:
    return Fault(
        "stability", f"contact '{name}' follows a law of another kind, and only friction contacts are known",
        remedy="leave stability out, or check points in time with a code of your own",
    )  # fmt: skip
