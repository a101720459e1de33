"""Contact of a turning rotor with a circular stator: a radial spring beyond the clearance, and tangential friction.

With the centre of the rotor at ``(x, y) = r (cos a, sin a)`` from that of the stator and the surface of the rotor at
the speed V (radius times speed of rotation, positive in the sense from x to y), where ``r > gap``::

    N = kn (r - gap) + cn r',    T = mu N v / sqrt(v^2 + slip_velocity^2),    v = V + r a'

N resists the motion outwards, T the sliding of the rotor's surface [A. Muszynska, Rotordynamics,
2005]. There is no stick: below ``slip_velocity`` friction grows with the velocity.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

import numpy as np

from slipstick.contact.law import Interval, Law, Motion, Response, TimeSlopes, Variable
from slipstick.contact.sampled import ByPorts, Jumps, SampledLaw, base_edges, moving, one_element
from slipstick.errors import Fault
from slipstick.faults import SMALLEST, Gathering, number_or_numbers, same_length, wrong
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray, Numbers

X, Y, SPIN = 0, 1, 2


def _force(q: Any, velocity: Any, kn: Any, mu: Any, gap: Any, cn: Any, slip_velocity: Any) -> Any:
    """Forces along x and y, and the friction that brakes the rotor; complex steps pass through."""
    (x, y, _), (dx, dy, speed) = q, velocity
    squared = x * x + y * y
    open_ = np.real(squared) <= gap * gap
    r = np.sqrt(np.where(open_, 1.0, squared))
    normal = kn * (r - gap) + cn * (x * dx + y * dy) / r
    slip = speed + (x * dy - y * dx) / r
    held = np.where(slip_velocity > 0.0, slip_velocity, 1.0)
    friction = mu * normal * slip / np.sqrt(slip * slip + held * held)
    normal, friction = np.where(open_, 0.0, normal / r), np.where(open_, 0.0, friction)
    return normal * x - friction * y / r, normal * y + friction * x / r, friction


def _slopes(q: list[Array], velocity: list[Array], values: Mapping[str, Array]) -> tuple[ByPorts, ByPorts]:
    """Derivatives of ``_force`` by motion and by velocity, in closed form, which is faster than complex steps."""
    (x, y, _), (dx, dy, speed) = q, velocity
    kn, mu, cn, slow = (values[name] for name in ("kn", "mu", "cn", "slip_velocity"))
    r = np.hypot(x, y)
    closed = r > values["gap"]
    r = np.where(closed, r, 1.0)
    cos, sin = x / r, y / r
    out, round_ = dx * cos + dy * sin, dy * cos - dx * sin
    normal, slip = np.where(closed, kn * (r - values["gap"]) + cn * out, 0.0), speed + round_
    reach = np.sqrt(slip * slip + np.where(slow > 0.0, slow * slow, 1.0))
    share, steep = slip / reach, (1.0 - (slip / reach) ** 2) / reach
    zero = np.zeros_like(r)
    none = {(i, SPIN): zero for i in range(3)}

    def by(grows: Array, turns: Array, outwards: Array, sliding: Array) -> tuple[Array, Array, Array]:
        """For changes of r, of the angle, and of both velocities."""
        pressed = np.where(closed, kn * grows + cn * outwards, 0.0)
        friction = mu * (share * pressed + normal * steep * sliding)
        across, along = friction + normal * turns, pressed - mu * normal * share * turns
        return along * cos - across * sin, along * sin + across * cos, friction

    one = np.ones_like(r)
    motion = {
        X: by(cos, -sin / r, -sin / r * round_, sin / r * out),
        Y: by(sin, cos / r, cos / r * round_, -cos / r * out),
    }
    rates = {X: by(zero, zero, cos, -sin), Y: by(zero, zero, sin, cos), SPIN: by(zero, zero, zero, one)}
    by_motion, by_velocity = (
        {(i, j): part for j, parts in table.items() for i, part in enumerate(parts)} for table in (motion, rates)
    )
    return by_motion | none, by_velocity


_SAMPLED = SampledLaw(
    force=_force, ports=("x", "y", "spin"),
    parameters={"kn": 1.0, "mu": 0.0, "gap": 1.0, "cn": 0.0, "slip_velocity": 1.0},
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class StatorContact(Law):
    """A rotor in a circular stator: ports "x" and "y", the displacement of the rotor's centre from the stator's.

    The surface speed of the rotor is the rubbing motion: ``RubbingMotion(velocity=radius * speed)``, or
    ``velocity_per_omega=radius`` of a rotor that turns with the fundamental frequency; negative where it turns from y
    to x.

    Parameters
    ----------
    kn
        Radial contact stiffness, force/length, >= 0.
    gap
        Clearance, > 0.
    mu
        Friction coefficient, >= 0.
    cn
        Radial damping while in contact, force/velocity, >= 0. It may pull where the rotor leaves fast.
    slip_velocity
        Velocity at which friction has 0.71 of its limit; > 0 where there is friction. What would stick creeps at a
        part of it. Where sliding never reverses, one of 1 % of the velocities changes friction by 0.005 %; where it
        reverses, amplitudes change in proportion to it (by 0.2 % at 1 % of them, by 0.01 % at 0.01 %, for a rotor of
        two dofs that whirls against its surface). A smaller one costs little: an evaluation takes 1.4 times as long at
        1e-6 as at 1e-2, and a first point is found with a larger one and followed down to it.

    Numbers, or arrays (n,) for n contacts.

    Raises
    ------
    InputError
        For values out of range.

    Examples
    --------
    >>> import numpy as np
    >>> from slipstick.trig.harmonics import Harmonics
    >>> law = StatorContact(kn=2.0, gap=1.0)
    >>> circle = np.array([[0.0, 1.5, 0.0]]), np.array([[0.0, 0.0, 1.5]]), np.zeros((1, 3))
    >>> motion = Motion(Harmonics([0, 1]), 1.0, circle, np.zeros((3, 1)))
    >>> values = {name: np.atleast_1d(value) for name, value in law.values.items()}
    >>> float(law.respond(motion, values).force[0][0, 1].round(12))          # kn (r - gap)
    1.0
    """

    kn: Numbers
    gap: Numbers
    mu: Numbers = 0.0
    cn: Numbers = 0.0
    slip_velocity: Numbers = 0.0

    ports = _SAMPLED.ports
    kind: ClassVar[str] = "stator"
    optional_ports: ClassVar[tuple[str, ...]] = ("spin",)
    prescribed_ports: ClassVar[tuple[str, ...]] = ("spin",)
    surface_ports: ClassVar[Mapping[str, str]] = {"tangential": "spin"}
    factors: ClassVar[Mapping[str, str]] = {"friction": "mu"}
    linear_states: ClassVar[tuple[str, ...]] = ("free",)
    force_names: ClassVar[tuple[str, ...]] = ("x", "y", "braking")
    slow: ClassVar[str | None] = "slip_velocity"
    units: ClassVar[Mapping[str, str]] = {
        "kn": "force/length", "gap": "length", "mu": "1", "cn": "force time/length", "slip_velocity": "length/time",
    }  # fmt: skip
    variables: ClassVar[Mapping[str, Variable]] = {
        "friction_coefficient": Variable("mu", (), "1", "friction coefficient"),
        "normal_stiffness": Variable("kn", (), "force/length", "normal contact stiffness"),
        "gap": Variable("gap", (), "length", "clearance"),
    }

    def __post_init__(self) -> None:
        checks = Gathering()
        given: dict[str, Any] = {}
        for name in (f.name for f in fields(self)):
            least = SMALLEST if name == "gap" else 0.0
            given[name] = checks.take(_number, name, getattr(self, name), least)
        checks.end()
        same_length("stator contact", given)
        mu, slow = np.broadcast_arrays(given["mu"], given["slip_velocity"])
        if np.any((mu > 0.0) & (slow <= 0.0)):
            checks.faults.append(
                Fault("slip_velocity", "friction needs it", remedy="give a velocity that counts as slow")
            )
        checks.end()
        for name, value in given.items():
            object.__setattr__(self, name, value)

    @property
    def values(self) -> Mapping[str, Numbers]:  # type: ignore[override]
        """Every parameter by name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def changed(self, **values: Numbers) -> StatorContact:
        """A copy with other parameters."""
        return replace(self, **values)

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements, sampled finely where contact begins or ends and where sliding reverses.

        Derivatives are exact for the samples; the error of the coefficients is about 1e-9 of the force.
        """
        return _SAMPLED.respond_resolved(motion, values, _edges, _slopes)

    def states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]]:
        """Intervals of slip, where the rotor touches the stator, and separation, of n elements, in rad."""
        elements = (one_element(motion, values, e) for e in range(len(motion.Q[0])))
        return [_intervals(*_touches(own, float(at["gap"][0]))) for own, at in elements]

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
        """Forces (n, k) at phases (k,)."""
        return _SAMPLED.forces_in_time(motion, values, tau)

    def rate(self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Forces at motion and velocity; there is no memory."""
        return _SAMPLED.rate(q, velocity, memory, values)

    def time_slopes(
        self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array], scale: tuple[float, float]
    ) -> TimeSlopes:
        """Derivatives of ``rate``, exact."""
        return _SAMPLED.time_slopes(q, velocity, memory, values, scale)

    def size(self, values: Mapping[str, Array]) -> Array:
        """The clearance."""
        return np.asarray(values["gap"])

    def ramps(self, values: Mapping[str, Array]) -> Iterator[tuple[str, str, float]]:
        """Ramps towards a first point: friction, then stiffness."""
        del values
        return iter((("friction ramp", "mu", 0.0), ("contact ramp", "kn", 1e-3)))

    def warnings(self, values: Mapping[str, float], ports: set[str], approach: float) -> Iterator[str]:
        """Sentences on suspicious parameters of a contact."""
        del ports, approach
        if values["kn"] == 0.0:
            yield "kn = 0, so it never acts; give the radial contact stiffness"


