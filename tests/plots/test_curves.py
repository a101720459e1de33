"""Curves draw the numbers they are given, in the unit asked for, and name what they draw."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import OMEGA, branch, dataset, drawn, named, problem, title

import slipstick as ss
from slipstick import plots
from slipstick.errors import InputError


def test_a_response_curve_with_its_peak() -> None:
    data = dataset()
    data.attrs["title"] = "Two masses"
    ax = plots.response(data, "z")
    x, y = drawn(ax.lines[0])
    assert (x == OMEGA).all()
    assert (y == data["amplitude"].values[:, 1]).all()
    px, py = drawn(ax.lines[1])
    assert (px.tolist(), py.tolist()) == ([OMEGA[13]], [data["amplitude"].values[13, 1]])
    assert ax.get_xlabel() == "Omega [rad/s]"
    assert ax.get_ylabel() == "Amplitude [m]"
    assert named(ax) == ["z", "peak"]
    assert title(ax) == "Two masses (z)"


def test_branches_are_overlaid_in_different_colours_none_of_them_dashed() -> None:
    ax = plots.response({"v = 0": dataset(), "v = 10": dataset(2.0)}, peaks=False)
    first, second = ax.lines
    assert first.get_color() != second.get_color()
    assert first.get_linestyle() == second.get_linestyle() == "-"
    assert named(ax) == ["v = 0", "v = 10"]
    np.testing.assert_allclose(drawn(second)[1], 2 * drawn(first)[1])


def test_several_dofs_and_branches_in_one_figure() -> None:
    ax = plots.response({"a": dataset(), "b": dataset(2.0)}, ["x", "z"], peaks=False)
    assert named(ax) == ["a, x", "a, z", "b, x", "b, z"]
    assert len({(line.get_color(), str(line.get_linestyle())) for line in ax.lines}) == 4
    np.testing.assert_array_equal(drawn(ax.lines[3])[1], dataset(2.0)["amplitude"].values[:, 1])
    assert named(plots.power(dataset(), ["tip", "root"])) == ["tip", "root"]


def test_drawing_into_given_axes_goes_on_in_them() -> None:
    ax = plots.response(dataset(), label="one")
    assert plots.response(dataset(2.0), ax=ax, label="two") is ax
    assert named(ax) == ["one", "two", "peak"]
    assert sorted(ax.get_legend_handles_labels()[1]) == ["one", "peak", "two"]  # also for a legend of one's own
    assert title(ax) == "x"  # that of the figure that was made


def test_references_are_thin_and_do_not_set_the_scale() -> None:
    plain = plots.response(dataset())
    ax = plots.response(dataset(), references={"free": dataset(3.0)})
    assert ax.get_ylim()[1] == pytest.approx(plain.get_ylim()[1])
    free = next(line for line in ax.lines if line.get_label() == "free")
    assert free.get_linewidth() < ax.lines[0].get_linewidth()
    np.testing.assert_allclose(drawn(free)[1], dataset(3.0)["amplitude"].values[:, 0])
    assert named(ax) == ["x", "free", "peak"]
    far = plots.response(dataset(), references={"free": dataset(1e9)})
    assert named(far) == ["x", "peak"]  # what is out of sight is not named


def test_decades_ask_for_a_logarithmic_scale() -> None:
    data = dataset()
    assert plots.response(data).get_yscale() == "linear"
    assert plots.response(data, log=True).get_yscale() == "log"
    data["amplitude"].values[:5] = 1e-5
    assert plots.response(data).get_yscale() == "log"
    assert plots.response(data, log=False).get_yscale() == "linear"
    assert plots.response(data, references={"free": dataset(1e4)}).get_ylim()[1] < 10.0
    assert plots.response(data).get_xscale() == "linear"
    data["omega"].values[:] = np.geomspace(0.1, 100.0, 40)
    assert plots.response(data).get_xscale() == "log"


@pytest.mark.parametrize("unit, factor", [("Hz", 2 * np.pi), ("rpm", np.pi / 30), ("kHz", 2e3 * np.pi), ("rad/s", 1.0)])
def test_the_unit_of_the_frequency_axis(unit: str, factor: float) -> None:
    ax = plots.response(dataset(), "z", frequency=unit)
    assert ax.get_xlabel() == f"Omega [{unit}]"
    np.testing.assert_allclose(drawn(ax.lines[0])[0], OMEGA / factor, rtol=1e-15)
    np.testing.assert_allclose(drawn(ax.lines[1])[0], OMEGA[13] / factor, rtol=1e-15)
    free = plots.response(dataset(), references={"free": dataset()}, frequency=unit).lines[-1]
    np.testing.assert_allclose(drawn(free)[0], OMEGA / factor, rtol=1e-15)


def test_results_say_in_which_unit() -> None:
    data = dataset()
    data.attrs["frequency_unit"] = "Hz"
    for draw in (plots.response, plots.mean, plots.power, plots.friction, plots.fractions):
        ax = draw(data)
        assert ax.get_xlabel() == "Omega [Hz]"
        assert draw(data, frequency="rpm").get_xlabel() == "Omega [rpm]"
    assert plots.abscissa_text(data, 0) == "0.31831 Hz"
    with pytest.raises(InputError, match="frequency: found 'herz'"):
        plots.response(data, frequency="herz")


def test_other_times_have_no_hertz() -> None:
    data = dataset()
    data.attrs |= {"time_unit": "ms", "frequency_unit": "rad/ms"}
    assert plots.response(data).get_xlabel() == "Omega [rad/ms]"
    with pytest.raises(InputError, match="expected one of rad/ms"):
        plots.response(data, frequency="Hz")


def test_mean_power_and_friction() -> None:
    data = dataset()
    assert (drawn(plots.mean(data, "x").lines[0])[1] == data["mean"].values[:, 0]).all()
    np.testing.assert_allclose(drawn(plots.power(data).lines[0])[1], data["dissipated_power"].values.sum(axis=1))
    assert (drawn(plots.power(data, "root").lines[0])[1] == data["dissipated_power"].values[:, 1]).all()
    assert (drawn(plots.friction(data, "tip").lines[0])[1] == 0.3).all()
    assert plots.power(data).get_ylabel() == "Dissipated power [W]"
    assert plots.friction(data).get_ylabel() == "Friction coefficient"
    assert named(plots.friction(data)) == []  # the title has the name
    with pytest.raises(InputError, match="the contacts are not heated"):
        plots.temperature(data)


def test_a_mean_that_is_rounding_is_drawn_as_zero() -> None:
    data = dataset()
    largest = float(data["amplitude"].max())
    data["mean"].values[:, 0] = 1e-13 * largest * np.sin(7 * OMEGA)
    data["mean"].values[:, 1] = 1e-9 * largest * np.sin(7 * OMEGA)
    data["mean"].values[3, 1] = np.nan
    assert (drawn(plots.mean(data, "x").lines[0])[1] == 0.0).all()
    np.testing.assert_array_equal(drawn(plots.mean(data, "z").lines[0])[1], data["mean"].values[:, 1])


def test_power_that_is_rounding_is_drawn_as_zero() -> None:
    """A contact stuck all period dissipates nothing, however the integrals round."""
    stuck = ss.forced_response(problem(force=1e-3, load=1e-3), omega=(5.0, 5.5))
    data = stuck.dataset.copy(deep=True)
    size = float(abs(data["friction_force"]).max() * abs(data["contact_tangential"]).max()) * 5.5
    data["dissipated_power"].values[:] = 1e-14 * size
    assert (drawn(plots.power(data).lines[0])[1] == 0.0).all()
    data["dissipated_power"].values[:] = 1e-8 * size
    assert (drawn(plots.power(data).lines[0])[1] > 0.0).all()


def test_rounding_is_not_magnified() -> None:
    data = dataset()
    data["dissipated_power"].values[:, 0] = 2400.0 + 1e-9 * np.sin(OMEGA)
    low, high = plots.power(data, "tip").get_ylim()
    assert (low, high) == pytest.approx((1920.0, 2880.0))
    data["dissipated_power"].values[:] = 0.0
    assert plots.power(data).get_ylim() == (-0.05, 1.0)


def test_one_point_is_seen() -> None:
    for draw in (plots.response, plots.mean, plots.power, plots.fractions):
        assert draw(dataset().isel(point=slice(3, 4))).lines[0].get_marker() == "o"


def test_the_phase_is_that_of_a_load() -> None:
    data = branch().dataset
    ax = plots.phase(branch(), "x1")
    X = data["displacement"].sel(dof="x1")
    angle = np.radians(drawn(ax.lines[0])[1])
    size = np.hypot(X.sel(coefficient="c1"), X.sel(coefficient="s1"))
    np.testing.assert_allclose(size * np.cos(angle), X.sel(coefficient="c1"), atol=1e-12)
    np.testing.assert_allclose(-size * np.sin(angle), X.sel(coefficient="s1"), atol=1e-12)
    assert np.abs(np.diff(angle)).max() < np.pi
    assert (ax.get_ylabel(), title(ax)) == ("Phase of harmonic 1 [deg]", "Chain (x1)")
    with pytest.raises(InputError, match="harmonic: found 7; the results hold 1, 2, 3, 4, 5"):
        plots.phase(branch(), harmonic=7)


def test_no_motion_has_no_phase() -> None:
    data = branch().dataset.copy(deep=True)
    data["displacement"].loc[{"dof": "x1"}] *= 1e-14
    ax = plots.phase(data, "x1")
    assert np.isnan(drawn(ax.lines[0])[1]).all()
    assert [text.get_text() for text in ax.texts] == ["no values"]


def test_names_that_do_not_exist() -> None:
    with pytest.raises(InputError, match="there is no dof 'y' in the results"):
        plots.response(dataset(), "y")
    with pytest.raises(InputError, match="there is no contact 'tipp' in the results; did you mean 'tip'"):
        plots.power(dataset(), ["root", "tipp"])
    for nothing in ([], {}, None, 3, "a"):
        with pytest.raises(InputError, match="nothing to draw"):
            plots.response(nothing)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = plots.nothing


def test_what_does_not_fit_in_one_figure_is_refused() -> None:
    other = dataset()
    other["amplitude"].attrs["units"] = "mm"
    with pytest.raises(InputError, match=r"Amplitude \[m\], Amplitude \[mm\]"):
        plots.response([dataset(), other])
    with pytest.raises(InputError, match=r"branches over Omega \[rad/s\] and over damper.velocity \[mm/s\]"):
        plots.response([dataset(), over_velocity()])


def over_velocity() -> ss.Branch:
    data = dataset()
    data["parameter"] = ("point", OMEGA * 10, {"units": "mm/s", "long_name": "damper.velocity"})
    data["omega"].values[:] = 5.0
    data.attrs["parameter"] = "damper.velocity"
    return data


def test_a_followed_parameter_is_the_abscissa() -> None:
    data = over_velocity()
    ax = plots.response(data)
    assert (drawn(ax.lines[0])[0] == OMEGA * 10).all()
    assert ax.get_xlabel() == "damper.velocity [mm/s]"  # the user's own name, as it is
    assert title(ax) == "x, at 5 rad/s"
    assert plots.abscissa_text(data, 0) == "damper.velocity = 20 mm/s"
    with pytest.raises(InputError, match=r"frequency: the branch follows damper.velocity"):
        plots.response(data, frequency="Hz")


def test_python_figures_are_those_of_the_command_line() -> None:
    """By a branch, by its dataset, and by its own methods."""
    a, b = plots.response(branch(), "x1"), branch().plot.response("x1")
    c = plots.response(branch().dataset, "x1")
    for other in (b, c):
        assert title(other) == title(a) == "Chain (x1)"
        assert other.get_ylabel() == a.get_ylabel() == "Amplitude [mm]"
        np.testing.assert_array_equal(drawn(other.lines[0]), drawn(a.lines[0]))


def test_dollars_in_names_are_no_formulas() -> None:
    data = dataset().assign_coords(dof=["$x", "z$"])
    data.attrs["title"] = "costs 5$ or 6$"
    ax = plots.response(data, ["$x", "z$"])
    ax.figure.savefig("/dev/null", format="png")
    assert title(ax) == "costs 5$ or 6$"


def test_results_without_points_or_contacts_are_refused_with_a_sentence() -> None:
    empty = dataset().isel(point=slice(0, 0))
    for draw in (plots.response, plots.mean, plots.phase, plots.power):
        with pytest.raises(InputError, match="has no points to draw"):
            draw(empty)
    with pytest.raises(InputError, match="has no points to draw"):
        plots.compare({"a": dataset(), "b": empty})
    with pytest.raises(InputError, match="there is no contact in the results"):
        plots.power(dataset().drop_dims("contact"))
