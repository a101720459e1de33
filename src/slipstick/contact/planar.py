"""Friction on a surface that slides in both directions: the Coulomb circle as a law on three ports."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import SERIAL, run_in_threads
from slipstick.contact.friction import FrictionContact
from slipstick.contact.friction_law import EDGE, FrictionLaw
from slipstick.contact.law import ByPort, Interval, Law, Linear, Motion, Response, Variable, default
from slipstick.contact.planar_in_time import PlanarInTime
from slipstick.contact.rest import REST, SECOND_REST, remember_in_plane, rest_of
from slipstick.errors import IS_MISSING, Fault, InputError, SlipstickError
from slipstick.faults import number, number_or_numbers, plain, same_length
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Numbers, Reals

TOLERANCE = 1e-8
TINY = float(np.finfo(float).tiny)
_PIECES = (512, 8192, 131072)
"""Capacities for the pieces of a period, tried in turn."""
_PARAMETERS = ("kt", "mu", "kn", "gap")


@dataclass(frozen=True, init=False, repr=False)
class PlanarFrictionContact(FrictionContact):
    """A friction contact whose surface slides in both tangential directions (the Coulomb circle).

    The friction force is a vector ``f`` of length at most ``mu f_y``. While stuck ``f' = kt w'`` for the relative
    motion ``w`` in the plane; while slipping it points along the velocity of slip. Along one straight line it is the
    element of ``FrictionContact``, which is exact and some 30 times quicker; this one is integrated to ``tolerance``,
    its derivatives likewise.

    Parameters
    ----------
    kt, mu, kn, gap, normal_load
        As of ``FrictionContact``; kt is the same in both directions.
    rest, second_rest
        As of ``FrictionContact``, along both directions; both or none.
    tolerance
        Error of the friction force, relative to its largest value.

    Raises
    ------
    InputError
        As ``FrictionContact``; for a tolerance outside 1e-12 to 1e-3.

    Notes
    -----
    Ports: "tangential", "second" (the other direction in the surface, perpendicular to it) and "normal". B. D. Yang and
    C. H. Menq (1998) for the law, ``slipstick.contact.kernel.planar`` for the integration.

    Examples
    --------
    >>> PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    PlanarFrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    """

    second_rest: Numbers | None
    tolerance: float

    slips_at_once: ClassVar[bool] = True
    memory: ClassVar[tuple[str, ...]] = ("first", "second")
    """While stuck the force at zero motion; while slipping the angle of the force (``PlanarInTime``)."""
    regimes: ClassVar[PlanarInTime] = PlanarInTime()
    ports: ClassVar[tuple[str, ...]] = ("tangential", "second", "normal")  # type: ignore[misc]
    dissipating: ClassVar[tuple[int, ...]] = (0, 1)
    stiffness_names: ClassVar[Mapping[int, str]] = {0: "kt", 1: "kt", 2: "kn"}
    force_names: ClassVar[tuple[str, ...]] = ("friction", "second_friction", "normal")
    surface_ports: ClassVar[Mapping[str, str]] = {"tangential": "tangential", "second": "second", "normal": "normal"}
    variables: ClassVar[Mapping[str, Variable]] = {
        name: variable for name, variable in FrictionLaw.variables.items() if name != "residual_traction"
    }

    def __init__(
        self,
        *,
        kt: Reals | None = None,
        mu: Reals | None = None,
        kn: Reals | None = None,
        gap: Reals | None = None,
        normal_load: Reals | None = None,
        rest: Reals | None = None,
        second_rest: Reals | None = None,
        tolerance: float = TOLERANCE,
    ) -> None:
        super().__init__(kt=kt, mu=mu, kn=kn, gap=gap, normal_load=normal_load, rest=rest)
        if (rest is None) != (second_rest is None):
            missing = "rest" if rest is None else "second_rest"
            raise InputError(Fault(missing, IS_MISSING, remedy="give rest and second_rest, or none of them"))
        along = None if second_rest is None else number_or_numbers("second_rest", second_rest)
        object.__setattr__(self, "second_rest", along)
        same_length("friction contact", self.values)
        tolerance = number("tolerance", tolerance)
        if not 1e-12 <= tolerance <= 1e-3:
            raise InputError(Fault("tolerance", found=str(tolerance), expected="1e-12 to 1e-3"))
        object.__setattr__(self, "tolerance", tolerance)

    def __repr__(self) -> str:
        own = "" if self.second_rest is None else f", second_rest={plain(self.second_rest)}"
        own += "" if self.tolerance == TOLERANCE else f", tolerance={self.tolerance:g}"
        return f"{super().__repr__()[:-1]}{own})"

    def changed(self, **values: Reals) -> PlanarFrictionContact:
        """A copy with other parameters, of the same tolerance."""
        new = super().changed(**values)
        assert isinstance(new, PlanarFrictionContact)
        object.__setattr__(new, "tolerance", self.tolerance)
        return new

    @default
    def kind(self) -> Hashable:  # type: ignore[override]
        """Planar contacts of one tolerance are computed together."""
        return ("planar friction", self.tolerance, *([] if self.rest is None else ["from rest"]))

    @default
    def values(self) -> Mapping[str, Numbers]:
        """Every parameter by name."""
        usual: Any = FrictionContact.values
        own = usual.__get__(self)
        return own if self.second_rest is None else {**own, "second_rest": self.second_rest}

    @default
    def optional_ports(self) -> tuple[str, ...]:
        """The normal, whose load is constant then; a surface that moves in one direction alone."""
        return ("second", "normal")

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements with their derivatives."""
        f = _Forces(motion, values, self.tolerance)
        ways = [(i, j) for i in range(3) for j in range(3) if i < 2 or j == 2]
        return Response(
            force=tuple(np.ascontiguousarray(f.forces[:, i]) for i in range(3)),
            by_motion={(i, j): f.by_motion(i, j) for i, j in ways},
            by_drift={(i, j): f.column(i, j) for i in (0, 1) for j in (0, 1)},
            by_parameter=f.by_parameter,
            values=values,
            work=f.work,
            detail=f,
        )

    def states(self, motion: Motion, values: Mapping[str, Array]) -> list[list[Interval]]:
        """Intervals of stick, slip and separation of n elements, in rad."""
        f = _Inputs(motion, values, self.tolerance)
        return [_intervals(*f.trace(e)) for e in range(f.count)]

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
        """Both friction forces and the normal one (n, k) at phases (k,), with their corners."""
        f = _Inputs(motion, values, self.tolerance)
        both = tuple(np.stack(rows) for rows in zip(*(f.in_time(e, tau) for e in range(f.count)), strict=True))
        if REST in values:
            means = [_Forces(motion, own, self.tolerance).forces[:, :2, 0] for own in (values, rest_of(values)[0])]
            for i in (0, 1):
                both[i][:] += (means[0] - means[1])[:, i, None]
        return both

    @staticmethod
    def undecided(response: Response) -> NDArray[np.bool_]:
        """Contacts that never slip, whose mean force is indeterminate."""
        return np.asarray(response.detail.stuck_all_period & (REST not in response.values))

    def springs(self, response: Response) -> dict[int, Array]:
        """Effective contact springs, or the slope of the friction where that is steeper.

        Where a whole circle has just begun to slip, friction grows as a square root: its slope is unbounded, and so is
        the effect of rounding of the motion.
        """
        f, p = response.detail, response.values
        k = p["kt"] * f.stick_fraction + p["mu"] * p["kn"] * f.slip_fraction
        steep = Law.springs(self, response)
        own = {0: k, 1: k, 2: p["kn"] * (1.0 - f.separation_fraction)}
        return own | {i: np.maximum(own[i], steep[i]) for i in (0, 1) if i in steep}

    @staticmethod
    def linear(state: str, values: Mapping[str, Array], drift: Array) -> Linear | None:
        """The law with contact and friction fixed in one state: "free", "stuck", "pressed", or "sliding" along the rub.

        The states are those of ``FrictionLaw.linear``.
        """
        closed = np.logical_or(state == "pressed", values["gap"] < 0).astype(float)
        kn = values["kn"] * closed
        if state in ("stuck", "pressed"):
            kt = values["kt"] * closed
            at_rest = {i: -kt * each for i, each in enumerate(rest_of(values)[1])}
            return Linear({(0, 0): kt, (1, 1): kt, (2, 2): kn}, {**at_rest, 2: -kn * values["gap"]})
        if state != "sliding":
            return Linear({}, {})
        speed = np.hypot(drift[0], drift[1])
        if not speed.any():
            return None
        along = [np.divide(d, speed, out=np.zeros_like(speed), where=speed > 0) * values["mu"] * kn for d in drift[:2]]
        constant = {i: -along[i] * values["gap"] for i in (0, 1)}
        return Linear({(0, 2): along[0], (1, 2): along[1], (2, 2): kn}, {**constant, 2: -kn * values["gap"]})


