"""Figures of studies: what is drawn is in the dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from slipstick import plots
from slipstick.errors import InputError
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
