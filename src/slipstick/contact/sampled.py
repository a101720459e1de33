"""Laws given by a smooth force as a function of motion and velocity, sampled over the period.

Forces without memory or kinks need no more; derivatives are exact for the samples, by complex steps.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from inspect import signature
from typing import Any, NamedTuple, cast

import numpy as np

from slipstick.contact.law import ByPort, Law, Motion, Response, TimeSlopes, add_to, default
from slipstick.errors import InputError
from slipstick.faults import (
    MOST_ITEMS,
    Gathering,
    names,
    number_or_numbers,
    same_length,
    shown,
    table,
    warn,
    whole,
    wrong,
)
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import AnyArray, Array, Numbers, Reals

_SIZES = (1e-6, 1e-3, 1.0)
"""Sizes of the motions at which a force function is tested."""
_TRIED = [np.array([-1.3, -0.4, 0.7, 1.1]), np.array([0.9, -0.8, 0.5, -1.2]), np.array([0.6, 1.4, -0.3, -0.9])]
_STEP = 1e-30
"""Imaginary part of a complex step: a derivative without cancellation (J. N. Lyness and C. B. Moler, 1967)."""


@dataclass(frozen=True, kw_only=True)
class SampledLaw(Law):
    """A smooth force law ``force(q, velocity, **parameters)``, evaluated at equidistant times of the period.

    Parameters
    ----------
    force
        Force that resists the motion. With one port ``q`` and ``velocity`` are arrays of any shape, and so is the
        result; with several they are tuples of such arrays, one for each port, and so is the result. It is called with
        complex arrays too: use numpy functions that are analytic (no ``abs``, ``max``, ``sign``, comparisons).
    parameters
        Its parameters by name: numbers, or arrays (n,) for n elements.
    ports
        Names of the ports.
    samples
        Times in a period; by default 16 for each order of the highest harmonic. A polynomial of degree ``d`` in the
        motion is integrated exactly from ``(d + 1) m_n + 1`` on. Where
        forces are wanted in more harmonics than those kept, as many more are taken.

    Raises
    ------
    InputError
        For a force that is no function, parameters that are not finite, ports without names, or too few samples.

    Examples
    --------
    A cubic spring:

    >>> import numpy as np
    >>> spring = SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": 0.5}, ports=("x",))
    >>> motion = Motion(Harmonics([0, 1]), 1.0, (np.array([[0.0, 2.0, 0.0]]),), np.zeros((1, 1)))
    >>> float(spring.respond(motion, {"k3": np.array([0.5])}).force[0][0, 1].round(12))     # 3/4 k3 a^3 cos
    3.0
    """

    force: Callable[..., Any]
    parameters: Mapping[str, Reals] = field(default_factory=dict)
    ports: tuple[str, ...] = ("x",)
    samples: int | None = None

    def __post_init__(self) -> None:
        checks = Gathering()
        values: dict[str, Any] = {
            "parameters": checks.take(_parameters, self.parameters),
            "ports": checks.take(_ports, self.ports),
            "samples": None if self.samples is None else checks.take(whole, "law samples", self.samples, 4, MOST_ITEMS),
        }
        if not checks.faults:
            checks.take(_callable, self.force, values["parameters"])
        checks.end()
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def warnings(self, values: Mapping[str, float], ports: set[str], approach: float) -> Iterator[str]:
        """Report where complex steps do not give the derivative of the force: the function is not analytic."""
        del ports, approach
        if not _known_somewhere(self, values):
            raise InputError(
                "law force: it is not a finite number at any motion that was tried, 0 to 1 in size; check the function "
                "and its parameters"
            )
        for size in _SIZES:
            q, rate = [size * t for t in _TRIED[: len(self.ports)]], [size * t for t in _TRIED[-len(self.ports) :]]
            if not _differentiable(self, q, rate, values):
                yield (
                    "the derivative of its law by complex steps is not the slope of its force; use numpy functions "
                    "that are analytic: no abs, real, sign, max, no comparison"
                )
                return

    @default
    def kind(self) -> tuple[Hashable, ...]:
        """Laws with the same function are computed together."""
        return self.force, self.ports, self.samples

    @default
    def values(self) -> Mapping[str, Numbers]:
        """Every parameter by name."""
        return cast(Mapping[str, Numbers], self.parameters)

    def changed(self, /, **values: Reals) -> SampledLaw:
        """A copy with other parameters."""
        return replace(self, parameters={**self.parameters, **values})

    def widened(self, narrow: Harmonics, wide: Harmonics) -> SampledLaw:
        """The law for forces in ``wide`` at motions in ``narrow``, sampled as finely for these as before."""
        if self.samples is None:
            return self
        more = self.samples + max(0, wide.highest - narrow.highest)
        return replace(self, samples=max(more, 4 * wide.highest + 1))

    def respond(self, motion: Motion, values: Mapping[str, Array]) -> Response:
        """Forces and derivatives of n elements whose parameters are ``values``, (n,) each."""
        return _Sampled(self, motion, values, _times(self, motion.harmonics)).response()

    def respond_resolved(
        self, motion: Motion, values: Mapping[str, Array], edges: Edges, slopes: Slopes | None = None
    ) -> Response:
        """As ``respond``, with samples graded to where the force of a contact changes fast, and none where it is open.

        ``edges`` gives phases (k,) of one element at which panels of integration end: where the force has corners, and
        graded to where it nearly jumps; and the jumps, if any. Panels are divided until each resolves the force. The
        error of the coefficients is about 1e-9 of the largest force; a warning is given where ``MOST_PANELS`` are too
        few.
        """
        elements = [one_element(motion, values, e) for e in range(len(motion.Q[0]))]
        responses = [_resolved(self, own, at, *edges(own, at), slopes).response() for own, at in elements]
        if len(responses) == 1:
            return responses[0]

        def joined(name: str) -> dict[Any, Array]:
            return {
                key: np.concatenate([getattr(r, name)[key] for r in responses]) for key in getattr(responses[0], name)
            }

        def by_parameter(name: str) -> ByPort:
            parts = [r.by_parameter(name) for r in responses]
            return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}

        return Response(
            force=tuple(np.concatenate(parts) for parts in zip(*(r.force for r in responses), strict=True)),
            by_motion=joined("by_motion"), by_drift=joined("by_drift"), by_omega=joined("by_omega"),
            by_parameter=by_parameter, values=values, work=np.concatenate([r.work for r in responses]),
        )  # fmt: skip

    def rate(self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Forces at motion and velocity; there is no memory."""
        del memory
        forces = _called(self, list(q), list(velocity), dict(values))
        return np.array([np.real(f) for f in forces]), np.zeros((0, *q.shape[1:]))

    def time_slopes(
        self, q: Array, velocity: Array, memory: Array, values: Mapping[str, Array], scale: tuple[float, float]
    ) -> TimeSlopes:
        """Derivatives of the force, exact by complex steps."""
        del scale
        columns = []
        for argument, j in ((a, j) for a in (0, 1) for j in range(len(q))):
            moved = [list(q.astype(complex)), list(velocity.astype(complex))]
            moved[argument][j] = moved[argument][j] + 1j * _STEP
            columns.append(np.array([np.imag(f) for f in _called(self, moved[0], moved[1], dict(values))]) / _STEP)
        force, rates = self.rate(q, velocity, memory, values)
        return TimeSlopes(np.stack(columns, axis=1), force, rates)

    def forces_in_time(self, motion: Motion, values: Mapping[str, Array], tau: Array) -> tuple[Array, ...]:
        """Forces (n, k) at phases (k,), for each port: those of the function itself."""
        at = _Sampled(self, motion, values, tau)
        return tuple(np.array(np.real(f)) for f in at.force(at.q, at.rate, at.values))


