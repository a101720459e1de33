"""Stability asked for along a branch: what is in the results, and what is refused."""

import dataclasses

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.floquet import distance
from helpers.laws import Spring
from helpers.oscillator import damper, one_mass, oscillator, with_law
from helpers.stability import point_at, two_dofs

import slipstick as ss
from slipstick.analysis.curve.response import follow
from slipstick.analysis.stability.floquet import unstable
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.stability import Unjudged, judged

SHORT = {"max_step": 0.2, "first_step": 0.2}


def test_a_branch_tells_for_every_point_whether_it_is_stable(tmp_path) -> None:
    branch = ss.forced_response(oscillator(10.0), omega=(4.0, 6.0), options=SHORT, stability=True)
    data = branch.dataset
    assert data.multiplier.dims == ("point", "rank", "part")
    assert data.part.values.tolist() == ["real", "imaginary"]
    known = np.hypot(*data.multiplier.values.transpose(2, 0, 1))
    assert np.allclose(np.nanmax(known, axis=1), data.multiplier_max)
    assert np.all(np.diff(known, axis=1)[np.isfinite(known[:, 1:])] <= 1e-12), "the largest first"
    assert data.stable.values.tolist() == [1] * len(branch)
    assert set(data.stability_method.values.tolist()) == {"PW"}
    again = ss.load(branch.save(tmp_path / "r.nc")).dataset
    for name in ("multiplier", "stable", "unstable_multipliers", "neutral_contacts", "stability_method"):
        assert np.array_equal(again[name].values, data[name].values, equal_nan=name == "multiplier"), name


def test_without_being_asked_nothing_is_said() -> None:
    branch = ss.forced_response(oscillator(10.0), omega=(4.0, 4.5), options=SHORT)
    assert not {"multiplier", "stable"} & set(branch.dataset.variables)


def test_a_followed_parameter_changes_the_contacts_and_the_structure() -> None:
    """Twice the damping of an oscillator whose contact is stuck: the multipliers are those of that damping."""
    problem = oscillator(0.0)
    problem = problem.with_parameter("damper.normal_load", 1e6)
    branch = ss.parameter_response(problem, "damping", (1.0, 2.0), omega=5.0, options=SHORT, stability=True)
    values = branch.dataset.parameter.values
    wanted = np.exp(-0.5 * 0.4 * values * 2.0 * np.pi / 5.0)
    assert np.allclose(branch.dataset.multiplier_max, wanted, rtol=1e-12)


def test_a_hot_contact_keeps_the_friction_it_has_there() -> None:
    """Its stability is that of a cold contact with the same friction coefficient."""
    cold = oscillator(10.0)
    curve = ss.FrictionCurve(temperature=[20.0, 400.0], mu=[0.3, 0.15])
    hot = dataclasses.replace(cold, thermal=ss.ThermalModel(curve=curve, background=20.0, resistance=0.2))
    found = point_at(hot, 4.3, stability=True)
    mu = float(found.detail.responses[0].values["mu"][0])
    assert 0.16 < mu < 0.29
    alike = point_at(cold.with_parameter("damper.mu", mu), 4.3, stability=True)
    assert distance(found.stability.multipliers, alike.stability.multipliers) < 1e-7


def test_other_laws_and_structures_without_equations_in_time_are_refused_by_name() -> None:
    problem = with_law(Spring(1.0), port="along")
    with raises_fault("stability", says="'spring' .* does not tell its rate"):
        ss.forced_response(problem, omega=(1.0, 2.0), stability=True)


@pytest.mark.parametrize("given", ["yes", 1, None])
def test_what_is_no_request_is_told(given) -> None:
    with raises_fault("stability", expected='True, False, or "full" (all modes in motion)'):
        ss.forced_response(oscillator(10.0), omega=(4.0, 6.0), stability=given)


def test_multipliers_beyond_the_unit_circle_are_counted_beyond_rounding() -> None:
    assert unstable(np.array([1.0 + 1e-9, -1.1, 0.9j, 1.1j])) == 2


@pytest.mark.parametrize("name", ["one contact", "two contacts", "one that opens"])
def test_interpolated_points_are_judged_together_as_each_alone(name) -> None:
    """Contacts on one dof, of which one slips before the other; and one that moves along its normal."""
    rubbing = ss.RubbingMotion(velocity=10.0)
    problem, span = {
        "one contact": (oscillator(10.0), (4.0, 5.5)),
        "two contacts": (one_mass(damper(3.0), damper(10.0, name="other", kt=30.0), harmonics=range(6)), (4.0, 6.0)),
        "one that opens": (two_dofs(rubbing, gap=-0.1), (5.0, 5.6)),
    }[name]
    waiting = [p.stability for p in follow(problem, omega=span, stability=True) if isinstance(p.stability, Unjudged)]
    assert len(waiting) > 5
    postprocessing = Postprocessing()
    for found, one in zip(judged(waiting, postprocessing), waiting, strict=True):
        alone = one.alone()
        assert np.abs(found.multipliers - alone.multipliers).max() < 1e-12
        same = ("unstable", "method", "neutral", "error")
        assert [getattr(found, name) for name in same] == [getattr(alone, name) for name in same]
    assert not postprocessing.failures


def test_between_solved_points_of_many_contacts_the_verdict_is_theirs() -> None:
    """The same damper in five parts: verdicts as with one, and the multipliers of that at the solved points."""
    whole = oscillator(10.0)
    contact = ss.FrictionContact(kt=20.0, mu=0.3, normal_load=160.0)
    parts = [
        ss.ContactPair(name=f"d{i}", tangential="x", contact=contact, rubbing=ss.RubbingMotion(velocity=10.0))
        for i in range(5)
    ]
    five = ss.Problem(whole.structure, contacts=parts, loads=whole.loads, harmonics=whole.harmonics)
    one, many = (ss.forced_response(p, omega=(4.0, 7.0), stability=True).dataset for p in (whole, five))
    between = many.kind.values == "interpolated"
    assert between.any()
    assert np.isnan(many.multiplier.values[between]).all()
    assert set(many.stable.values.tolist()) == {1}
    solved = many.isel(point=~between)
    assert np.isfinite(solved.multiplier_max.values).all()
    wanted = np.interp(solved.omega, one.omega, one.multiplier_max)
    assert np.abs(solved.multiplier_max - wanted).max() < 0.02


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
@pytest.mark.parametrize("velocity", [0.0, 1.0])
def test_a_contact_without_tangential_stiffness_remembers_nothing(velocity) -> None:
    """Its multipliers are those of the structure alone."""
    problem = one_mass(damper(velocity, kt=0.0, normal_load=10.0), force=1.0)
    found = ss.forced_response(problem, omega=(4.0, 4.1), stability=True).dataset
    assert found.multiplier_max.values == pytest.approx(np.exp(-0.2 * 2.0 * np.pi / found.omega.values))
