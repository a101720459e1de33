"""States of contacts in addition to their motion: temperature, worn depth, or one of the user's own.

A contact state has one value ``z`` for each contact of one law. Parameters of the law follow it, ``b(z)``, and friction
drives it: its rate is ``r(z, P)``, with ``P(Q, b)`` the dissipated powers. A **fast** state is in equilibrium with each
steady motion, ``r = 0``, and is eliminated: every derivative of the forces gains ``F_z dz`` with

    dz = G dP,    G = -(r_z + r_P P_z)^-1 r_P,

``dP`` the change of the powers at fixed z (THEORY.md (8.2), where ``r = T_0 + R P - T``). A **slow** state keeps its
value from point to point; an integration of ``dz/dt = r`` changes it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, NamedTuple, Self

import numpy as np

from slipstick.contact.law import Law, Motion, Response, add_to
from slipstick.contact.power import Power
from slipstick.errors import Fault
from slipstick.solve.linear.dense import solution
from slipstick.solve.norm import norm
from slipstick.typing import Array
from slipstick.units import Units

_TOLERANCE = 1e-12
"""Relative Newton step at which an equilibrium is found."""
_ACCEPTED = 1e-10
"""Relative Newton step up to which an equilibrium counts, where rounding stops the iteration."""
_MOST_CORRECTIONS = 40
_SHORTEST_STEP = 1e-3
"""Factor on a Newton step below which no shorter one is tried."""


class StateVariable(NamedTuple):
    """Results variable with the values of a state, one for each contact."""

    name: str
    units: str
    """Dimension in words, such as "length/time"."""
    long_name: str


class Sampled(NamedTuple):
    """A parameter of the law at values of a state, and its derivative by them, of one shape."""

    value: Array
    derivative: Array


class Rate(NamedTuple):
    """Rate of a state (n,) with its derivatives: (n,) where each contact depends on itself alone, else (n, n)."""

    value: Array
    by_state: Array
    by_power: Array


class StateModel(ABC):
    """Model of a contact state, for ``ss.Problem(..., states=[model])``."""

    @abstractmethod
    def of(self, laws: Sequence[Law], names: Sequence[Sequence[str]]) -> Sequence[ContactState]:
        """States of the contacts, one for each law that the model applies to.

        ``laws`` are those of the problem, ``names`` the contacts of each. Raises InputError with every fault.
        """


class ContactState(ABC):
    """A state of the n contacts of one law.

    Attributes
    ----------
    batch
        Number of the law among those of the problem.
    names
        The contacts.
    slow
        Whether its values are given, not computed from equilibrium.
    variable
        Its results variable.
    limits
        Lowest and highest value for which the parameters are defined, numbers or (n,). A curve stops where a value
        leaves them. Where the equilibrium of a fast state vanishes within finite limits, the curve goes on with the
        next that is reached.
    """

    batch: int
    names: tuple[str, ...]
    slow: bool = False
    limits: tuple[Array | float, Array | float] = (-np.inf, np.inf)
    variable: ClassVar[StateVariable]
    has: ClassVar[str] = "with a state"
    """Description of contacts with this state in notebooks."""
    left: ClassVar[str] = "stopped early: a contact state left the range in which its parameters are known"
    """Outcome of a curve where a value leaves the limits."""

    @property
    @abstractmethod
    def start(self) -> Array:
        """Value without friction, (n,): the first guess of a fast state, the initial value of a slow one."""

    @abstractmethod
    def parameters(self, z: Array, given: Mapping[str, Array]) -> dict[str, Sampled]:
        """Parameters of the law that follow the state, at z (n,) within the limits; ``given`` are the problem's."""

    @abstractmethod
    def by_given(self, name: str, z: Array) -> Array:
        """Derivative (n,) of one of these parameters at z by the problem's."""

    @abstractmethod
    def rate(self, z: Array, power: Array) -> Rate:
        """``r(z, P)`` (n,) for powers (n,), per time of any unit that all fast states of a problem share."""

    def parameter_fault(self, name: str, quantity: str, rows: Sequence[int]) -> Fault | None:
        """Fault where a quantity of these contacts, called ``name``, cannot be varied because the state gives it."""
        return None

    def at_start(self) -> Mapping[str, Array]:
        """Parameters (n,) at the start that the state gives in place of the problem's; nan for contacts without."""
        return {}

    def faults(self, law: Law, ports: Sequence[Container[str]]) -> Iterator[Fault]:
        """Faults of contacts that cannot have this state; ``ports`` are those of each."""
        return iter(())

    def warnings(self) -> Iterator[str]:
        """Sentences on suspicious input."""
        return iter(())

    def time_fault(self, held: Container[str]) -> Fault | None:
        """Fault where motion cannot be integrated in time with these parameters ``held`` constant."""
        changes = f"the {self.variable.long_name} changes in these contacts, which is not integrated in time"
        return Fault("time integration", changes, remedy="leave the state out and give its parameters")

    def self_excited_fault(self) -> Fault:
        """Fault of self-excited vibration with this state."""
        changes = f"self-excited vibration with a changing {self.variable.long_name} is not known"
        return Fault("states", changes, remedy="leave it out")

    @property
    def equilibrium_name(self) -> str:
        """Name of its equilibrium in messages."""
        return f"equilibrium of the {self.variable.long_name}"

    @property
    def extreme_name(self) -> str:
        """Name of the largest value among the contacts in messages."""
        return f"largest {self.variable.long_name}"

    @property
    def span(self) -> Array:
        """Range of the values, (n,); inf where there are no limits."""
        return np.broadcast_to(self.limits[1] - self.limits[0], len(self.names))

    def held(self) -> Self:
        """A copy that is slow: its values are given."""
        held = copy(self)
        object.__setattr__(held, "slow", True)
        object.__setattr__(held, "within", _Remembered(self.within))
        return held

    def settled(self, law: Law, motion: Motion, given: Mapping[str, Array], near: Array | None) -> Carried:
        """Equilibrium at a motion, from values (n,) or, without them, from the start.

        By Newton's method with steps halved until the rate falls, which suffices where there is one equilibrium.
        """
        at = self.at(law, motion, given, self.start if near is None else near)
        size, left = np.where(np.isfinite(self.span), self.span, 1.0), np.inf
        for _ in range(_MOST_CORRECTIONS):
            try:
                step = at.solve(-at.rate.value)
            except np.linalg.LinAlgError:
                break
            left = float(np.max(np.abs(step) / np.maximum(np.abs(at.values), size)))
            factor, rate = 1.0, norm(at.rate.value)
            while left > _TOLERANCE and factor > _SHORTEST_STEP:
                trial = self.at(law, motion, given, at.values + factor * step)
                if norm(trial.rate.value) < rate:
                    at = trial
                    break
                factor *= 0.5
            else:
                break
        return replace(at, converged=left <= _ACCEPTED)

    def at(self, law: Law, motion: Motion, given: Mapping[str, Array], z: Array) -> Carried:
        """Forces and powers at values z (n,), in equilibrium or not."""
        sampled = self.within(z, given)
        power = Power(law, motion, law.respond(motion, _with(given, sampled)))
        return Carried(state=self, values=z, power=power, sampled=sampled)

    def within(self, z: Array, given: Mapping[str, Array]) -> dict[str, Sampled]:
        """``parameters``, constant beyond the limits."""
        inside = np.minimum(np.maximum(z, self.limits[0]), self.limits[1])
        if (inside == z).all():
            return self.parameters(z, given)
        return {
            name: Sampled(sampled.value, np.where(inside == z, sampled.derivative, 0.0))
            for name, sampled in self.parameters(inside, given).items()
        }


