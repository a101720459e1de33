"""Conveniences of a branch lead to the same as the rooms they come from."""

import matplotlib
import numpy as np
import pytest

import slipstick as ss
from slipstick.verify.cases import oscillator

matplotlib.use("agg")


@pytest.fixture(scope="module")
def branch():
    return ss.forced_response(oscillator(velocity=10.0), omega=(4.0, 6.0))


def test_a_point_is_checked_by_time_integration(branch):
    check = branch.check_in_time(3)
    assert check.converged
    assert check.omega == float(branch.dataset["omega"][3])
    assert check.dofs == ("x",)
    sizes = np.concatenate([check.amplitude, check.amplitude_in_time, check.mean, check.mean_in_time])
    worst = max(np.abs(check.amplitude - check.amplitude_in_time).max(), np.abs(check.mean - check.mean_in_time).max())
    assert check.relative_difference == pytest.approx(worst / np.abs(sizes).max())
    assert check.relative_difference < 1e-2
    again = ss.transient(branch.problem, check.omega)
    np.testing.assert_allclose(check.amplitude_in_time, again.amplitude, rtol=1e-5)


def test_saving_is_loading_again(branch, tmp_path):
    path = branch.save(tmp_path / "r.nc")
    assert path == tmp_path / "r.nc"
    np.testing.assert_array_equal(ss.load(path).dataset["amplitude"], branch.dataset["amplitude"])


def test_figures_draw_the_branch(branch):
    axes = branch.plot.response("x")
    drawn = np.concatenate([line.get_ydata() for line in axes.lines])
    assert float(branch.dataset["amplitude"].max()) == pytest.approx(np.nanmax(drawn))
    for name in ("mean", "power", "friction", "fractions"):
        assert getattr(branch.plot, name)().figure is not None
    loop = branch.plot.loop(3)
    force = np.concatenate([line.get_ydata() for line in loop.lines])
    assert np.nanmax(np.abs(force)) == pytest.approx(240.0, rel=1e-9)
    assert branch.plot.states(3).figure is not None
