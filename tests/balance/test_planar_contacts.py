"""Contacts that slide in two directions: what they are made from, and that it comes back from a file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.contacts import perpendicular_faults
from slipstick.balance.physics_checks import problem_warnings
from slipstick.errors import InputError

FOOT = ss.PlanarFrictionContact(kt=100.0, mu=0.3, kn=50.0, normal_load=800.0, tolerance=1e-9)


def problem(pair: ss.ContactPair, **options: Any) -> ss.Problem:
    return ss.Problem(
        ss.MatrixStructure(M=np.eye(3), C=0.4 * np.eye(3), K=40.0 * np.eye(3), dofs=["x", "y", "z"]),
        contacts=[pair], harmonics=range(4),
        loads=[ss.Load(dof="x", cos=200.0), ss.Load(dof="y", sin=100.0), ss.Load(dof="z", cos=300.0)], **options,
    )  # fmt: skip


def test_two_directions_and_vectors() -> None:
    motion = ss.RubbingMotion(velocity=(3.0, 0.5), velocity_per_omega=(0.1, 0.2), cos={1: (0.5, 0.0)}, sin={2: 0.1})
    pair = ss.ContactPair(name="foot", contact=FOOT, tangential=({"x": 1.0}, "y"), normal="z", rubbing=motion)
    told = ss.RubbingMotion(
        velocity=3.0, second_velocity=0.5, velocity_per_omega=0.1, second_velocity_per_omega=0.2,
        cos={1: 0.5}, sin={2: 0.1},
    )  # fmt: skip
    assert pair.rubbing == told
    assert len(pair) == 1
    assert pair.n_ports == 3
    assert pair.direction("second") == {"y": 1.0}
    assert "tangential=('x', 'y')" in repr(pair)
    assert (
        eval(
            repr(pair),
            {
                "ContactPair": ss.ContactPair,
                **vars(ss),
                "PlanarFrictionContact": ss.PlanarFrictionContact,
                "RubbingMotion": ss.RubbingMotion,
            },
        )
        == pair
    )
    assert pair.with_value("second_velocity", 7.0).rubbing.second_velocity == 7.0
    assert pair.with_value("mu", 0.1).contact.tolerance == 1e-9


def test_many_contacts_in_one_pair() -> None:
    pair = ss.ContactPair(
        name="feet", contact=FOOT, tangential=(["x", "y"], ["y", "x"]),
        rubbing=ss.RubbingMotion(velocity=[3.0, 4.0], second_velocity=[0.0, 1.0]),
    )  # fmt: skip
    assert len(pair) == 2
    assert [pair.direction("tangential", k) for k in (0, 1)] == [{"x": 1.0}, {"y": 1.0}]
    np.testing.assert_array_equal(pair.with_value("velocity", 9.0, 1).rubbing.velocity, [3.0, 9.0])
    velocities = [
        ss.ContactPair(
            name="f", contact=FOOT, tangential=(["x", "y"], ["y", "x"]), rubbing=ss.RubbingMotion(velocity=[3.0, 4.0])
        )
    ]
    np.testing.assert_array_equal(velocities[0].rubbing.velocity, [3.0, 4.0])  # of two contacts, and no vector


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"tangential": ("x", "x")}, "is the tangential direction"),
        ({"tangential": ("x", "y", "z")}, "two directions of a surface"),
        ({"tangential": "x", "rubbing": ss.RubbingMotion(second_velocity=1.0)}, "second direction"),
        (
            {
                "tangential": "x", "rubbing": ss.RubbingMotion(second_cos={1: 1.0}),
                "contact": ss.FrictionContact(kt=1.0, mu=0.1, normal_load=1.0),
            },
            "second direction",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        problem(ss.ContactPair(**{"name": "foot", "contact": FOOT, **given}))


def test_a_second_velocity_is_no_parameter_of_one_direction() -> None:
    own = problem(ss.ContactPair(name="c", contact=ss.FrictionContact(kt=9.0, mu=0.1, normal_load=1.0), tangential="x"))
    with pytest.raises(InputError, match="second_velocity"):
        ss.parameter_response(own, "c.second_velocity", (0.0, 1.0), omega=9.0)


def test_the_second_velocity_and_the_turned_contact(tmp_path: Path) -> None:
    """Rubbing along the second direction of a contact is that along the first of the contact turned by 90 degrees."""
    one = problem(
        ss.ContactPair(
            name="foot", contact=FOOT, tangential=("x", "y"), normal="z", rubbing=ss.RubbingMotion(velocity=(1.0, 2.0))
        )
    )
    turned = problem(
        ss.ContactPair(
            name="foot",
            contact=FOOT,
            tangential=("y", {"x": -1.0}),
            normal="z",
            rubbing=ss.RubbingMotion(velocity=(2.0, -1.0)),
        )
    )
    first, second = (ss.steady_response(p, omega=[9.0, 15.0]) for p in (one, turned))
    size = float(np.abs(first.dataset["displacement"]).max())
    np.testing.assert_allclose(first.dataset["displacement"], second.dataset["displacement"], atol=1e-7 * size)
    np.testing.assert_allclose(first.dataset["dissipated_power"], second.dataset["dissipated_power"], rtol=1e-6)
    d = first.dataset
    np.testing.assert_allclose(d["stick_fraction"] + d["slip_fraction"] + d["separation_fraction"], 1.0)
    assert first.states(1) == first.states(1)
    # power balance: what the load and the rubbing bring is dissipated in the contact and the dampers
    work = d["dissipated_power"].to_numpy()[:, 0]
    X, w = d["displacement"].to_numpy(), d["omega"].to_numpy()
    dampers = 0.4 * 0.5 * (w[:, None] ** 2 * (X[:, :, 1:] ** 2 * np.repeat([1, 2, 3], 2) ** 2).sum(2)).sum(1)
    loads = 0.5 * w * (200.0 * X[:, 0, 2] - 100.0 * X[:, 1, 1] + 300.0 * X[:, 2, 2])
    rubbing = d["friction_force"].to_numpy()[:, 0, 0] * 1.0 + d["second_friction_force"].to_numpy()[:, 0, 0] * 2.0
    np.testing.assert_allclose(work + dampers, loads + rubbing, rtol=1e-6)
    path = tmp_path / "r.nc"
    first.save(path)
    again = ss.load(path)
    assert again.problem is not None
    assert again.problem.contacts[0].contact == FOOT
    assert again.problem.contacts[0].rubbing == one.contacts[0].rubbing
    assert again.states(0) == first.states(0)


def test_derivatives_by_the_second_velocity() -> None:
    pair = ss.ContactPair(
        name="foot", contact=FOOT, tangential=("x", "y"), normal="z", rubbing=ss.RubbingMotion(velocity=(1.0, 2.0))
    )
    names = ["foot.second_velocity", "foot.velocity", "foot.mu", "foot.kt"]
    branch = ss.steady_response(problem(pair), omega=9.0)
    slopes = branch.sensitivity(names, dof="x")["amplitude"].to_numpy().ravel()
    for name, slope in zip(names, slopes, strict=True):
        quantity = name.partition(".")[2]
        value, step = float(pair.values(quantity)[0]), 1e-4
        ends = [
            float(
                ss.steady_response(problem(pair.with_value(quantity, value * (1 + s))), omega=9.0).dataset["amplitude"][
                    0, 0
                ]
            )
            for s in (step, -step)
        ]
        assert abs((ends[0] - ends[1]) / (2 * step * value) - slope) < 1e-5 * abs(slope) + 1e-9


def test_a_wave_round_a_disc_with_shrouds_that_slide_in_two_directions() -> None:
    """One sector with a phase to the next one is the whole disc."""
    M, K1 = np.eye(2), -np.array([[5.0, 1.0], [0.5, 4.0]])
    sector = ss.CyclicStructure(
        M=(M, 0.0 * M), K=(np.diag([60.0, 70.0]), K1), C=(0.6 * M, 0.0 * M), dofs=["x", "y"], sectors=6
    )
    contact = ss.PlanarFrictionContact(kt=30.0, mu=0.3, normal_load=100.0)
    shroud = ss.ContactPair(
        name="shroud", contact=contact, tangential=({"x": 1.0, "x@next": -1.0}, {"y": 1.0, "y@next": -1.0}),
        rubbing=ss.RubbingMotion(cos={1: (0.1, 0.2)}),
    )  # fmt: skip
    loads = [ss.Load(dof="x", cos=20.0), ss.Load(dof="y", sin=15.0)]
    wave = ss.Problem(sector.travelling_wave(engine_order=1), contacts=[shroud], loads=loads, harmonics=range(4))
    disc = sector.mistuned()
    whole = ss.Problem(
        disc, contacts=[disc.contacts(shroud, engine_order=1)], harmonics=range(4),
        loads=[each for load in loads for each in disc.loads(load, engine_order=1)],
    )  # fmt: skip
    one, all_of = (ss.steady_response(p, omega=9.0).dataset for p in (wave, whole))
    assert float(one["slip_fraction"][0, 0]) > 0.1
    np.testing.assert_allclose(all_of["slip_fraction"][0], float(one["slip_fraction"][0, 0]), atol=1e-6)
    for dof in ("x", "y"):
        found = [float(all_of["amplitude"].sel(dof=f"{dof}@{s}")[0]) for s in range(6)]
        np.testing.assert_allclose(found, float(one["amplitude"].sel(dof=dof)[0]), rtol=1e-6)


@pytest.mark.parametrize(
    ("second", "angle"),
    [({"x": 1.0, "y": 1.0}, "45 degrees"), ({"x": -0.1, "y": 1.0}, "95.71 degrees"), ({"x": 3.0}, "0 degrees")],
)
def test_directions_that_are_not_perpendicular_are_refused_with_the_one_that_is(second, angle) -> None:
    with pytest.raises(InputError) as refused:
        problem(ss.ContactPair(name="foot", contact=FOOT, tangential=({"x": 1.0}, second), normal="z"))
    (fault,) = refused.value.faults
    assert fault.where[:2] == ("contact", "foot")
    assert angle in fault.found
    assert fault.remedy == ("give {'y': 1.0}" if "y" in second else "")


def test_directions_over_two_bodies_and_over_dofs_of_unknown_direction() -> None:
    """Of both bodies together; modes and rotations have no angle to each other that is known."""
    across = {"tip.x": 0.8, "tip.y": 0.6, "tip.x@next": -0.8, "tip.y@next": -0.6}
    along = {"tip.x": -0.6, "tip.y": 0.8, "tip.x@next": 0.6, "tip.y@next": -0.8}
    assert not list(perpendicular_faults(across, along))
    assert list(perpendicular_faults(across, {**along, "tip.x": -0.5}))
    assert not list(perpendicular_faults({"mode1": 0.3, "mode2": 0.5}, {"mode1": 0.2, "mode2": 0.1}))
    assert not list(perpendicular_faults({"x": 1.0, "rz": -0.2}, {"y": 1.0, "rz": 0.4}))


def test_directions_of_unequal_length_are_told() -> None:
    pair = ss.ContactPair(name="foot", contact=FOOT, tangential=({"x": 1.0}, {"y": 2.0}), normal="z")
    told = [str(w) for w in problem_warnings(problem(pair), (1.0, 2.0))]
    assert any("2 times as long as the first" in sentence for sentence in told)
    equal = ss.ContactPair(name="foot", contact=FOOT, tangential=({"x": 1000.0}, {"y": 1000.5}), normal="z")
    assert not any("as long as" in str(w) for w in problem_warnings(problem(equal), (1.0, 2.0)))


def test_a_unit_normal_that_is_not_perpendicular_is_told() -> None:
    """A shorter one may be the part of a direction that the dofs of a structure leave."""

    def told(normal: dict[str, float]) -> list[str]:
        pair = ss.ContactPair(name="foot", contact=FOOT, tangential=("x", "y"), normal=normal)
        return [str(w) for w in problem_warnings(problem(pair), (1.0, 2.0)) if "normal is" in str(w)]

    (sentence,) = told({"x": 0.6, "z": 0.8})
    assert "normal is 53.13 degrees from the tangential direction" in sentence
    assert "from the second direction" in told({"y": -0.6, "z": 0.8})[0]
    assert not told({"x": 0.6, "z": 0.1})
    assert not told({"z": -1.0})


def test_two_directions_of_a_law_of_one_are_said_to_be_two_contacts() -> None:
    """In a case file they are a plane; contacts that differ, or do not stand at one place, are meant."""
    law = ss.FrictionContact(kt=100.0, mu=0.3, kn=50.0, gap=-16.0)

    def said(contact: ss.FrictionContact, tangential: Any, **others: Any) -> bool:
        pair = ss.ContactPair(name="foot", contact=contact, tangential=tangential, **others)
        return any("two directions are two contacts" in text for text in problem_warnings(problem(pair)))

    assert said(law, ("x", "y"), normal="z")
    assert said(law, [{"x": 0.6, "y": 0.8}, {"x": -0.8, "y": 0.6}])
    assert not said(law, ["x", {"x": 0.6, "y": 0.8}], normal="z")
    assert not said(law, ("x", "y"), area=[1.0, 2.0])
    assert not said(ss.FrictionContact(kt=[100.0, 50.0], mu=0.3, normal_load=800.0), ("x", "y"))
    assert not said(law, "x", normal="z")
