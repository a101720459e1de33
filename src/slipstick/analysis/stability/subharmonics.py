"""Branches of motion with twice the period, which begin where the period doubles."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.analysis.curve.follow import CurveRequest, frequency_request, parameter_request
from slipstick.analysis.curve.slip_corners import StartingPoint
from slipstick.balance.problem import Problem
from slipstick.balance.scaling import scales
from slipstick.contact.rubbing import SECOND, SWEPT
from slipstick.errors import InputError
from slipstick.faults import warn
from slipstick.results.solutions import Solutions
from slipstick.results.stability import PERIOD_DOUBLING
from slipstick.results.view import analysis_of
from slipstick.solve.continuation.corrector import Corrector
from slipstick.solve.continuation.events import BranchEvent
from slipstick.solve.continuation.metric import Metric
from slipstick.solve.newton import NewtonOptions
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, BoolArray

_SIZES = (1e-2, 3e-2, 3e-3)
"""Sizes of the new harmonics over the motion at which the branch is started, in the order of trial."""

_VANISHED = 1e-3
"""Size of the new harmonics over the motion, below which the branch has returned to the single period."""


def doubled(problem: Problem) -> Problem:
    """The same problem with half the fundamental frequency: all orders doubled, and the odd ones between them."""
    even = [2 * m for m in problem.harmonics.orders]
    orders = sorted({*even, *range(1, max(even), 2)})
    loads = [replace(load, harmonic=2 * load.harmonic) for load in problem.loads]
    pairs = [
        pair if pair.rubbing is None else replace(pair, rubbing=_slower(pair.rubbing)) for pair in problem.contacts
    ]
    return replace(problem, harmonics=Harmonics(orders), loads=loads, contacts=pairs, told=None)


def _slower(rubbing: Any) -> Any:
    """The same rubbing motion in terms of half the frequency."""
    parts = {part: {2 * m: value for m, value in amplitudes.items()} for part, amplitudes in rubbing.parts.items()}
    swept = {name: 2.0 * np.asarray(rubbing.velocities[name]) for name in (SWEPT, SECOND + SWEPT)}
    return replace(rubbing, **swept, **parts)


def renamed(parameter: str) -> str:
    """A parameter's name with its order doubled.

    >>> renamed("load.x.1.amplitude"), renamed("rubbing.cos3"), renamed("damper.mu")
    ('load.x.2.amplitude', 'rubbing.cos6', 'damper.mu')
    """
    if parameter.startswith("load."):
        return re.sub(r"\.(\d+)\.(amplitude|phase)$", lambda match: f".{2 * int(match[1])}.{match[2]}", parameter)
    return re.sub(r"((?:cos|sin))(\d+)$", lambda match: f"{match[1]}{2 * int(match[2])}", parameter)


def subharmonic_response(branch: Solutions, point: int, *, stability: Any = True, **options: Any) -> Solutions:
    """As ``Branch.subharmonic``."""
    if analysis_of(branch.table) == "cycles":
        raise InputError("motion of twice the period is not followed from limit cycles: integrate in time")
    kind = str(branch.table["kind"].to_numpy()[point])
    if kind != PERIOD_DOUBLING:
        raise InputError(f"point {point} is a {kind} point; branch.bifurcations() lists where the period doubles")
    request = _request(branch, {**options, "stability": stability})
    x, value = _embedded(branch, request, point), float(branch.table[branch.followed].to_numpy()[point])
    value *= 1.0 if request.parameter else 0.5
    is_new = _new_unknowns(request)
    starting_point = _starting_point(request, x, value, is_new)
    if starting_point is None:
        raise InputError(f"no motion of twice the period was found beside point {point}; keep more harmonics")
    gone = BranchEvent(
        name="the period is the single one again", kind="end", terminal=True, direction=-1,
        function=lambda step: float(np.linalg.norm(step.x[is_new]) - _VANISHED * np.linalg.norm(step.x)),
    )  # fmt: skip
    return replace(request, starting_point=replace(starting_point, events=(gone,))).solutions()


def subharmonics_of(branch: Solutions, **options: Any) -> tuple[Solutions, ...]:
    """Branches from all points where the period doubles; a branch that ends at another such point comes once."""
    kinds, where = branch.table["kind"].to_numpy(), branch.table[branch.followed].to_numpy()
    branches: list[Solutions] = []
    for point in np.flatnonzero(kinds == PERIOD_DOUBLING).tolist():
        if any(_ends_at(other, float(where[point]), float(np.ptp(where))) for other in branches):
            continue
        try:
            branches.append(subharmonic_response(branch, point, **options))
        except InputError as error:
            warn(error.sentences)
    return tuple(branches)


def _ends_at(branch: Solutions, value: float, span: float) -> bool:
    """Whether a branch of twice the period ends at a value of the branch on which it began."""
    factor = 2.0 if branch.followed == "omega" else 1.0
    return abs(factor * float(branch.table[branch.followed].to_numpy()[-1]) - value) < 1e-3 * span


def _request(branch: Solutions, options: Mapping[str, Any]) -> CurveRequest:
    """The range of the branch, with half its frequencies."""
    problem, where = branch.problem, branch.table[branch.followed].to_numpy()
    if problem is None:
        raise InputError(f"the problem of this branch is not known: {branch.without}")
    ends = float(where.min()), float(where.max())
    if branch.followed == "omega":
        return frequency_request(doubled(problem), (0.5 * ends[0], 0.5 * ends[1]), **options)
    omega = 0.5 * float(branch.table["omega"].to_numpy()[0])
    name = renamed(str(branch.table.attrs["parameter"]))
    return parameter_request(doubled(problem), name, ends, omega, **options)


def _new_unknowns(request: CurveRequest) -> BoolArray:
    """Unknowns (N,) of the odd orders."""
    h = request.balance.harmonics
    one = np.concatenate([[False], np.repeat(h.m % 2 == 1, 2)])
    return np.asarray(np.tile(one, request.balance.n_ports))


def _embedded(branch: Solutions, request: CurveRequest, point: int) -> Array:
    """The unknowns of a point of the branch among those with twice the period."""
    X, h = branch.guess(point), request.balance.harmonics
    out = np.zeros((len(X), h.size))
    places = [0, *(h.index(2 * m, part) for m in branch.harmonics.orders[1:] for part in ("c", "s"))]
    out[:, places] = X
    return out.reshape(-1)


def _starting_point(request: CurveRequest, x: Array, value: float, is_new: BoolArray) -> StartingPoint | None:
    """A solution with a little of the new harmonics, at whatever value of the followed quantity it has."""
    direction = np.zeros(x.size + 1)
    direction[:-1] = _direction(request, x, value, is_new)
    metric = Metric(
        scales(request.balance, request.inputs, request.omega).arclength(), x, abs(request.stop - request.start)
    )
    for size in _SIZES:
        corrector = Corrector(request.system, x.size, metric, NewtonOptions())
        guess = np.append(x, value) + size * float(np.linalg.norm(x)) * direction
        normal = direction / metric.weights**2
        step, _ = corrector.correct(guess, normal, "start")
        inside = step is not None and min(request.start, request.stop) < step.parameter < max(
            request.start, request.stop
        )
        if step is not None and inside and np.linalg.norm(step.x[is_new]) > _VANISHED * np.linalg.norm(step.x):
            return StartingPoint(x=step.x, at=step.parameter, direction=step.tangent)
    return None


def _direction(request: CurveRequest, x: Array, value: float, is_new: BoolArray) -> Array:
    """The direction (N,) in which the balance is singular, by inverse iteration among the new harmonics."""
    jacobian = request.system.evaluate(x, value).jacobian
    direction = np.where(is_new, np.cos(np.arange(x.size)), 0.0)
    for _ in range(4):
        direction = np.where(is_new, jacobian.solve(direction), 0.0)
        direction /= np.linalg.norm(direction)
    return direction
