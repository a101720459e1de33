"""Warnings that only results can give."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.oscillator import one_mass

import slipstick as ss
from slipstick.results.result_warnings import result_warnings


def problem(gap: float) -> ss.Problem:
    K = np.array([[40.0, -5.0], [-5.0, 60.0]])
    structure = ss.MatrixStructure(M=np.eye(2), C=0.02 * K, K=K, dofs=["x", "y"])
    pair = ss.ContactPair(
        name="tip", contact=ss.FrictionContact(kt=30.0, mu=0.3, kn=50.0, gap=gap), tangential="x", normal="y",
        rubbing=ss.RubbingMotion(velocity=3.0),
    )  # fmt: skip
    loads = [ss.Load(dof="x", sin=4.0), ss.Load(dof="y", cos=1.0)]
    return ss.Problem(structure, contacts=[pair], loads=loads, harmonics=range(11))


def test_a_contact_that_was_never_closed_is_told() -> None:
    with pytest.warns(ss.SlipstickWarning, match="'tip': it was open at every point"):
        branch = ss.forced_response(problem(1.5), omega=(2.0, 12.0))
    assert float(branch.dataset.separation_fraction.min()) == 1.0
    assert "open at every point" in branch.dataset.attrs["warnings"]
    ss.forced_response(problem(0.01), omega=(2.0, 12.0))  # warnings are errors


def test_what_is_told_of_results() -> None:
    values = {"omega": np.array([1.0, 2.0]), "truncation": np.array([0.0, 0.05])}
    (missing,) = result_warnings("omega", values, ["a"])
    assert "omega = 2 rad/s" in missing
    values["separation_fraction"] = np.array([[1.0, 0.5, np.nan], [1.0, 1.0, np.nan]])
    assert [s[:11] for s in result_warnings("omega", values, ["a", "b", "c"])] == ["contact 'a'", missing[:11]]


def test_a_surface_that_never_comes_near_enough() -> None:
    rub = ss.RubbingMotion(velocity=1.0, normal_cos={1: 0.5})
    pair = ss.ContactPair(
        name="tip", contact=ss.FrictionContact(kt=1.0, mu=0.3, kn=1.0, gap=2.0), tangential="x", rubbing=rub
    )
    problem = one_mass(pair, force=1.0)
    with pytest.warns(ss.SlipstickWarning, match="so it never acts"):
        ss.linear_response(problem, omega=2.0)


def test_points_near_peaks_are_named():
    values = {
        "omega": np.array([1.0, 2.5, 3.0]), "kind": np.array(["start", "near peak", "end"]), "truncation": np.zeros(3),
    }  # fmt: skip
    (said,) = result_warnings("omega", values, [])
    assert "2.5 rad/s" in said
    assert "near peak" in said
    values["kind"] = np.array(["start", "near turning point", "end"])
    (said,) = result_warnings("damper.mu", values, [])
    assert "2.5 (damper.mu) the branch turns back" in said


def test_requested_values_that_are_passed_over_are_named():
    """Of every part by itself, and where an interpolated point is all there is; what was not reached is not passed."""
    values = {
        "omega": np.array([1.0, 2.0, 3.0, 4.0, 3.5, 9.0, 8.0]), "truncation": np.zeros(7),
        "kind": np.array(["start", "requested", "interpolated", "regular", "end", "start", "end"]),
        "branch_part": np.array([1, 1, 1, 1, 1, 2, 2]),
    }  # fmt: skip
    assert result_warnings("omega", values, [], requested=[1.0, 2.0, 6.0, 9.5]) == []
    (said,) = result_warnings("omega", values, [], requested=[8.5, 2.0, 3.0, 3.75, 6.0])
    assert said.startswith("a point was requested at 3, 3.75, 8.5 rad/s, but ")
    (said,) = result_warnings("p", {"parameter": values["omega"], **values}, [], requested=[3.0])
    assert said.startswith("a point was requested at 3 (p)")
    found = {"parameter": np.linspace(0.0, 9.0, len(values["omega"])), **values}  # a parameter that is found over omega
    assert result_warnings("omega", found, [], requested=[1.0, 2.0, 6.0, 9.5]) == []
    assert result_warnings("omega", found, [], requested=[3.0]) == result_warnings("omega", values, [], requested=[3.0])


def test_many_contacts_that_never_acted_are_one_sentence() -> None:
    values = {"omega": np.array([1.0]), "truncation": np.array([0.0]), "separation_fraction": np.ones((1, 200))}
    (sentence,) = result_warnings("omega", values, [f"c{k}" for k in range(200)])
    assert sentence.startswith("contact 'c0': it was open at every point")
    assert sentence.endswith("; likewise 199 more contacts: 'c1', 'c2', 'c3', ...")
    values["separation_fraction"][0, 4:] = 0.5
    assert len(result_warnings("omega", values, [f"c{k}" for k in range(200)])) == 4


def test_a_vibration_lost_beside_a_mean_names_ratio_and_place():
    motion = np.zeros((4, 1, 3))
    motion[:, 0, 0] = 1.0, 1.0, -3e10, 5.0
    motion[:, 0, 2] = 1.0, 1e-8, 1.0, 0.0  # the last one is at rest
    values = {"omega": np.array([1.0, 2.0, 3.0, 4.0]), "truncation": np.zeros(4), "contact_tangential": motion}
    (said,) = result_warnings("omega", values, ["a"])
    assert "3e+10 times the vibration at 3 rad/s (and more than 1e+09 times at 1 of 4 points)" in said
    motion[2] = 0.0
    assert not result_warnings("omega", values, ["a"])
