"""Curves followed side by side are those followed alone: the same points, peaks, turning points and warnings."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.curve import lockstep
from slipstick.analysis.curve.follow import CurveRequest, frequency_request
from slipstick.analysis.curve.lockstep import Lockstep, alike, in_lockstep
from slipstick.analysis.curve.lockstep_events import Events
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.inputs import Assigned
from slipstick.balance.many import ManyBalances, same_form
from slipstick.results import record
from slipstick.results.solutions import Solutions

ONE = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
TWO = ss.MatrixStructure(
    M=[[1.0, 0.0], [0.0, 2.0]], C=[[0.5, -0.1], [-0.1, 0.4]], K=[[60.0, -20.0], [-20.0, 90.0]], dofs=["x", "y"]
)


def damper(kt: float, mu: float, load: float, velocity: float = 0.0, force: float = 100.0, top: int = 6) -> ss.Problem:
    """The oscillator with one friction contact under a constant normal load."""
    law = ss.FrictionContact(kt=kt, mu=mu, kn=1.0, gap=-load)
    rubbing = ss.RubbingMotion(velocity=velocity) if velocity else None
    pair = ss.ContactPair(name="damper", contact=law, tangential="x", rubbing=rubbing)
    return ss.Problem(ONE, contacts=[pair], loads=[ss.Load(dof="x", sin=force)], harmonics=range(top + 1))


def stop(kn: float, gap: float, force: float = 20.0) -> ss.Problem:
    """An oscillator that meets an elastic stop: folds on the right of its resonance."""
    law = ss.FrictionContact(kt=0.0, mu=0.0, kn=kn, gap=gap)
    pair = ss.ContactPair(name="stop", contact=law, normal="x")
    return ss.Problem(ONE, contacts=[pair], loads=[ss.Load(dof="x", cos=force)], harmonics=range(8))


def two_contacts(kt: float, mu: float, gap: float, velocity: float) -> ss.Problem:
    """A friction contact that opens, and one that is always closed, on two dofs."""
    opening = ss.ContactPair(
        name="opening", contact=ss.FrictionContact(kt=kt, mu=mu, kn=60.0, gap=gap), tangential="x", normal="y"
    )
    closed = ss.ContactPair(
        name="closed", contact=ss.FrictionContact(kt=30.0, mu=0.3, kn=1.0, gap=-40.0), tangential="y",
        rubbing=ss.RubbingMotion(velocity=velocity),
    )  # fmt: skip
    loads = [ss.Load(dof="x", cos=30.0), ss.Load(dof="y", sin=25.0)]
    return ss.Problem(TWO, contacts=[opening, closed], loads=loads, harmonics=range(5))


def requests_of(problems: Sequence[ss.Problem], span: tuple[float, float], **more: Any) -> list[CurveRequest]:
    return [frequency_request(problem, span, (), None, more or None) for problem in problems]


def side_by_side(problems: Sequence[ss.Problem], span: tuple[float, float]) -> list[Solutions | None]:
    requests = requests_of(problems, span)
    assert all(in_lockstep(request) and alike(requests[0], request) for request in requests)
    return Lockstep(requests).branches()


def of_kind(branch: Solutions, kind: str) -> int:
    return int(np.sum(branch.table["kind"].to_numpy() == kind))


def hold(found: Solutions, problem: ss.Problem, span: tuple[float, float]) -> None:
    """That a curve is the one followed alone."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # they are compared below
        alone = ss.forced_response(problem, omega=span)
    assert found.outcome is alone.outcome
    assert found.message == alone.message
    assert found.warnings == alone.warnings
    for kind in ("turning point", "near turning point", "peak", "near peak", "start", "end"):
        assert of_kind(found, kind) == of_kind(alone, kind), kind
    for dof in problem.outputs or ():
        np.testing.assert_allclose(found.peaks(dof), alone.peaks(dof), rtol=1e-8)
    assert abs(len(found) - len(alone)) <= 2
    if len(found) == len(alone):
        assert found.table["kind"].to_numpy().tolist() == alone.table["kind"].to_numpy().tolist()
        solved = alone.table["kind"].to_numpy() != "interpolated"
        for name in ("omega", "amplitude", "mean", "displacement", "dissipated_power", "stick_fraction"):
            expected = alone.table[name].to_numpy()
            scale = max(np.abs(expected).max(), 0.01)  # rounding beside the motion, of order one, is not compared
            error = np.abs(found.table[name].to_numpy() - expected).reshape(len(found), -1).max(axis=1)
            # peaks at corners are known to 5e-9; a stick that begins there grows with the root of that: 6e-6 off
            assert error[solved].max() <= (2e-5 if name == "stick_fraction" else 1e-7 * scale), name
            assert error.max() <= 2e-4 * scale, name
        estimate, expected = (one.table["truncation"].to_numpy() for one in (found, alone))
        # it jumps at a corner, and a peak there is on either side: by up to twofold, at 7 points of 8 rubbing dampers
        differs = np.flatnonzero(~np.isclose(estimate, expected, rtol=1e-3, atol=1e-8))
        peaks = np.flatnonzero(alone.table["kind"].to_numpy() == "peak")
        assert all(np.abs(peaks - k).min(initial=len(alone)) <= 1 for k in differs)


