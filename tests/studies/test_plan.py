"""Which cases a study has, and what is refused before anything is computed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.studies.plan import make_plan
from slipstick.verify.cases import oscillator


@pytest.fixture(scope="module")
def problem() -> ss.Problem:
    return oscillator(velocity=10.0)


def test_a_grid_is_every_combination_the_last_parameter_fastest(problem: ss.Problem) -> None:
    plan = make_plan(problem, {"damper.velocity": [1, 2], "damper.mu": [0.1, 0.2, 0.3]})
    assert (plan.dims, plan.shape, len(plan)) == (("damper.velocity", "damper.mu"), (2, 3), 6)
    assert plan.values.tolist() == [[v, m] for v in (1, 2) for m in (0.1, 0.2, 0.3)]
    changed = plan.problem(problem, 4)
    assert changed.parameter("damper.velocity") == 2.0
    assert changed.parameter("damper.mu") == pytest.approx(0.2)


def test_a_list_is_side_by_side(problem: ss.Problem) -> None:
    plan = make_plan(problem, {"damper.velocity": [1, 1], "damper.mu": [0.1, 0.2]}, method="list")
    assert (plan.dims, plan.values.tolist()) == (("case",), [[1, 0.1], [1, 0.2]])


@pytest.mark.parametrize("method", ["latin-hypercube", "sobol"])
def test_samples_fill_their_ranges_and_follow_from_the_seed(problem: ss.Problem, method: str) -> None:
    given = {"damper.velocity": {"from": 1, "to": 100, "spacing": "log"}, "damper.mu": [0.1, 0.4]}
    plan = make_plan(problem, given, method=method, samples=64, seed=3)
    assert np.array_equal(plan.values, make_plan(problem, given, method=method, samples=64, seed=3).values)
    assert not np.array_equal(plan.values, make_plan(problem, given, method=method, samples=64, seed=4).values)
    velocity, mu = plan.values.T
    for unit in (np.log(velocity) / np.log(100.0), (mu - 0.1) / 0.3):  # one sample in each of 64 equal parts
        assert sorted(np.floor(64 * unit).astype(int).tolist()) == list(range(64))


def test_samples_of_a_logarithmic_range_fill_its_logarithm(problem: ss.Problem) -> None:
    given = {"damper.velocity": {"from": 10.0, "to": 1e4, "spacing": "log"}, "damper.mu": [0.2, 0.4]}
    plan = make_plan(problem, given, method="latin-hypercube", samples=30, seed=3)
    velocity, mu = plan.values.T
    thirds = np.floor((np.log10(velocity) - 1.0) * 10.0)  # one sample in each of thirty equal parts
    assert sorted(thirds.tolist()) == list(range(30))
    assert sorted(np.floor((mu - 0.2) * 150.0).tolist()) == list(range(30))


def test_sobol_samples_that_do_not_fill_evenly_are_told(problem: ss.Problem) -> None:
    plan = make_plan(problem, {"damper.mu": [0.1, 0.4]}, method="sobol", samples=100)
    assert plan.warnings == (
        "study: 100 Sobol samples do not fill the ranges evenly; a power of two does, such as 128",
    )


def test_a_normal_load_is_set_after_the_stiffness_it_depends_on() -> None:
    contact = ss.FrictionContact(kt=100.0, mu=0.3, kn=50.0, gap=-2.0)
    pair = ss.ContactPair(name="tip", contact=contact, tangential="x", normal="y")
    structure = ss.MatrixStructure(M=np.eye(2), C=0.1 * np.eye(2), K=40 * np.eye(2), dofs=["x", "y"])
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=1.0)], harmonics=range(6))
    plan = make_plan(problem, {"tip.normal_load": [300.0], "tip.kn": [10.0, 1000.0]})
    assert plan.names == ("tip.kn", "tip.normal_load")
    for case in range(2):
        assert plan.problem(problem, case).parameter("tip.normal_load") == pytest.approx(300.0)


@pytest.mark.parametrize(
    ("given", "options", "sentence"),
    [
        ({}, {}, "study: no parameter is given"),
        ([1, 2], {}, "study: found [1, 2]; expected a table"),
        ({"damper.muu": [1]}, {}, "there is no parameter 'damper.muu'; did you mean 'damper.mu'?"),
        ({"damper.mu": []}, {}, "study, damper.mu: found an empty list"),
        ({"damper.mu": [0.1, 0.1]}, {}, "study, damper.mu: found 0.1 twice"),
        ({"damper.mu": [-0.1]}, {}, "study, damper.mu: -0.1 is not allowed; mu: found -0.1"),
        ({"damper.mu": [0.1], "*.mu": [0.2]}, {}, "'damper.mu' and '*.mu' set the same thing; keep one of them"),
        ({"damper.gap": [-1], "damper.normal_load": [2]}, {}, "set the same thing"),
        ({"damper.mu": [0.1]}, {"method": "gird"}, "study, method: found 'gird'; did you mean 'grid'?"),
        ({"damper.mu": [0.1, 0.2]}, {"method": "sobol"}, "study, samples is missing"),
        ({"damper.mu": [0.1, 0.2]}, {"samples": 8}, "study, samples: it is given, but"),
        ({"damper.mu": [0.1, 0.2]}, {"method": "sobol", "samples": 0}, "study, samples: found 0"),
        ({"damper.mu": [0.1, 0.2]}, {"seed": -1}, "study, seed: found -1"),
        (
            {"damper.mu": [1, 2], "damper.velocity": [1]},
            {"method": "list"},
            "found 2 of damper.mu, 1 of damper.velocity",
        ),
        ({name: {"from": 0, "to": 1, "count": 2000} for name in ("damper.mu", "load")}, {}, "found 4000000 cases"),
    ],
)
def test_what_is_no_study(problem: ss.Problem, given: Any, options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        make_plan(problem, given, **options)
    assert sentence in str(caught.value)


def test_all_faults_are_told_at_once(problem: ss.Problem) -> None:
    with pytest.raises(InputError) as caught:
        make_plan(problem, {"a": [1], "damper.mu": "x"}, method="sobol", seed="y")
    assert len(caught.value.faults) == 5
