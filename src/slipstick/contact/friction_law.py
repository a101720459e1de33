"""The friction element as a law on ports, for the balance and the analyses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import (
    ContactForces,
    element_forces,
    element_intervals,
    element_states,
    forces_on_ports,
)
from slipstick.contact.law import ByPort, Interval, Law, Linear, Motion, Placed, Response, Variable, default
from slipstick.contact.quasi_static import Increment, incremented
from slipstick.contact.rest import REST, remember, rest_of
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Numbers

TANGENTIAL_PORT, NORMAL_PORT = 0, 1
_OWN = ("kt", "mu", "kn", "gap")
"""Parameters of the element, in the order of its kernel."""
EDGE = 1e-12
"""Phase (rad) by which intervals overlap, so that each phase is in one of them."""
LARGEST_FRICTION = 2.0
"""Highest friction coefficient of dry surfaces."""


class FrictionLaw(Law):
    """Behaviour of a friction contact; the numbers ``kt, mu, kn, gap`` come with each call."""

    ports: tuple[str, ...] = ("tangential", "normal")
    kind: str = "friction"
    kind_at_rest: ClassVar[str] = "friction from rest"
    """Kind of those of which the motion without tangential force is known."""
    coulomb: ClassVar[bool] = True
    derived_parameters: ClassVar[tuple[str, ...]] = ("normal_load",)
    dissipating: ClassVar[tuple[int, ...]] = (TANGENTIAL_PORT,)
    """The normal force is elastic: its work over a period is zero."""
    factors: ClassVar[Mapping[str, str]] = {"friction": "mu"}
    linear_states: tuple[str, ...] = ("sliding", "stuck", "free")
    units: ClassVar[Mapping[str, str]] = {
        "kt": "force/length", "mu": "1", "kn": "force/length", "gap": "length", "normal_load": "force",
        "rest": "length", "second_rest": "length",
    }  # fmt: skip
    variables: ClassVar[Mapping[str, Variable]] = {
        "friction_coefficient": Variable("mu", (), "1", "friction coefficient"),
        "tangential_stiffness": Variable("kt", (), "force/length", "tangential contact stiffness"),
        "normal_stiffness": Variable("kn", (), "force/length", "normal contact stiffness"),
        "gap": Variable("gap", (), "length", "gap, negative for interference"),
        "stick_fraction": Variable("stick_fraction", (), "1", "fraction of the period in stick"),
        "slip_fraction": Variable("slip_fraction", (), "1", "fraction of the period in slip"),
        "separation_fraction": Variable("separation_fraction", (), "1", "fraction of the period in separation"),
        "residual_traction": Variable(
            "residual_traction", ("bound",), "force", "interval of admissible mean friction forces"
        ),
    }
    stiffness_names: ClassVar[Mapping[int, str]] = {TANGENTIAL_PORT: "kt", NORMAL_PORT: "kn"}
    force_names: ClassVar[tuple[str, ...]] = ("friction", "normal")

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements, exact to rounding (THEORY.md sections 3 to 7)."""
        own, rest = rest_of(values)
        f = element_forces(
            motion.harmonics,
            motion.Q[TANGENTIAL_PORT],
            motion.Q[NORMAL_PORT],
            v=motion.drift[TANGENTIAL_PORT],
            **own,
        )
        response = _response(f, values)
        if not rest:
            return response
        by_rest = remember(f, motion, own, rest[0])
        return response._replace(by_parameter=lambda name: {0: by_rest} if name == REST else _by_parameter(f, name))

    @default
    def tabulated(self) -> tuple[str, ...]:
        """All parameters; none of contacts that remember where they were at rest, which ``respond`` alone knows."""
        return () if REST in self.values else _OWN

    def respond_on_ports(
        self, harmonics: Harmonics, placed: Placed, on_ports: Array, values: Mapping[str, Array]
    ) -> Response:
        """``respond`` in one compiled call."""
        return _response(forces_on_ports(harmonics, placed, on_ports), values)

    def states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]]:
        """Intervals of stick, slip and separation of n elements, as ``ContactForces.states``."""
        X, Y = motion.Q
        return element_states(motion.harmonics, X, Y, v=motion.drift[TANGENTIAL_PORT], **rest_of(values)[0])

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
        """Friction and normal force (n, k) at phases (k,): with their corners (THEORY.md (3.1))."""
        return friction_in_time(motion, values, tau)

    def quasi_static(
        self, force: Array, before: Array, after: Array, values: Mapping[str, Array], gap_before: Array | None = None
    ) -> Increment:
        """Forces after a slow, straight increment of motion, by return mapping."""
        return incremented(force, before, after, values, gap_before)

    @staticmethod
    def undecided(response: Response) -> NDArray[np.bool_]:
        """Contacts that are stuck all period without sliding: their mean friction force is indeterminate."""
        low, high = response.detail.residual_traction.T
        return np.asarray((low < high) & (REST not in response.values))

    @staticmethod
    def kinked(values: Mapping[str, Array]) -> NDArray[np.bool_]:
        """Contacts that have friction."""
        return np.asarray((values["mu"] > 0) & (values["kt"] > 0))

    @staticmethod
    def warnings(values: Mapping[str, float], ports: set[str], approach: float) -> Iterator[str]:
        """Sentences on suspicious parameters of a contact."""
        mu, kt, kn = values["mu"], values["kt"], values["kn"]
        if "normal" not in ports and values["gap"] >= approach:
            yield "the normal load is 0 and the contact has no normal direction, so it never acts"
        elif kn == 0:
            yield "kn = 0, so it carries no normal load and never acts; give the normal contact stiffness"
        elif "tangential" not in ports:
            pass  # a stop
        elif mu == 0 and kt > 0:
            yield "mu = 0, so there is no friction force"
        elif kt == 0:
            yield "kt = 0, so no sliding changes its friction force; give the tangential contact stiffness"
        if mu > LARGEST_FRICTION:
            yield f"mu = {mu:g} is more than dry surfaces reach; expected below {LARGEST_FRICTION:g}"

    def springs(self, response: Response) -> dict[int, Array]:
        """Effective contact springs, by the fractions of the period in stick, slip and contact."""
        f, p = response.detail, response.values
        slipping = p["mu"] * p["kn"] * f.slip_fraction
        return {0: p["kt"] * f.stick_fraction + slipping, 1: p["kn"] * (1.0 - f.separation_fraction)}

    @staticmethod
    def derived(name: str, values: Mapping[str, Array]) -> tuple[str, Numbers] | None:
        """``(parameter, factor)`` of a derived name: a normal load is a gap of ``-load / kn``."""
        if name != "normal_load":
            return None
        kn = np.asarray(values["kn"], dtype=float)
        return "gap", np.divide(-1.0, kn, out=np.full_like(kn, np.nan), where=kn > 0)

    @staticmethod
    def linear(state: str, values: Mapping[str, Array], drift: Array) -> Linear | None:
        """The law with contact and friction fixed in one state.

        "free": no contact; "stuck": contacts closed at rest are springs kt and kn; "sliding": the friction force is mu
        times the normal force, in the direction of the constant rubbing velocity, if any; "pressed": all contacts are
        springs kt and kn.
        """
        closed = np.logical_or(state == "pressed", values["gap"] < 0).astype(float)
        kn = values["kn"] * closed
        if state == "sliding":
            if not drift[TANGENTIAL_PORT].any():
                return None
            slope = np.sign(drift[TANGENTIAL_PORT]) * values["mu"] * kn
            return Linear({(0, 1): slope, (1, 1): kn}, {0: -slope * values["gap"], 1: -kn * values["gap"]})
        if state in ("stuck", "pressed"):
            kt = values["kt"] * closed
            at_rest = {0: -kt * values[REST]} if REST in values else {}
            return Linear({(0, 0): kt, (1, 1): kn}, {**at_rest, 1: -kn * values["gap"]})
        return Linear({}, {})

    @staticmethod
    def ramps(values: Mapping[str, Array]) -> Iterator[tuple[str, str, float]]:
        """Ramps of parameters towards a first point: label, parameter, starting fraction."""
        yield "friction ramp", "mu", 0.0
        if np.any(values["gap"] < 0):
            yield "normal load ramp", "gap", 0.001

    @staticmethod
    def size(values: Mapping[str, Array]) -> Array:
        """Motion up to slip, length (n,)."""
        limit = values["mu"] * values["kn"] * np.maximum(-values["gap"], 0.0)
        return np.divide(limit, values["kt"], out=np.zeros_like(limit), where=values["kt"] > 0)