_GRID = 8
"""Points of the search for contact and reversals, in each panel that resolves the motion."""
_GRADES = np.array([0.6, 1.8, 6.0, 24.0, 96.0, 400.0, 1600.0, 6400.0, 25600.0])
"""Ends of panels beside a reversal, over the distance of the pole of the friction there: a rule of ten nodes leaves
1e-10 where a panel is three times as long as it is far from the pole. Beyond the last, friction is at its limit."""
_MOST_STEPS, _SLOPE_STEP = 60, 1e-5
"""Steps of the root search; difference of phase (rad) for the slope of the sliding velocity."""


def _edges(motion: Motion, values: Mapping[str, Array]) -> tuple[Array, Jumps | None]:
    """Ends of panels of one element: where contact begins or ends, and graded towards reversals of the sliding.

    With them the jumps of the damping force where contact begins or ends.
    """
    kn, mu, gap, cn, slow = (float(values[name][0]) for name in ("kn", "mu", "gap", "cn", "slip_velocity"))
    touched, rising, inside = _touches(motion, gap)
    if (kn == 0.0 and cn == 0.0) or not (touched.size or inside):
        return np.empty(0), None
    jumps = _jumps(motion, touched, rising, mu, cn, slow) if cn != 0.0 and touched.size else None
    sampled, width = _depth_and_slip(motion, gap), base_edges(motion.harmonics)[1]
    turned = _reversals(sampled, motion.harmonics, slow) if mu != 0.0 else np.empty(0)
    if not turned.size:
        return touched, jumps
    near, far = (sampled(turned + step)[1] for step in (-_SLOPE_STEP, _SLOPE_STEP))
    reach = 2.0 * _SLOPE_STEP * slow / np.maximum(np.abs(far - near), 1e-300)[:, None] * _GRADES
    beside = np.where(reach < 0.5 * width, reach, 0.0)
    at = turned[:, None]
    return np.concatenate([touched, turned, (at + beside).ravel(), (at - beside).ravel()]), jumps


