"""Friction whose coefficient depends on the sliding velocity: Stribeck's curve, or a table, with sticking."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.friction import FrictionContact
from slipstick.contact.friction_law import FrictionLaw
from slipstick.contact.law import ByPort, Interval, Law, Linear, Motion, Response, TimeSlopes, Variable, default
from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, number, number_or_numbers, plain, same_length, shown, wrong
from slipstick.typing import Array, IntArray, Numbers, Reals

FORMS = ("table", "exponential", "gaussian", "hyperbolic", "cubic")
"""Forms of the curve, in the order of the kernel's numbers."""
_STRIBECK = ("mu_s", "mu_d", "v_s", "viscous")
_SPLITS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Velocities over the Stribeck velocity between which a curve is smooth enough for one rule of integration."""
_FASTER = 30.0
"""Rate at which an excess of the spring force decays in time, over that of the spring at the velocity of the law."""
_SHORT = 1e-9
"""Length (rad) of an interval that is rounding."""
_INTERVALS = 24
"""Intervals per harmonic and corner of the law, at most."""


class StribeckContact(Law):
    r"""Friction with a coefficient that depends on the sliding velocity, ``mu(|w'|)``; one contact or many.

    The contact sticks on a spring ``kt`` and slips at ``f = +-mu(|w'|) N``, ``N = kn max(y - gap, 0)``: the law of
    ``FrictionContact``, whose limit follows the velocity ``w'`` at which the two bodies slide past each other, the
    rubbing motion included. The spring's own rate ``f'/kt`` is left out of that velocity: with it a massless slider on
    a falling curve would jump for ever and have no steady sliding at all. It is small as long as ``f'`` is small
    beside ``kt w'``.

    Stribeck's curve is ``mu = mu_d + (mu_s - mu_d) g(|w'| / v_s) + viscous |w'|`` with
    ``g(s) = exp(-s)`` ("exponential"), ``exp(-s^2)`` ("gaussian"; B. Armstrong-Helouvry, P. Dupont and C. Canudas de
    Wit, Automatica 30 (1994) 1083, eq. 7) or ``1 / (1 + s)`` ("hyperbolic").

    Changes of state are located to rounding, forces and derivatives are integrals between them, exact to rounding for
    a table and for a curve to about 1e-10. There is no smoothed sign: a law regularised by ``tanh`` does not stick, and
    its steep slope at rest decides the steady motion (``SampledLaw`` allows it).

    In time (``rate``) the spring force is an internal variable z, ``z' = kt w' - relaxation (z - f)``, with ``f`` the
    part of z within the limits: sticks begin late by about ``1 / relaxation``, with an error of second order in it.

    Parameters
    ----------
    kt
        Tangential stiffness while it sticks, force/length, > 0.
    mu
        A table of ``(velocity, mu)``, the first velocity 0 and increasing (length/time): mu is linear between, and
        constant beyond. Or leave it out and give Stribeck's curve:
    mu_s, mu_d, v_s, viscous
        Coefficients at rest and at high velocity, the velocity of the fall (> 0, length/time), the slope (time/length;
        0 by default).
    form
        "exponential" (default), "gaussian" or "hyperbolic".
    kn, gap, normal_load
        Normal contact as of ``FrictionContact``.
    relaxation
        Rate (1/time) of time integration alone; by default ``30 kt v / (mu N)`` at the preload, with mu at rest and
        v the Stribeck velocity or the second one of the table. Without a preload it is needed for motion in time.

    Raises
    ------
    InputError
        For a parameter that is not finite or negative, a table that does not begin at 0 or does not increase, a table
        together with Stribeck's parameters, or as ``FrictionContact``.

    Examples
    --------
    >>> pad = StribeckContact(kt=100.0, mu=[(0.0, 0.4), (2.0, 0.3)], normal_load=10.0)
    >>> dict(pad.values)["mu2"], float(pad.mu(1.0)[0])
    (0.3, 0.35)
    """

    ports = ("tangential", "normal")
    optional_ports: ClassVar[tuple[str, ...]] = ("normal",)
    derived_parameters: ClassVar[tuple[str, ...]] = ("normal_load",)
    dissipating: ClassVar[tuple[int, ...]] = (0,)
    linear_states: ClassVar[tuple[str, ...]] = ("sliding", "stuck", "free")
    force_names: ClassVar[tuple[str, ...]] = ("friction", "normal")
    stiffness_names: ClassVar[Mapping[int, str]] = {0: "kt", 1: "kn"}
    memory: ClassVar[tuple[str, ...]] = ("spring_force",)

    def __init__(
        self,
        *,
        kt: Reals,
        mu: Sequence[tuple[Reals, Reals]] | None = None,
        mu_s: Reals | None = None,
        mu_d: Reals | None = None,
        v_s: Reals | None = None,
        viscous: Reals | None = None,
        form: str | None = None,
        kn: Reals | None = None,
        gap: Reals | None = None,
        normal_load: Reals | None = None,
        relaxation: float | None = None,
    ) -> None:
        checks = Gathering()
        curve = dict(zip(_STRIBECK, (mu_s, mu_d, v_s, viscous), strict=True))
        base = checks.take(_base, kt, kn, gap, normal_load)
        numbers: dict[str, Any] = {}
        if mu is not None:
            given = [name for name, value in (*curve.items(), ("form", form)) if value is not None]
            if given:
                fault = f"is given together with {', '.join(given)}"
                checks.faults.append(Fault("mu", fault, remedy="give the table, or Stribeck's parameters"))
            self.form = FORMS[0]
            numbers = checks.take(_table, mu) or {}
        else:
            self.form = form if isinstance(form, str) else "exponential"
            if not isinstance(form, str | None) or form not in (None, *FORMS[1:]):
                remedy = ""
                if self.form in ("tanh", "arctan", "regularised", "regularized", "smooth"):
                    remedy = "a smoothed sign never sticks; if that is wanted use ss.SampledLaw"
                known = '"exponential", "gaussian", "hyperbolic" or "cubic"'
                checks.faults.append(Fault("form", found=shown(form), expected=known, remedy=remedy))
            for name, value in curve.items():
                if value is None and name != "viscous":
                    checks.faults.append(Fault(name, "is missing", remedy="give it, or a table mu=[(0, 0.4), ...]"))
                else:
                    numbers[name] = checks.take(_checked, name, 0.0 if value is None else value)
        if relaxation is not None:
            relaxation = checks.take(number, "relaxation", relaxation, "a rate > 0, 1/time", above=SMALLEST)
        checks.end()
        assert base is not None
        self._base: FrictionContact = base
        self._numbers, self._relaxation = numbers, relaxation
        self.values: Mapping[str, Numbers] = {"kt": base.kt, **numbers, "kn": base.kn, "gap": base.gap}
        checks.take(same_length, "friction contact", dict(self.values))
        checks.end()

    @property
    def normal_load(self) -> NDArray[np.float64]:
        """Static preload at ``y = 0``: ``kn max(-gap, 0)``."""
        return self._base.normal_load

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments that make an equal one."""
        base = self._base
        normal = {} if base._scaled else {"kn": base.kn}
        load = {"normal_load": base.normal_load} if base._loaded else {"gap": base.gap}
        if self.form == FORMS[0]:
            n = len(self._numbers) // 2
            law: dict[str, Any] = {
                "mu": [(self._numbers[f"speed{k + 1}"], self._numbers[f"mu{k + 1}"]) for k in range(n)]
            }
        else:
            law = {**self._numbers, "form": self.form}
        rate = {} if self._relaxation is None else {"relaxation": self._relaxation}
        return {"kt": base.kt, **law, **normal, **load, **rate}

    def __repr__(self) -> str:
        arguments = (f"{k}={_written(v)}" for k, v in self.arguments.items())
        return f"StribeckContact({', '.join(arguments)})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StribeckContact) and repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash(repr(self))

    def changed(self, **values: Reals) -> StribeckContact:
        """A copy with other parameters; a normal load becomes a gap at the present ``kn``."""
        unknown = set(values) - {*self.values, "normal_load"}
        if unknown:
            raise InputError(Fault(min(unknown), "is no parameter of the law", expected=", ".join(self.values)))
        base = self._base.changed(**{k: v for k, v in values.items() if k in ("kt", "kn", "gap", "normal_load")})
        numbers = {**self._numbers, **{k: v for k, v in values.items() if k in self._numbers}}
        arguments = self.arguments
        for name in ("kn", "gap", "normal_load"):
            arguments.pop(name, None)
        if self.form == FORMS[0]:
            n = len(numbers) // 2
            arguments["mu"] = [(numbers[f"speed{k + 1}"], numbers[f"mu{k + 1}"]) for k in range(n)]
        else:
            arguments |= numbers
        arguments["kt"] = base.kt
        new = StribeckContact(**arguments, kn=None if base._scaled else base.kn, gap=base.gap)
        new._base = base
        return new

    def mu(self, speed: Reals) -> Array:
        """Friction coefficient at sliding speeds (>= 0) of any shape, one row for each contact: (n, ...)."""
        at = np.asarray(speed, dtype=float)
        rows = {k: np.asarray(v, dtype=float).reshape(-1, *(1,) * at.ndim) for k, v in self._numbers.items()}
        return self._coefficient(at[None], rows)[0]

    def _coefficient(self, speed: Array, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """mu and its slope at speeds, with parameters that broadcast against them."""
        if self.form == FORMS[0]:
            n = len(self._numbers) // 2
            mu, slope = speed * 0.0 + values["mu1"], speed * 0.0
            for k in range(1, n):
                a, b = values[f"speed{k}"], values[f"speed{k + 1}"]
                rise = (values[f"mu{k + 1}"] - values[f"mu{k}"]) / (b - a)
                mu = mu + rise * (np.clip(speed, a, b) - a)
                slope = slope + rise * ((speed >= a) & (speed < b))
            return mu, slope
        static, kinetic, scale, viscous = (values[name] for name in _STRIBECK)
        s = speed / scale
        if self.form == "exponential":
            g = np.exp(-s)
            d = -g
        elif self.form == "gaussian":
            g = np.exp(-s * s)
            d = -2.0 * s * g
        elif self.form == "hyperbolic":
            g = 1.0 / (1.0 + s)
            d = -g * g
        else:
            g = 1.0 - 1.5 * s + 0.5 * s * s * s
            d = 1.5 * (s * s - 1.0)
        return kinetic + (static - kinetic) * g + viscous * speed, (static - kinetic) * d / scale + viscous

    @default
    def kind(self) -> tuple[Hashable, ...]:
        """Laws of one form are computed together."""
        return "velocity friction", self.form, len(self._numbers), self._relaxation

    @default
    def units(self) -> Mapping[str, str]:
        """Units of parameters by name."""
        speeds = {name: "length/time" for name in self._numbers if name.startswith(("speed", "v_s"))}
        return {**FrictionLaw.units, **speeds, "viscous": "time/length"}

    @default
    def variables(self) -> Mapping[str, Variable]:
        """Parameters, and how the period is divided."""
        fractions = ("stick_fraction", "slip_fraction", "separation_fraction")
        own = {name: Variable(name, (), self.unit(name), f"parameter {name}") for name in self.values}
        return {**own, **{name: FrictionLaw.variables[name] for name in fractions}}

    # forces

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements with all derivatives."""
        return self._evaluated(motion, values).response(self, motion, values)

    def states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]]:
        """Intervals (start, end, state) of one period of n elements."""
        return self._evaluated(motion, values).intervals()

    def smooth_states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]]:
        """The same, cut also where the velocity passes a row of a table."""
        return self._evaluated(motion, values).intervals(cut=self.form == FORMS[0])

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, Array]:
        """Friction and normal force (n, k) at phases (k,), with corners."""
        from slipstick.contact.kernel.tuples import STICK

        found, h = self._evaluated(motion, values), motion.harmonics
        (X, Y), v = motion.Q, motion.drift[0]
        H = h.H_minus(tau)
        normal = values["kn"][:, None] * np.maximum(Y @ H.T - values["gap"][:, None], 0.0)
        rate = np.reshape(motion.omega, (-1, 1)) * (h.derivative(X) @ H.T + v[:, None])
        columns = {name: value[:, None] for name, value in values.items()}
        limit = normal * self._coefficient(np.abs(rate), columns)[0]
        friction = np.zeros_like(normal)
        for e, total in enumerate(found.totals):
            for (start, end, held), (state, _, _) in zip(found.at[e, :total], found.code[e, :total], strict=True):
                phase = start + (tau - start) % (2.0 * np.pi)
                inside = phase <= end
                if state == STICK:
                    stuck = held + values["kt"][e] * (H @ X[e] + v[e] * phase)
                    friction[e, inside] = stuck[inside]
                elif state:
                    friction[e, inside] = (limit[e] if state == 2 else -limit[e])[inside]
        return friction, normal

    def _evaluated(self, motion: Motion, values: Mapping[str, Array]) -> _Evaluated:
        from slipstick.contact.kernel.velocity_friction import NODES, WEIGHTS, run

        h, n = motion.harmonics, len(motion.Q[0])
        p = np.ascontiguousarray(np.column_stack([values[name] for name in self._ordered]))
        if self.form == FORMS[0]:
            k = p.shape[1] // 2
            levels = np.concatenate([p[:, :k], -p[:, 1:k]], axis=1)
        else:
            splits = np.array([0.0, *_SPLITS, *(-s for s in _SPLITS)])
            levels = p[:, 2:3] * splits
        omega = np.broadcast_to(np.asarray(motion.omega, dtype=float), (n,))
        constants = np.column_stack([motion.drift[0], omega, values["kt"], values["kn"], values["gap"]])
        most, L, G = _INTERVALS * (h.highest + 1) * (levels.shape[1] + 1), h.size, 2 * h.size + 5 + p.shape[1]
        out = _Evaluated(
            forces=np.empty((2, n, L)), slopes=np.empty((2, n, L, G)), scalars=np.empty((n, 5)),
            at=np.empty((n, most, 3)), code=np.empty((n, most, 3), np.int64), totals=np.empty(n, np.int64),
            names=self._ordered, omega=omega,
        )  # fmt: skip
        run(
            np.ascontiguousarray(motion.Q[0], dtype=float), np.ascontiguousarray(motion.Q[1], dtype=float),
            np.asarray(h.m, dtype=float), FORMS.index(self.form), p, np.ascontiguousarray(levels),
            np.ascontiguousarray(constants, dtype=float), (NODES, WEIGHTS), *out.forces, *out.slopes, out.scalars,
            out.at, out.code, out.totals,
        )  # fmt: skip
        failed = out.totals < 0
        out.totals[failed] = 0
        out.forces[:, failed], out.slopes[:, failed] = np.nan, np.nan
        return out

    @property
    def _ordered(self) -> tuple[str, ...]:
        """Names of the numbers of the curve, in the order of the kernel."""
        if self.form != FORMS[0]:
            return _STRIBECK
        n = len(self._numbers) // 2
        return tuple(f"{part}{k + 1}" for part in ("speed", "mu") for k in range(n))

    # in time

    def rate(self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array]) -> tuple[Array, Array] | None:
        """Forces, and the rate of the spring force; None without a relaxation."""
        relaxation = self._decay_rate(values)
        if relaxation is None:
            return None
        z = memory[0]
        normal = values["kn"] * np.maximum(q[1] - values["gap"], 0.0)
        limit = normal * self._coefficient(np.abs(velocity[0]), values)[0]
        friction = np.clip(z, -limit, limit)
        return np.stack([friction, normal]), (values["kt"] * velocity[0] - relaxation * (z - friction))[None]

    def time_slopes(
        self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array], scale: tuple[float, float]
    ) -> TimeSlopes:
        """Derivatives of ``rate``."""
        del scale
        returned, relaxation = self.rate(q, velocity, memory, values), self._decay_rate(values)
        assert returned is not None
        assert relaxation is not None
        (_, normal), z = returned[0], memory[0]
        mu, slope = self._coefficient(np.abs(velocity[0]), values)
        side = np.where(np.abs(z) > mu * normal, np.sign(z), 0.0)
        spring = np.where(q[1] > values["gap"], values["kn"], 0.0)
        out = np.zeros((3, 5, *z.shape))
        out[0, 1], out[0, 2] = side * mu * spring, side * slope * np.sign(velocity[0]) * normal
        out[0, 4] = side == 0.0
        out[1, 1] = spring
        out[2] = relaxation * out[0]
        out[2, 2] += values["kt"]
        out[2, 4] -= relaxation
        return TimeSlopes(out, returned[0], returned[1])

    def memory_in_sliding(self, q: Array, velocity: Array, values: Mapping[str, Array]) -> Array:
        """Beyond the limit on the side of the velocity, whatever the spring force."""
        normal = values["kn"] * np.maximum(q[1] - values["gap"], 0.0)
        return (
            2.0 * np.sign(velocity[0]) * (1.0 + normal) * (1.0 + self._coefficient(np.abs(velocity[0]), values)[0])
        )[None]

    def _decay_rate(self, values: Mapping[str, Array]) -> Array | None:
        if self._relaxation is not None:
            return np.asarray(self._relaxation)
        speed, mu = ("speed2", "mu1") if self.form == FORMS[0] else ("v_s", "mu_s")
        limit = values[mu] * values["kn"] * np.maximum(-values["gap"], 0.0)
        if np.any(limit <= 0.0):
            return None
        return np.asarray(_FASTER * values["kt"] * values[speed] / limit)

    # properties and first guesses

    def missing(self, ports: set[str]) -> Iterator[Fault]:
        """A normal stiffness that was not given, where something moves across the surface."""
        return self._base.missing(ports)

    @staticmethod
    def derived(name: str, values: Mapping[str, Array]) -> tuple[str, Numbers] | None:
        """A normal load is a gap of ``-load / kn``."""
        return FrictionLaw.derived(name, values)

    @staticmethod
    def undecided(response: Response) -> NDArray[np.bool_]:
        """Contacts that are stuck all period at rest."""
        return np.asarray(response.detail.scalars[:, 3] < response.detail.scalars[:, 4])

    def kinked(self, values: Mapping[str, Array]) -> NDArray[np.bool_]:
        """All of them: friction acts."""
        return np.asarray(values["kt"] > 0)

    def linear(self, state: str, values: Mapping[str, Array], drift: Array) -> Linear | None:
        """The law fixed in one state; "sliding" with the coefficient at rest, for a first guess."""
        mu = values["mu1" if self.form == FORMS[0] else "mu_s"]
        return FrictionLaw.linear(state, {**values, "mu": mu}, drift)

    def ramps(self, values: Mapping[str, Array]) -> Iterator[tuple[str, str, float]]:
        """The normal load grows."""
        if np.any(values["gap"] < 0):
            yield "normal load ramp", "gap", 0.001

    def size(self, values: Mapping[str, Array]) -> Array:
        """Motion up to slip, length (n,)."""
        mu = values["mu1" if self.form == FORMS[0] else "mu_s"]
        return FrictionLaw.size({**values, "mu": mu})

    def warnings(self, values: Mapping[str, float], ports: set[str], approach: float) -> Iterator[str]:
        """Sentences on suspicious parameters of a contact."""
        names = [name for name in values if name.startswith("mu")]
        mu = max(values[name] for name in names)
        yield from FrictionLaw.warnings({**values, "mu": mu}, ports, approach)


@dataclass(frozen=True, kw_only=True)
class _Evaluated:
    """Results of the kernel for n elements, with the fractions of the period."""

    forces: Array
    slopes: Array
    scalars: Array
    at: Array
    code: IntArray
    totals: IntArray
    names: tuple[str, ...]
    omega: Array

    @property
    def stick_fraction(self) -> Array:
        """(n,)."""
        return np.asarray(self.scalars[:, 1])

    @property
    def slip_fraction(self) -> Array:
        """(n,)."""
        return np.asarray(self.scalars[:, 2])

    @property
    def separation_fraction(self) -> Array:
        """(n,)."""
        return np.asarray(1.0 - self.scalars[:, 1] - self.scalars[:, 2])

    def response(self, law: StribeckContact, motion: Motion, values: Mapping[str, Array]) -> Response:
        """The results as a ``Response``."""
        L = motion.harmonics.size
        (fx, fy), (by_x, by_y) = self.forces, self.slopes
        columns = {"kt": 2 * L + 2, "kn": 2 * L + 3, "gap": 2 * L + 4}
        columns |= {name: 2 * L + 5 + j for j, name in enumerate(self.names)}

        def by_parameter(name: str) -> ByPort:
            across = {1: by_y[..., columns[name]]} if name in ("kn", "gap") else {}
            return {0: by_x[..., columns[name]], **across}

        return Response(
            force=(fx, fy),
            by_motion={(0, 0): by_x[..., :L], (0, 1): by_x[..., L : 2 * L], (1, 1): by_y[..., L : 2 * L]},
            by_drift={(0, 0): by_x[..., 2 * L]},
            by_omega={0: by_x[..., 2 * L + 1]},
            by_parameter=by_parameter,
            values=values,
            work=self.scalars[:, 0],
            detail=self,
        )

    def intervals(self, *, cut: bool = False) -> list[list[Interval]]:
        """States of each element from 0 to 2 pi; ``cut``: also where the law has corners."""
        from slipstick.contact.kernel.tuples import NAMES

        every = []
        for e, total in enumerate(self.totals):
            merged: list[list[Any]] = []
            for (start, end, _), (state, _, _) in zip(self.at[e, :total], self.code[e, :total], strict=True):
                if merged and merged[-1][2] == NAMES[state] and (not cut or end - start < _SHORT):
                    merged[-1][1] = end
                else:
                    merged.append([start, end, NAMES[state]])
            if len(merged) > 1 and merged[0][2] == merged[-1][2] and not cut:
                merged[0][0] = merged.pop()[0] - 2.0 * np.pi
            elif len(merged) == 1:
                merged = [[0.0, 2.0 * np.pi, merged[0][2]]]
            turned = [(float(a % (2.0 * np.pi)), float(a % (2.0 * np.pi) + b - a), name) for a, b, name in merged]
            every.append(sorted(turned))
        return every


def _written(value: Any) -> str:
    """An argument in Python's syntax."""
    if isinstance(value, list):
        return f"[{', '.join(f'({plain(speed)}, {plain(mu)})' for speed, mu in value)}]"
    return repr(value) if isinstance(value, str) else str(plain(value))


def _base(kt: Any, kn: Any, gap: Any, load: Any) -> FrictionContact:
    base = FrictionContact(kt=kt, mu=1.0, kn=kn, gap=gap, normal_load=load)
    if np.any(np.asarray(base.kt) <= 0):
        raise InputError(Fault("kt", found=shown(kt), expected="a tangential contact stiffness > 0"))
    if not base._scaled and np.any(np.asarray(base.kn) <= 0):
        raise InputError(Fault("kn", found=shown(kn), expected="a normal contact stiffness > 0"))
    return base


def _checked(name: str, value: Any) -> Any:
    value = number_or_numbers(name, value)
    least = np.min(np.asarray(value))
    if name == "v_s" and not least > 0:
        raise InputError(Fault(name, found=shown(value), expected="a velocity > 0"))
    if name.startswith("mu") and least < 0:
        raise InputError(Fault(name, found=f"{shown(value)}, negative", expected="a value >= 0"))
    return value


def _length(value: Any) -> int:
    """Number of items of a value; 0 where it has none, such as an array without axes."""
    try:
        return len(value)
    except TypeError:
        return 0


def _table(rows: Any) -> dict[str, Any]:
    expected = "rows of velocity and mu such as [(0.0, 0.4), (2.0, 0.3)], at least two"
    if isinstance(rows, str | Mapping) or _length(rows) < 2 or any(_length(row) != 2 for row in rows):
        raise wrong("mu", rows, expected)
    checks, speeds, coefficients = Gathering(), {}, {}
    for k, (speed, mu) in enumerate(rows):
        speeds[f"speed{k + 1}"] = checks.take(number_or_numbers, f"speed{k + 1}", speed)
        coefficients[f"mu{k + 1}"] = checks.take(_checked, f"mu{k + 1}", mu)
    checks.end()
    same_length("velocity table", {**speeds, **coefficients})
    every = list(speeds.values())
    if np.any(np.asarray(every[0]) != 0.0):
        raise InputError(Fault("mu", found=f"velocities from {shown(every[0])}", expected="velocities from 0 on"))
    if any(np.any(np.asarray(b) <= np.asarray(a)) for a, b in pairwise(every)):
        raise InputError(Fault("mu", found=f"velocities {shown(every)}", expected="velocities that increase"))
    return {**speeds, **coefficients}