def randomly(make: Any, count: int, seed: int, *ranges: tuple[float, float]) -> list[ss.Problem]:
    generator = np.random.default_rng(seed)
    return [make(*(float(generator.uniform(*ends)) for ends in ranges)) for _ in range(count)]


def test_vibrations_beside_far_larger_means() -> None:
    """Their peaks are those without the mean; where it hides the vibration the same warning is given."""
    problems = []
    for static in (0.0, 1e8, 1e12):
        loads = [ss.Load(dof="x", sin=100.0), ss.Load(dof="x", harmonic=0, cos=static)]
        law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
        pair = ss.ContactPair(name="damper", contact=law, tangential="x")
        problems.append(ss.Problem(ONE, contacts=[pair], loads=loads, harmonics=range(7)))
    branches = [branch for branch in side_by_side(problems, (2.0, 15.0)) if branch is not None]
    assert len(branches) == 3
    kinds = [branch.table["kind"].to_numpy() == "peak" for branch in branches]
    peaks = [np.ravel(branch.table["amplitude"].to_numpy()[kind]) for branch, kind in zip(branches, kinds, strict=True)]
    np.testing.assert_allclose(peaks[1], peaks[0], rtol=1e-8)
    hidden = ["do not resolve the vibration" in "".join(branch.warnings) for branch in branches]
    assert hidden == [False, False, True]


def test_evaluations_are_those_of_each_balance() -> None:
    problems = randomly(two_contacts, 3, 1, (20.0, 60.0), (0.1, 0.5), (-0.3, 0.2), (0.0, 20.0))
    requests = requests_of(problems, (3.0, 12.0))
    many = ManyBalances([r.balance for r in requests], [r.inputs for r in requests])
    generator, which = np.random.default_rng(2), np.array([2, 0, 1, 1])
    states = generator.normal(size=(4, requests[0].balance.size + 1))
    states[:, -1] = generator.uniform(3.0, 12.0, 4)
    residual, by_state = many.evaluate(which, states)
    for i, state, R, J in zip(which, states, residual, by_state, strict=True):
        alone = FrequencySystem(requests[i].balance, requests[i].inputs).evaluate(state[:-1], float(state[-1]))
        np.testing.assert_array_equal(R, alone.residual)
        np.testing.assert_array_equal(J[:, :-1], alone.jacobian.matrix)
        np.testing.assert_allclose(J[:, -1], alone.parameter_derivative, rtol=1e-12, atol=1e-14)
    states[1, 0], states[2, -1] = np.nan, -1.0
    residual, _ = many.evaluate(which, states)
    assert np.isnan(residual[[1, 2]]).all()
    assert np.isfinite(residual[[0, 3]]).all()


@pytest.mark.parametrize("velocity", [0.0, 10.0, 300.0])
def test_dampers_with_stick_and_slip(velocity: float) -> None:
    problems = randomly(lambda kt, mu, load: damper(kt, mu, load, velocity), 4, 3, (60, 140), (0.2, 0.4), (500, 1100))
    for found, problem in zip(side_by_side(problems, (2.0, 15.0)), problems, strict=True):
        assert found is not None
        hold(found, problem, (2.0, 15.0))


def test_folds_of_an_elastic_stop() -> None:
    span = (4.0, 11.0)
    problems = [*randomly(stop, 3, 5, (20.0, 120.0), (0.5, 2.0)), stop(80.0, 1e3)]
    found = side_by_side(problems, span)
    assert sum(branch is not None for branch in found) >= 3
    assert any(of_kind(branch, "turning point") >= 2 for branch in found if branch is not None)
    for branch, problem in zip(found, problems, strict=True):
        if branch is not None:
            hold(branch, problem, span)


def test_several_contacts_that_open_and_close() -> None:
    span = (3.0, 12.0)
    problems = randomly(two_contacts, 3, 7, (20.0, 60.0), (0.1, 0.5), (-0.3, 0.2), (0.0, 20.0))
    found = side_by_side(problems, span)
    assert sum(branch is not None for branch in found) >= 2
    for branch, problem in zip(found, problems, strict=True):
        if branch is not None:
            hold(branch, problem, span)


