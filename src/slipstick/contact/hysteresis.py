"""Hysteresis without a sharp limit: Iwan's sliders, Dahl's friction and the Bouc-Wen element, as laws on one port."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Hashable, Iterator, Mapping
from typing import Any, ClassVar, Self

import numpy as np

from slipstick.contact.friction import FrictionContact
from slipstick.contact.friction_law import FrictionLaw
from slipstick.contact.law import ByPort, Law, Linear, Motion, Response, Variable, default
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, number_or_numbers, plain, same_length, shown, whole
from slipstick.typing import Array, Numbers, Reals

MOST_SLIDERS = 10_000
"""Sliders of an Iwan element."""
SHARPEST = 20.0
"""Largest exponent of a Bouc-Wen element, up to which its accuracy was checked."""
_STEP = 1e-30
"""Imaginary part of a complex step."""


class Hysteresis(Law):
    """Base class of the three laws: one port, "tangential", parameters by name, and no states."""

    ports = ("tangential",)
    stiffness_names: ClassVar[Mapping[int, str]] = {0: "kt"}
    force_names: ClassVar[tuple[str, ...]] = ("friction",)
    values: Mapping[str, Numbers]

    def _take(self, given: Mapping[str, Any], ranges: Mapping[str, tuple[float, float, str]]) -> None:
        """Set the parameters; InputError outside their ranges (the lower end excluded)."""
        checks = Gathering()
        values: dict[str, Any] = {name: checks.take(number_or_numbers, name, value) for name, value in given.items()}
        for name, value in values.items():
            low, high, expected = ranges[name]
            if value is not None and not np.all((np.asarray(value) > low) & (np.asarray(value) <= high)):
                checks.faults.append(Fault(name, found=shown(value), expected=expected))
        checks.end()
        checks.take(same_length, type(self).__name__, values)
        checks.end()
        self.values = values

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments that make an equal one."""
        return dict(self.values)

    def changed(self, **values: Reals) -> Self:
        """A copy with other parameters."""
        if unknown := set(values) - set(self.values):
            raise InputError(Fault(min(unknown), "is no parameter of the law", expected=", ".join(self.values)))
        return type(self)(**{**self.arguments, **values})

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={plain(v)}' for k, v in self.arguments.items())})"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and repr(self) == repr(other)

    def __hash__(self) -> int:
        return hash(repr(self))

    @default
    def kind(self) -> Hashable:
        """Laws of one class are computed together."""
        return type(self).__name__

    @default
    def units(self) -> Mapping[str, str]:
        """Units of parameters by name."""
        return {"kt": "force/length", "limit": "force"}

    @default
    def variables(self) -> Mapping[str, Variable]:
        """Parameters; the stiffness has the name of that of friction contacts."""
        own = {name: Variable(name, (), self.unit(name), f"parameter {name}") for name in self.values}
        return {**own, "tangential_stiffness": FrictionLaw.variables["tangential_stiffness"]}

    def linear(self, state: str, values: Mapping[str, Array], drift: Array) -> Linear | None:
        """The spring before it yields ("stuck"), or no force."""
        del drift
        return Linear({(0, 0): values["kt"]} if state == "stuck" else {}, {}) if state in ("stuck", "free") else None

    def ramps(self, values: Mapping[str, Array]) -> Iterator[tuple[str, str, float]]:
        """The stiffness grows."""
        del values
        yield "stiffness ramp", "kt", 0.001

    @abstractmethod
    def size(self, values: Mapping[str, Array]) -> Array:
        """Motion in which it yields, length (n,)."""