def _times(law: SampledLaw, harmonics: Harmonics) -> Array:
    """Equidistant phases at which the law is sampled."""
    times = law.samples or 16 * max(harmonics.highest, 1)
    if times < 4 * harmonics.highest + 1:  # a law linear in the motion alone needs half of that
        raise InputError(
            f"law samples: found {times} with harmonics up to {harmonics.highest}; expected at least "
            f"{4 * harmonics.highest + 1}: (degree of the law + 1) times the highest harmonic, plus 1"
        )
    return np.asarray(np.arange(times) * (2.0 * np.pi / times), dtype=float)


def _callable(force: Any, parameters: Mapping[str, Any]) -> None:
    """InputError unless it is a function that takes motion, velocity and the parameters."""
    if not callable(force):
        raise wrong("law force", force, "a function force(q, velocity, **parameters)")
    try:
        signature(force).bind(None, None, **parameters)
    except TypeError as error:
        raise InputError(
            f"law force: cannot be called as force({', '.join(['q', 'velocity', *parameters])}): {error}"
        ) from None
    except ValueError:  # a function without a signature
        return


def _parameters(parameters: Any) -> dict[str, Any]:
    checks = Gathering()
    named = table("law parameters", parameters, 'values by name such as {"k3": 0.5}')
    values = {name: checks.take(number_or_numbers, f"law parameter {name}", v) for name, v in named.items()}
    checks.end()
    same_length("law parameters", values)
    return values


