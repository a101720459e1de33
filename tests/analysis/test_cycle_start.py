"""The vibration at a Hopf point, and the first limit cycle beside it."""

import numpy as np
import pytest
from helpers.stability import at_the_hopf_point, brake

from slipstick.analysis.cycle_system import CycleSystem


def test_sticking_begins_at_the_size_of_a_closed_form():
    """Slip ends where kt (x' + v) = mu kn y': the rates of harmonic 1 have a largest value."""
    _, hopf, _, start = at_the_hopf_point(brake())
    x, y = hopf.shapes[:, hopf.pairs[0]] / np.linalg.norm(hopf.shapes[:, hopf.pairs[0]])
    largest = 200.0 / (10.0 * abs(200.0 * x - hopf.value * 40.0 * y))
    assert start.largest == pytest.approx(largest, rel=1e-9)
    # of a load so small that the pad lifts off before
    _, hopf, rest, start = at_the_hopf_point(brake(load=1.0))
    assert start.largest == pytest.approx(rest[21] / abs(y), rel=1e-9)


def test_up_to_there_the_pair_solves_the_balance_and_beyond_it_does_not():
    request, hopf, rest, start = at_the_hopf_point(brake())
    system = CycleSystem(request.space, start.phase)
    left = [
        np.abs(system.evaluate(np.append(rest + part * start.largest * start.motion, hopf.omega), hopf.value).residual)
        for part in (0.1, 0.999, 1.2)
    ]
    assert max(left[0].max(), left[1].max()) < 1e-10
    assert left[2].max() > 1e-5


def test_the_first_cycle_is_a_little_larger():
    request, hopf, _, start = at_the_hopf_point(brake())
    step = start.first(CycleSystem(request.space, start.phase), request.span)
    assert 1.0 < start.size(step.x[:-1]) / start.largest < 1.2
    assert hopf.value < step.parameter < hopf.value + 0.01


def test_no_first_cycle_outside_the_range():
    request, hopf, _, start = at_the_hopf_point(brake())
    assert start.first(CycleSystem(request.space, start.phase), (hopf.value - 0.1, hopf.value)) is None
