"""Tracked peaks of random oscillators against walks of many small steps from each point to the next."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.peaks.continuation import PeakPoint
from slipstick.analysis.peaks.system import PeakSystem
from slipstick.analysis.peaks.tracking import tracked_peak
from slipstick.solve.newton import NewtonOptions, newton
from slipstick.solve.norm import norm
from slipstick.typing import Array

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
_NEWTON = NewtonOptions(max_iterations=20, min_damping=0.25, patience=4, non_monotone=2)
_SMALL = 0.01
"""Change of motion, and of ten times the frequency, that a small step makes at most."""
_APART = 0.03
"""The same from where walks from both sides end, above which these are two peaks."""
_MOST = 40
"""Steps of a tracked peak that are looked at: a few cases have hundreds."""
_FAST = (121,)


def request(seed: int) -> tuple[ss.Problem, str, tuple[float, float]]:
    """One or two masses with a rubbing contact, a parameter and its range."""
    rng = np.random.default_rng([77, seed])
    damping, K = 10.0 ** rng.uniform(-1.3, 0.0), np.array([[40.0]])
    M = np.eye(1)
    if seed % 2:
        spring = 40.0 * 10.0 ** rng.uniform(-1.0, 0.5)
        M = np.diag([1.0, rng.uniform(0.3, 2.0)])
        K = np.array([[40.0 + spring, -spring], [-spring, spring + rng.uniform(0.0, 40.0)]])
    structure = ss.MatrixStructure(M=M, C=damping * np.eye(len(M)), K=K, dofs=["x", "y"][: len(M)])
    kt, mu = 40.0 * 10.0 ** rng.uniform(-0.7, 1.0), rng.uniform(0.1, 0.6)
    contact = ss.FrictionContact(kt=kt, mu=mu, normal_load=10.0 ** rng.uniform(1.5, 3.0))
    velocity = rng.choice([0.0, 1.0]) * 10.0 ** rng.uniform(-0.5, 2.0)
    cos = {2: float(rng.normal())} if rng.random() < 0.3 else {}
    rubbing = ss.RubbingMotion(velocity=velocity, cos=cos)
    pair = ss.ContactPair(name="damper", tangential="x", contact=contact, rubbing=rubbing)
    loads = [ss.Load(dof="x", sin=100.0)]
    if rng.random() < 0.4:
        order, sin, cosine = int(rng.choice([2, 3])), rng.uniform(10.0, 80.0), rng.uniform(-50.0, 50.0)
        loads.append(ss.Load(dof="x", harmonic=order, sin=sin, cos=cosine))
    problem = ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(8))
    if rng.integers(2) == 0:
        first, last = 10.0 ** rng.uniform(1.2, 3.2, 2)
        return problem, "damper.normal_load", (float(first), float(last))
    first = rng.uniform(0.0, 60.0)
    return problem, "damper.velocity", (first, first + float(rng.choice([-1, 1])) * rng.uniform(10.0, 80.0))


def change(system: PeakSystem, before: Array, after: Array) -> float:
    """Of the vibration and of ten times the frequency, relative; the mean may change its side where rubbing does."""
    vibration = np.arange(before.size - 1) % system.balance.L > 0
    motion = norm((after - before)[:-1][vibration]) / norm(before[:-1][vibration])
    return float(motion + 10.0 * abs(after[-1] / before[-1] - 1.0))


def walked(system: PeakSystem, begin: PeakPoint, stop: float) -> tuple[Array, bool]:
    """Where the maximum at a point goes to by small steps, and whether it came to ``stop``."""
    y, context, value, step = begin.y, begin.context, begin.parameter, (stop - begin.parameter) / 12.0
    least = abs(step) / 20000.0
    while value != stop and abs(step) >= least:
        at = stop if abs(stop - value) <= abs(step) * (1.0 + 1e-9) else value + step
        scale = np.append(np.full(y.size - 1, norm(y[:-1])), y[-1])
        result = newton(lambda z, at=at, near=context: system.evaluate(z, at, near), y, options=_NEWTON, scale=scale)
        moved = change(system, y, result.x) if result.converged else np.inf
        same = result.converged and result.evaluation.detail.bend < 0.0
        if not same or moved > _SMALL:
            step *= 0.5
            continue
        y, value, context = result.x, at, result.evaluation.context
        step *= 2.0 if moved < 0.25 * _SMALL else 1.0
    return y, value == stop


def jumps(problem: ss.Problem, name: str, low: PeakPoint, high: PeakPoint) -> bool:
    """Whether maxima of whole curves jump between two points: by halves, however close they come."""
    ends = [(point.parameter, float(point.y[-1])) for point in (low, high)]
    window, far = (0.97 * min(w for _, w in ends), 1.03 * max(w for _, w in ends)), abs(ends[1][1] - ends[0][1])
    for _ in range(8):
        (p, v), (q, w) = ends
        d = ss.forced_response(problem.with_parameter(name, 0.5 * (p + q)), omega=window, peaks_of="x").dataset
        maxima = d.omega.values[d.kind.values == "peak"]
        middle = 0.5 * (p + q), float(min(maxima, key=lambda each, between=0.5 * (v + w): abs(each - between)))
        ends = [ends[0], middle] if abs(middle[1] - v) > abs(w - middle[1]) else [middle, ends[1]]
    return abs(ends[1][1] - ends[0][1]) > 0.3 * far


def gone_over(seed: int) -> list[str]:
    """Steps of one part of a branch that small steps do not lead along."""
    problem, name, span = request(seed)
    run = tracked_peak(problem, name, span, (1.5, 22.0), (), "x", None).run()
    first, system = run.request.highest(run.system, run.request.start).y, run.system
    assert first is not None
    found, looked_at = [], 0
    for before, after in pairwise(run.continuation(*span).points(first)):
        ordinary = {before.kind, after.kind}.isdisjoint({"turning point", "tie", "corner"})
        one_peak = before.part == after.part and max(before.detail.bend, after.detail.bend) < 0.0
        if not (ordinary and one_peak) or before.parameter == after.parameter:
            continue
        looked_at += 1
        if looked_at > _MOST:
            break
        there, arrived = walked(system, before, after.parameter)
        off = change(system, there, after.y)
        if not arrived:  # at a kink they meet from the other side; where the peak sits on a change of state curves tell
            here, back = walked(system, after, before.parameter)
            off = change(system, here, before.y if back else there)
        if off > (1e-4 if arrived else _APART) and jumps(problem, name, before, after):
            found.append(f"{before.parameter:.6g} to {after.parameter:.6g}: {off:.2g}")
    return found


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=[] if s in _FAST else [pytest.mark.verify(sample=10)]) for s in range(150)]
)
def test_small_steps_lead_from_each_point_to_the_next(seed):
    assert gone_over(seed) == []