class IwanContact(Hysteresis):
    r"""Iwan's joint: springs side by side, each with a slider of its own limit; one contact or many.

    Stiffness per yield displacement is spread as ``phi^chi`` from 0 to a largest one, where a last spring has ``beta``
    times the stiffness of all the others [D. J. Segalman, J. Appl. Mech. 72 (2005) 752, eq. 20 to 26]. Each slider is
    answered by the exact friction element. A bin has the stiffness and the limit that the distribution has there, so
    ``kt`` and ``limit`` are exact whatever the number of bins. In time it is these sliders, each with its own sticks
    and slips.

    Parameters
    ----------
    kt
        Stiffness while all stick, force/length, > 0.
    limit
        Force while all slide, > 0.
    chi
        Exponent of the distribution, > -1: 0 spreads evenly; the energy of a small loop grows as amplitude^(3 + chi).
    beta
        Stiffness of the last spring over that of all the others, >= 0: with it the joint slides with a corner.
    sliders
        Number of bins of equal width; 1 with ``beta = 0`` is a friction contact with ``mu N = limit``.

    Raises
    ------
    InputError
        For a parameter out of its range, or arrays of different length.

    Examples
    --------
    >>> IwanContact(kt=1.0, limit=2.0)
    IwanContact(kt=1.0, limit=2.0, chi=0.0, beta=0.0, sliders=100)
    """

    def __init__(self, *, kt: Reals, limit: Reals, chi: Reals = 0.0, beta: Reals = 0.0, sliders: int = 100) -> None:
        self._take(
            {"kt": kt, "limit": limit, "chi": chi, "beta": beta},
            {
                "kt": (0.0, np.inf, "a tangential contact stiffness > 0"), "limit": (0.0, np.inf, "a force > 0"),
                "chi": (-1.0, np.inf, "an exponent > -1"), "beta": (-np.finfo(float).tiny, np.inf, "a ratio >= 0"),
            },
        )  # fmt: skip
        self.sliders = whole("sliders", sliders, 1, MOST_SLIDERS)

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments that make an equal one."""
        return {**self.values, "sliders": self.sliders}

    @default
    def kind(self) -> Hashable:
        """Those with as many sliders are computed together."""
        return "Iwan", self.sliders, self._last

    @property
    def _last(self) -> bool:
        """Whether the last spring has any stiffness."""
        return bool(np.any(np.asarray(self.values["beta"]) > 0.0))

    def slider_parameters(self, values: Mapping[str, Any]) -> tuple[Array, Array]:
        """Stiffness and limit of the sliders, (n, count) each; of real or complex parameters (n,)."""
        kt, limit, chi, beta = (np.asarray(values[name])[:, None] for name in ("kt", "limit", "chi", "beta"))
        edges = np.arange(self.sliders + 1) / self.sliders
        # of phi over the largest one: shares of the stiffness and of the first moment
        with np.errstate(divide="ignore"):
            logs = np.log(edges)
        stiffness = np.diff(np.exp((chi + 1.0) * logs), axis=1)
        moment = (chi + 1.0) / (chi + 2.0) * np.diff(np.exp((chi + 2.0) * logs), axis=1)
        largest = limit * (1.0 + beta) / (kt * (beta + (chi + 1.0) / (chi + 2.0)))
        k, moments = kt / (1.0 + beta) * stiffness, kt / (1.0 + beta) * largest * moment
        if not self._last:
            return k, moments
        last = kt * beta / (1.0 + beta)
        return np.concatenate([k, last], axis=1), np.concatenate([moments, last * largest], axis=1)

    def _single(self, motion: Motion, values: Mapping[str, Array]) -> tuple[Motion, dict[str, Array]]:
        """Motion and parameters of the sliders of every contact: friction contacts with mu = 1 and kn = 1."""
        k, limits = (part.reshape(-1) for part in self.slider_parameters(values))
        X = np.repeat(motion.Q[0], self.slider_count, axis=0)
        v, one = np.repeat(motion.drift[0], self.slider_count), np.ones(k.size)
        omega = np.asarray(motion.omega)
        wide = motion._replace(
            Q=(X, np.zeros_like(X)), drift=np.stack([v, 0.0 * v]),
            omega=np.repeat(omega, self.slider_count) if omega.ndim else motion.omega, swept=0.0,
        )  # fmt: skip
        return wide, {"kt": k, "mu": one, "kn": one, "gap": -limits}

    @default
    def slider_count(self) -> int:
        """Number of sliders, with the last spring where it has any stiffness."""
        return self.sliders + self._last

    def _total(self, of_sliders: Array) -> Array:
        return np.asarray(of_sliders.reshape(-1, self.slider_count, *of_sliders.shape[1:]).sum(axis=1))

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements with all derivatives, exact for the sliders there are."""
        found = _SLIDER.respond(*self._single(motion, values))

        def by_parameter(name: str) -> ByPort:
            k, limits = self.slider_parameters({**values, name: values[name] + 1j * _STEP})
            by_k, by_gap = (found.by_parameter(part)[0] for part in ("kt", "gap"))
            dk, dlimit = (part.imag.reshape(-1, 1) / _STEP for part in (k, limits))
            return {0: self._total(by_k * dk - by_gap * dlimit)}

        return Response(
            force=(self._total(found.force[0]),),
            by_motion={(0, 0): self._total(found.by_motion[0, 0])},
            by_drift={(0, 0): self._total(found.by_drift[0, 0])},
            by_parameter=by_parameter,
            values=values,
            work=self._total(found.work),
        )

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
        """The force (n, k) at phases (k,)."""
        forces = _SLIDER.forces_in_time(*self._single(motion, values), tau)
        return (self._total(forces[0]),)

    def size(self, values: Mapping[str, Array]) -> Array:
        """Motion in which it yields, length (n,)."""
        return np.asarray(values["limit"] / values["kt"])