@dataclass(frozen=True, kw_only=True)
class Carried:
    """A state at one motion: its values, the forces there, and their derivatives."""

    state: ContactState
    values: Array
    """(n,)."""
    power: Power
    sampled: Mapping[str, Sampled]
    """Parameters that depend on it."""
    converged: bool = True

    @property
    def batch(self) -> int:
        """Number of its law among those of the problem."""
        return self.state.batch

    @property
    def response(self) -> Response:
        """The forces."""
        return self.power.response

    @cached_property
    def rate(self) -> Rate:
        """Its rate; zero in equilibrium."""
        return self.state.rate(self.values, self.power.value)

    @cached_property
    def power_by_value(self) -> Array:
        """``dP/dz`` (n,) at fixed motion [THEORY.md (8.4)]."""
        slope = np.zeros(self.values.size)
        for name, sampled in self.sampled.items():
            if sampled.derivative.any():
                slope += self.power.by_parameter(name) * sampled.derivative
        return slope

    @cached_property
    def force_by_value(self) -> Mapping[int, Array]:
        """``dF_i/dz`` (n, L) by port, at fixed motion."""
        forces: dict[int, Array] = {}
        for name, sampled in self.sampled.items():
            for i, tangent in self.response.by_parameter(name).items():
                add_to(forces, i, tangent * sampled.derivative[:, None])
        return forces

    def solve(self, right: Array) -> Array:
        """``(r_z + r_P P_z)^-1`` times something (n, ...)."""
        _, by_state, by_power = self.rate
        matrix = _square(by_state) + _square(by_power) * self.power_by_value
        solved = solution(matrix, right)
        if solved is None:
            raise np.linalg.LinAlgError("singular matrix")
        return solved

    @cached_property
    def gain(self) -> Array:
        """``G`` (n, n): the change of the values by powers put in at fixed values; 0 of a slow state."""
        if self.state.slow:
            return np.zeros((self.values.size, self.values.size))
        _, by_state, by_power = self.rate
        if by_state.ndim == by_power.ndim == 1:
            return np.diag(-by_power / (by_state + by_power * self.power_by_value))
        return -self.solve(_square(by_power))

    @property
    def margin(self) -> float:
        """Distance from a fold of the equilibrium at this motion: 1 less the largest eigenvalue of ``-r_z^-1 r_P P_z``.

        0 at the fold, negative beyond; at most 1, and 1 for a slow state.
        """
        if self.state.slow:
            return 1.0
        _, by_state, by_power = self.rate
        if by_state.ndim == by_power.ndim == 1:
            return float(1.0 - np.max(-by_power / by_state * self.power_by_value, initial=0.0))
        feedback = np.linalg.solve(-_square(by_state), _square(by_power)) * self.power_by_value
        return float(1.0 - np.linalg.eigvals(feedback).real.max(initial=0.0))

    @property
    def lost(self) -> bool:
        """Whether there is no equilibrium near the values of the neighbouring solution."""
        return not self.converged

    def fault(self, units: Units | None = None) -> str | None:
        """One sentence where the values are beyond the limits, and so no result; with ``units`` of the problem."""
        state = self.state
        outside = np.flatnonzero(np.clip(self.values, *state.limits) != self.values)
        if not outside.size:
            return None
        i = int(outside[0])
        low, high = (np.broadcast_to(limit, self.values.size)[i] for limit in state.limits)
        unit = "" if units is None else units.after(state.variable.units)
        return (
            f"the {state.variable.long_name} of contact {state.names[i]} leaves its range, {low:g} to {high:g}{unit}: "
            f"it would be {self.values[i]:.4g}{unit}"
        )


