"""What a law may tell beyond the members of ``Law``, and what is taken where it does not."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.contact.law import Law, Motion, Response, add_to
from slipstick.errors import Fault
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

Interval = tuple[float, float, str]
"""Start and end, rad, and the state between."""


class Linear(NamedTuple):
    """``F_i = sum_j stiffness[i, j] Q_j + constant[i] e1``: a law held in one state; what is left out is zero."""

    stiffness: Mapping[tuple[int, int], Array]
    """(n,) each."""
    constant: Mapping[int, Array]
    """(n,) each, on harmonic 0."""


class Variable(NamedTuple):
    """A results variable of a law: a parameter, or an attribute of ``Response.detail``."""

    source: str
    dims: tuple[str, ...]
    """Dimensions after point and contact."""
    units: str
    long_name: str


def optional_ports(law: Law) -> tuple[str, ...]:
    """Ports that a contact may go without; none by default."""
    return tuple(getattr(law, "optional_ports", ()))


def dissipating(law: Law) -> tuple[int, ...]:
    """Ports whose force does work over a period; all by default."""
    return tuple(getattr(law, "dissipating", range(len(law.ports))))


def factors(law: Law) -> Mapping[str, str]:
    """Names of factors on one parameter of all contacts, such as "friction" on mu."""
    return dict(getattr(law, "factors", {}))


def units(law: Law, parameter: str) -> str:
    """Units of a parameter; "1" where the law does not tell."""
    return str(getattr(law, "units", {}).get(parameter, "1"))


def variables(law: Law) -> Mapping[str, Variable]:
    """Results variables; by default the parameters under their own names."""
    own = {name: Variable(name, (), units(law, name), f"parameter {name}") for name in law.values}
    return dict(getattr(law, "variables", own))


def derived(law: Law, name: str, values: Mapping[str, Array]) -> tuple[str, ArrayLike] | None:
    """``(parameter, factor)`` where ``name`` stands for ``parameter = factor * name``, else None."""
    if name in law.values:
        return name, 1.0
    own = getattr(law, "derived", None)
    return own(name, values) if own is not None else None


def linear_states(law: Law) -> tuple[str, ...]:
    """States for which ``linear`` gives a first guess, the likeliest first."""
    return tuple(getattr(law, "linear_states", ("stuck", "free")))


def linear(law: Law, state: str, values: Mapping[str, Array], drift: Array) -> Linear | None:
    """The law held in one state; by default nothing ("free"), or the tangent at rest ("stuck")."""
    own = getattr(law, "linear", None)
    if own is not None:
        found: Linear | None = own(state, values, drift)
        return found
    return Linear({}, {}) if state == "free" else (_at_rest(law, values, drift) if state == "stuck" else None)


def _at_rest(law: Law, values: Mapping[str, Array], drift: Array) -> Linear:
    n, p = drift.shape[1], len(law.ports)
    still = Motion(Harmonics([0]), 1.0, tuple(np.zeros((n, 1)) for _ in range(p)), np.zeros((p, n)))
    response = law.respond(still, values)
    return Linear(
        {key: tangent[:, 0, 0] for key, tangent in response.by_motion.items()},
        {i: force[:, 0] for i, force in enumerate(response.force)},
    )


def ramps(law: Law, values: Mapping[str, Array]) -> Iterator[tuple[str, str, float]]:
    """Label, parameter and starting fraction of the ramps towards a first point; by default each parameter from 0."""
    own = getattr(law, "ramps", None)
    return own(values) if own is not None else ((f"{name} ramp", name, 0.0) for name in law.values)


def size(law: Law, values: Mapping[str, Array]) -> Array:
    """Typical motion set by the law itself, (n,); zero where it has none."""
    own = getattr(law, "size", None)
    if own is not None:
        found: Array = own(values)
        return found
    return np.zeros(1)


def kind(law: Law) -> Hashable:
    """Laws of equal kind are computed together, as one batch; by default each law is its own."""
    return getattr(law, "kind", id(law))


def widened(law: Law, own: Harmonics, wide: Harmonics) -> Law:
    """The law where forces are wanted in more harmonics than the motion has; by default it answers in any."""
    found = getattr(law, "widened", None)
    return law if found is None else found(own, wide)


def force_names(law: Law) -> tuple[str, ...]:
    """Names of the forces along the ports; by default those of the ports."""
    return tuple(getattr(law, "force_names", law.ports))


def springs(law: Law, response: Response) -> Mapping[int, Array]:
    """Stiffness (n,) with which the force at each port answers, as far as it acts: what its rounding is judged by."""
    own = getattr(law, "springs", None)
    if own is not None:
        found: Mapping[int, Array] = own(response)
        return found
    total: dict[int, Array] = {}
    for (i, _), tangent in response.by_motion.items():
        size = np.abs(tangent).max(axis=(1, 2))
        add_to(total, i, size)
    return total


def undecided(law: Law, response: Response) -> NDArray[np.bool_]:
    """Which of n elements have a constant force that any steady sliding makes jump, (n,)."""
    own = getattr(law, "undecided", None)
    return np.zeros(len(response.work), dtype=bool) if own is None else np.asarray(own(response), dtype=bool)


def kinked(law: Law, values: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Which of n elements have friction that acts, (n,) of bool: their forces have kinks and many harmonics."""
    own = getattr(law, "kinked", None)
    count = len(next(iter(values.values()), ()))
    return np.zeros(count, dtype=bool) if own is None else np.asarray(own(values), dtype=bool)


def stiffness_names(law: Law) -> Mapping[int, str]:
    """The parameter that is a stiffness along a port, by port."""
    return dict(getattr(law, "stiffness_names", {}))


def warnings(law: Law, values: Mapping[str, float], ports: set[str], approach: float) -> Iterator[str]:
    """What is suspicious in one contact with these ports, whose opposing surface comes no nearer than ``approach``."""
    own = getattr(law, "warnings", None)
    return iter(()) if own is None else own(values, ports, approach)


def states_of(law: Law, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]] | None:
    """Intervals (start, end, state) of one period of n elements, in rad; None where the law does not tell them."""
    own = getattr(law, "states", None)
    return None if own is None else list(own(motion, values))


def forces_in_time(law: Law, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...] | None:
    """Forces at phases ``tau`` (k,), (n, k) for each port, no harmonics cut off; None where the law does not tell."""
    own = getattr(law, "forces_in_time", None)
    return None if own is None else tuple(own(motion, values, tau))


def missing(law: Law, ports: set[str]) -> Iterator[Fault]:
    """Parameters that were not given, but are needed where something moves along these ports."""
    own = getattr(law, "missing", None)
    return iter(()) if own is None else own(ports)
