"""What is sought in measured numbers, checked once: parameters, their starts and bounds, the noise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.identification.decays import decay_of
from slipstick.analysis.identification.kinds import Backbone, Measured
from slipstick.analysis.identification.measured import dataset_of, parameter_starts, read_measured
from slipstick.analysis.identification.noise import given_noise
from slipstick.analysis.identification.predicted import Predictor, predictor_of
from slipstick.analysis.road.events import EventFunction, Working
from slipstick.analysis.road.request import followed_problem, heard_by
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, number, numbers, shown, suggestion, whole, wrong
from slipstick.results.sensitivities import direction_of
from slipstick.typing import Array

_MOST, _MOST_IN_TIME = 200, 30
"""Largest number of evaluations in a descent, the second for motions that are integrated."""


@dataclass(frozen=True, kw_only=True)
class FitRequest:
    """A request for a fit, checked."""

    problem: Problem
    measured: Measured
    names: tuple[str, ...]
    starts: tuple[Array, ...]
    low: Array
    high: Array
    noise: Array | None
    """Standard deviations, of the shape of the measured numbers."""
    relative: float | None = None
    """Given noise over each number, in addition to ``absolute``."""
    absolute: Array | None = None
    found: bool = False
    """Whether ``noise`` was found in the residuals."""
    listeners: tuple[EventFunction, ...] = ()
    kept: list[Any] = field(default_factory=list, compare=False)
    """Request and end of the best step so far, for an interrupted fit; shared with all requests made of this one."""

    def tell(self, place: int | None, evaluations: int) -> None:
        """Send an event about an evaluation of the descent from start ``place``; None: of a reweighted fit."""
        count = len(self.starts)
        doing = "fitting again" if place is None else f"fitting from start {place + 1} of {count}"
        event = Working(
            doing=doing, points=0, evaluations=evaluations, progress=1.0 if place is None else place / count
        )
        for listener in self.listeners:
            listener(event)

    @property
    def known(self) -> bool:
        """Whether the noise was given."""
        return self.noise is not None and not self.found

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Mask of the fitted numbers."""
        used = np.isfinite(self.measured.values)
        return np.asarray(used if self.noise is None else used & np.isfinite(self.noise))

    @cached_property
    def data(self) -> Array:
        """Fitted numbers (m,)."""
        return np.asarray(self.measured.values[self.used])

    @cached_property
    def scale(self) -> Array:
        """Divisors of the fitted numbers: their noise, or their size without known noise."""
        if self.noise is not None:
            return np.asarray(self.noise[self.used])
        return self.measured.scale(self.used)

    @property
    def most(self) -> int:
        """Largest number of evaluations in a descent; each integration of motions takes seconds."""
        return _MOST_IN_TIME if self.measured.in_time else _MOST

    def left(self, predicted: Array) -> Array:
        """Residuals over the noise, (m,)."""
        return np.asarray((predicted[self.used] - self.data) / self.scale)

    def misfit(self, left: Array) -> float:
        """Root mean square of the residuals without their weights, over that of the measurement."""
        sizes = self.measured.sizes[self.used]  # frequencies and amplitudes, each by its own size
        wrong, size = left * self.scale / sizes, self.data / sizes
        return float(np.sqrt(np.mean(wrong**2))) / (float(np.sqrt(np.mean(size**2))) or 1.0)

    def predictor(self) -> Predictor:
        """A new predictor."""
        return predictor_of(self.problem, self.names, self.measured)


def fit_in_time(request: FitRequest, measured: Any, noise: float | None) -> FitRequest | None:
    """What is sought in the time series of a free decay; None for all else, and where it is not simulated."""
    mode = request.measured
    if not isinstance(mode, Backbone) or mode.kind != "mode":
        return None
    data = dataset_of(request.problem, measured)
    if "time" not in data.variables:
        return None
    decay = decay_of(request.problem, data, mode.dof, float(mode.omega[0]))
    if decay is None:
        return None
    spread = decay.noise if noise is None else np.full(decay.values.shape, float(noise))
    if request.relative is not None:  # a displacement that passes zero has the noise of the others
        share = request.relative * float(np.sqrt(np.nanmean(decay.values**2)))
        spread = np.full(decay.values.shape, share) if spread is None else np.hypot(spread, share)
    return replace(request, measured=decay, noise=spread, relative=None, absolute=None)