class _Inputs:
    """Motion and parameters of a batch for the compiled functions."""

    def __init__(self, motion: Motion, values: Mapping[str, Array], tolerance: float) -> None:
        from slipstick.trig.basis import grid

        harmonics, Q = motion.harmonics, motion.Q
        if harmonics.n == 0:  # at rest: one harmonic of zeros
            Q = tuple(np.hstack([q, np.zeros((len(q), 2))]) for q in Q)
            harmonics = Harmonics([0, 1])
        self.harmonics, self.tolerance, self.count = harmonics, tolerance, len(Q[0])
        self.X = np.ascontiguousarray(np.stack(Q, axis=1), dtype=float)
        self.parameters = np.empty((self.count, 6))
        for i, value in enumerate((motion.drift[0], motion.drift[1], *(values[name] for name in _PARAMETERS))):
            self.parameters[:, i] = value
        self.tables = tuple(grid(harmonics))

    def trace(self, e: int) -> tuple[Any, ...]:
        """Pieces of one element's period: kinds, ``at``, angles at the nodes, arcs of contact."""
        from slipstick.contact.kernel.planar.elements import trace
        from slipstick.contact.kernel.planar.motion import FULL, LOST

        for capacity in _PIECES:
            count, kind, at, theta, arcs = trace(self.X[e], self.parameters[e], self.tables, self.tolerance, capacity)
            if count != FULL:
                break
        if count in (FULL, LOST):
            raise _failed(e, count == FULL)
        return kind[:count], at[:count], theta[:count], arcs

    def in_time(self, e: int, tau: Array) -> tuple[Array, Array, Array]:
        """Both friction forces and the normal one at phases (k,)."""
        from slipstick.contact.kernel.planar.motion import STICK
        from slipstick.contact.kernel.planar.slip import angle_within

        X, (v1, v2, kt, mu, kn, gap) = self.X[e], self.parameters[e]
        H = self.harmonics.H_minus(tau)
        normal = kn * np.maximum(H @ X[2] - gap, 0.0)
        forces = np.zeros((2, tau.size))
        kinds, ats, thetas, _ = self.trace(e)
        for kind, (start, end, f1, f2, first), theta in zip(kinds, ats, thetas, strict=True):
            since = (tau - start + EDGE) % (2.0 * np.pi) - EDGE
            inside = since <= end - start + EDGE
            if kind == STICK:
                moved = (H[inside] - self.harmonics.H_minus(start)) @ X[:2].T
                for i, (f, v) in enumerate(((f1, v1), (f2, v2))):
                    forces[i, inside] = f + kt * (moved[:, i] + v * since[inside])
            else:
                angle = angle_within(first, theta, np.clip(since[inside] / max(end - start, TINY), 0.0, 1.0), kind)
                forces[:, inside] = mu * normal[inside] * np.array([np.cos(angle), np.sin(angle)])
        return forces[0], forces[1], normal


