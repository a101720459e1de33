"""How far the modes of a finite element model reach where a case does not say how many it wants."""

from __future__ import annotations

from typing import Any

import pytest

from slipstick.case.fe import reaching

CASE: dict[str, Any] = {"structure": {"kind": "blade"}, "response": {"from": 100.0, "to": 190.0}}


def case(**changes: Any) -> dict[str, Any]:
    return {**CASE, **changes}


@pytest.mark.parametrize(
    ("given", "up_to"),
    [
        (CASE, 1000.0),
        (case(response={"from": 200.0, "to": 10.0}), 1000.0),
        (case(response={"from": 100.0, "to": 201.0}), 1500.0),
        (case(response={"from": "10 Hz", "to": "15 Hz"}), 500.0),
        (case(response={"parameter": "a.mu", "from": 0.0, "to": 1.0, "omega": 30.0}), 150.0),
        (case(load=[{"shape": "pressure", "cos": 1.0}, {"shape": "pressure", "cos": 1.0, "harmonic": 3}]), 3000.0),
        (case(load=[{"shape": "pressure", "cos": 1.0, "harmonic": 0}]), 1000.0),
    ],
)
def test_the_range_says_how_far(given: dict[str, Any], up_to: float) -> None:
    assert reaching(given) == {"kind": "blade", "up_to": pytest.approx(up_to)}


@pytest.mark.parametrize("said", [{"modes": 4}, {"up_to": 10.0}, {"accuracy": 1e-5, "up_to": 10.0}])
@pytest.mark.parametrize("kind", ["blade", "fe"])
def test_what_is_said_stands(kind: str, said: dict[str, Any]) -> None:
    structure = {"kind": kind, **said}
    assert reaching(case(structure=structure)) == structure


@pytest.mark.parametrize("kind", ["matrices", "modal"])
def test_other_kinds_are_not_reduced(kind: str) -> None:
    assert reaching(case(structure={"kind": kind})) == {"kind": kind}


@pytest.mark.parametrize(
    "wrong",
    [
        {"response": None}, {"response": 3}, {"response": {"from": 2.0}}, {"response": {"from": -1.0, "to": 2.0}},
        {"response": {"from": "a", "to": "b"}}, {"response": {"parameter": "a.mu", "from": 0.0, "to": 1.0}},
        {"load": 3}, {"load": [1]}, {"load": [{"harmonic": "x"}]}, {"load": [{"harmonic": None}]},
        {"structure": 3}, {"structure": {"kind": ["blade"]}},
    ],
)  # fmt: skip
def test_faults_are_left_to_others(wrong: dict[str, Any]) -> None:
    given = case(**wrong)
    assert reaching(given) is given["structure"]
