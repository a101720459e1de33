"""Prescribed rubbing motion ``u = velocity t + periodic part``, and its common period with the excitation."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import gcd, lcm
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import Gathering, number_or_numbers, plain, same_length, shown, whole, wrong
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Numbers, Reals

VELOCITIES = (VELOCITY, SWEPT) = ("velocity", "velocity_per_omega")
SECOND = "second_"
"""Prefix of components along the second direction of a surface."""
ALL_VELOCITIES = (*VELOCITIES, *(SECOND + name for name in VELOCITIES))
MOTION_PARTS = ("cos", "sin", "second_cos", "second_sin", "normal_cos", "normal_sin")
_NONE: Mapping[int, float] = MappingProxyType({})
_COMPONENT = re.compile(r"((?:normal_|second_)?(?:cos|sin))(0|[1-9][0-9]*)")


class PortMotion(NamedTuple):
    """Prescribed motion along one port; each for all elements or (n, ...)."""

    velocity: Numbers
    """Length per time."""
    velocity_per_omega: Numbers
    """Length."""
    motion: NDArray[np.float64]
    """Coefficients of the periodic part, (..., L)."""


@dataclass(frozen=True, init=False, repr=False)
class RubbingMotion:
    """Prescribed sliding of side 1 over the opposing surface, added to its vibration [THEORY.md (1.5)].

    ``u(t) = velocity t + sum cos_m cos(m omega t) + ...`` is added to the relative motion, ``w = x + u``; the opposing
    surface itself moves by ``-u``. A belt that carries a pad along at +V: ``velocity=-V``. A blade that runs at +V in a
    casing at rest: ``velocity=V``; friction holds it back, towards ``x < 0`` (THEORY.md section 2).

    Parameters
    ----------
    velocity
        Constant part, length per time, positive along the tangential direction of the contact; scalar or (n_elements,).
    velocity_per_omega
        Velocity for each rad/s of the fundamental frequency, length; scalar or (n_elements,): a rotor whose speed
        sweeps with the frequency, ``radius / k`` at the engine order k.
    cos, sin
        Amplitudes of the periodic part by harmonic order, length; order 0 is allowed in ``cos`` (an offset, which
        changes no force). Values are scalars or (n_elements,).
    second_velocity, second_velocity_per_omega, second_cos, second_sin
        The same along the second direction of a ``PlanarFrictionContact``. For one such contact ``velocity``,
        ``velocity_per_omega`` and amplitudes may be vectors, ``velocity=(3.0, 0.0)``, which ``ContactPair`` splits.
    normal_cos
        Motion of the opposing surface along the normal by harmonic order, length, positive towards the structure:
        run-out, a lobed casing, disc thickness variation. Order 0 is a constant approach, which closes the gap by as
        much.
    normal_sin
        Its sine amplitudes, as ``normal_cos``.

    Raises
    ------
    InputError
        If a value is not a finite number or an order is negative or not whole.

    Examples
    --------
    >>> import slipstick as ss
    >>> belt = ss.RubbingMotion(velocity=-2.0)
    >>> shaken = ss.RubbingMotion(cos={1: 0.5}, sin={3: 0.1})
    >>> rotor = ss.RubbingMotion(velocity_per_omega=0.3, normal_cos={2: 1e-4})
    """

    velocity: Numbers
    velocity_per_omega: Numbers
    cos: Mapping[int, Numbers]
    sin: Mapping[int, Numbers]
    normal_cos: Mapping[int, Numbers]
    normal_sin: Mapping[int, Numbers]
    second_velocity: Numbers
    second_velocity_per_omega: Numbers
    second_cos: Mapping[int, Numbers]
    second_sin: Mapping[int, Numbers]

    def __init__(
        self,
        *,
        velocity: Reals = 0.0,
        velocity_per_omega: Reals = 0.0,
        cos: Mapping[int, Reals] = _NONE,
        sin: Mapping[int, Reals] = _NONE,
        normal_cos: Mapping[int, Reals] = _NONE,
        normal_sin: Mapping[int, Reals] = _NONE,
        second_velocity: Reals = 0.0,
        second_velocity_per_omega: Reals = 0.0,
        second_cos: Mapping[int, Reals] = _NONE,
        second_sin: Mapping[int, Reals] = _NONE,
    ) -> None:
        checks = Gathering()
        along = (velocity, velocity_per_omega, second_velocity, second_velocity_per_omega)
        velocities = dict(zip(ALL_VELOCITIES, along, strict=True))
        values: dict[str, Any] = {
            name: checks.take(number_or_numbers, ("rubbing", name), value) for name, value in velocities.items()
        }
        parts = dict(zip(MOTION_PARTS, (cos, sin, second_cos, second_sin, normal_cos, normal_sin), strict=True))
        for part, by_order in parts.items():
            least = int(part.endswith("sin"))
            values[part] = checks.take(amplitudes, ("rubbing", part), by_order, least=least)
        checks.end()
        sizes = {f"{part} {order}": a for part in MOTION_PARTS for order, a in values[part].items()}
        same_length("rubbing", {**{name: values[name] for name in ALL_VELOCITIES}, **sizes})
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        values: dict[str, Any] = {**self.velocities, **self.parts}
        shown_values = (f"{name}={plain(value)}" for name, value in values.items() if np.size(value) > 1 or value)
        return f"RubbingMotion({', '.join(shown_values)})"

    @property
    def velocities(self) -> dict[str, Numbers]:
        """Constant velocities along both directions, and those for each rad/s of omega, by name."""
        return {name: getattr(self, name) for name in ALL_VELOCITIES}

    @property
    def parts(self) -> dict[str, Mapping[int, Numbers]]:
        """Amplitudes by order of each periodic part, by name."""
        return {part: getattr(self, part) for part in MOTION_PARTS}

    @property
    def orders(self) -> tuple[int, ...]:
        """Harmonic orders of the periodic part with a nonzero amplitude."""
        parts = (item for by_order in self.parts.values() for item in by_order.items())
        return tuple(sorted({int(m) for m, value in parts if np.any(np.asarray(value) != 0)}))

    def narrowed(self, kept: Container[int], order_factor: int = 1) -> RubbingMotion:
        """A copy without the amplitudes on other harmonics of the fundamental frequency than those kept."""
        parts: dict[str, Any] = {
            part: {m: value for m, value in by_order.items() if m * order_factor in kept}
            for part, by_order in self.parts.items()
        }
        return replace(self, **parts)

    @property
    def moves(self) -> bool:
        """Whether there is any rubbing motion."""
        slides = any(np.any(np.asarray(value) != 0) for value in self.velocities.values())
        return bool(slides or any(m > 0 for m in self.orders))

    def speed(self, omega: Reals) -> NDArray[np.float64]:
        """Constant velocity at a fundamental frequency (rad/s), length per time."""
        return np.asarray(np.asarray(self.velocity) + np.asarray(self.velocity_per_omega) * omega, dtype=float)

    def by_direction(self, harmonics: Harmonics, order_factor: int = 1) -> dict[str, PortMotion]:
        """Its motion along "tangential", "second" and "normal", see ``Law.surface_ports``."""
        return {
            "tangential": PortMotion(
                self.velocity, self.velocity_per_omega, self.coefficients(harmonics, order_factor)
            ),
            "second": PortMotion(
                self.second_velocity,
                self.second_velocity_per_omega,
                _coefficients(harmonics, self.second_cos, self.second_sin, order_factor),
            ),
            "normal": PortMotion(0.0, 0.0, self.normal_coefficients(harmonics, order_factor)),
        }

    def coefficients(self, harmonics: Harmonics, order_factor: int = 1) -> NDArray[np.float64]:
        """Coefficients ``U`` of the periodic part, (L,) or (n_elements, L).

        ``order_factor`` turns harmonics of the rubbing motion into harmonics of the fundamental frequency.
        """
        return _coefficients(harmonics, self.cos, self.sin, order_factor)

    def normal_coefficients(self, harmonics: Harmonics, order_factor: int = 1) -> NDArray[np.float64]:
        """Coefficients ``N`` of the normal motion, added to ``Y`` (THEORY.md (1.5)), (L,) or (n_elements, L)."""
        return _coefficients(harmonics, self.normal_cos, self.normal_sin, order_factor)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of its components: "velocity", "cos1", "normal_sin2", ..."""
        there = (name for name, v in self.velocities.items() if name == VELOCITY or np.any(np.asarray(v) != 0))
        return (*there, *(f"{part}{order}" for part, by_order in self.parts.items() for order in by_order))

    def components(self) -> Iterator[tuple[str, Numbers]]:
        """Names and values."""
        return ((name, self.component(name)) for name in self.names)

    @staticmethod
    def is_component(name: str) -> bool:
        """Whether a name is that of a component, present or not."""
        return name in ALL_VELOCITIES or _COMPONENT.fullmatch(name) is not None

    def component(self, name: str) -> Numbers:
        """Value of a component; 0 where it is absent."""
        if name in ALL_VELOCITIES:
            return self.velocities[name]
        part, order = _split(name)
        return self.parts[part].get(order, 0.0)

    def with_component(self, name: str, value: Reals) -> RubbingMotion:
        """A copy with another value of a component."""
        if name in ALL_VELOCITIES:
            return replace(self, **cast(Any, {name: value}))
        part, order = _split(name)
        change: dict[str, Any] = {part: {**self.parts[part], order: value}}
        return replace(self, **change)

    def parted(self) -> RubbingMotion:
        """A copy whose vectors of two values are split into both directions of the surface."""
        new: dict[str, Any] = {}
        for name in VELOCITIES:
            new[name], new[SECOND + name] = _two(self.velocities[name])
        for part in ("cos", "sin"):
            both = {order: _two(value) for order, value in self.parts[part].items()}
            new[part] = {order: first for order, (first, _) in both.items()}
            new[SECOND + part] = {order: second for order, (_, second) in both.items() if second}
        return replace(self, **new)


