"""Which analysis made results: as it is written, and of files written before that as their contents tell."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.branch import Branch
from slipstick.io.loading import load_table
from slipstick.results.schema import ANALYSIS
from slipstick.results.table import ResultColumn, ResultTable
from slipstick.results.view import (
    after,
    analysis_of,
    analysis_of_journal,
    followed_text,
    frequency_unit,
    label_of,
    names_of,
    unit_of,
    values_of,
    view_of,
)

LOADED = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
DAMPER = ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=800.0)
PROBLEM = ss.Problem(
    LOADED, contacts=ss.ContactPair(name="damper", tangential="x", contact=DAMPER), loads=ss.Load(dof="x", sin=100.0),
    harmonics=range(4),
)  # fmt: skip
BELT = ss.Problem(
    ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[40.0]], dofs=["x"]), harmonics=range(4),
    contacts=ss.ContactPair(
        name="belt", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0),
        rubbing=ss.RubbingMotion(velocity=1.0),
    ),
)  # fmt: skip
SLIGHT = replace(PROBLEM, structure=ss.MatrixStructure(M=[[1.0]], C=[[0.01]], K=[[40.0]], dofs=["x"]))
FEW = {"max_points": 3}
MADE = {
    "response": lambda: ss.forced_response(PROBLEM, omega=(5.0, 6.0), options=FEW),
    "linear": lambda: ss.linear_response(PROBLEM, omega=[5.0, 6.0], state="stuck"),
    "parameter": lambda: ss.parameter_response(PROBLEM, "damper.mu", (0.2, 0.3), omega=9.0, options=FEW),
    "steady": lambda: ss.steady_response(PROBLEM, "damper.mu", 0.2, omega=9.0),
    "track": lambda: ss.track_peak(PROBLEM, "damper.mu", (0.3, 0.31), omega=(8.0, 11.0)),
    "optimal": lambda: ss.optimal(PROBLEM, "damper.normal_load", omega=(2.0, 15.0), start=500.0).branch,
    "modes": lambda: ss.nonlinear_modes(SLIGHT, amplitude=(0.01, 0.011)),
    "cycles": lambda: ss.limit_cycles(BELT, "belt.mu", (0.2, 0.3)),
    "wear": lambda: ss.wear(PROBLEM, 1e-6, (0, 1), omega=9.0),
}
BEFORE = {"linear": "response", "steady": "parameter", "optimal": "track"}
"""What files written before the attribute cannot tell from another analysis, whose view they share."""


@pytest.mark.parametrize("analysis", MADE)
def test_results_say_their_analysis_and_files_without_it_tell_it(analysis: str, tmp_path: Path) -> None:
    branch = MADE[analysis]()
    assert len(branch)
    assert branch.table.attrs[ANALYSIS] == analysis
    view = view_of(branch.table)
    assert view.over[0] in branch.table
    del branch.table.attrs[ANALYSIS]
    before = load_table(Branch.save(branch, tmp_path / "before.nc"))
    assert before.attrs[ANALYSIS] == BEFORE.get(analysis, analysis)
    assert view_of(before) == view


def test_journals_written_before_are_known_by_what_they_say() -> None:
    assert analysis_of_journal({"study": "hash", "case_path": ""}) == "study"
    assert analysis_of_journal({"run_up": "hash"}) == "run_up"
    assert analysis_of_journal({"analysis": "wear", "problem": "hash"}) == "wear"
    assert analysis_of_journal({"problem": "hash"}) == ""


def test_what_is_no_result_is_of_no_analysis() -> None:
    assert analysis_of(ResultTable({})) == ""
    assert analysis_of(ResultTable({}, {"study_parameters": "damper.mu"})) == "curves"
    assert view_of(ResultTable({}, {ANALYSIS: "of tomorrow"})).over == ("omega",)


def table(**attributes: str) -> ResultTable:
    """Two points of a length and a rotation."""
    columns = {
        "omega": ResultColumn(("point",), np.array([10.0, 20.0]), {"units": "rad/s", "long_name": "frequency"}),
        "dof": ResultColumn(("dof",), np.array(["n1x", "n1rx"])),
        "amplitude": ResultColumn(("point", "dof"), np.array([[2.0, 1e-4], [1.0, 1e-4]]), {"units": "mm or rad"}),
        "mean": ResultColumn(("point", "dof"), np.array([[1e-12, 1e-12], [np.nan, 1e-16]]), {"units": "mm or rad"}),
        "dissipated_power": ResultColumn(("point",), np.zeros(2), {"units": "N mm/s"}),
        "truncation": ResultColumn(("point",), np.zeros(2), {"units": "1"}),
    }
    return ResultTable(columns, {"length_unit": "mm", "force_unit": "N", "time_unit": "s", **attributes})


@pytest.mark.parametrize("data", [table(), table().to_dataset()], ids=["table", "dataset"])
def test_names_labels_and_units(data: object) -> None:
    assert names_of(data, "dof") == ["n1x", "n1rx"]
    assert names_of(data, "contact") == []
    assert label_of(data, "omega") == "Frequency"
    assert label_of(data, "dissipated_power") == "Dissipated power"
    assert [unit_of(data, "amplitude", dof) for dof in ("n1x", "n1rx")] == ["mm", "rad"]
    assert unit_of(data, "amplitude") == "mm or rad"
    assert (unit_of(data, "dissipated_power"), after(data, "dissipated_power")) == ("mW", " mW")
    assert (unit_of(data, "truncation"), after(data, "truncation")) == ("", "")


@pytest.mark.parametrize("data", [table(), table().to_dataset()], ids=["table", "dataset"])
def test_a_mean_that_is_rounding_is_zero_beside_motion_of_its_unit(data: object) -> None:
    np.testing.assert_array_equal(values_of(data, "mean", "dof", "n1x"), [0.0, np.nan])
    np.testing.assert_array_equal(values_of(data, "mean", "dof", "n1rx"), [1e-12, 0.0])


def test_frequencies_are_shown_in_the_unit_of_the_case_where_that_has_a_meaning() -> None:
    assert frequency_unit(table()) == "rad/s"
    assert frequency_unit(table(frequency_unit="rpm")) == "rpm"
    assert frequency_unit(table(frequency_unit="rpm", time_unit="ms")) == "rad/ms"
    assert followed_text(table(frequency_unit="rpm"), 10.0) == "10 rad/s (95.493 rpm)"