_SLIDER = FrictionContact(kt=0.0, mu=0.0, normal_load=0.0)


class _Smooth(Hysteresis):
    """A force ``alpha kt w + (1 - alpha) kt z`` with ``dz/dw = 1 - |z|^n (b sign(w' z) + g)``."""

    memory: ClassVar[tuple[str, ...]] = ("z",)

    @abstractmethod
    def _curve(self, values: Mapping[str, Any]) -> tuple[Array, Array, Array, Array]:
        """``alpha, b, g, n`` (n,) each; of real or complex parameters."""

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces of n elements with all derivatives.

        Their error is below 1e-8 of the limit, or of the largest force where that is less; that of derivatives
        likewise, by n 1e-6; checked for motions up to 1e6 times the yield. Steps and panels follow the shortest scale
        of the law and a tolerance.
        """
        from slipstick.contact.kernel.bouc_wen import RULE, run

        X, L = np.ascontiguousarray(motion.Q[0], dtype=float), motion.harmonics.size
        alpha, *curve = self._curve(values)
        if np.any(motion.drift[0] * alpha):
            slides = "the opposing surface slides, and the stiffness after yield has no bound"
            raise InputError(Fault("alpha", slides, remedy="give alpha = 0, or no rubbing velocity"))
        f, by, work = np.empty((len(X), L)), np.empty((len(X), L, L + 4)), np.empty(len(X))
        p = np.ascontiguousarray(np.column_stack([np.broadcast_to(c, len(X)) for c in curve]))
        run(X, np.asarray(motion.harmonics.m, dtype=float), np.ascontiguousarray(motion.drift[0]), p, RULE, f, by, work)
        kt = values["kt"][:, None]
        a = np.broadcast_to(alpha, len(X))[:, None]
        force = kt * (a * X + (1.0 - a) * f)
        tangent = kt[..., None] * (a[..., None] * np.eye(L) + (1.0 - a)[..., None] * by[..., :L])

        def by_parameter(name: str) -> ByPort:
            stepped = self._curve({**values, name: values[name] + 1j * _STEP})
            da, db, dg, dn = (np.broadcast_to(np.imag(c) / _STEP, len(X))[:, None] for c in stepped)
            along = by[..., L + 1] * db + by[..., L + 2] * dg + by[..., L + 3] * dn
            out = kt * (da * (X - f) + (1.0 - a) * along)
            if name == "alpha":  # undefined while it slides: with alpha > 0 its force is unbounded
                out[motion.drift[0] != 0.0] = np.nan
            return {0: out + force / kt if name == "kt" else out}

        return Response(
            force=(force,), by_motion={(0, 0): tangent}, by_drift={(0, 0): kt * (1.0 - a) * by[..., L]},
            by_parameter=by_parameter, values=values, work=(kt * (1.0 - a))[:, 0] * work,
        )  # fmt: skip

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
        """The force (n, k) at phases (k,)."""
        from slipstick.contact.kernel.bouc_wen import START, path

        X, tau = np.ascontiguousarray(motion.Q[0], dtype=float), np.asarray(tau, dtype=float)
        phases = START + (tau - START) % (2.0 * np.pi)
        order = np.argsort(phases)
        alpha, *curve = self._curve(values)
        p = np.ascontiguousarray(np.column_stack([np.broadcast_to(c, len(X)) for c in curve]))
        z, sorted_z = np.empty((len(X), tau.size)), np.empty((len(X), tau.size))
        m = np.asarray(motion.harmonics.m, dtype=float)
        path(X, m, np.ascontiguousarray(motion.drift[0]), p, np.ascontiguousarray(phases[order]), sorted_z)
        z[:, order] = sorted_z
        a = np.broadcast_to(alpha, len(X))[:, None]
        return (values["kt"][:, None] * (a * (X @ motion.harmonics.H_minus(tau).T) + (1.0 - a) * z),)

    def rate(self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Force, and dz/dt."""
        alpha, b, g, n = self._curve(values)
        (z,), (speed,) = memory, velocity
        force = values["kt"] * (alpha * q[0] + (1.0 - alpha) * z)
        return force[None], (speed * (1.0 - np.abs(z) ** n * (b * np.sign(speed * z) + g)))[None]

    def size(self, values: Mapping[str, Array]) -> Array:
        """Motion in which it yields, length (n,)."""
        _, b, g, n = self._curve(values)
        return np.asarray((b + g) ** (-1.0 / n))


