"""Bifurcations where they were published, and where contacts change the order of their states."""

import numpy as np
import pytest
from helpers.oscillator import oscillator
from helpers.stability import flutter, point_at, stops

import slipstick as ss
from slipstick.analysis.stability.special_points import torus

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")


def kinds(branch, kind):
    return [found for found in branch.bifurcations() if found.kind == kind]


PUBLISHED = {
    "period doubling of forced flutter": ("period doubling", 6.0, (50.0, 43.0), 45.699748),
    "Neimark-Sacker of forced flutter": ("Neimark-Sacker", 14.0, (50.0, 48.4), 48.7368505),
}


@pytest.mark.parametrize("name", PUBLISHED)
def test_bifurcations_over_force_are_where_they_were_published(name) -> None:
    kind, omega, span, value = PUBLISHED[name]
    branch = ss.parameter_response(flutter(), "load.y.1.amplitude", span, omega=omega, stability=True)
    (found,) = kinds(branch, kind)
    assert abs(found.value / value - 1.0) < 1e-5
    assert abs(abs(found.multiplier) - 1.0) < 1e-6
    assert (found.before, found.after) == (0, 1 if kind == "period doubling" else 2)
    if kind == "Neimark-Sacker":
        assert 0.0 < found.second_omega < 7.0


def test_the_period_of_a_preloaded_stop_doubles_where_it_was_published() -> None:
    branch = ss.forced_response(stops(gap=-0.1, harmonics=11), omega=(2.3, 2.7), stability=True)
    (found,) = kinds(branch, "period doubling")
    assert abs(found.value / 2.5033727 - 1.0) < 1e-5


def test_a_fold_is_where_a_multiplier_passes_one() -> None:
    branch = ss.forced_response(stops(), omega=(1.3, 1.6), stability=True)
    first, second = kinds(branch, "fold")
    assert abs(first.multiplier - 1.0) < 1e-4
    assert [(f.before, f.after) for f in (first, second)] == [(0, 1), (1, 0)]
    (change,) = kinds(branch, "state change")
    before, after = (branch.states(change.point + step)["up"] for step in (-2, 2))
    assert ([s for *_, s in before], [s for *_, s in after]) != ([s for *_, s in after], [s for *_, s in before])


def test_symmetry_breaks_between_two_stops() -> None:
    branch = ss.forced_response(stops(kn=20.0, force=5.0, both=True, harmonics=17), omega=(1.75, 1.45), stability=True)
    (found,) = kinds(branch, "symmetry breaking")
    assert abs(found.multiplier - 1.0) < 5e-3
    assert abs(found.value / 1.61936 - 1.0) < 1e-4, "as with more harmonics"
    assert set(branch.dataset.unstable_multipliers.values.tolist()) == {0, 1}


def test_contacts_change_their_states_at_the_points_that_say_so() -> None:
    """On the sides of every such point the orders of states differ; between two of them they do not."""
    branch = ss.forced_response(oscillator(10.0), omega=(2.0, 6.0), stability=True)
    words = [_word([s for *_, s in branch.states(i)["damper"]]) for i in range(len(branch))]
    places = [found.point for found in kinds(branch, "state change")]
    assert len(places) == 3
    for at in places:
        assert words[at - 1] != words[at + 1]
    runs = np.split(np.arange(len(branch)), places)
    for run in runs:
        assert len({words[i] for i in run if i not in places}) == 1


def _word(states):
    return min(tuple(states[i:] + states[:i]) for i in range(len(states)))


def test_without_damping_pairs_that_stay_on_the_circle_are_no_bifurcations() -> None:
    """A stuck contact on a structure without damping: all magnitudes are 1 but for rounding."""
    structure = ss.MatrixStructure(M=np.diag([1.0, 2.0]), K=[[60.0, -20.0], [-20.0, 50.0]], dofs=["a", "b"])
    damper = ss.FrictionContact(kt=30.0, mu=0.5, normal_load=1000.0)
    pair = ss.ContactPair(name="damper", tangential="a", contact=damper)
    problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="a", cos=2.0), harmonics=range(4))
    branch = ss.forced_response(problem, omega=(5.1, 7.5), stability=True)
    assert branch.dataset.stick_fraction.values == pytest.approx(1.0)
    assert branch.bifurcations() == []
    assert abs(branch.dataset.multiplier_max.values - 1.0).max() < 1e-9


def test_without_a_pair_nothing_can_leave_the_circle_as_one() -> None:
    assert torus(np.array([1.4 + 0j, 0.3])) == -1.0
    assert abs(torus(np.array([0.6 + 0.8j, 0.6 - 0.8j, 3.0]))) < 1e-6


def test_results_without_stability_have_no_bifurcations() -> None:
    branch = ss.forced_response(oscillator(10.0), omega=(4.0, 4.1))
    with pytest.raises(ss.InputError, match="compute them with stability=True"):
        branch.bifurcations()
    assert point_at(oscillator(10.0), 4.0).stability is None
