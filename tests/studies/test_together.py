"""Cases solved side by side are those solved alone; which were is told of each."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import Outcome
from slipstick.studies import together
from slipstick.studies.plan import StudyPlan, make_plan
from slipstick.studies.solving import CaseSolved, Job, solve
from slipstick.studies.together import Portion, portions, solve_portion
from slipstick.verify.cases import oscillator

CHAIN = ss.MatrixStructure(
    M=[[1.0, 0.0], [0.0, 2.0]], C=[[0.5, -0.1], [-0.1, 0.4]], K=[[60.0, -20.0], [-20.0, 90.0]], dofs=["x", "y"]
)
"""Damped otherwise than by its modes."""


@pytest.fixture(scope="module")
def job() -> Job:
    return Job(problem=oscillator(velocity=10.0), span=(4.0, 8.0))


@pytest.fixture(scope="module")
def plan(job: Job) -> StudyPlan:
    return make_plan(job.problem, {"damper.velocity": [10.0, 40.0], "damper.mu": [0.2, 0.3]})


def side_by_side(*cases: int) -> Portion:
    return Portion(cases, lockstep=True)


def hold(job: Job, one: CaseSolved, alone: CaseSolved) -> None:
    """That two are the same but for rounding, the time they took and the road they went."""
    assert (one.message, one.warnings, one.outcome) == (alone.message, alone.warnings, alone.outcome)
    for name in set(alone.row) - {"seconds", "lockstep", "evaluations", "outcome"}:
        np.testing.assert_allclose(one.row[name], alone.row[name], rtol=1e-8, err_msg=name)
    a, b = (job.curve_layout.unpack(solved.curve) for solved in (one, alone))
    for name in ("omega", "amplitude", "dissipated_power", "peak_dof"):
        np.testing.assert_allclose(a[name], b[name], rtol=1e-7, atol=1e-9, err_msg=name)


def test_a_portion_is_its_cases_alone(job: Job, plan: StudyPlan) -> None:
    found = list(solve_portion(job, plan, side_by_side(0, 1, 2, 3)))
    assert [one.row["case"] for one in found] == [0, 1, 2, 3]
    assert [one.row["lockstep"] for one in found] == [1, 1, 1, 1]
    for case, one in enumerate(found):
        hold(job, one, solve(job, plan, case))


def test_parameters_of_the_structure_and_of_loads(job: Job) -> None:
    """Cases that differ in damping have a receptance each."""
    structure = ss.ModalStructure(omega=[6.3], mode_shapes=[[1.0]], damping_ratio=[0.03], dofs=["x"])
    modal = replace(job, problem=replace(job.problem, structure=structure))
    plan = make_plan(modal.problem, {"mode1.damping_ratio": [0.02, 0.05], "load.x.amplitude": [60.0, 120.0]})
    found = list(solve_portion(modal, plan, side_by_side(0, 1, 2, 3)))
    assert [one.row["lockstep"] for one in found] == [1, 1, 1, 1]
    assert len({float(one.row["peak_amplitude"][0]) for one in found}) == 4
    for case, one in enumerate(found):
        hold(modal, one, solve(modal, plan, case))


def test_a_case_that_cannot_be_computed_is_a_row_beside_the_others(job: Job, plan: StudyPlan) -> None:
    odd = replace(plan, values=np.array([[10.0, 0.2], [10.0, -1.0], [20.0, 0.3]]))
    found = list(solve_portion(job, odd, side_by_side(0, 1, 2)))
    assert [one.outcome for one in found] == [Outcome.COMPLETED, Outcome.FAILED, Outcome.COMPLETED]
    assert [one.row["lockstep"] for one in found] == [1, 0, 1]
    assert found[1].message == solve(job, odd, 1).message


def test_a_fault_beside_the_road_leaves_every_case_alone(
    job: Job, plan: StudyPlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(together.Lockstep, "branches", broken)
    found = list(solve_portion(job, plan, side_by_side(0, 1)))
    assert [one.row["lockstep"] for one in found] == [0, 0]
    assert all(one.outcome.ok for one in found)


def test_a_case_at_fault_leaves_what_is_beside_it_in_lockstep(
    job: Job, plan: StudyPlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = list(solve_portion(job, plan, side_by_side(0, 1, 2)))
    sound = together.Lockstep._branches

    def broken(self: Any) -> Any:
        if any(request.problem.contacts[0].contact.mu == 0.3 for request in self._requests):
            raise ZeroDivisionError
        return sound(self)

    monkeypatch.setattr(together.Lockstep, "_branches", broken)
    found = list(solve_portion(job, plan, side_by_side(0, 1, 2)))
    assert [one.row["lockstep"] for one in found] == [1, 0, 1]
    assert [one.curve.tobytes() for one in found[::2]] == [one.curve.tobytes() for one in whole[::2]]


def test_a_case_is_the_same_to_the_last_bit_whatever_is_beside_it(job: Job) -> None:
    """Alone, with others before and behind it and in another order; stuck and freely slipping ones among them."""
    of_several = replace(job.problem, structure=CHAIN, outputs=["x"])
    for problem, values in (
        (job.problem, [0.0, 0.1, 0.2, 0.3, 1.0, 50.0]),
        (of_several, [0.02, 0.1, 0.2, 0.3, 0.5, 1.0]),
    ):
        some = replace(job, problem=problem)
        hold_beside_others(some, make_plan(problem, {"damper.mu": values}))


def hold_beside_others(job: Job, plan: StudyPlan) -> None:
    whole = {one.row["case"]: one for one in solve_portion(job, plan, side_by_side(*range(6)))}
    assert [one.row["lockstep"] for one in whole.values()] == [1] * 6
    for cases in ((5, 4, 3, 2, 1, 0), (2,), (0,), (3, 1)):
        for one in solve_portion(job, plan, side_by_side(*cases)):
            other = whole[one.row["case"]]
            assert one.curve.tobytes() == other.curve.tobytes()
            assert {**one.row, "seconds": 0.0, **_arrays(one)} == {**other.row, "seconds": 0.0, **_arrays(other)}


def _arrays(solved: CaseSolved) -> dict[str, object]:
    return {name: value.tolist() for name, value in solved.row.items() if isinstance(value, np.ndarray)}


def test_what_is_solved_side_by_side(job: Job) -> None:
    assert portions(job, [3]) == [side_by_side(3)]
    assert portions(job, []) == []
    assert [len(portion.cases) for portion in portions(job, range(600))] == [200, 200, 200]
    assert [len(portion.cases) for portion in portions(job, range(600), 2)] == [100] * 6
    assert [len(portion.cases) for portion in portions(job, range(616), 2, tried=True)] == [16, *[100] * 6]
    assert [case for portion in portions(job, range(617), 3, tried=True) for case in portion.cases] == list(range(617))
    wide = replace(job, problem=replace(job.problem, harmonics=range(28)))
    assert len(portions(wide, range(256))) > 1  # the room of their Jacobians
    assert portions(replace(job, problem=replace(job.problem, harmonics=range(62))), [0]) == [Portion((0,))]
    over = replace(job, parameter="damper.velocity", span=(5.0, 15.0), omega=6.0)
    for alone in (replace(job, stability=True), over, replace(job, requested=(5.0,)), replace(job, span=(8.0, 8.0))):
        assert portions(alone, [0, 1]) == [Portion((0,)), Portion((1,))]


def test_the_study_says_how_each_case_was_solved(job: Job) -> None:
    found = ss.study(job.problem, {"damper.mu": [0.2, 0.3]}, omega=job.span, workers=1)
    assert found["lockstep"].values.tolist() == [1, 1]
    steady = ss.study(job.problem, {"damper.mu": [0.2]}, omega=job.span, workers=1, stability=True)
    assert steady["lockstep"].values.tolist() == [0]
    np.testing.assert_allclose(steady["peak_amplitude"][0], found["peak_amplitude"][0], rtol=1e-8)