def _response(f: ContactForces, values: Mapping[str, Array]) -> Response:
    Fx, Fy, dFx_dX, dFx_dY, dFy_dY, dFx_dv, work = f.of_batch
    return Response(
        (Fx, Fy), {(0, 0): dFx_dX, (0, 1): dFx_dY, (1, 1): dFy_dY}, partial(_by_parameter, f), values, work,
        {(0, 0): dFx_dv}, detail=f,
    )  # fmt: skip


def friction_in_time(motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
    """Friction and normal force (n, k) at phases (k,): with their corners (THEORY.md (3.1))."""
    from slipstick.contact.kernel.tuples import SLIP_MINUS, SLIP_PLUS, STICK

    h, (X, Y), v = motion.harmonics, motion.Q, motion.drift[TANGENTIAL_PORT]
    rest = rest_of(values)[1]
    values = {name: values[name] for name in _OWN}
    intervals = element_intervals(h, X, Y, v=v, **values)
    H = h.H_minus(tau)
    normal = values["kn"][:, None] * np.maximum(Y @ H.T - values["gap"][:, None], 0.0)
    friction = np.full_like(normal, np.nan)
    for e, total in enumerate(intervals.totals):
        limit, x = values["mu"][e] * normal[e], H @ X[e]
        for (start, end, first), (state, _) in zip(intervals.at[e, :total], intervals.code[e, :total], strict=True):
            since = (tau - start + EDGE) % (2.0 * np.pi) - EDGE
            moved = v[e] * since + x - h.H_minus(start) @ X[e]
            force = {STICK: first + values["kt"][e] * moved, SLIP_PLUS: limit, SLIP_MINUS: -limit}.get(state, 0.0)
            friction[e] = np.where(since <= end - start + EDGE, force, friction[e])
    if rest:
        f = element_forces(h, X, Y, v=v, **values)
        middle = f.Fx[:, 0].copy()
        remember(f, motion, values, rest[0])
        friction += (f.Fx[:, 0] - middle)[:, None]
    return friction, normal


def is_friction(law: Law) -> bool:
    """Whether a law is that of the friction element, whatever the names of its ports."""
    return law.kind in (FrictionLaw.kind, FrictionLaw.kind_at_rest)


def _by_parameter(f: ContactForces, name: str) -> ByPort:
    if name == "gap":
        return {0: f.dFx_dgap, 1: f.dFy_dgap}
    if name == "kn":
        return {0: f.dFx_dkn, 1: f.dFy_dkn}
    return {0: f.dFx_dmu if name == "mu" else f.dFx_dkt}
