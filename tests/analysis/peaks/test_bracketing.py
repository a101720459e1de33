from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.peaks.continuation import bracketed_peak
from slipstick.analysis.peaks.system import PeakSystem, StateSpace
from slipstick.balance.balance import Balance
from slipstick.balance.parameters import parameter_path
from slipstick.results.record import Outputs
from slipstick.verify.cases import oscillator


def test_a_peak_is_walked_to_and_narrowed():
    """From a state below the peak; smooth, so that the slope there is zero."""
    problem = oscillator()
    name = "damper.normal_load"
    outputs = Outputs(Balance(problem), ("x",))
    system = PeakSystem(StateSpace(outputs, problem.inputs, parameter_path(problem, name)))
    branch = ss.forced_response(problem, omega=(10.5, 10.6))
    found = bracketed_peak(system, 800.0, np.append(branch.guess(0).reshape(-1), 10.5), None)
    assert found.y[-1] == pytest.approx(10.7901272065, rel=1e-9)
    assert found.detail.amplitude == pytest.approx(3.3399400096, rel=1e-9)
    assert found.kind == "regular"
    assert found.residual < 1e-9
