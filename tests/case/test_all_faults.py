"""Every fault of a case, and of a problem, is told at once and once, whatever else is wrong; as data, at its place."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from itertools import combinations
from typing import Any

import pytest

import slipstick as ss
from slipstick.case.case import read_case

CASE: dict[str, Any] = {
    "format": 1,
    "harmonics": "0..3",
    "structure": {
        "kind": "matrices",
        "dofs": ["x", "z"],
        "mass": [[1.0, 0.0], [0.0, 1.0]],
        "damping": [[0.4, 0.0], [0.0, 0.4]],
        "stiffness": [[40.0, 0.0], [0.0, 50.0]],
    },
    "load": [{"dof": "x", "harmonic": 1, "sin": 100.0}, {"dof": "z", "cos": 1.0}],
    "contact": [
        {"name": "pad", "tangential": "x", "kt": 10.0, "mu": 0.3, "normal_load": 8.0, "rubbing": {"velocity": 1.0}},
        {"name": "shoe", "tangential": "z", "kt": 10.0, "mu": 0.3, "normal_load": 8.0},
    ],
    "response": {"from": 1.0, "to": 2.0, "parameter": "pad.velocity", "omega": 3.0},
    "output": {"dofs": ["x", "z"]},
}
FAULTS: dict[tuple[str | int, ...], Any] = {
    ("title",): 3,
    ("period_ratio",): "3:2",
    ("speed",): 3,
    ("structure", "mass"): [[1.0, 5.0], [0.0, 1.0]],
    ("structure", "stiffness"): [[-40.0, 0.0], [0.0, 50.0]],
    ("structure", "loss_factor"): -1.0,
    ("load", 0, "dof"): "q",
    ("load", 1, "harmonic"): -2,
    ("load", 0, "harmonic"): 9,
    ("contact", "pad", "kt"): -1.0,
    ("contact", "pad", "rubbing", "cos"): {"7": 1.0},
    ("contact", "pad", "rubbing", "velocity"): "fast",
    ("contact", "shoe", "tangential"): "q",
    ("contact", "shoe", "mu"): "low",
    ("contact", "shoe", "stiff"): 1.0,
    ("response", "parameter"): "pad.speed",
    ("response", "from"): "1 Hz",
    ("output", "dofs"): ["x", "q"],
}
HIDES = {
    frozenset([("period_ratio",), ("load", 0, "harmonic")]),
    frozenset([("period_ratio",), ("contact", "pad", "rubbing", "cos")]),
}
"""Which harmonic of the motion a load sits on is not known while the ratio of the periods is not."""


def put(case: dict[str, Any], where: tuple[str | int, ...], value: Any) -> None:
    """One fault; contacts by their names."""
    inner: Any = case
    for part in where[:-1]:
        named = isinstance(inner, list) and isinstance(part, str)
        inner = next(table for table in inner if table["name"] == part) if named else inner[part]
    inner[where[-1]] = value


def told(call: Callable[[], Any]) -> list[tuple[str | int, ...]]:
    """Places of all faults."""
    with pytest.raises(ss.InputError) as caught:
        call()
    return sorted((fault.where for fault in caught.value.faults), key=str)


def test_the_case_is_good(tmp_path):
    assert read_case(CASE, tmp_path).problem.outputs == ("x", "z")


@pytest.mark.parametrize("first", FAULTS, ids=lambda where: ".".join(map(str, where)))
def test_two_faults_are_told_together(first, tmp_path):
    """Each fault alone, and with each that comes after it."""
    places = list(FAULTS)
    for others in [(), *((other,) for other in places[places.index(first) + 1 :])]:
        case = deepcopy(CASE)
        for where in (first, *others):
            put(case, where, FAULTS[where])
        if frozenset([first, *others]) not in HIDES:
            assert told(lambda case=case: read_case(case, tmp_path)) == sorted((first, *others), key=str)


def test_all_faults_are_told_together(tmp_path):
    case = deepcopy(CASE)
    places = [where for where in FAULTS if where != ("period_ratio",)]
    for where in places:
        put(case, where, FAULTS[where])
    assert told(lambda: read_case(case, tmp_path)) == sorted(places, key=str)


@pytest.mark.parametrize("stiffness", [40.0, -40.0])
def test_contacts_on_a_surface_need_one_whether_or_not_the_matrices_are_right(tmp_path, stiffness):
    case = deepcopy(CASE)
    put(case, ("structure", "stiffness"), [[stiffness, 0.0], [0.0, 50.0]])
    case["contact"].append(
        {"name": "face", "points": "all", "direction": [1.0, 0.0, 0.0], "kt": 1.0, "mu": 0.1, "normal_load": 1.0}
    )
    wrong = [("contact", "face", "points")] + ([("structure", "stiffness")] if stiffness < 0 else [])
    assert told(lambda: read_case(case, tmp_path)) == wrong


CONTACT = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
STRUCTURE = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
WRONG: dict[tuple[str | int, ...], dict[str, Any]] = {
    ("structure",): {"structure": 3},
    ("harmonics",): {"harmonics": "all"},
    ("period_ratio",): {"period_ratio": 2},
    ("title",): {"title": 3},
    ("load",): {"load": "high"},
    ("friction",): {"friction": -1.0},
    ("thermal",): {"thermal": 3},
    ("outputs", 0): {"outputs": [3]},
    ("contact", "pad", "name"): {"contacts": [ss.ContactPair(name="*", contact=CONTACT, tangential="x")]},
    ("loads", 0): {"loads": ["x"]},
}


def test_a_problem_tells_all_its_faults():
    good: dict[str, Any] = {
        "structure": STRUCTURE,
        "contacts": [ss.ContactPair(name="pad", contact=CONTACT, tangential="x")],
        "loads": [ss.Load(dof="x", cos=1.0)],
        "harmonics": [0, 1],
        "told": None,
    }
    for where, other in combinations(WRONG, 2):
        given = good | WRONG[where] | WRONG[other]
        expected = [("contact", "*", "name") if place[0] == "contact" else place for place in (where, other)]
        assert told(
            lambda given=given: ss.Problem(given["structure"], **{k: v for k, v in given.items() if k != "structure"})
        ) == sorted(expected, key=str)


def places(table: Any, where: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Paths of everything in a case."""
    items = table.items() if isinstance(table, dict) else enumerate(table) if isinstance(table, list) else ()
    return [path for key, inner in items for path in [(*where, key), *places(inner, (*where, key))]]


def is_there(where: tuple[str | int, ...], case: Any) -> bool:
    """Whether a path names something of the case, or something that is missing in a table of it."""
    for i, part in enumerate(where):
        if isinstance(case, list) and isinstance(part, str):
            case = next((table for table in case if isinstance(table, dict) and table.get("name") == part), None)
        elif isinstance(case, dict) and part not in case:
            return i == len(where) - 1
        else:
            case = case[part]
        if case is None:
            return False
    return True


@pytest.mark.parametrize("value", [True, -1, 3.5, float("nan"), "", "q", [], [1, "a"], {}, {"q": 1}], ids=str)
def test_every_place_is_one_of_the_case(value, tmp_path):
    for where in places(CASE):
        case = deepcopy(CASE)
        put(case, where, value)
        try:
            read_case(case, tmp_path)
        except ss.InputError as error:
            lost = [fault for fault in error.faults if not fault.where or not is_there(fault.where, case)]
            assert not lost, (where, lost)