def _ports(value: Any) -> tuple[str, ...]:
    ports = names("law ports", value, 'names of ports such as ("x",)')
    if not ports or len(set(ports)) < len(ports) or not all(ports):
        raise wrong("law ports", value, "at least one name, each once")
    return ports


def _differentiable(law: SampledLaw, q: list[Array], rate: list[Array], values: Mapping[str, float]) -> bool:
    """Whether complex steps and central differences agree along one direction in motion and velocity."""

    def at(step: complex) -> list[AnyArray]:
        moved, speed = ([value * (1.0 + step) for value in both] for both in (q, rate))
        one = len(q) == 1
        returned = law.force(moved[0] if one else tuple(moved), speed[0] if one else tuple(speed), **values)
        return _arrays((returned,) if one else returned, len(q), moved[0].shape)

    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        slopes = [np.imag(f) / _STEP for f in at(1j * _STEP)]
        differences = [(np.real(b) - np.real(a)) / 2e-6 for a, b in zip(at(-1e-6), at(1e-6), strict=True)]
    for slope, difference in zip(slopes, differences, strict=True):
        size = np.maximum(np.abs(slope), np.abs(difference))
        known = np.isfinite(size)
        if np.any(np.abs(slope - difference)[known] > 1e-3 * size.max(initial=0.0, where=known)):
            return False
    return True


def _known_somewhere(law: SampledLaw, values: Mapping[str, float]) -> bool:
    """Whether the force is a finite number for at least one of the test motions."""
    one = len(law.ports) == 1
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for size in (0.0, *_SIZES):
            q, rate = [size * t for t in _TRIED[: len(law.ports)]], [size * t for t in _TRIED[-len(law.ports) :]]
            returned = law.force(q[0] if one else tuple(q), rate[0] if one else tuple(rate), **values)
            if any(np.any(np.isfinite(f)) for f in _arrays((returned,) if one else returned, len(q), q[0].shape)):
                return True
    return False


def _arrays(returned: Any, ports: int, shape: tuple[int, ...]) -> list[AnyArray]:
    """Results of a force as arrays of a shape, one for each port; InputError for other results."""
    if not isinstance(returned, tuple | list) or len(returned) != ports:
        raise InputError(
            f"law force: returned {shown(returned)}; expected a tuple of {ports} arrays, one for each port"
        )
    try:
        arrays = [f if np.shape(f) == shape else np.broadcast_to(f, shape) for f in map(np.asarray, returned)]
    except ValueError:
        shapes = [np.shape(f) for f in returned]
        raise InputError(
            f"law force: returned shapes {shapes} for motions of shape {shape}; expected the same shape"
        ) from None
    if any(a.dtype.kind not in "biufc" for a in arrays):
        shows = shown(returned[0] if ports == 1 else returned)
        raise InputError(f"law force: returned {shows}; expected arrays of numbers")
    return arrays