def respond(
    states: Sequence[ContactState], law: Law, motion: Motion, given: Mapping[str, Array], near: Sequence[Array | None]
) -> tuple[Response, list[Carried]]:
    """Forces of a law whose contacts have these states, with the values ``near`` of the neighbouring solution.

    Slow states keep these values and change the parameters one after the other. The last state may be fast: its
    equilibrium is found with the parameters that the others give.
    """
    values, held, fast = given, list[tuple[ContactState, Array, dict[str, Sampled]]](), None
    for state, z in zip(states, near, strict=True):
        if state.slow:
            at = state.start if z is None else z
            held.append((state, at, state.within(at, values)))
            values = _with(values, held[-1][2])
        else:
            fast = state.settled(law, motion, values, z)
    power = Power(law, motion, law.respond(motion, values)) if fast is None else fast.power
    carried = [Carried(state=state, values=z, power=power, sampled=sampled) for state, z, sampled in held]
    return power.response, carried if fast is None else [*carried, fast]


class _Remembered:
    """Parameters of a state with given values, evaluated once for each set of values."""

    def __init__(self, within: Callable[[Array, Mapping[str, Array]], dict[str, Sampled]]) -> None:
        self._within = within
        self._last: tuple[Array, Mapping[str, Array], dict[str, Sampled]] | None = None

    def __call__(self, z: Array, given: Mapping[str, Array]) -> dict[str, Sampled]:
        last = self._last
        if last is None or last[1] is not given or not np.array_equal(last[0], z):
            last = self._last = z.copy(), given, self._within(z, given)
        return last[2]


def _with(given: Mapping[str, Array], sampled: Mapping[str, Sampled]) -> dict[str, Array]:
    return {**given, **{name: value.value for name, value in sampled.items()}}


def _square(gain: Array) -> Array:
    return np.diag(gain) if gain.ndim == 1 else gain
