"""Figures of studies: what is drawn is in the dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slipstick import plots
from slipstick.errors import InputError
from slipstick.plots import study as study_module
from slipstick.plots.style import save_figure
from slipstick.studies.plan import make_plan
from slipstick.studies.solving import CaseSolved, Job, solve
from slipstick.studies.table import curves_dataset, study_attributes, study_dataset
from slipstick.verify.cases import oscillator

JOB = Job(problem=oscillator(velocity=10.0), span=(5.0, 7.0), options={"max_step": 0.1, "first_step": 0.1})


def made(given: dict[str, Any], *, failed: tuple[int, ...] = (), **options: Any) -> tuple[Any, Any]:
    plan = make_plan(JOB.problem, given, **options)
    found = {i: CaseSolved.failed(i, "") if i in failed else solve(JOB, plan, i) for i in range(len(plan))}
    attributes = study_attributes(JOB, plan, found, {})
    return study_dataset(JOB, plan, found, attributes), curves_dataset(JOB, found, attributes)


@pytest.fixture(scope="module")
def grid() -> tuple[Any, Any]:
    return made({"damper.velocity": [1.0, 10.0, 100.0], "damper.mu": [0.2, 0.3]}, failed=(3,))


def test_one_parameter_is_a_line(tmp_path: Any) -> None:
    data, _ = made({"damper.velocity": [10.0, 20.0, 30.0]})
    ax = plots.study_map(data)
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), [10.0, 20.0, 30.0])
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), data["peak_amplitude"].to_numpy()[:, 0])
    assert ax.get_xlabel() == "damper.velocity [length/time]"
    assert len(save_figure(ax, tmp_path / "map")) == 2


def test_two_parameters_are_a_map_with_crosses_where_a_case_failed(grid: tuple[Any, Any], tmp_path: Any) -> None:
    ax = plots.study_map(grid[0], "x")
    mesh = ax.collections[0].get_array()
    assert np.ma.filled(mesh, np.nan).shape == (2, 3)
    np.testing.assert_array_equal(np.ma.filled(mesh, np.nan), grid[0]["peak_amplitude"].to_numpy()[:, :, 0].T)
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "linear")
    [cross] = ax.lines
    assert (cross.get_xdata().tolist(), cross.get_ydata().tolist()) == ([10.0], [0.3])
    assert len(save_figure(ax, tmp_path / "map")) == 2


def test_of_more_parameters_the_others_are_held(grid: tuple[Any, Any]) -> None:
    ax = plots.study_map(grid[0], over="damper.mu")
    lowest = grid[0]["peak_amplitude"][..., 0]
    there = lowest[lowest.argmin(...)]
    assert ax.get_title() == f"damper.velocity = {float(there['damper.velocity']):.6g}"


def test_samples_are_dots() -> None:
    data, curves = made({"damper.velocity": [1.0, 40.0], "damper.mu": [0.1, 0.4]}, method="sobol", samples=8)
    ax = plots.study_map(data)
    assert ax.collections[0].get_offsets().shape == (8, 2)
    assert len(plots.study_curves(curves, data).lines) == 9


def test_curves_are_coloured_by_a_parameter(grid: tuple[Any, Any]) -> None:
    data, curves = grid
    ax = plots.study_curves(curves, data)
    lines = ax.lines[:-1]
    assert len(lines) == 5
    own = curves["case"].to_numpy() == 4
    np.testing.assert_array_equal(lines[3].get_xdata(), curves["omega"].to_numpy()[own])
    assert lines[3].get_label() == "100"
    assert ax.get_legend().get_title().get_text() == "damper.velocity [length/time]"


def test_values_that_are_not_all_positive_are_drawn_on_a_plain_axis(grid: tuple[Any, Any]) -> None:
    """Also where their sizes are decades apart: a logarithm would leave out the cases at 0 and below."""
    data, curves = grid
    for values in ([-100.0, 1.0, 10.0], [0.0, 1.0, 100.0]):
        other = data.assign_coords({"damper.velocity": values})
        line = plots.study_map(other, over="damper.velocity")
        assert line.get_xscale() == "linear"
        mesh = plots.study_map(other)
        assert mesh.get_xscale() == "linear"
        edges = mesh.collections[0].get_coordinates()[0, :, 0]
        np.testing.assert_allclose((edges[1:-1]), np.array(values[1:]) / 2 + np.array(values[:-1]) / 2)
        assert edges[0] == pytest.approx(values[0] - (edges[1] - values[0]))
        coloured = plots.study_curves(curves, other)
        assert len({line.get_color() for line in coloured.lines[:-1]}) == 3  # so many values of the parameter
    near = data.assign_coords({"damper.velocity": [1.0, 2.0, 3.0]})
    assert plots.study_map(near, over="damper.velocity").get_xscale() == "linear"
    assert plots.study_map(data, over="damper.velocity").get_xscale() == "log"


def test_cells_of_a_logarithmic_map_meet_half_way_there(grid: tuple[Any, Any]) -> None:
    edges = plots.study_map(grid[0]).collections[0].get_coordinates()[0, :, 0]
    np.testing.assert_allclose(edges, 10.0 ** np.array([-0.5, 0.5, 1.5, 2.5]))


def test_a_map_of_one_value_has_a_cell_around_it() -> None:
    data, _ = made({"damper.velocity": [10.0], "damper.mu": [0.2, 0.3]})
    mesh = plots.study_map(data).collections[0]
    np.testing.assert_allclose(mesh.get_coordinates()[0, :, 0], [9.5, 10.5])
    np.testing.assert_allclose(mesh.get_coordinates()[:, 0, 1], [0.15, 0.25, 0.35])


def test_a_line_is_broken_where_a_case_failed_and_the_case_is_crossed(grid: tuple[Any, Any]) -> None:
    data = grid[0].copy(deep=True)
    ax = plots.study_map(data.isel({"damper.mu": [1]}), over="damper.velocity")
    line, cross = ax.lines
    assert np.isnan(line.get_ydata()).tolist() == [False, True, False]
    assert cross.get_xdata().tolist() == [10.0]
    assert ax.get_legend() is not None
    assert plots.study_map(data.isel({"damper.mu": [0]}), over="damper.velocity").get_legend() is None


def test_of_hundreds_of_curves_some_are_drawn_and_that_is_said(
    grid: tuple[Any, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    data, curves = grid
    monkeypatch.setattr(study_module, "_FEW", 4)
    monkeypatch.setattr(study_module, "_MOST", 3)
    ax = plots.study_curves(curves, data)
    assert ax.get_title() == "3 of 5 curves"
    assert ax.get_legend() is None
    cases = [case for case in range(6) if case != 3]  # in the order of the velocity, evenly
    for line, case in zip(ax.lines[:-1], [cases[0], cases[2], cases[4]], strict=True):
        own = curves["case"].to_numpy() == case
        np.testing.assert_array_equal(line.get_xdata(), curves["omega"].to_numpy()[own])
    assert ax.get_figure().axes[-1].get_ylabel() == "damper.velocity [length/time]"


def test_parts_of_a_curve_are_not_joined(grid: tuple[Any, Any]) -> None:
    data, curves = grid
    broken = curves.copy(deep=True)
    first = np.flatnonzero(curves["case"].to_numpy() == 0)
    broken["branch_part"][first[5:]] = 2
    y = plots.study_curves(broken, data).lines[0].get_ydata()
    assert np.flatnonzero(np.isnan(y)).tolist() == [5]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda data, curves: plots.study_map(curves), "expected the dataset that ss.study returns"),
        (lambda data, curves: plots.study_map(data, "y"), "there is no dof 'y'"),
        (
            lambda data, curves: plots.study_map(data, over="damper.nu"),
            "no parameter 'damper.nu' in the study",
        ),
        (lambda data, curves: plots.study_curves(data, data), "expected the dataset in curves.nc"),
        (lambda data, curves: plots.study_curves(3, data), "expected the dataset in curves.nc"),
        (lambda data, curves: plots.study_map(data, ax=3), "expected matplotlib Axes|found 3"),
    ],
)
def test_wrong_arguments(grid: tuple[Any, Any], call: Any, sentence: str | None) -> None:
    with pytest.raises(InputError, match=sentence):
        call(*grid)


def test_a_map_is_one_figure_without_a_line(grid: tuple[Any, Any]) -> None:
    from matplotlib import pyplot

    before = len(pyplot.get_fignums())
    ax = plots.study_map(grid[0])
    assert len(pyplot.get_fignums()) == before + 1
    assert [line.get_label() for line in ax.lines] == ["did not complete"]