def _jumps(motion: Motion, tau: Array, rising: BoolArray, mu: float, cn: float, slow: float) -> Jumps:
    """Contact begins with the force ``cn r'`` outwards and its friction, at a phase that moves by ``-dr / r'``."""
    (x, y, _), (dx, dy, speed) = moving(motion)(tau)
    omega = float(np.reshape(motion.omega, -1)[0])
    r = np.hypot(x, y)
    cos, sin, slip = x / r, y / r, omega * (speed + (x * dy - y * dx) / r)
    friction = mu * slip / np.hypot(slip, slow or 1.0)
    size = np.where(rising, cn * omega, -cn * omega)
    by_depth = [size * (cos - friction * sin), size * (sin + friction * cos), size * friction]
    by_motion = {(i, j): part * along for i, part in enumerate(by_depth) for j, along in ((X, cos), (Y, sin))}
    return Jumps(tau, by_motion, {"gap": {i: -part for i, part in enumerate(by_depth)}})


def _reversals(sampled: Callable[[Array], tuple[Array, Array]], harmonics: Harmonics, slow: float) -> Array:
    """Phases at which the sliding reverses while the rotor touches, of its depth and sliding velocity."""
    base = base_edges(harmonics)
    tau = np.arange(_GRID * base.size + 1) * (base[1] / _GRID)
    depth, slip = sampled(tau)
    closed = depth > 0.0
    place = np.flatnonzero(((slip[:-1] > 0.0) != (slip[1:] > 0.0)) & (closed[:-1] | closed[1:]))
    a, b, fa, fb = tau[place], tau[place + 1], slip[place], slip[place + 1]
    at, before = a, np.zeros(place.size)
    for _ in range(_MOST_STEPS if place.size else 0):  # the Illinois method
        at = b - fb * (b - a) / (fb - fa)
        f = sampled(at)[1]
        if np.all((np.abs(f) <= 0.05 * slow) | (b - a < 1e-14)):
            break
        left = (f > 0.0) == (fa > 0.0)
        side = np.where(left, 1.0, -1.0)
        kept = np.where(side == before, 0.5, 1.0)
        a, fa = np.where(left, at, a), np.where(left, f, kept * fa)
        b, fb = np.where(left, b, at), np.where(left, kept * fb, f)
        before = side
    return at


