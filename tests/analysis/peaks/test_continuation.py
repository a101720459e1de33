from __future__ import annotations

import numpy as np

from slipstick.analysis.peaks.continuation import NEWTON, PeakContinuation
from slipstick.analysis.peaks.system import PeakSystem, StateSpace
from slipstick.analysis.peaks.tracking import highest_peak
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.errors import Outcome
from slipstick.results.record import Outputs
from slipstick.solve.continuation import ContinuationOptions
from slipstick.verify.cases import oscillator


def test_points_come_one_by_one_and_the_end_says_how():
    problem = oscillator()
    space = StateSpace(Outputs(Balance(problem), ("x",)), problem.inputs, parameter_path(problem, "damper.normal_load"))
    system, options = PeakSystem(space), ContinuationOptions(max_step=0.5, first_step=0.5, newton=NEWTON)
    locus = PeakContinuation(system, (700.0, 800.0), (8.0, 12.0), options)
    first = highest_peak(space, 700.0, (8.0, 12.0), "x").y
    points = locus.points(first)
    start = next(points)
    assert (start.kind, start.parameter, locus.outcome) == ("start", 700.0, None)
    rest = list(points)
    assert (rest[-1].kind, rest[-1].parameter) == ("end", 800.0)
    assert locus.outcome is Outcome.COMPLETED
    assert np.all(np.diff([p.detail.amplitude for p in (start, *rest)]) > 0.0)
    assert locus.work.evaluations == system.factorisations