def test_a_step_with_no_solution_in_its_middle_is_left_to_be_taken_alone() -> None:
    """Shorter steps are taken there, and no peak is left that could not be narrowed."""
    structure = ss.ModalStructure(
        omega=[5.6085], mode_shapes=[[0.3624], [0.31327]], damping_ratio=[0.0232], dofs=["x", "y"]
    )
    held = ss.ContactPair(
        name="held", contact=ss.FrictionContact(kt=31.42, mu=0.3172, normal_load=247.0), tangential="y",
        rubbing=ss.RubbingMotion(velocity=10.0),
    )  # fmt: skip
    opening = ss.ContactPair(
        name="opening", contact=ss.FrictionContact(kt=42.69, mu=0.2436, kn=139.93, gap=-0.6054), tangential="y",
        normal="x", rubbing=ss.RubbingMotion(velocity=100.0),
    )  # fmt: skip
    shaken = ss.ContactPair(
        name="shaken", contact=ss.FrictionContact(kt=30.54, mu=0.4937, normal_load=125.84), tangential="y",
        rubbing=ss.RubbingMotion(cos={1: 0.284}),
    )  # fmt: skip
    problem = ss.Problem(
        structure, contacts=[held, opening, shaken], loads=ss.Load(dof="x", cos=1.6219), harmonics=[0, 1, 2, 3, 5]
    )
    (found,) = Lockstep(requests_of([problem], (2.0, 16.0), max_step=0.3)).branches()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        alone = ss.forced_response(problem, omega=(2.0, 16.0), options={"max_step": 0.3})
    assert found is None
    assert alone.outcome.ok
    assert of_kind(alone, "near peak") == 0
    assert alone.dataset.attrs["rejected_steps"] > 0


def test_stuck_free_and_equal_cases_beside_others() -> None:
    """A contact stuck all along, one without friction, and one case three times."""
    span = (2.0, 15.0)
    problems = [damper(100.0, 0.3, 1e6), damper(100.0, 0.0, 800.0), *[damper(80.0, 0.3, 300.0)] * 3]
    found = side_by_side(problems, span)
    for branch, problem in zip(found[:3], problems[:3], strict=True):
        assert branch is not None
        hold(branch, problem, span)
    same = [branch.table["amplitude"].to_numpy() for branch in found[2:] if branch is not None]
    assert len(same) == 3
    np.testing.assert_array_equal(same[0], same[1])
    np.testing.assert_array_equal(same[0], same[2])


@pytest.mark.verify
@pytest.mark.parametrize("seed", [100, 200])
def test_many_random_cases(seed: int) -> None:
    """No curve differs from the one followed alone, and few are left to be."""
    stuck_and_slipping = ((60.0, 140.0), (0.1, 0.5), (50.0, 1100.0), (0.0, 20.0), (30.0, 120.0))
    ensembles = (
        (randomly(damper, 16, seed, *stuck_and_slipping), (2.0, 15.0)),
        (randomly(stop, 16, seed + 1, (20.0, 120.0), (-0.5, 2.0), (5.0, 40.0)), (4.0, 11.0)),
        (randomly(two_contacts, 16, seed + 2, (20.0, 60.0), (0.1, 0.5), (-0.3, 0.2), (0.0, 20.0)), (3.0, 12.0)),
    )
    for problems, span in ensembles:
        branches = side_by_side(problems, span)
        assert sum(branch is not None for branch in branches) >= 14
        for branch, problem in zip(branches, problems, strict=True):
            if branch is not None:
                hold(branch, problem, span)


def test_a_case_does_not_depend_on_the_others() -> None:
    """Alone, with others before and behind it, and in another order: the same numbers to rounding."""
    span = (3.0, 11.0)
    problems = randomly(lambda kt, mu, load: damper(kt, mu, load, 5.0), 5, 11, (60, 140), (0.2, 0.4), (100, 900))
    whole = side_by_side(problems, span)
    backward = side_by_side(problems[::-1], span)[::-1]
    [alone] = side_by_side(problems[2:3], span)
    assert alone is not None
    for one, other in [*zip(whole, backward, strict=True), (whole[2], alone)]:
        assert one is not None
        assert other is not None
        for name in ("omega", "amplitude", "displacement"):
            np.testing.assert_allclose(one.table[name].to_numpy(), other.table[name].to_numpy(), rtol=1e-9, atol=1e-12)


