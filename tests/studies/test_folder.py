"""The folder of a study: nothing is lost, nothing is mixed up, shares come together."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.io.loading import load_dataset
from slipstick.io.lock import FolderLock
from slipstick.studies.folder import CURVES_FILE, STUDY_FILE, Share, StudyFolder
from slipstick.studies.plan import make_plan
from slipstick.studies.solving import CaseSolved, Job, solve
from slipstick.verify.cases import oscillator

JOB = Job(problem=oscillator(velocity=10.0), span=(5.0, 7.0))
PLAN = make_plan(JOB.problem, {"damper.velocity": [10.0, 20.0, 30.0]})


@pytest.fixture(scope="module")
def solved() -> list[CaseSolved]:
    return [solve(JOB, PLAN, case) for case in range(3)]


def opened(folder: Path, **more: object) -> StudyFolder:
    return StudyFolder(folder, JOB, PLAN, about={"case": "text"}, **more)  # type: ignore[arg-type]


def test_cases_survive_their_process(tmp_path: Path, solved: list[CaseSolved]) -> None:
    place = opened(tmp_path / "out")
    place.add(solved[1])
    place.add(CaseSolved.failed(0, "it broke"))
    place._lock.release()  # as the system does when a process ends
    again = opened(tmp_path / "out")
    assert again.todo() == [2]
    assert again.todo(missing=True) == [0, 2]
    assert again.found[1].curve.tobytes() == solved[1].curve.tobytes()
    assert (again.found[1].message, again.found[0].message) == (solved[1].message, "it broke")
    again.add(solved[0])
    again.add(solved[2])
    data = again.write()
    again.release()
    assert data["outcome"].to_numpy().tolist() == ["COMPLETED"] * 3
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [CURVES_FILE, STUDY_FILE]
    assert load_dataset(tmp_path / "out" / STUDY_FILE).identical(data)


def test_a_torn_record_loses_its_case_alone(tmp_path: Path, solved: list[CaseSolved]) -> None:
    place = opened(tmp_path)
    place.add(solved[0])
    place.add(solved[1])
    place.release()
    journal = tmp_path / "study.journal"
    journal.write_bytes(journal.read_bytes()[:-5])
    again = opened(tmp_path)
    assert again.todo() == [1, 2]
    again.add(solved[1])
    again.release()
    assert opened(tmp_path).todo() == [2]


def test_shares_come_together(tmp_path: Path, solved: list[CaseSolved]) -> None:
    for index in (1, 0):
        place = opened(tmp_path, share=Share(index, 2))
        assert place.todo() == list(range(index, 3, 2))
        for case in place.todo():
            place.add(solved[case])
        place.release()
    assert len(list(tmp_path.glob("study-*-of-2.journal"))) == 2
    whole = opened(tmp_path)
    assert whole.todo() == []
    data = whole.write()
    whole.release()
    np.testing.assert_array_equal(
        data["peak_amplitude"].to_numpy()[:, 0], [one.row["peak_amplitude"][0] for one in solved]
    )
    assert not list(tmp_path.glob("*.journal"))


def test_another_study_is_refused(tmp_path: Path, solved: list[CaseSolved]) -> None:
    place = opened(tmp_path)
    place.add(solved[0])
    place.release()
    other = make_plan(JOB.problem, {"damper.velocity": [10.0, 20.0, 31.0]})
    with pytest.raises(InputError, match="another study is in it, or the case has changed since"):
        StudyFolder(tmp_path, JOB, other, about={})
    with pytest.raises(InputError, match="another study is in it"):
        StudyFolder(tmp_path, Job(problem=JOB.problem, span=(5.0, 7.1)), PLAN, about={})


def test_two_processes(tmp_path: Path) -> None:
    place = opened(tmp_path)
    with pytest.raises(InputError, match="another run writes there"):
        opened(tmp_path)
    with pytest.raises(InputError, match="another run writes there"):
        opened(tmp_path, share=Share(0, 2))
    place.release()
    held = FolderLock(tmp_path, ".study-0-of-2.lock")
    with pytest.raises(InputError, match="another run writes there"):
        opened(tmp_path)
    opened(tmp_path, share=Share(1, 2)).release()
    held.release()


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        opened(tmp_path / "file" / "out")