def _called(law: SampledLaw, q: list[AnyArray], velocity: list[AnyArray], values: Mapping[str, Any]) -> list[AnyArray]:
    """Results of the force function at each port."""
    if len(q) == 1:
        return _arrays((law.force(q[0], velocity[0], **values),), 1, q[0].shape)
    return _arrays(law.force(tuple(q), tuple(velocity), **values), len(q), q[0].shape)


class _Sampled:
    """One evaluation: motion at phases ``tau`` (times,), and the transforms to and from coefficients.

    ``weights`` (times,) of an integral over the period; those of equidistant times by default. ``slopes`` of the force
    by motion and velocity; by default by complex steps. ``jumps`` of the force of a single element.
    """

    def __init__(
        self,
        law: SampledLaw,
        motion: Motion,
        values: Mapping[str, Array],
        tau: Array,
        weights: Array | None = None,
        slopes: Slopes | None = None,
        jumps: Jumps | None = None,
    ) -> None:
        h = motion.harmonics
        self.jumps = jumps
        self.law, self.motion, self.given, self.known = law, motion, values, slopes
        self.omega = np.reshape(motion.omega, (-1, 1))
        self.basis = h.H_minus(tau)
        self.slope = _basis_slope(h, self.basis)
        self.weights = np.full(tau.size, 2.0 * np.pi / tau.size) if weights is None else weights
        self.project = (self.weights / np.pi)[:, None] * self.basis
        self.project[:, 0] *= 0.5
        self.values = {name: np.asarray(value, dtype=float)[:, None] for name, value in values.items()}
        self.q = [X @ self.basis.T for X in motion.Q]
        # velocity in time: omega times the derivative by phase, the drift included
        self.rate = [X @ self.slope.T + d[:, None] for X, d in zip(motion.Q, motion.drift, strict=True)]

    def force(self, q: list[AnyArray], rate: list[AnyArray], values: Mapping[str, Array]) -> list[AnyArray]:
        """Forces in time at each port, (n, times)."""
        return _called(self.law, q, [self.omega * r for r in rate], values)

    def slopes(self, q: list[AnyArray], rate: list[AnyArray], values: Mapping[str, Array]) -> list[Array]:
        """Derivatives in time at each port, from arguments with one imaginary step among them."""
        return [np.ascontiguousarray(np.imag(f)) / _STEP for f in self.force(q, rate, values)]

    def coefficients(self, force: Array) -> Array:
        """(n, times) -> (n, L)."""
        return np.asarray(force @ self.project, dtype=float)

    def response(self) -> Response:
        """Forces with all derivatives."""
        force = [np.real(f) for f in self.force(self.q, self.rate, self.values)]
        if self.known is None:
            stiffness, damping = self._tangents(self.q), self._tangents(self.rate)
        else:
            stiffness, damping = self.known(self.q, [self.omega * r for r in self.rate], self.values)
            damping = {key: self.omega * slope for key, slope in damping.items()}
        work = sum(f * r for f, r in zip(force, self.rate, strict=True)) @ self.weights / (2.0 * np.pi)
        return Response(
            force=tuple(self.coefficients(f) for f in force),
            by_motion={key: self._by_motion(key, stiffness[key], damping[key]) for key in stiffness},
            by_drift={key: self.coefficients(value) for key, value in damping.items()},
            by_omega=self._by_omega(damping),
            by_parameter=self._by_parameter,
            values=self.given,
            work=np.asarray(work, dtype=float),
        )

    def _tangents(self, argument: list[Array]) -> dict[tuple[int, int], Array]:
        """``(i, j) -> df_i/dargument_j`` in time, (n, times)."""
        slopes = {}
        for j in range(len(argument)):
            stepped = [value + 1j * _STEP * (k == j) for k, value in enumerate(argument)]
            q, rate = (stepped, self.rate) if argument is self.q else (self.q, stepped)
            for i, slope in enumerate(self.slopes(q, rate, self.values)):
                slopes[i, j] = slope
        return slopes

    def _by_motion(self, key: tuple[int, int], stiffness: Array, damping: Array) -> Array:
        """``int H_+ (k H_-^T + c H_-'^T)`` for every element, (n, L, L); jumps move with the motion."""
        moved = stiffness[:, :, None] * self.basis + damping[:, :, None] * self.slope
        out = np.asarray(self.project.T @ moved, dtype=float)
        if self.jumps is not None and key in self.jumps.by_motion:
            h, tau = self.motion.harmonics, self.jumps.tau
            out += (h.H_plus(tau).T / np.pi * self.jumps.by_motion[key]) @ h.H_minus(tau)
        return out

    def _by_omega(self, damping: Mapping[tuple[int, int], Array]) -> dict[int, Array]:
        slopes: dict[int, Array] = {}
        for (i, j), slope in damping.items():
            part = self.coefficients(slope * self.rate[j] / self.omega)
            add_to(slopes, i, part)
        return slopes

    def _by_parameter(self, name: str) -> ByPort:
        stepped = {**self.values, name: self.values[name] + 1j * _STEP}
        out = {i: self.coefficients(slope) for i, slope in enumerate(self.slopes(self.q, self.rate, stepped))}
        if self.jumps is not None and name in self.jumps.by_parameter:
            at = self.motion.harmonics.H_plus(self.jumps.tau).T / np.pi
            for i, part in self.jumps.by_parameter[name].items():
                out[i] = out[i] + at @ part
        return out


