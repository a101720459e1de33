"""Cases become a dataset over their parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipstick.studies.plan import make_plan
from slipstick.studies.solving import CaseSolved, Job, solve
from slipstick.studies.table import curves_dataset, study_attributes, study_dataset
from slipstick.verify.cases import oscillator


@pytest.fixture(scope="module")
def job() -> Job:
    return Job(problem=oscillator(velocity=10.0), span=(5.0, 7.0))


GIVEN = {"damper.velocity": [10.0, 20.0], "damper.mu": [0.2, 0.3, 0.4]}


def test_a_grid_has_its_parameters_as_dimensions(job: Job) -> None:
    plan = make_plan(job.problem, GIVEN)
    found = {case: solve(job, plan, case) for case in (0, 5)}
    found[1] = CaseSolved.failed(1, "it broke")
    data = study_dataset(job, plan, found, study_attributes(job, plan, found, {"case": "text"}))
    assert data["peak_amplitude"].dims == ("damper.velocity", "damper.mu", "dof")
    assert data["damper.velocity"].attrs["units"] == "length/time"
    there = data.sel({"damper.velocity": 20.0, "damper.mu": 0.4})
    assert (int(there["case"]), str(there["outcome"].item())) == (5, "COMPLETED")
    assert there["peak_amplitude"].to_numpy() == found[5].row["peak_amplitude"]
    assert data["outcome"].to_numpy().tolist() == [["COMPLETED", "FAILED", ""], ["", "", "COMPLETED"]]
    assert str(data["message"].to_numpy()[0, 1]) == "it broke"
    assert np.isnan(data["peak_amplitude"].to_numpy()[0, 1:]).all()
    assert data.attrs["outcome_text"] == "3 of 6 cases are computed, 1 of them did not complete"
    assert data.attrs["outcome"] == "INTERRUPTED"
    assert data.attrs["case"] == "text"


def test_samples_lie_along_case(job: Job) -> None:
    plan = make_plan(job.problem, {"damper.mu": [0.2, 0.4]}, method="sobol", samples=4, seed=1)
    found = {case: solve(job, plan, case) for case in range(4)}
    data = study_dataset(job, plan, found, study_attributes(job, plan, found, {}))
    assert data["peak_amplitude"].dims == ("case", "dof")
    np.testing.assert_array_equal(data["damper.mu"].to_numpy(), plan.values[:, 0])
    assert (data.attrs["study_method"], data.attrs["study_seed"], data.attrs["outcome"]) == ("sobol", 1, "COMPLETED")


def test_curves_lie_one_after_another(job: Job) -> None:
    plan = make_plan(job.problem, GIVEN)
    found = {case: solve(job, plan, case) for case in (4, 2)}
    curves = curves_dataset(job, found, {})
    assert list(dict.fromkeys(curves["case"].to_numpy().tolist())) == [2, 4]
    one = curves.isel(point=curves["case"].to_numpy() == 4)
    assert float(one["amplitude"].max()) == found[4].row["peak_amplitude"][0]
    assert curves_dataset(job, {}, {}).sizes["point"] == 0


def test_so_many_warnings_are_kept_each_once(job: Job) -> None:
    plan = make_plan(job.problem, {"damper.mu": [0.2, 0.3]})
    failed = CaseSolved.failed(0, "it broke")
    said = [replace(failed, warnings=tuple(f"w{i}" for i in range(k, k + 15))) for k in (0, 10)]
    attributes = study_attributes(job, plan, dict(enumerate(said)), {})
    assert attributes["warnings"].splitlines() == [f"w{i}" for i in range(20)]
    assert "study_seed" not in attributes
    assert attributes["outcome"] == "FAILED"
    assert attributes["outcome_text"] == "2 of 2 cases are computed, 2 of them did not complete"
