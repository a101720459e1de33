"""Planar contacts whose motion is nearly straight: which they are, and what one direction costs there."""

from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import Outcome
from slipstick.models import straight
from slipstick.models.straight import STRAIGHT


def problem(
    x: float = 1.0,
    y: float = 0.0,
    *,
    phase: float = 0.0,
    K: tuple[float, float] = (40.0, 40.0),
    C: float = 2.0,
    mu: float = 0.3,
    rubbing: ss.RubbingMotion | None = None,
) -> ss.Problem:
    """An oscillator in the plane on a foot, under a load of amplitudes x, y."""
    law, along, across = ss.PlanarFrictionContact(kt=100.0, mu=mu, normal_load=800.0), 200.0 * x, 200.0 * y
    return ss.Problem(
        ss.MatrixStructure(M=np.eye(2), C=C * np.eye(2), K=np.diag(K), dofs=["x", "y"]),
        contacts=ss.ContactPair(name="foot", contact=law, tangential=("x", "y"), rubbing=rubbing),
        loads=[
            ss.Load(dof="x", cos=along),
            ss.Load(dof="y", cos=across * np.cos(phase), sin=across * np.sin(phase)),
        ],
        harmonics=[0, 1, 3, 5],
    )


def chosen(given: ss.Problem, **options: object) -> ss.Problem:
    with pytest.warns(ss.SlipstickWarning, match="of 1 contacts are planar, those .* more than 0.2"):
        return ss.models.straight_contacts(given, omega=(5.0, 14.0), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("given", "planar"),
    [
        (problem(1.0, 0.1, phase=np.pi / 2), False),
        (problem(1.0, 0.115, phase=np.pi / 2), True),
        (problem(1.0, 0.5), True),  # straight, but not along the direction
        (problem(0.0, 1.0), True),
        (problem(0.0, 0.0), True),  # nothing is known of it
        (problem(1.0, 0.06, K=(640.0, 40.0)), True),  # across it is at resonance where nothing holds it
        (problem(1.0, 0.0, rubbing=ss.RubbingMotion(velocity=(3.0, 0.0))), False),
        (problem(1.0, 0.0, rubbing=ss.RubbingMotion(velocity=(3.0, 1.0))), True),
    ],
)
def test_which_are_planar(given: ss.Problem, planar: bool) -> None:
    (pair,) = chosen(given).contacts
    assert isinstance(pair.contact, ss.PlanarFrictionContact) == planar
    if not planar:
        assert pair.contact == ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
        assert repr(pair.contact) == "FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)"
        assert set(pair.given) == {"tangential"}
        assert pair.rubbing.velocity == given.contacts[0].rubbing.velocity


SYSTEMS = [
    (K, C, mu, phase)
    for K in ((40.0, 40.0), (40.0, 400.0), (400.0, 40.0), (40.0, 100.0))
    for C, mu in ((2.0, 0.3), (2.0, 0.1), (1.0, 0.4))
    for phase in (0.0, np.pi / 2)
]


def check_costs(K: tuple[float, float], C: float, mu: float, phase: float) -> None:
    """At the threshold the largest amplitude along the direction is wrong by less than 1 %, whatever the system."""
    omega = (4.0, 26.0)

    def loaded(share: float) -> ss.Problem:
        return problem(1.0, share, phase=phase, K=K, C=C, mu=mu)

    share = 0.999 * STRAIGHT / straight._ratios(loaded(1.0), *omega)["foot"]  # linear in the load across
    with pytest.warns(ss.SlipstickWarning, match="0 of 1 contacts are planar"):
        one = ss.models.straight_contacts(loaded(share), omega=omega)
    curves = [ss.forced_response(each, omega=omega) for each in (one, loaded(share))]
    assert all(curve.outcome is Outcome.COMPLETED for curve in curves)
    heights = [float(curve.dataset["amplitude"].max("point")[0]) for curve in curves]
    assert abs(heights[0] / heights[1] - 1.0) < 0.01


def test_what_a_straight_one_costs() -> None:
    check_costs((40.0, 40.0), 2.0, 0.3, np.pi / 2)


@pytest.mark.verify(sample=8)
@pytest.mark.filterwarnings("ignore:next to 14:slipstick.SlipstickWarning")  # a point near a peak of one of them
@pytest.mark.parametrize(("K", "C", "mu", "phase"), SYSTEMS)
def test_what_straight_ones_cost(K: tuple[float, float], C: float, mu: float, phase: float) -> None:
    check_costs(K, C, mu, phase)


def test_only_those_named() -> None:
    given = problem(1.0, 0.0)
    with pytest.warns(ss.SlipstickWarning, match="0 of 0 contacts"):
        assert ss.models.straight_contacts(given, omega=(5.0, 14.0), contacts=[]).contacts == given.contacts
    with pytest.raises(ss.InputError, match="there is no planar contact 'fot'; did you mean 'foot'"):
        ss.models.straight_contacts(given, omega=(5.0, 14.0), contacts=["fot"])