def fit_request(
    problem: Any,
    measured: Any,
    parameters: Any,
    bounds: Any,
    noise: Any,
    relative: Any,
    starts: Any,
    seed: Any,
    listeners: Any = (),
) -> FitRequest:
    """What is asked for, checked; InputError with all faults."""
    problem = followed_problem(problem)
    values = parameter_starts(problem, parameters)
    names, checks = tuple(values), Gathering()
    table = checks.take(read_measured, problem, measured)
    checks.take(_independent, problem, names)
    low, high = checks.take(_bounds, problem, bounds, values) or (np.empty(0), np.empty(0))
    heard = checks.take(heard_by, listeners)
    count, seed = checks.take(whole, "starts", starts, 1, 10_000), checks.take(whole, "seed", seed)
    if noise is not None:
        noise = checks.take(number, "noise", noise, "a standard deviation > 0", above=0.0)
        if noise == 0.0:
            checks.faults.append(Fault("noise", "0", expected="a standard deviation > 0"))
    if relative is not None:
        relative = checks.take(number, "relative_noise", relative, "a share > 0 such as 0.01", above=0.0)
        if relative is not None and not 0.0 < relative < 1.0:
            remedy = "for 1 % give 0.01" if relative >= 1.0 else ""
            checks.faults.append(
                Fault("relative_noise", f"{relative:g}", expected="a share between 0 and 1", remedy=remedy)
            )
    if count is not None and count > 1 and low.size and not np.all(np.isfinite([low, high])):
        unbound = [name for name, a, b in zip(names, low, high, strict=True) if not np.isfinite(b - a)]
        checks.faults.append(
            Fault("bounds", f"{', '.join(unbound)} has none", expected="bounds of all where there are several starts")
        )  # fmt: skip
    if table is not None:
        for name in set(names) & set(table.conditions):
            checks.faults.append(
                Fault(
                    ("parameters", name), "is measured too: it was set at every point",
                    remedy="leave it out of one of them",
                )
            )  # fmt: skip
    checks.end()
    assert table is not None
    spread = table.noise
    if noise is not None:
        spread = np.full(table.values.shape, noise) * table.sizes
    if spread is not None and np.any(spread[np.isfinite(spread)] <= 0.0):
        raise InputError(Fault(("measured", "noise"), "0 or less", expected="standard deviations > 0"))
    absolute = spread
    if relative is not None:
        spread = given_noise(table, np.nan_to_num(table.values), absolute, relative).deviations
    request = FitRequest(
        problem=problem, measured=table, names=names, low=low, high=high, noise=spread, relative=relative,
        absolute=absolute,
        starts=tuple(spread_starts(np.array(list(values.values())), low, high, count or 1, seed or 0)),
        listeners=heard or (),
    )  # fmt: skip
    if request.data.size < len(names):
        few = f"{request.data.size} numbers"
        raise InputError(Fault("measured", few, expected=f"at least {len(names)}, one for each parameter"))
    if not np.any(np.abs(request.data) > SMALLEST):
        nothing = f"all {request.data.size} measured numbers are 0"
        remedy = "check which column was read, and whether the sensor was connected"
        raise InputError(Fault("measured", nothing, expected="a vibration", remedy=remedy))
    return request


def spread_starts(first: Array, low: Array, high: Array, count: int, seed: int) -> Iterator[Array]:
    """The start given, then others spread over the bounds, over their logarithm where these are > 0."""
    from scipy.stats import qmc

    yield first
    if count > 1:
        decades = low > 0.0
        a, b = (np.where(decades, np.log(np.where(decades, side, 1.0)), side) for side in (low, high))
        for share in qmc.Halton(len(first), seed=seed).random(count - 1):
            at = a + share * (b - a)
            yield np.where(decades, np.exp(np.where(decades, at, 0.0)), at)


def _bounds(problem: Problem, bounds: Any, values: Mapping[str, float]) -> tuple[Array, Array]:
    given = {} if bounds is None else bounds
    if not isinstance(given, Mapping):
        raise wrong("bounds", bounds, 'lowest and highest values by name such as {"damper.mu": (0.05, 1.0)}')
    checks = Gathering()
    for name in given:
        if name not in values:
            known = f"{shown(name)} is not among the parameters"
            checks.faults.append(Fault("bounds", known, remedy=suggestion(str(name), list(values))))
    low, high = [], []
    for name, value in values.items():
        ends = given.get(name)
        if ends is None:
            low.append(0.0 if value > 0.0 and not _may_be(problem, name, -value) else -np.inf)
            high.append(np.inf)
            continue
        pair = checks.take(numbers, ("bounds", name), ends, "two numbers, the lowest and the highest")
        if pair is None:
            pair = np.array([-np.inf, np.inf])
        elif pair.shape != (2,) or not pair[0] < pair[1]:
            checks.faults.append(Fault(("bounds", name), shown(ends), expected="two numbers, the lowest first"))
            pair = np.array([-np.inf, np.inf])
        elif not pair[0] <= value <= pair[1]:
            checks.faults.append(
                Fault(("parameters", name), f"{value:g}", expected=f"a start within its bounds {pair}")
            )
        low.append(float(pair[0]))
        high.append(float(pair[1]))
    checks.end()
    return np.array(low), np.array(high)


def _may_be(problem: Problem, name: str, value: float) -> bool:
    try:
        problem.at_parameter(name, value)
    except InputError:
        return False
    return True


_MOVED = 1.01


def _independent(problem: Problem, names: Sequence[str]) -> None:
    """InputError where one of the parameters moves another, as a normal stiffness does the load at a fixed gap."""
    checks = Gathering()
    for name in names:
        checks.inside((name,), direction_of, problem, name)
        value = problem.parameter(name)
        moved = problem.at_parameter(name, _MOVED * value if value else 1.0)
        for other in names:
            before = problem.parameter(other)
            if other != name and abs(moved.parameter(other) - before) > 1e-9 * abs(before):
                remedy = "seek one of them" if name[-3:] != ".kn" else "seek the gap instead of the load"
                checks.faults.append(Fault((name,), f"moves {other} too", expected="independent ones", remedy=remedy))
    checks.end("parameters")
