"""Verdicts of stability against disturbed starts that are integrated in time: no harmonics, no contact element."""

import warnings

import numpy as np
import pytest
from helpers.floquet import distance, exact_multipliers
from helpers.perturbed import grows_in_time, random_contacts
from helpers.sampling import sample
from helpers.stability import contact_motion, flutter, stops

import slipstick as ss
from slipstick.analysis.curve.response import follow

CLEAR = 0.01
"""Distance of the largest multiplier from the unit circle from which on the verdict has to be the same."""


def verdicts(seed):
    """By multipliers and in time; None where one of them is not known, or the circle too near."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem, omega = random_contacts(seed)
        point = next(follow(problem, omega=(omega, omega + 0.01), stability=True), None)
    if point is None or point.stability.unstable < 0:
        return None
    largest = float(abs(point.stability.multipliers[0]))
    if abs(largest - 1.0) <= CLEAR:
        return None
    grows = grows_in_time(problem, omega, *contact_motion(problem, point), largest)
    return None if grows is None else (point.stability.unstable > 0, grows)


@pytest.mark.parametrize("seed", [3, 11])
def test_a_disturbed_start_does_what_the_multipliers_say(seed) -> None:
    found = verdicts(seed)
    assert found is not None
    assert found[0] == found[1]


@pytest.mark.verify
def test_random_points_have_the_verdict_of_integration_in_time() -> None:
    """A thousand in all."""
    seeds = sample(range(1020), 250)
    known = {seed: found for seed in seeds if (found := verdicts(seed)) is not None}
    assert len(known) >= 0.96 * len(seeds)
    assert [seed for seed, (said, grows) in known.items() if said != grows] == []
    assert any(said for said, _ in known.values()), "some are unstable"


UNSTABLE = {
    "stop beyond its period doubling": (stops(gap=-0.1, harmonics=11), 2.55),
    "flutter beyond its period doubling": (flutter(force=43.0), 6.0),
    "flutter beyond its second frequency": (flutter(force=48.5), 14.0),
}


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
@pytest.mark.parametrize("name", UNSTABLE)
def test_unstable_orbits_have_the_multipliers_of_shooting(name) -> None:
    problem, omega = UNSTABLE[name]
    point = next(follow(problem, omega=(omega, omega + 0.01), stability=True))
    exact = exact_multipliers(problem, omega, *contact_motion(problem, point))
    assert exact is not None
    assert abs(exact[0][0]) > 1.0
    assert point.stability.unstable == int(np.sum(abs(exact[0]) > 1.0))
    assert distance(point.stability.multipliers, exact[0]) < 2e-4


@pytest.mark.verify
@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_a_fold_stands_where_many_harmonics_put_it() -> None:
    """To 1e-5 with twelve harmonics, as the harmonics left out alone move it."""
    places = []
    for harmonics in (13, 33):
        branch = ss.forced_response(stops(harmonics=harmonics), omega=(1.3, 1.6), stability=True)
        places.append(next(f.value for f in branch.bifurcations() if f.kind == "fold"))
    assert abs(places[0] / places[1] - 1.0) < 1e-5
