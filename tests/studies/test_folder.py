"""The folder of a study: nothing is lost, nothing is mixed up, shares come together."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.io.journal import Journal, read_journal
from slipstick.io.loading import load_dataset
from slipstick.io.lock import FolderLock
from slipstick.studies.folder import CURVES_FILE, STUDY_FILE, Share, StudyFolder, study_mark
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
    assert again.cases[1].curve.tobytes() == solved[1].curve.tobytes()
    assert (again.cases[1].message, again.cases[0].message) == (solved[1].message, "it broke")
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
    with pytest.raises(InputError, match="another study is in it"):
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


def test_results_that_cannot_be_written_leave_the_cases(
    tmp_path: Path, solved: list[CaseSolved], monkeypatch: pytest.MonkeyPatch
) -> None:
    place = opened(tmp_path)
    for one in solved:
        place.add(one)

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("slipstick.replacing._sync", full)
        with pytest.raises(InputError, match=r"cannot be written \(no space left on device\)"):
            place.write()
    assert (tmp_path / "study.journal").exists()
    assert opened_after(place).todo() == []
    again = opened(tmp_path)
    (tmp_path / ".study.journal.1-1.tmp").write_bytes(b"left by a killed process")
    again.write()
    again.release()
    assert sorted(p.name for p in tmp_path.iterdir()) == [CURVES_FILE, STUDY_FILE]


def opened_after(place: StudyFolder) -> StudyFolder:
    place.release()
    again = opened(place.folder)
    again.release()
    return again


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_of_two_answers_to_one_case_the_complete_one_counts(
    tmp_path: Path, solved: list[CaseSolved], order: tuple[int, int]
) -> None:
    """Whichever journal is read first; of two that failed the last one."""
    given = [solved[0], CaseSolved.failed(0, "it broke")]
    for index, which in enumerate(order):
        share = opened(tmp_path, share=Share(index=index, of=2))
        share.add(given[which])
        share.add(CaseSolved.failed(2, f"by {index}"))
        share.release()
    found = opened_after(opened(tmp_path)).cases
    assert found[0].outcome.ok
    assert found[0].curve.tobytes() == solved[0].curve.tobytes()
    assert found[2].message == "by 1"


def test_a_case_that_was_made_anew_stands_beside_the_one_that_failed(tmp_path: Path, solved: list[CaseSolved]) -> None:
    place = opened(tmp_path)
    place.add(CaseSolved.failed(1, "it broke"))
    place.add(solved[1])
    assert place.todo(missing=True) == [0, 2]
    assert len(read_journal(tmp_path / "study.journal").rows) == 2
    assert opened_after(place).cases[1].outcome.ok
    share = opened(tmp_path, share=Share(index=1, of=2))
    assert share.todo() == []
    share.release()
    assert Share(index=1, of=2).name == "study-1-of-2"
    assert [case in Share(index=1, of=2) for case in range(4)] == [False, True, False, True]


@pytest.mark.parametrize(("first", "second"), [(Share(), Share(index=0, of=2)), (Share(index=1, of=2), Share())])
def test_shares_and_the_whole_do_not_compute_side_by_side(tmp_path: Path, first: Share, second: Share) -> None:
    place = opened(tmp_path, share=first)
    with pytest.raises(InputError, match="another run writes there"):
        opened(tmp_path, share=second)
    place.release()
    opened(tmp_path, share=second).release()
    assert not list(tmp_path.glob(".*.lock"))


@pytest.mark.parametrize("wrong", [{"case": 3}, {"case": -1}])
def test_cases_that_cannot_be_are_damage(tmp_path: Path, solved: list[CaseSolved], wrong: dict[str, int]) -> None:
    place = opened(tmp_path)
    values = dict(zip(PLAN.names, PLAN.values[0].tolist(), strict=True))
    row = place._layout.pack({**solved[0].row, **values, **wrong})
    journal = Journal(tmp_path / "study.journal", place._layout, {"study": study_mark(JOB, PLAN)})
    journal.append(row, {"message": "", "warnings": [], "curve": solved[0].curve.ravel()})
    journal.close(remove=False)
    place.release()
    with pytest.raises(InputError, match="a case in its journal is damaged"):
        opened(tmp_path)


@pytest.mark.parametrize(
    "note", [{}, {"message": "", "warnings": [], "curve": [1.0, 2.0]}, {"message": "", "curve": []}]
)
def test_notes_that_are_none_are_damage(tmp_path: Path, solved: list[CaseSolved], note: dict[str, object]) -> None:
    place = opened(tmp_path)
    values = dict(zip(PLAN.names, PLAN.values[0].tolist(), strict=True))
    journal = Journal(tmp_path / "study.journal", place._layout, {"study": study_mark(JOB, PLAN)})
    journal.append(place._layout.pack({**solved[0].row, **values}), note)
    journal.close(remove=False)
    place.release()
    with pytest.raises(InputError, match="a case in its journal is damaged"):
        opened(tmp_path)


def test_a_study_is_known_by_all_that_its_numbers_depend_on() -> None:
    same = study_mark(Job(problem=oscillator(velocity=10.0), span=(5.0, 7.0)), PLAN)
    assert study_mark(JOB, PLAN) == same
    others = [
        replace(JOB, span=(5.0, 8.0)), replace(JOB, requested=(6.0,)), replace(JOB, peaks_of=["x"]),
        replace(JOB, options={"max_step": 0.1}), replace(JOB, problem=oscillator(velocity=11.0)),
        replace(JOB, parameter="damper.mu", omega=6.0), replace(JOB, parameter="damper.mu", omega=7.0),
    ]  # fmt: skip
    plans = [
        make_plan(JOB.problem, {"damper.velocity": [10.0, 20.0, 31.0]}), make_plan(JOB.problem, {"damper.mu": [0.1]}),
        make_plan(JOB.problem, {"damper.velocity": [10.0, 20.0, 30.0]}, method="list"),
    ]  # fmt: skip
    marks = [study_mark(job, PLAN) for job in others] + [study_mark(JOB, plan) for plan in plans]
    assert len({same, *marks}) == 1 + len(marks)