def test_what_cannot_be_told_of_one_curve_leaves_that_one_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """What a curve records fails where it is with others and alone; theirs is kept, as it is without it."""
    span, problems = (3.0, 11.0), [damper(100.0, mu, 400.0, 5.0) for mu in (0.2, 0.25, 0.3)]
    expected, told = side_by_side(problems, span), record.truncation

    def fails(outputs: Any, x: Any, motion: Any, omega: Any, inputs: Assigned, reactions: Any) -> Any:
        if any(inputs.distinct[i].batches[0].values["mu"][0] == 0.25 for i in inputs.which):
            raise ZeroDivisionError
        return told(outputs, x, motion, omega, inputs, reactions)

    monkeypatch.setattr(record, "truncation", fails)
    first, middle, last = side_by_side(problems, span)
    assert middle is None
    for found, other in ((first, expected[0]), (last, expected[2])):
        assert found is not None
        assert other is not None
        for name in ("omega", "amplitude", "truncation"):
            np.testing.assert_array_equal(found.table[name].to_numpy(), other.table[name].to_numpy())


def test_peaks_at_corners_are_located_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Near to a corner secants do not find them; few are left to be located curve by curve."""

    def rubbed(kt: float, mu: float, load: float) -> ss.Problem:
        return damper(kt, mu, load, velocity=5.0)

    problems = randomly(rubbed, 8, 22, (60, 140), (0.2, 0.4), (500, 1100))
    alone, narrowed = list[int](), list[int]()
    each, together = Events._each, Events._narrowed

    def one_by_one(self: Events, wanted: Any, *more: Any) -> None:
        alone.extend(wanted)
        each(self, wanted, *more)

    def narrow(self: Events, i: int, brackets: Any, found: Any) -> None:
        narrowed.extend(brackets.branch)
        together(self, i, brackets, found)

    monkeypatch.setattr(Events, "_each", one_by_one)
    monkeypatch.setattr(Events, "_narrowed", narrow)
    found = side_by_side(problems, (2.0, 15.0))
    assert len(narrowed) >= 3
    assert len(alone) <= 12  # 11, of which 10 hold a kink with a minimum: 109 of the 5204 evaluations of all 8 curves
    for i in narrowed[:4]:
        branch = found[i]
        assert branch is not None
        hold(branch, problems[i], (2.0, 15.0))


def test_a_range_followed_downwards() -> None:
    problems = randomly(lambda kt, mu: damper(kt, mu, 400.0), 2, 13, (60, 140), (0.2, 0.4))
    for found, problem in zip(side_by_side(problems, (14.0, 3.0)), problems, strict=True):
        assert found is not None
        hold(found, problem, (14.0, 3.0))


def test_what_is_out_of_the_ordinary_is_left_to_be_followed_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    problems = [damper(100.0, 0.3, 400.0), damper(90.0, 0.2, 500.0)]
    limited = requests_of(problems, (2.0, 15.0), max_points=5)
    assert Lockstep(limited).branches() == [None, None]
    monkeypatch.setattr(lockstep.FirstPoint, "find", lambda self: None)
    assert Lockstep(requests_of(problems, (2.0, 15.0))).branches() == [None, None]


def test_which_curves_are_followed_side_by_side() -> None:
    one, other = requests_of([damper(100.0, 0.3, 400.0), damper(90.0, 0.2, 500.0)], (2.0, 15.0))
    assert in_lockstep(one)
    assert alike(one, other)
    [finer] = requests_of([damper(100.0, 0.3, 400.0)], (2.0, 15.0), max_step=0.01)
    [elsewhere] = requests_of([damper(100.0, 0.3, 400.0)], (2.0, 14.0))
    [wider] = requests_of([damper(100.0, 0.3, 400.0, top=8)], (2.0, 15.0))
    [another] = requests_of([stop(50.0, 1.0)], (2.0, 15.0))
    assert not any(alike(one, request) for request in (finer, elsewhere, wider, another))
    assert not same_form(one.balance, another.balance)
    assert not in_lockstep(frequency_request(damper(100.0, 0.3, 400.0), (2.0, 15.0), (7.0,)))
    [larger] = requests_of([damper(100.0, 0.3, 400.0, top=35)], (2.0, 15.0))
    assert not in_lockstep(larger)  # 71 unknowns
    assert not in_lockstep(requests_of([damper(100.0, 0.3, 400.0)], (2.0, 15.0), adapt_harmonics=1e-3)[0])
    steady = frequency_request(damper(100.0, 0.3, 400.0), (2.0, 15.0), (), None, None, (), None, True)
    assert not in_lockstep(steady)