_TOO_MANY = (
    "a contact force changes too fast in time to integrate it as accurately as asked; check the parameters of the "
    "contacts"
)
ByPorts = dict[tuple[int, int], Array]
Slopes = Callable[[list[Array], list[Array], Mapping[str, Array]], tuple[ByPorts, ByPorts]]
"""Of motion and velocity in time, (n, times) for each port, and parameters (n, 1): ``(i, j) -> df_i/dq_j``, and those
by the velocities."""


class Jumps(NamedTuple):
    """Jumps in time of the force of one element, at phases ``tau`` (k,) that depend on its motion.

    What they add to the derivative of a coefficient, ``-(1/pi) sum H_+(tau) [f_i] dtau``: the jump of the force, from
    before ``tau`` to after, times the rate at which its phase moves.
    """

    tau: Array
    by_motion: ByPorts
    """``(i, j) -> -[f_i] dtau/dq_j``, (k,)."""
    by_parameter: Mapping[str, Mapping[int, Array]]
    """Of the parameters that ``tau`` depends on: ``i -> -[f_i] dtau/dparameter``, (k,)."""


Edges = Callable[[Motion, Mapping[str, Array]], tuple[Array, Jumps | None]]
MOST_PANELS = 5_000
"""Panels of one element."""
_RESOLVED = 1e-10
"""Error of a panel over the largest force, times its share of the period."""
_PARTS = 2
"""Parts of a panel that does not resolve the force."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)
_SERIES = np.linalg.inv(np.polynomial.legendre.legvander(_NODES, 9))
_MIDDLE, _LAST = _SERIES[4:7].T.copy(), _SERIES[7:].T.copy()
"""Terms of a Legendre series through the values at the nodes."""


def one_element(motion: Motion, values: Mapping[str, Array], e: int) -> tuple[Motion, dict[str, Array]]:
    """Motion and parameters of one element among n."""
    one = slice(e, e + 1)
    omega = np.asarray(motion.omega)
    own = motion._replace(
        Q=tuple(X[one] for X in motion.Q), drift=motion.drift[:, one], omega=omega[one] if omega.ndim else motion.omega
    )
    return own, {name: np.asarray(value)[one] for name, value in values.items()}


def moving(motion: Motion) -> Callable[[Array], tuple[Array, Array]]:
    """Function of phases (k,) for the motion of one element and its derivative by phase, (ports, k) each."""
    h = motion.harmonics
    coefficients = np.concatenate(motion.Q)
    both = np.concatenate([coefficients, h.derivative(coefficients)])
    ports = len(coefficients)
    both[ports:, 0] = motion.drift[:, 0]

    def at(tau: Array) -> tuple[Array, Array]:
        out = both @ h.H_minus(tau).T
        return out[:ports], out[ports:]

    return at


def _resolved(
    law: SampledLaw,
    motion: Motion,
    values: Mapping[str, Array],
    edges: Array,
    jumps: Jumps | None,
    slopes: Slopes | None,
) -> _Sampled:
    """One element at nodes of Gauss's rule in panels that resolve its force."""
    ends = np.unique(np.concatenate([base_edges(motion.harmonics), edges % (2.0 * np.pi)]))
    starts, width = ends, np.diff(ends, append=2.0 * np.pi)
    columns = {name: np.asarray(value, dtype=float)[:, None] for name, value in values.items()}
    omega, path = np.reshape(motion.omega, (-1, 1)), moving(motion)
    kept: list[tuple[Array, Array]] = []
    size, total = 0.0, starts.size
    while starts.size:
        q, rate = path((starts[:, None] + 0.5 * width[:, None] * (1.0 + _NODES)).ravel())
        returned = _called(law, list(q[:, None]), list(omega * rate[:, None]), columns)
        force = np.stack([np.real(f).reshape(starts.size, -1) for f in returned])
        largest = np.abs(force).max(axis=(0, 2))
        size = max(size, float(largest.max(initial=0.0)))
        coarse = _errors(force) * width / (2.0 * np.pi) > _RESOLVED * size  # nan is not divided
        total += _PARTS * int(coarse.sum())
        if total > MOST_PANELS:
            warn([_TOO_MANY])
            coarse[:] = False
        acts = ~coarse & (largest != 0.0)
        kept.append((starts[acts], width[acts]))
        part = width[coarse] / _PARTS
        starts = (starts[coarse, None] + part[:, None] * np.arange(_PARTS)).ravel()
        width = np.repeat(part, _PARTS)
    begin, width = (np.concatenate(parts)[:, None] for parts in zip(*kept, strict=True))
    tau = (begin + 0.5 * width * (1.0 + _NODES)).ravel()
    return _Sampled(law, motion, values, tau, (0.5 * width * _WEIGHTS).ravel(), slopes, jumps)


def base_edges(harmonics: Harmonics) -> Array:
    """Phases at which panels begin that resolve the motion."""
    count = 4 * max(harmonics.highest, 1)
    return np.asarray(np.arange(count) * (2.0 * np.pi / count), dtype=float)


def _errors(force: Array) -> Array:
    """Errors (panels,) of the rule, from the values (ports, panels, nodes), by the decay of their Legendre series.

    The decay is extrapolated: the rule with n nodes is exact up to the term 2 n - 1.
    """
    last, middle = np.abs(force @ _LAST).max(axis=2), np.abs(force @ _MIDDLE).max(axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        fall = np.minimum(last / middle, 1.0)
    return np.asarray(np.where(last > 0.0, last * fall * fall, 0.0).max(axis=0))


def _basis_slope(harmonics: Harmonics, basis: Array) -> Array:
    """``dH_-/dtau`` (k, L) of ``H_-`` (k, L)."""
    out = np.zeros_like(basis)
    out[:, 1::2], out[:, 2::2] = -harmonics.m * basis[:, 2::2], harmonics.m * basis[:, 1::2]
    return out