class _Forces(_Inputs):
    """Forces of a batch with their derivatives."""

    def __init__(self, motion: Motion, values: Mapping[str, Array], tolerance: float) -> None:
        super().__init__(motion, values, tolerance)
        n, L, self.kept = self.count, self.harmonics.size, motion.harmonics.size
        self.forces = np.empty((n, 3, L))
        self.derivatives = np.empty((n, 3, L, 3 * L + 6))
        self.scalars = np.empty((n, 4))
        run_in_threads(n, SERIAL // 16, self._run)
        own, rest = rest_of(values)
        self.by_rest = np.zeros((n, 2, 2))
        if rest:
            every = {name: np.broadcast_to(value, (n,)) for name, value in own.items()}
            out = self.forces, self.derivatives
            loose = self.stuck_all_period & ~np.any(motion.drift[:2], axis=0)
            self.by_rest = remember_in_plane(self.harmonics, self.X, every, rest, loose, out)
        self.forces = self.forces[:, :, : self.kept]
        m = motion.harmonics.m
        work = sum(motion.drift[i] * self.forces[:, i, 0] for i in (0, 1))
        for i in (0, 1):
            q, f = motion.Q[i], self.forces[:, i]
            work = work + 0.5 * ((q[:, 2::2] * f[:, 1::2] - q[:, 1::2] * f[:, 2::2]) * m).sum(axis=1)
        self.work = np.asarray(work, dtype=float)

    def _run(self, first: int, last: int) -> None:
        """Evaluate elements from first to last, with a larger capacity where it does not suffice."""
        from slipstick.contact.kernel.planar.elements import run_planar

        outputs, capacities = (self.forces, self.derivatives, self.scalars), iter(_PIECES)
        capacity = next(capacities)
        while first < last:
            end = run_planar(first, last, self.X, self.parameters, self.tables, self.tolerance, capacity, outputs)
            if end == -1:
                return
            if end < 0:
                raise _failed(-2 - end, False)
            first, capacity = end, next(capacities, 0)
            if capacity == 0:
                raise _failed(end, True)

    def by_motion(self, i: int, j: int) -> Array:
        """``dF_i/dQ_j`` (n, L, L)."""
        L = self.harmonics.size
        return np.ascontiguousarray(self.derivatives[:, i, : self.kept, j * L : j * L + self.kept])

    def column(self, i: int, column: int) -> Array:
        """Derivative of ``F_i`` by a column after those of the motion, (n, L)."""
        return np.ascontiguousarray(self.derivatives[:, i, : self.kept, 3 * self.harmonics.size + column])

    def by_parameter(self, name: str) -> ByPort:
        """Derivatives of the forces by a parameter."""
        if name in (REST, SECOND_REST):
            found = np.zeros((self.count, 2, self.kept))
            found[:, :, 0] = self.by_rest[:, :, int(name == SECOND_REST)]
            return {i: found[:, i] for i in range(2)}
        column = 2 + _PARAMETERS.index(name)
        return {i: self.column(i, column) for i in range(3)}

    @cached_property
    def stuck_all_period(self) -> NDArray[np.bool_]:
        """Contacts that never slip, (n,)."""
        return np.asarray(self.scalars[:, 3] > 0.5)

    @property
    def stick_fraction(self) -> Array:
        """Fraction of the period in stick, (n,)."""
        return self.scalars[:, 0]

    @property
    def slip_fraction(self) -> Array:
        """Fraction of the period in slip, (n,)."""
        return self.scalars[:, 1]

    @property
    def separation_fraction(self) -> Array:
        """Fraction of the period in separation, (n,)."""
        return self.scalars[:, 2]


def _failed(e: int, full: bool) -> SlipstickError:
    why = f"more than {_PIECES[-1]} pieces of slip in a period" if full else "no periodic state of friction"
    return SlipstickError(f"planar contact element {e}: found {why}; check kt, the rubbing velocity and the motion")


def _intervals(kinds: Array, ats: Array, thetas: Array, arcs: Array) -> list[Interval]:
    """States of one period, neighbours of one kind joined, cyclically."""
    from slipstick.contact.kernel.planar.motion import NAMES

    del thetas
    turn = 2.0 * np.pi
    if not len(arcs):
        return [(0.0, turn, "separation")]
    pieces = [(float(at[0]), float(at[1]), NAMES[kind]) for kind, at in zip(kinds, ats, strict=True)]
    if not len(kinds):  # without friction
        pieces = [(float(a), float(b), "slip") for a, b, _ in arcs]
    joined: list[Interval] = []
    for start, end, name in pieces:
        if joined and start - joined[-1][1] > 1e-12:
            joined.append((joined[-1][1], start, "separation"))
        if joined and joined[-1][2] == name:
            joined[-1] = (joined[-1][0], end, name)
        else:
            joined.append((start, end, name))
    rest = joined[0][0] + turn - joined[-1][1]
    if rest > 1e-12:
        joined.append((joined[-1][1], joined[0][0] + turn, "separation"))
    elif len(joined) > 1 and joined[0][2] == joined[-1][2]:
        start, _, name = joined.pop()
        joined[0] = (start, joined[0][1] + turn, name)
        joined = [*joined[1:], joined[0]]
    return joined