class DahlContact(_Smooth):
    r"""Dahl's friction: the force creeps towards its limit, ``df/dw = kt (1 - sign(w') f / limit)``.

    Between reversals it is an exponential of the way made [P. R. Dahl, A solid friction model, Aerospace Corporation
    TOR-0158(3107-18)-1 (1968)]. It does not know how fast it is moved.

    Parameters
    ----------
    kt
        Slope where the force is zero, force/length, > 0.
    limit
        Force that it tends to, > 0.

    Raises
    ------
    InputError
        For a parameter out of its range, or arrays of different length.

    Examples
    --------
    >>> DahlContact(kt=100.0, limit=0.5)
    DahlContact(kt=100.0, limit=0.5)
    """

    def __init__(self, *, kt: Reals, limit: Reals) -> None:
        positive = {"kt": (0.0, np.inf, "a tangential contact stiffness > 0"), "limit": (0.0, np.inf, "a force > 0")}
        self._take({"kt": kt, "limit": limit}, positive)

    def _curve(self, values: Mapping[str, Any]) -> tuple[Array, Array, Array, Array]:
        b = values["kt"] / values["limit"]
        return 0.0 * b, b, 0.0 * b, 0.0 * b + 1.0


class BoucWenContact(_Smooth):
    r"""Bouc-Wen: ``f = alpha kt w + (1 - alpha) kt z`` with ``dz/dw = 1 - |z|^n (beta sign(w' z) + gamma)``.

    [Y.-K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249.] The amplitude A of ``dz/dw`` is 1: it says nothing that kt does
    not [F. Ma et al., J. Appl. Mech. 71 (2004) 489]. z tends to ``(beta + gamma)^(-1/n)``. The restrictions are those
    under which every loop dissipates.

    Parameters
    ----------
    kt
        Stiffness before it yields, force/length, > 0.
    beta, gamma
        Of the loop's shape, 1/length^n: beta > 0, -beta < gamma <= beta.
    n
        Sharpness of the yield, 1 to 20.
    alpha
        Stiffness after yield over ``kt``, 0 to 1.

    Raises
    ------
    InputError
        For a parameter out of its range, or arrays of different length.

    Notes
    -----
    With ``alpha > 0`` the force has no bound, and the opposing surface cannot slide at a constant velocity. Where it
    does, with ``alpha = 0``, derivatives by ``alpha`` are nan.

    Examples
    --------
    >>> BoucWenContact(kt=10.0, beta=4.0, gamma=2.0)
    BoucWenContact(kt=10.0, beta=4.0, gamma=2.0, n=1.0, alpha=0.0)
    """

    def __init__(self, *, kt: Reals, beta: Reals, gamma: Reals = 0.0, n: Reals = 1.0, alpha: Reals = 0.0) -> None:
        below = np.nextafter(1.0, 0.0)
        self._take(
            {"kt": kt, "beta": beta, "gamma": gamma, "n": n, "alpha": alpha},
            {
                "kt": (0.0, np.inf, "a tangential contact stiffness > 0"), "beta": (0.0, np.inf, "a number > 0"),
                "gamma": (-np.inf, np.inf, "a number"), "n": (below, SHARPEST, f"a number from 1 to {SHARPEST:g}"),
                "alpha": (-np.finfo(float).tiny, 1.0, "a ratio from 0 to 1"),
            },
        )  # fmt: skip
        b, g = np.asarray(self.values["beta"], dtype=float), np.asarray(self.values["gamma"], dtype=float)
        if not np.all((g > -b) & (g <= b)):
            raise InputError(Fault("gamma", found=shown(gamma), expected="above -beta, at most beta"))

    @default
    def units(self) -> Mapping[str, str]:
        """Units of parameters by name; those of beta and gamma are 1/length^n."""
        return {"kt": "force/length"}

    def _curve(self, values: Mapping[str, Any]) -> tuple[Array, Array, Array, Array]:
        return values["alpha"], values["beta"], values["gamma"], values["n"]