def _two(value: Numbers) -> tuple[float, float]:
    """Along both directions; a single number is along the first."""
    array = np.ravel(np.asarray(value, dtype=float))
    return float(array[0]), float(array[1]) if array.size > 1 else 0.0


def _split(name: str) -> tuple[str, int]:
    match = _COMPONENT.fullmatch(name)
    if match is None:
        raise InputError(
            Fault("rubbing", f"there is no component '{name}'", expected="velocity, cos1, normal_sin2, ...")
        )
    return match[1], int(match[2])


def _coefficients(
    harmonics: Harmonics, cos: Mapping[int, Numbers], sin: Mapping[int, Numbers], factor: int
) -> NDArray[np.float64]:
    if not cos and not sin:
        return np.zeros(harmonics.size)
    shape = np.broadcast_shapes(*(np.shape(v) for v in (*cos.values(), *sin.values())), ())
    out = np.zeros((*shape, harmonics.size))
    for part, values in (("c", cos), ("s", sin)):
        for order, value in values.items():
            if np.any(np.asarray(value) != 0):
                out[..., harmonics.index(int(order) * factor, part)] += value
    return out


def amplitudes(name: Where, series: Any, least: int) -> dict[int, Numbers]:
    """Amplitudes by whole order >= ``least``."""
    if not isinstance(series, Mapping):
        raise wrong(name, series, "amplitudes by harmonic such as {1: 2.0}")
    checks, by_order = Gathering(), {}
    for order, value in series.items():
        at = checks.take(whole, (*name, "harmonic"), order, least)
        amplitude = checks.take(number_or_numbers, (*name, shown(order)), value)
        if at is not None and amplitude is not None:
            by_order[at] = amplitude
    checks.end()
    return by_order


def common_period(j1: int, j2: int) -> tuple[int, int]:
    """Harmonics of the fundamental frequency that are those of excitation and rubbing motion [THEORY.md (1.2)].

    With periods in the ratio ``T_p / T_u = j1 / j2`` the response has the period ``T = (T_p / j1) lcm(j1, j2)``; the
    excitation has harmonic ``lcm / j1`` of ``2 pi / T`` and its multiples, the rubbing motion ``lcm / j2``.

    >>> common_period(1, 1), common_period(2, 3), common_period(4, 2)
    ((1, 1), (3, 2), (1, 2))
    """
    j1, j2 = whole("period ratio", j1, 1), whole("period ratio", j2, 1)
    j1, j2 = j1 // gcd(j1, j2), j2 // gcd(j1, j2)
    common = lcm(j1, j2)
    return common // j1, common // j2
