"""Step control: growth and shrinkage bounded, each measure alone decides where it is the worst."""

import pytest

from slipstick.errors import InputError
from slipstick.solve.continuation.step_control import StepOptions, next_step

OPTIONS = StepOptions(max_step=1.0, contraction=0.1, aimed_angle=0.2)


def after(contraction=1e-9, iterations=1, angle=1e-9, step=0.01, order=4):
    return (
        next_step(step, contraction=contraction, iterations=iterations, angle=angle, order=order, options=OPTIONS)
        / step
    )


def test_what_went_as_aimed_stays():
    assert after(contraction=0.1) == pytest.approx(1.0)
    assert after(angle=0.2) == pytest.approx(1.0)
    assert after() == 2.0
    assert after(contraction=1e3, angle=3.0, iterations=99) == 0.5


def test_error_of_the_predictor_and_angle_by_their_orders():
    assert after(contraction=0.1 * 1.3**4) == pytest.approx(1 / 1.3)
    assert after(contraction=0.1 * 1.3**2, order=2) == pytest.approx(1 / 1.3)
    assert after(angle=0.2 * 1.5) == pytest.approx(1 / 1.5)
    assert after(iterations=5) == pytest.approx(4 / 5)


def test_the_largest_step_is_the_largest():
    assert after(step=0.9) * 0.9 == 1.0


@pytest.mark.parametrize(
    "given", [{"first_step": 0.0}, {"max_step": -1.0}, {"min_step": 1.0}, {"aimed_angle": 1.0}, {"max_angle": 2.0}]
)
def test_options_out_of_range(given):
    with pytest.raises(InputError, match="continuation"):
        StepOptions(**given)