def _depth_and_slip(motion: Motion, gap: float) -> Callable[[Array], tuple[Array, Array]]:
    """Function of phases (k,) for the penetration of one element and its sliding velocity."""
    path, omega = moving(motion), float(np.reshape(motion.omega, -1)[0])

    def at(tau: Array) -> tuple[Array, Array]:
        (x, y, _), (dx, dy, speed) = path(tau)
        r = np.maximum(np.sqrt(x * x + y * y), 1e-300)
        return r - gap, omega * (speed + (x * dy - y * dx) / r)

    return at


def _intervals(at: Array, rising: BoolArray, inside: bool) -> list[Interval]:
    """States between the phases at which contact begins or ends."""
    if not at.size:
        return [(0.0, 2.0 * np.pi, "slip" if inside else "separation")]
    ends = [*at[1:].tolist(), float(at[0]) + 2.0 * np.pi]
    return [
        (start, end, "slip" if up else "separation")
        for start, end, up in zip(at.tolist(), ends, rising.tolist(), strict=True)
    ]


def _touches(motion: Motion, gap: float) -> tuple[Array, BoolArray, bool]:
    """Phases (k,) at which one element begins or ends to touch, whether it begins there, and whether it touches at 0.

    They are all the roots of ``r^2 - gap^2``, a trigonometric polynomial of twice the order: no contact is too short.
    """
    from slipstick.trig.roots import roots  # compiled: reading and checking a case needs none

    wide = Harmonics(range(2 * motion.harmonics.highest + 1))
    tau = 2.0 * np.pi * np.arange(wide.size) / wide.size
    x, y = (np.reshape(Q, -1) @ motion.harmonics.H_minus(tau).T for Q in motion.Q[:2])
    samples = x * x + y * y - gap * gap
    lines = np.fft.rfft(samples) / samples.size
    p = np.concatenate([lines.real[:1], np.stack([2.0 * lines.real[1:], -2.0 * lines.imag[1:]], axis=1).ravel()])
    at, rising = roots(wide, p)
    return at, rising, bool(samples[0] > 0.0)


def _number(name: str, value: Any, least: float) -> Any:
    expected = "a number > 0, or one for each contact" if least else "a number >= 0, or one for each contact"
    found = number_or_numbers(name, value, expected)
    if np.any(np.asarray(found) < least):
        raise wrong(name, value, expected)
    return found
