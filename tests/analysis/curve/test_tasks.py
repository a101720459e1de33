"""Tasks are what was asked for."""

import pytest
from helpers.stability import oscillator

import slipstick as ss
from slipstick.analysis.curve.tasks import frequency_task, parameter_task


def test_a_task_holds_the_range_and_what_varies() -> None:
    over_frequency = frequency_task(oscillator(1.0), (2.0, 5.0), (3.0,))
    assert (over_frequency.start, over_frequency.stop, over_frequency.requested) == (2.0, 5.0, (3.0,))
    over_velocity = parameter_task(oscillator(1.0), "damper.velocity", (1.0, 2.0), 4.0)
    assert (over_velocity.parameter, over_velocity.omega, over_velocity.stability) == ("damper.velocity", 4.0, None)


def test_all_faults_come_at_once() -> None:
    with pytest.raises(ss.InputError) as caught:
        parameter_task(oscillator(1.0), "damper.none", (1.0, 1.0), -4.0)
    assert len(caught.value.faults) >= 2
