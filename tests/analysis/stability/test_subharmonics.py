"""Motion of twice the period, taken up where the period doubles."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import oscillator
from helpers.stability import flutter, stops, two_dofs

import slipstick as ss
from slipstick.analysis.stability.subharmonics import doubled

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")


def test_half_the_frequency_with_twice_the_orders_is_the_same_problem() -> None:
    """Its curve is the same, with loads and the rubbing motion on even orders."""
    rubbing = ss.RubbingMotion(velocity_per_omega=0.2, cos={1: 0.5}, normal_cos={2: 0.1})
    problem = two_dofs(rubbing, harmonics=5)
    twice = doubled(problem)
    assert twice.harmonics.orders == (0, 1, 2, 3, 4, 5, 6, 7, 8)
    one = ss.forced_response(problem, omega=(6.0, 6.1)).dataset
    two = ss.forced_response(twice, omega=(3.0, 3.05)).dataset
    assert np.allclose(two.amplitude[0], one.amplitude[0], rtol=1e-9)
    assert np.allclose(two.displacement[0, :, 3:5], one.displacement[0, :, 1:3], atol=1e-9)


def test_a_branch_of_twice_the_period_joins_two_doublings() -> None:
    """Stable between them, as the motion it came from is not."""
    branch = ss.parameter_response(
        flutter(), "load.y.1.amplitude", (47.0, 39.0), omega=6.0, follow="subharmonic", options={"max_step": 0.05}
    )
    first, second = branch.bifurcations()
    (own,) = branch.subharmonics
    value = own.dataset.parameter.values
    assert abs(value[0] - first.value) < 0.01
    assert abs(value[-1] - second.value) < 0.01
    assert set(own.dataset.stable.values.tolist()) == {1}
    middle = len(own) // 2
    assert abs(own.dataset.displacement.values[middle, 0, 1]) > 1e-3, "the new harmonic"


def test_over_frequency_it_is_followed_to_the_end_of_the_range() -> None:
    branch = ss.forced_response(stops(gap=-0.1, harmonics=7), omega=(2.45, 2.6), stability=True)
    (found,) = branch.bifurcations()
    own = branch.subharmonic(found.point, options={"max_step": 0.1}, at=1.29)
    assert own.outcome.name == "COMPLETED"
    assert own.dataset.kind.values[own.at(1.29)] == "requested"
    assert abs(2.0 * own.dataset.omega.values[0] - found.omega) < 1e-2
    assert 2.0 * own.dataset.omega.values[-1] == 2.6
    with pytest.raises(TypeError, match="'stabilty'"):
        branch.subharmonic(found.point, stabilty=False)
    check = own.check_in_time(len(own) // 2)
    assert check.converged, "integration in time finds it too"
    assert check.relative_difference < 1e-3


def test_elsewhere_there_is_none() -> None:
    branch = ss.forced_response(oscillator(10.0), omega=(4.0, 4.1), stability=True)
    with pytest.raises(ss.InputError, match=r"point 0 is a start point; branch\.bifurcations\(\) lists"):
        branch.subharmonic(0)
    with (
        pytest.warns(DeprecationWarning, match="^subharmonic: the argument 'requested' is now called 'at'"),
        raises_fault(says="point 0 is a start point"),
    ):
        branch.subharmonic(0, requested=2.05)
    assert branch.subharmonics == ()
    with raises_fault("follow", found="'twice'", expected='"subharmonic" or None'):
        ss.forced_response(oscillator(10.0), omega=(4.0, 4.1), follow="twice")
