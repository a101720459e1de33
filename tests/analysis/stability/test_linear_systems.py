"""What is made anew from point to point, and what is kept."""

import dataclasses

from helpers.oscillator import oscillator
from helpers.stability import point_at

from slipstick.analysis.stability.linear_systems import LinearSystems
from slipstick.balance.balance import Balance


def test_systems_are_kept_as_long_as_the_contacts_keep_their_parameters() -> None:
    problem = oscillator(10.0)
    point = point_at(problem, 4.3)
    systems = LinearSystems(Balance(problem), full=False)
    first = systems.at(point.detail)
    assert systems.at(dataclasses.replace(point.detail, omega=4.4)) is first
    other = point_at(problem.with_parameter("damper.mu", 0.2), 4.3)
    assert systems.at(other.detail) is not first
    assert systems.at(other.detail).contacts.mu.tolist() == [0.2]


def test_other_damping_makes_another_structure() -> None:
    problem = oscillator(10.0)
    point = point_at(problem, 4.3)
    systems = LinearSystems(Balance(problem), full=False)
    inputs = dataclasses.replace(point.detail.inputs, structure={"damping": 2.0})
    damped = systems.at(dataclasses.replace(point.detail, inputs=inputs))
    assert damped.dynamics.C.tolist() == [[0.8]]
