"""Figures draw the numbers they are given; nothing touches pyplot."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray

from slipstick import plots
from slipstick.errors import InputError

OMEGA = np.linspace(2.0, 15.0, 40)


def dataset(factor: float = 1.0) -> xarray.Dataset:
    amplitude = factor / np.abs(40 - OMEGA**2 + 0.4j * OMEGA)
    kinds, peak_of = np.full(40, "regular"), np.full(40, -1)
    kinds[[0, 13, 20]] = "start", "peak", "peak"
    peak_of[[13, 20]] = 1, 0
    units = {"omega": "rad/s", "amplitude": "m", "mean": "m", "dissipated_power": "W"}
    data = {
        "omega": ("point", OMEGA),
        "kind": ("point", kinds),
        "peak_dof": ("point", peak_of),
        "amplitude": (("point", "dof"), np.stack([amplitude, 2 * amplitude], axis=1)),
        "mean": (("point", "dof"), np.stack([-amplitude, amplitude], axis=1)),
        "dissipated_power": (("point", "contact"), np.stack([amplitude, 3 * amplitude], axis=1)),
        "friction_coefficient": (("point", "contact"), np.full((40, 2), 0.3)),
        "stick_fraction": (("point", "contact"), np.full((40, 2), 0.25)),
        "slip_fraction": (("point", "contact"), np.full((40, 2), 0.7)),
        "separation_fraction": (("point", "contact"), np.full((40, 2), 0.05)),
    }
    result = xarray.Dataset(data, coords={"dof": ["x", "z"], "contact": ["tip", "root"]})
    for name in result.data_vars:
        result[name].attrs = {"units": units.get(str(name), "1"), "long_name": str(name).replace("_", " ")}
    return result


def drawn(line: object) -> tuple[np.ndarray, np.ndarray]:
    x, y = line.get_data()  # type: ignore[attr-defined]
    return np.asarray(x), np.asarray(y)


def test_a_response_curve_with_its_peak() -> None:
    data = dataset()
    ax = plots.response(data, "z")
    x, y = drawn(ax.lines[0])
    assert (x == OMEGA).all()
    assert (y == data["amplitude"].values[:, 1]).all()
    px, py = drawn(ax.lines[1])
    assert (px.tolist(), py.tolist()) == ([OMEGA[13]], [data["amplitude"].values[13, 1]])
    assert ax.get_xlabel() == "Omega [rad/s]"
    assert ax.get_ylabel() == "Amplitude [m]"


def test_branches_are_overlaid_in_different_colours_and_dashes() -> None:
    ax = plots.response({"v = 0": dataset(), "v = 10": dataset(2.0)}, peaks=False)
    first, second = ax.lines
    assert first.get_color() != second.get_color()
    assert first.get_linestyle() != second.get_linestyle()
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["v = 0", "v = 10"]
    np.testing.assert_allclose(drawn(second)[1], 2 * drawn(first)[1])


def test_drawing_into_given_axes_goes_on_in_them() -> None:
    ax = plots.response(dataset(), label="one")
    assert plots.response(dataset(2.0), ax=ax, label="two") is ax
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["one", "two"]
    ax.set_yscale("log")


def test_references_are_thin_and_do_not_set_the_scale() -> None:
    plain = plots.response(dataset())
    ax = plots.response(dataset(), references={"free": dataset(50.0)})
    assert ax.get_ylim()[1] == pytest.approx(plain.get_ylim()[1])
    free = next(line for line in ax.lines if line.get_label() == "free")
    assert free.get_linewidth() < ax.lines[0].get_linewidth()
    np.testing.assert_allclose(drawn(free)[1], dataset(50.0)["amplitude"].values[:, 0])
    assert plots.response(dataset(), log=True).get_yscale() == "log"


def test_mean_power_and_friction() -> None:
    data = dataset()
    assert (drawn(plots.mean(data, "x").lines[0])[1] == data["mean"].values[:, 0]).all()
    np.testing.assert_allclose(drawn(plots.power(data).lines[0])[1], data["dissipated_power"].values.sum(axis=1))
    assert (drawn(plots.power(data, "root").lines[0])[1] == data["dissipated_power"].values[:, 1]).all()
    assert (drawn(plots.friction(data, "tip").lines[0])[1] == 0.3).all()
    assert plots.power(data).get_ylabel() == "Dissipated power [W]"
    assert plots.friction(data).get_ylabel() == "Friction coefficient"


def test_a_mean_that_is_rounding_is_drawn_as_zero() -> None:
    data = dataset()
    largest = float(data["amplitude"].max())
    data["mean"].values[:, 0] = 1e-13 * largest * np.sin(7 * OMEGA)
    data["mean"].values[:, 1] = 1e-9 * largest * np.sin(7 * OMEGA)
    data["mean"].values[3, 1] = np.nan
    assert (drawn(plots.mean(data, "x").lines[0])[1] == 0.0).all()
    np.testing.assert_array_equal(drawn(plots.mean(data, "z").lines[0])[1], data["mean"].values[:, 1])


def test_fractions_are_stacked_to_one() -> None:
    ax = plots.fractions(dataset(), "root")
    tops = [float(np.max(c.get_paths()[0].vertices[:, 1])) for c in ax.collections]
    assert tops == pytest.approx([0.25, 0.95, 1.0])
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["stick", "slip", "separation"]


def test_names_that_do_not_exist() -> None:
    with pytest.raises(InputError, match="there is no dof 'y' in the results; there are x, z"):
        plots.response(dataset(), "y")
    with pytest.raises(InputError, match="there is no contact 'a'"):
        plots.power(dataset(), "a")
    with pytest.raises(InputError, match="no branch was given"):
        plots.response([])
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = plots.nothing


def test_a_followed_parameter_is_the_abscissa() -> None:
    data = dataset()
    data["parameter"] = ("point", OMEGA * 10, {"units": "length/s", "long_name": "damper.velocity"})
    data.attrs["parameter"] = "damper.velocity"
    ax = plots.response(data)
    assert (drawn(ax.lines[0])[0] == OMEGA * 10).all()
    assert ax.get_xlabel() == "damper.velocity [length/s]"  # the user's own name, as it is


def test_a_loop_is_closed_and_bounded() -> None:
    tau = np.linspace(0, 2 * np.pi, 100, endpoint=False)
    x, f, b = np.cos(tau), np.sin(tau), 1.5 + 0 * tau
    ax = plots.loop(x, f, limit=b, label="v = 0")
    lx, lf = drawn(ax.lines[0])
    assert (lx[0], lf[0]) == (lx[-1], lf[-1])
    assert (lx[:-1] == x).all()
    assert drawn(ax.lines[1])[1].tolist() == [1.5] * 101
    assert drawn(ax.lines[2])[1].tolist() == [-1.5] * 101


def test_states_are_wrapped_round_the_period() -> None:
    intervals = {
        "tip": [(0.5, 2.0, "stick"), (2.0, 5.0, "slip+"), (5.0, 0.5 + 2 * np.pi, "separation")],
        "root": [(0.0, 2 * np.pi, "slip-")],
    }
    ax = plots.states(intervals)
    boxes = sorted((p.get_y() + p.get_height() / 2, p.get_x(), p.get_width()) for p in ax.patches)
    expected = [(0, 0.0, 0.5), (0, 0.5, 1.5), (0, 2.0, 3.0), (0, 5.0, 2 * np.pi - 5.0), (1, 0.0, 2 * np.pi)]
    np.testing.assert_allclose(boxes, expected, atol=1e-12)
    assert [t.get_text() for t in ax.get_yticklabels()] == ["tip", "root"]
    assert [t.get_text() for t in ax.get_legend().get_texts()] == ["stick", "slip+", "slip-", "separation"]


def test_a_history_has_a_line_for_each_quantity() -> None:
    tau = np.linspace(0, 1, 5)
    ax = plots.history(tau, {"a": tau, "b": 2 * tau}, y_label="Force [N]")
    assert [line.get_label() for line in ax.lines] == ["a", "b"]


def test_figures_are_written_as_png_and_svg(tmp_path: Path) -> None:
    paths = plots.save_figure(plots.response(dataset()), tmp_path / "v1.5")
    assert [p.name for p in paths] == ["v1.5.png", "v1.5.svg"]
    assert paths[0].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths[1].read_bytes()[:1000]
    again = plots.save_figure(plots.response(dataset()), tmp_path / "b", formats=["svg"])
    assert len(again) == 1


def test_pyplot_and_matplotlib_stay_out_until_a_figure_is_drawn() -> None:
    code = (
        "import sys, slipstick.plots as p; assert 'matplotlib' not in sys.modules; "
        "p.loop([0, 1], [0, 1]); assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_rounding_is_not_magnified() -> None:
    data = dataset()
    data["dissipated_power"].values[:, 0] = 2400.0 + 1e-9 * np.sin(OMEGA)
    low, high = plots.power(data, "tip").get_ylim()
    assert (low, high) == pytest.approx((1920.0, 2880.0))


def test_where_a_point_lies_in_words() -> None:
    assert plots.abscissa_text(dataset(), 0) == "2 rad/s"
