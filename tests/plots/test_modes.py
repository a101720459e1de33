from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import drawn, named

import slipstick as ss
from slipstick.plots.overlay import BETWEEN
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")


def mode() -> ss.Branch:
    return ss.nonlinear_modes(oscillator(harmonics=[0, 1]), amplitude=(2.0, 10.0), load_factors=(1.0,))


def test_the_line_through_the_peaks_of_forced_curves():
    own, forced = mode(), ss.forced_response(oscillator(harmonics=[0, 1]), omega=(9.0, 12.0))
    ax = ss.plots.backbone(own, forced)
    line = next(line for line in ax.lines if line.get_label() == "nonlinear mode")
    x, y = (values[::BETWEEN] for values in drawn(line))
    assert x == pytest.approx(own.dataset.omega.values)
    assert y == pytest.approx(own.dataset.amplitude.values[:, 0])
    assert {"nonlinear mode", "predicted peak"} <= set(named(ax))
    assert len(ss.plots.backbone(own).lines) == 2


def test_damping_over_amplitude():
    own = mode()
    x, y = drawn(ss.plots.damping(own).lines[0])
    assert (x[-1], y[-1]) == pytest.approx((10.0, float(own.dataset.modal_damping[-1])))


def test_amplitudes_of_more_than_a_decade_are_drawn_on_a_logarithm():
    own = mode().dataset
    size = own.sizes["point"]
    for last, scale in ((9.9, "linear"), (10.1, "log")):
        data = own.assign(modal_amplitude=("point", np.linspace(1.0, last, size), own.modal_amplitude.attrs))
        assert ss.plots.damping(data).get_xscale() == scale


def test_other_branches_are_refused():
    with pytest.raises(ss.InputError, match="are not of a nonlinear mode"):
        ss.plots.damping(ss.forced_response(oscillator(), omega=(9.0, 9.1)))
