"""The vibration at a Hopf point, and the first limit cycle beside it."""

import numpy as np
import pytest
from helpers.stability import at_the_hopf_point, brake

import slipstick as ss
from slipstick.analysis.self_excited.system import CycleStart


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
    _, hopf, rest, start = at_the_hopf_point(brake())
    system = start.system
    left = [
        np.abs(system.evaluate(np.append(rest + part * start.largest * start.motion, hopf.omega), hopf.value).residual)
        for part in (0.1, 0.999, 1.2)
    ]
    assert max(left[0].max(), left[1].max()) < 1e-10
    assert left[2].max() > 1e-5


def test_the_first_cycle_is_a_little_larger():
    _, hopf, _, start = at_the_hopf_point(brake())
    step = start.first()
    assert 1.0 < start.size(step.x[:-1]) / start.largest < 1.2
    assert hopf.value < step.parameter < hopf.value + 0.01


def test_no_first_cycle_outside_the_range():
    request, hopf, rest, _ = at_the_hopf_point(brake())
    assert CycleStart(request.space, hopf, rest, (hopf.value - 0.1, hopf.value)).first() is None


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize(
    "loss", [0.0, 0.02, *(pytest.param(loss, marks=pytest.mark.verify) for loss in (0.001, 0.005))]
)
@pytest.mark.parametrize(("damping", "velocity"), [(0.3, 1.0), (0.45, 1.0), (0.45, 0.1)])
def test_cycles_begin_at_the_hopf_point_of_the_balance_whatever_the_damping(loss, damping, velocity):
    """There det(K (1 + i loss) + friction + i w c - w^2) = 0; rounding of what is given decides nothing."""
    K = np.array([[100.0, -20.0], [-20.0, 60.0]])
    for rounding in (-1e-13, 0.0, 1e-13):
        structure = ss.MatrixStructure(
            M=np.eye(2), C=damping * np.eye(2), K=K * (1.0 + rounding), dofs=["x", "y"], loss_factor=loss
        )
        problem = brake(structure=structure, velocity=velocity, harmonics=4)
        branch = ss.limit_cycles(problem, "pad.mu", (0.4, 0.8), options={"max_points": 2})
        data, hopf = branch.dataset, branch.bifurcations()[-1]
        cycles = data.isel(point=data.branch_part.values == 1)
        assert cycles.kind.values[:2].tolist() == ["start", "state change"]
        assert cycles.point.size > 2
        for omega, mu in zip(cycles.omega.values[:2], cycles.parameter.values[:2], strict=True):
            Z = K * (1.0 + 1j * loss) + [[0.0, 40.0 * mu], [0.0, 40.0]] + (1j * omega * damping - omega**2) * np.eye(2)
            assert abs(np.linalg.det(Z)) < 1e-9 * abs(Z[0, 1] * Z[1, 0])
        assert cycles.residual.values.max() < 1e-9
        # eigenvalues tell of the same one
        assert (hopf.kind, hopf.before, hopf.after) == ("Hopf", 0, 2)
        assert hopf.value == pytest.approx(cycles.parameter.values[0], rel=1e-10)
        assert hopf.omega == pytest.approx(cycles.omega.values[0], rel=1e-10)
