"""A study in one call."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from helpers.faults import raises_fault
from helpers.study_case import CASE

import slipstick as ss
from slipstick.analysis.events import CaseDone
from slipstick.io.loading import load_dataset
from slipstick.studies import together, workers
from slipstick.studies.together import Portion
from slipstick.verify.cases import oscillator

GIVEN = {"damper.velocity": [10.0, 30.0], "damper.mu": [0.2, 0.3]}


@pytest.fixture(scope="module")
def problem() -> ss.Problem:
    return oscillator(velocity=10.0)


def numbers(data: xarray.Dataset) -> xarray.Dataset:
    """What does not tell of the time."""
    return data.drop_vars("seconds").drop_attrs(deep=False)


def test_a_study_is_the_loop_that_a_user_would_write(problem: ss.Problem) -> None:
    found = ss.study(problem, GIVEN, omega=(5.0, 7.0), workers=1)
    for v in GIVEN["damper.velocity"]:
        for mu in GIVEN["damper.mu"]:
            changed = problem.with_parameter("damper.velocity", v).with_parameter("damper.mu", mu)
            branch = ss.forced_response(changed, omega=(5.0, 7.0))
            here = found.sel({"damper.velocity": v, "damper.mu": mu, "dof": "x"})
            assert float(here["peak_amplitude"]) == pytest.approx(float(branch.dataset["amplitude"].max()), rel=1e-8)
    assert found.attrs["outcome"] == "COMPLETED"


def test_a_folder_keeps_it_and_only_what_is_not_there_is_computed(problem: ss.Problem, tmp_path: Path) -> None:
    def stop(event: CaseDone) -> None:
        if event.done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ss.study(problem, GIVEN, omega=(5.0, 7.0), workers=1, folder=tmp_path, listeners=stop)
    assert load_dataset(tmp_path / "study.nc").attrs["outcome_text"].startswith("2 of 4 cases are computed")
    heard: list[CaseDone] = []
    found = ss.study(problem, GIVEN, omega=(5.0, 7.0), workers=1, folder=tmp_path, listeners=heard.append)
    assert [event.case for event in heard] == [2, 3]
    assert heard[0].values == {"damper.velocity": 30.0, "damper.mu": 0.2}
    assert (heard[-1].done, heard[-1].total) == (4, 4)
    assert numbers(found).identical(numbers(ss.study(problem, GIVEN, omega=(5.0, 7.0), workers=1)))
    assert numbers(load_dataset(tmp_path / "study.nc")).identical(numbers(found))


@pytest.mark.parametrize("lost", ["study.nc", "curves.nc"])
def test_a_file_that_was_lost_is_made_again_from_the_cases(
    problem: ss.Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lost: str
) -> None:
    """A study with a case that failed keeps its journal; nothing is computed twice."""
    monkeypatch.setattr(workers, "portions", lambda job, todo, count, tried: [Portion((case,)) for case in todo])
    monkeypatch.setattr(
        together,
        "solve",
        lambda job, plan, case, own=together.solve: (
            own(job, plan, case) if case == 0 else workers.CaseSolved.failed(case, "it broke")
        ),
    )
    given = {"damper.velocity": [10.0, 30.0]}
    first = ss.study(problem, given, omega=(5.0, 7.0), workers=1, folder=tmp_path)
    kept = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    assert {"study.nc", "curves.nc", "study.journal"} == set(kept)
    (tmp_path / lost).unlink()
    heard: list[CaseDone] = []
    again = ss.study(problem, given, omega=(5.0, 7.0), workers=1, folder=tmp_path, listeners=heard.append)
    assert heard == []
    assert again.identical(first)
    assert (tmp_path / lost).exists()
    assert first.attrs["outcome"] == "FAILED"
    assert first["message"].to_numpy().tolist()[1] == "it broke"


def test_order_does_not_matter(problem: ss.Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = workers.solutions
    forward = ss.study(problem, GIVEN, omega=(5.0, 7.0), workers=1)
    monkeypatch.setattr(
        "slipstick.studies.study.solutions",
        lambda job, plan, todo, **more: whole(job, plan, list(todo)[::-1], **more),
    )
    assert numbers(ss.study(problem, GIVEN, omega=(5.0, 7.0), workers=1)).identical(numbers(forward))


def test_missing_reruns_what_did_not_complete(
    problem: ss.Problem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arguments: dict[str, Any] = {"omega": (5.0, 7.0), "workers": 1, "folder": tmp_path}
    with monkeypatch.context() as patch:
        patch.setattr("slipstick.analysis.curve.follow.CurveRequest.solutions", lambda request: 1 / 0)
        patch.setattr("slipstick.analysis.curve.lockstep.Lockstep.branches", lambda curves: 1 / 0)
        failed = ss.study(problem, {"damper.mu": [0.2]}, **arguments)
    assert failed["outcome"].to_numpy().tolist() == ["FAILED"]
    assert ss.study(problem, {"damper.mu": [0.2]}, **arguments)["outcome"].to_numpy().tolist() == ["FAILED"]
    found = ss.study(problem, {"damper.mu": [0.2]}, missing=True, **arguments)
    assert found["outcome"].to_numpy().tolist() == ["COMPLETED"]
    assert np.isfinite(found["peak_amplitude"].to_numpy()).all()


@pytest.mark.parametrize(
    ("given", "options", "sentence"),
    [
        (None, {"omega": (1.0, 2.0)}, "study, problem: found None; expected an ss.Problem or an ss.Case"),
        ("problem", {}, "study, omega is missing"),
        ("problem", {"omega": (2.0, 2.0)}, "frequency"),
        ("problem", {"omega": (1.0, 2.0), "workers": 0}, "study, workers: found 0"),
        ("problem", {"omega": (1.0, 2.0), "client": "tcp://x"}, "study, client: found 'tcp://x'"),
        ("problem", {"omega": (1.0, 2.0), "missing": True}, "study, missing: it is given without folder"),
        ("problem", {"omega": (1.0, 2.0), "listeners": 3}, "study, listeners: found 3"),
        ("problem", {"omega": (1.0, 2.0), "options": {"max_stepp": 1}}, "did you mean 'max_step'?"),
    ],
)
def test_wrong_arguments(problem: ss.Problem, given: Any, options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ss.InputError) as caught:
        ss.study(problem if given == "problem" else given, GIVEN, **options)
    assert sentence in str(caught.value)


def test_a_case_says_itself_what_is_followed(tmp_path: Path) -> None:
    case = ss.Case.from_text(CASE)
    assert ss.study(case, workers=1)["peak_amplitude"].sizes == {"damper.velocity": 3, "dof": 1}
    with raises_fault("study", "omega", says="it is given, but the case says what is followed"):
        ss.study(case, omega=(1.0, 2.0))


def test_a_study_tells_stability_of_peaks_and_curves() -> None:
    """Sliding beyond its flutter is unstable everywhere, below it nowhere."""
    structure = ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"])
    contact = ss.FrictionContact(kt=200.0, mu=0.3, kn=40.0, gap=-1.25)
    pad = ss.ContactPair(
        name="pad", contact=contact, tangential="x", normal="y", rubbing=ss.RubbingMotion(velocity=100.0)
    )
    problem = ss.Problem(structure, contacts=pad, loads=ss.Load(dof="x", sin=0.1), harmonics=range(6))
    found = ss.study(problem, {"pad.mu": [0.3, 0.7]}, omega=(6.0, 7.0), stability=True, options={"max_step": 0.2})
    assert found.peak_stable.values.tolist() == [[1, 1], [0, 0]]
    assert found.unstable_points.values[0] == 0
    assert found.unstable_points.values[1] == found.points.values[1]


def test_a_client_that_is_none_is_told(problem: ss.Problem) -> None:
    with raises_fault("study", "client", found="3"):
        ss.study(problem, GIVEN, omega=(5.0, 7.0), client=3)
