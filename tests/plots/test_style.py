"""Titles and legends that fit, files, and figures that show themselves."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.figures import branch, dataset, named, title
from matplotlib.figure import Figure

from slipstick import plots
from slipstick.plots.shown import for_files
from slipstick.plots.style import COLOURS, DASHES, legend, log_scale, new_figure, over_decades, styled, titled


def test_long_titles_are_broken_into_lines() -> None:
    figure = new_figure()
    titled(figure, "word " * 60, "a dof", "at 3 Hz")
    lines = figure.get_suptitle().splitlines()
    assert len(lines) == 3
    assert lines[1].endswith("...")
    assert lines[2] == "(a dof, at 3 Hz)"
    figure.canvas.draw()
    box = figure._suptitle.get_window_extent()
    assert box.x0 > 0
    assert box.x1 < figure.bbox.width
    titled(figure, "", "x")
    assert figure.get_suptitle() == "x"


def test_long_legends_stand_beside_the_axes_with_names_that_differ() -> None:
    names = [f"a contact of the shroud of blade {k}, upper edge of the pad" for k in range(12)]
    ax = plots.response({name: dataset() for name in names}, peaks=False)
    assert len(set(named(ax))) == 12
    assert max(map(len, named(ax))) <= 36
    ax.figure.canvas.draw()
    assert ax.get_legend().get_window_extent().x0 > ax.get_window_extent().x1
    assert ax.get_legend().get_window_extent().x1 < ax.figure.bbox.width


@pytest.mark.parametrize(
    ("entries", "beside", "last"), [(7, False, "6"), (8, True, "7"), (20, True, "19"), (21, True, "... (21 in all)")]
)
def test_from_how_many_entries_on_a_legend_is_another(entries: int, beside: bool, last: str) -> None:
    ax = styled(None, "x", "y")
    for i in range(entries):
        ax.plot([0, 1], [0, 0.01 * i], label=str(i))
    ax.set_ylim(0.0, 1.0)
    legend(ax)
    made = ax.get_legend()
    names = [text.get_text() for text in made.get_texts()]
    assert (len(names), names[-1]) == (min(entries, 20), last)
    box = made.get_bbox_to_anchor().transformed(ax.transAxes.inverted())
    assert (box.x0 > 0.99) == beside


@pytest.mark.parametrize("high, beside", [(10.0, False), (0.6, True)])
def test_a_legend_hides_no_curve(high: float, beside: bool) -> None:
    """Waves all over the axes; with a high ordinate there is room above them."""
    ax, x = styled(None, "x", "y"), np.linspace(0.0, 60.0, 400)
    for k in range(3):
        ax.plot(x, 0.5 * np.sin(x + k), label=f"wave {k}")
    ax.set_ylim(-0.6, high)
    legend(ax)
    ax.figure.canvas.draw()
    box = ax.get_legend().get_window_extent()
    assert (box.x0 > ax.get_window_extent().x1) == beside
    hidden = [line.get_transform().transform_path(line.get_path()).intersects_bbox(box) for line in ax.lines]
    assert not any(hidden)


def test_a_legend_hides_no_area() -> None:
    """Areas below curves and bars, whose outlines alone a legend may lie between."""
    x = np.linspace(0.0, 1.0, 200)
    ax = styled(None, "x", "y")
    ax.stackplot(x, [0.6 + 0.1 * x, 0.4 - 0.1 * x], labels=["stick", "slip"])
    ax.set_ylim(0.0, 1.0)
    bars = styled(None, "x", "y")
    for k in range(4):
        bars.bar([k], [1.0 + 0.01 * k], width=1.0, label=str(k))
    for drawn in (ax, bars):
        legend(drawn)
        drawn.figure.canvas.draw()
        assert drawn.get_legend().get_window_extent().x0 > drawn.get_window_extent().x1


@pytest.mark.parametrize("low, high", [(2.0, 2.6), (2.0, 8.0), (1.9, 33.0), (2.0, 80.0), (0.003, 0.7), (1.0, 1e7)])
def test_texts_of_a_logarithmic_axis_do_not_touch(low: float, high: float) -> None:
    ax = styled(None, "x", "y")
    ax.plot([low, high], [0.0, 1.0])
    log_scale(ax, "x")
    ax.figure.canvas.draw()
    ticks = [*ax.xaxis.get_major_ticks(), *ax.xaxis.get_minor_ticks()]
    left, right = ax.get_xlim()
    shown = [tick.label1 for tick in ticks if tick.label1.get_text() and left <= tick.get_loc() <= right]
    boxes = sorted((text.get_window_extent() for text in shown), key=lambda box: box.x0)
    assert len(boxes) >= 2
    assert all(a.x1 < b.x0 for a, b in pairwise(boxes))


def test_a_legend_stays_inside_a_figure_that_cannot_make_room() -> None:
    figure = Figure()
    ax, x = figure.add_subplot(), np.linspace(0.0, 60.0, 400)
    ax.plot(x, np.sin(x), label="wave")
    legend(ax)
    figure.canvas.draw()
    assert ax.get_legend().get_window_extent().x1 < ax.get_window_extent().x1


def test_scales_are_logarithmic_from_two_decades_on() -> None:
    assert over_decades([np.array([1.0, 100.0])])
    assert not over_decades([np.array([1.0, 99.0])])
    assert not over_decades([np.array([0.0, -5.0, 3.0, np.inf, np.nan])])
    assert not over_decades([])
    assert over_decades([np.array([2.0]), np.array([[0.0, 300.0]])])


def test_every_curve_has_a_look_of_its_own() -> None:
    ax = styled(None, "x", "y")
    lines = [ax.plot([0, 1], [0, k])[0] for k in range(len(COLOURS) * len(DASHES))]
    assert len({(line.get_color(), str(line._unscaled_dash_pattern)) for line in lines}) == len(lines)


def test_figures_are_written_as_png_and_svg(tmp_path: Path) -> None:
    paths = plots.save_figure(plots.response(dataset()), tmp_path / "v1.5")
    assert [p.name for p in paths] == ["v1.5.png", "v1.5.svg"]
    assert paths[0].read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in paths[1].read_bytes()[:1000]
    assert len(plots.save_figure(branch().plot.loops(3)[0], tmp_path / "b", formats=["svg"])) == 1
    with raises_fault(str(tmp_path / "b.nc"), says="found .nc.; expected a format of figures"):
        plots.save_figure(plots.response(dataset()), tmp_path / "b", formats=["svg", "nc"])


def test_pyplot_and_matplotlib_stay_out_until_a_figure_is_drawn() -> None:
    code = (
        "import sys, slipstick as ss; p = ss.plots; assert 'matplotlib' not in sys.modules; "
        "from slipstick.plots.points import draw_states; from slipstick.plots.shown import for_files\n"
        "with for_files(): draw_states({'a': [(0.0, 1.0, 'stick')]})\n"
        "assert 'matplotlib' in sys.modules; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_new_figures_are_shown_by_notebooks_and_pyplot() -> None:
    from matplotlib import pyplot

    ax = plots.response(dataset())
    assert pyplot.get_fignums() == [ax.figure.number]
    with pyplot.rc_context({"font.size": 19.0}):
        assert plots.response(dataset()).xaxis.label.get_fontsize() == 19.0
    with for_files():
        plots.response(dataset())
    assert len(pyplot.get_fignums()) == 2
    plots.response(dataset(), ax=ax)
    assert len(pyplot.get_fignums()) == 2


def test_titles_name_what_is_alone() -> None:
    assert title(plots.response(branch(), ["x0", "x1"])) == "Chain"
    assert title(plots.response(branch(), "x1")) == "Chain (x1)"


def test_small_lengths_are_ticked_in_millimetres_and_stay_metres() -> None:
    ax = plots.response(dataset(1e-3 / float(dataset()["amplitude"].max())))
    ax.figure.canvas.draw()
    assert ax.get_ylabel() == "Amplitude [mm]"
    for tick, text in zip(ax.get_yticks(), ax.get_yticklabels(), strict=True):
        assert float(text.get_text().replace("\N{MINUS SIGN}", "-")) == pytest.approx(1e3 * tick)
    ax.set_ylim(0.0, 2.0)
    ax.figure.canvas.draw()
    assert ax.get_ylabel() == "Amplitude [mm]"  # of the results, whatever range is looked at
    ax.set_ylim(0.0, 0.002)
    ax.set_ylabel("of the tip, m")
    ax.figure.canvas.draw()
    assert ax.get_ylabel() == "of the tip, m"
    assert float(ax.get_yticklabels()[-1].get_text()) == pytest.approx(ax.get_yticks()[-1])


def test_small_lengths_on_a_logarithmic_axis() -> None:
    ax = plots.response(dataset(1e-3 / float(dataset()["amplitude"].max())), log=True)
    ax.figure.canvas.draw()
    assert ax.get_ylabel() == "Amplitude [mm]"
    ticks = [float(text.get_text()) / (1e3 * y) for y, text in zip(ax.get_yticks(), ax.get_yticklabels(), strict=True)]
    assert ticks == pytest.approx(np.ones(len(ticks)))


def _said(axis) -> None:
    """The texts of an axis are its ticks in the unit that its label names."""
    factor = {"[m]": 1.0, "[mm]": 1e3, "[µm]": 1e6}[axis.get_label_text().split()[-1]]
    ticks = axis.get_majorticklocs()
    for tick, text in zip(ticks, axis.get_major_formatter().format_ticks(ticks), strict=True):
        assert float(text.replace("\N{MINUS SIGN}", "-")) == pytest.approx(factor * tick)


def test_axes_that_share_a_scale_name_the_unit_of_their_ticks() -> None:
    small = dataset(1e-3 / float(dataset()["amplitude"].max()))
    for share in ("sharex", "sharey"):
        figure = Figure(figsize=(8, 3))
        axes = figure.subplots(1, 2, **{share: True})
        for ax in axes:
            plots.response(small, ax=ax)
        figure.draw_without_rendering()
        for ax in axes:
            assert ax.get_ylabel() == "Amplitude [mm]"
            _said(ax.yaxis)


def test_a_label_taken_from_axes_that_are_drawn_keeps_the_unit_of_the_ticks() -> None:
    small = dataset(1e-3 / float(dataset()["amplitude"].max()))
    figure = Figure(figsize=(8, 3))
    first, second = figure.subplots(1, 2, sharey=True)
    plots.response(small, ax=first)
    figure.draw_without_rendering()
    styled(second, "x", first.get_ylabel())
    second.plot([0, 1], [0, 1e-3])
    figure.draw_without_rendering()
    for ax in (first, second):
        assert ax.get_ylabel() == "Amplitude [mm]"
        _said(ax.yaxis)


@pytest.mark.parametrize("width", [2.0, 3.0, 4.5, 9.0])
@pytest.mark.parametrize("low, high", [(300.0, 320.0), (0.00018, 0.00042), (1380.0, 1480.0), (-6.0, 6.0), (0.0, 1e5)])
def test_texts_along_an_axis_leave_a_gap(low: float, high: float, width: float) -> None:
    ax = styled(new_figure(width, 3.0).add_subplot(), "x", "y")
    ax.plot([low, high], [0.0, 1.0])
    ax.figure.canvas.draw()
    boxes = [label.get_window_extent() for label in ax.get_xticklabels() if label.get_text()]
    shown = [box for box in boxes if ax.bbox.x0 - 1 <= 0.5 * (box.x0 + box.x1) <= ax.bbox.x1 + 1]
    assert len(shown) >= 2
    gap = 0.4 * shown[0].height
    assert all(one.x1 + gap < other.x0 for one, other in pairwise(shown))
