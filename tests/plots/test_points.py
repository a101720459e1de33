"""Loops, states, histories and harmonics of a point are those of the element, drawn as they are."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.figures import branch, drawn, named, title
from helpers.oscillator import one_mass

import slipstick as ss
from slipstick import plots
from slipstick.errors import InputError
from slipstick.plots.points import draw_states


def test_states_are_wrapped_round_the_period() -> None:
    intervals = {
        "tip": [(0.5, 2.0, "stick"), (2.0, 5.0, "slip+"), (5.0, 0.5 + 2 * np.pi, "separation")],
        "root": [(0.0, 2 * np.pi, "slip-")],
    }
    ax = draw_states(intervals)
    boxes = sorted((p.get_y() + p.get_height() / 2, p.get_x(), p.get_width()) for p in ax.patches)
    expected = [(0, 0.0, 0.5), (0, 0.5, 1.5), (0, 2.0, 3.0), (0, 5.0, 2 * np.pi - 5.0), (1, 0.0, 2 * np.pi)]
    np.testing.assert_allclose(boxes, expected, atol=1e-12)
    assert [t.get_text() for t in ax.get_yticklabels()] == ["tip", "root"]
    assert named(ax) == ["stick", "slip+", "slip-", "separation"]


@pytest.mark.parametrize(("count", "named"), [(40, 40), (41, 21), (81, 27)])
def test_of_many_contacts_not_each_is_named(count: int, named: int) -> None:
    ax = draw_states({f"c{i}": [(0.0, 2 * np.pi, "stick")] for i in range(count)})
    labels = [text.get_text() for text in ax.get_yticklabels()]
    assert len(labels) == named
    assert labels[:2] == ["c0", f"c{-(-count // 40)}"]
    assert ax.figure.get_figheight() == pytest.approx(1.5 + 0.3 * 40)
    assert len(ax.patches) == count


def test_states_of_a_point() -> None:
    point = branch().at(6.9)
    ax = branch().plot.states(point)
    whole = [sum(p.get_width() for p in ax.patches if round(p.get_y() + 0.35) == row) for row in range(3)]
    np.testing.assert_allclose(whole, 2 * np.pi, rtol=1e-12)
    assert [t.get_text() for t in ax.get_yticklabels()] == ["c0", "c1", "c2"]
    assert title(ax) == f"Chain (at {float(branch().dataset['omega'][point]):.5g} rad/s)"
    assert [t.get_text() for t in branch().plot.states(point, "c2").get_yticklabels()] == ["c2"]


def test_a_history_is_the_motion_in_time() -> None:
    b, point = branch(), branch().at(6.9)
    ax = b.plot.history(point, ["x0", "x2"])
    for line, dof in zip(ax.lines, ("x0", "x2"), strict=True):
        tau, motion = drawn(line)
        X = b.dataset["displacement"].isel(point=point).sel(dof=dof).to_numpy()
        np.testing.assert_allclose(motion, b.harmonics.H_minus(tau) @ X, rtol=1e-14)
        amplitude = float(b.dataset["amplitude"].isel(point=point).sel(dof=dof))
        assert np.abs(motion - X[0]).max() == pytest.approx(amplitude, rel=1e-4)
    assert (ax.get_ylabel(), named(ax)) == ("Motion [mm]", ["x0", "x2"])
    force = b.plot.history(point, contact="c1")
    np.testing.assert_array_equal(drawn(force.lines[0])[1], b.loop(point, "c1")["friction"])
    assert (force.get_ylabel(), named(force)) == ("Friction force [N]", ["friction force", "friction limit"])
    assert len(b.plot.history(point, contact=["c0", "c1"]).lines) == 2
    with pytest.raises(InputError, match="both dof and contact are given"):
        b.plot.history(point, "x0", contact="c1")


def test_motion_relative_to_a_support_says_so() -> None:
    load = ss.Load(base={"x": 1.0}, motion="displacement", amplitude=1.0)
    problem = one_mass(loads=[load], harmonics=[0, 1, 2], units={"length": "mm"})
    data = ss.linear_response(problem, omega=[5.0, 6.0]).dataset
    assert plots.response(data).get_ylabel() == "Amplitude, relative to the moving support [mm]"
    assert plots.history(data, 0).get_ylabel() == "Motion, relative to the moving support [mm]"
    assert plots.spectrum(data, 0).get_ylabel() == "Amplitude of the motion, relative to the moving support [mm]"


def test_a_spectrum_has_a_bar_for_each_harmonic() -> None:
    b, point = branch(5.0), branch(5.0).at(6.9)
    X = b.dataset["displacement"].isel(point=point).sel(dof="x1").to_numpy()
    ax = b.plot.spectrum(point, "x1")
    expected = [abs(X[0]), *np.hypot(X[1::2], X[2::2])]
    assert [bar.get_height() for bar in ax.patches] == expected
    assert (ax.get_yscale(), ax.get_ylabel()) == ("log", "Amplitude of the motion [mm]")
    assert [t.get_text() for t in ax.get_xticklabels()] == ["0", "1", "2", "3", "4", "5"]
    assert b.plot.spectrum(point, "x1", log=False).get_yscale() == "linear"
    F = b.dataset["friction_force"].isel(point=point).to_numpy()
    ax = b.plot.spectrum(point, contact=["c0", "c2"])
    assert ax.get_ylabel() == "Amplitude of the friction force [N]"
    assert named(ax) == ["c0", "c2"]
    assert ax.patches[6].get_height() == abs(F[2, 0])


def test_nothing_that_moves_can_be_drawn() -> None:
    d = branch().dataset.isel(point=slice(0, 1)).copy(deep=True)
    for name in ("displacement", "contact_tangential", "friction_force", "rubbing_motion"):
        d[name].values[:] = 0.0
    assert plots.loops(d, 0)[0].lines[0].get_marker() == "o"
    assert plots.spectrum(d, 0).get_ylim() == (0.0, 1.0)
    assert not drawn(plots.history(d, 0).lines[0])[1].any()


def test_linear_results_have_motion_and_no_loops() -> None:
    linear = ss.linear_response(branch().problem, omega=[5.0, 6.0])
    assert len(plots.history(linear, 1, "x1").lines) == 1
    assert len(plots.spectrum(linear, 1, "x1").patches) == 6
    with pytest.raises(InputError, match="there is no contact in the results to draw"):
        plots.loop(linear, 0)


@pytest.mark.parametrize("draw", [plots.loop, plots.loops, plots.states, plots.history, plots.spectrum])
def test_points_that_are_not_there(draw: object) -> None:
    count = len(branch())
    for point in (10**6, -(10**6), "a", 1.5, None):
        with raises_fault("point", expected=f"a whole number from {-count} to {count - 1}"):
            draw(branch(), point)  # type: ignore[operator]
    with pytest.raises(InputError, match="nothing to draw"):
        draw(3, 0)  # type: ignore[operator]
