"""Problems: named parameters, harmonics of loads and rubbing motions, faults all at once, warnings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.balance.checks import range_faults
from slipstick.balance.physics_checks import problem_warnings
from slipstick.case.load import LoadTable, build_load
from slipstick.case.validation import ReadTable


def problem(**changes: Any) -> ss.Problem:
    structure = ss.MatrixStructure(
        M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"], load_shapes={"pressure": np.array([2.0])}
    )
    pair = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=2.0, gap=-400.0),
        tangential="x",
        rubbing=ss.RubbingMotion(velocity=10.0, cos={1: 2.0}),
    )
    given: dict[str, Any] = {
        "contacts": [pair],
        "loads": [ss.Load(dof="x", sin=100.0)],
        "harmonics": ss.Harmonics(range(11)),
    }
    return ss.Problem(structure, **(given | changes))


def test_named_parameters() -> None:
    p = problem()
    assert p.parameter("damper.normal_load") == 800.0
    changed = p.with_parameter("damper.normal_load", 400.0)
    assert changed.parameter("damper.gap") == -200.0
    assert changed.parameter("damper.kn") == 2.0
    assert p.parameter("damper.gap") == -400.0
    assert p.with_parameter("*.velocity", 3.0).contacts[0].rubbing.velocity == 3.0
    assert p.with_parameter("load", 2.0).load_coefficients()[0, 2] == 200.0
    assert p.with_parameter("friction", 0.5).contact_values("mu") == pytest.approx([0.15])


@pytest.mark.parametrize("name, value, words", [
    ("damper.velocty", 1.0, "did you mean 'damper.velocity'"), ("demper.mu", 1.0, "did you mean 'damper.mu'"),
    ("damper.normal_load", -1.0, ">= 0"), ("damper.mu", -0.1, "negative"), ("load", np.nan, "finite"),
    ("friction", -1.0, ">= 0"),
])  # fmt: skip
def test_parameters_that_cannot_be_set(name: str, value: float, words: str) -> None:
    with pytest.raises(ss.InputError, match=words):
        problem().with_parameter(name, value)


def test_period_ratio_maps_loads_and_rubbing_to_the_principal_frequency() -> None:
    p = problem(harmonics=ss.Harmonics([0, 2, 3]), period_ratio=(2, 3))
    assert (p.load_order, p.rubbing_order) == (3, 2)
    assert p.load_coefficients()[0].tolist() == [0, 0, 0, 0, 100.0]
    assert p.inputs.batches[0].motion[0, 0].tolist() == [0, 2.0, 0, 0, 0]


def test_all_faults_at_once() -> None:
    contact = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
    pairs = [
        ss.ContactPair(name="a", contact=contact, tangential="y"),
        ss.ContactPair(name="a", contact=contact, tangential={"x": 0.0}, rubbing=ss.RubbingMotion(cos={7: 1.0})),
    ]
    loads = [ss.Load(dof="x", harmonic=4, cos=1.0), ss.Load(dof="x", shape="pressure"), ss.Load(shape="presure")]
    with pytest.raises(ss.InputError) as caught:
        problem(contacts=pairs, loads=loads, harmonics=ss.Harmonics([0, 1, 3]), outputs=["z"])
    text = str(caught.value)
    for words in ("used 2 times", "no dof 'y'", "no direction", "harmonic 7 is not", "harmonic 4 is not", "with dof",
                  "did you mean 'pressure'", "no dof 'z'"):  # fmt: skip
        assert words in text
    assert len(caught.value.sentences) == 8


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("changes, words", [
    ({"harmonics": ss.Harmonics([0, 1, 3, 5])}, "even harmonics"),
    ({"harmonics": ss.Harmonics([0, 1])}, "at least 0..5"),
    ({"loads": [], "contacts": []}, "nothing moves"),
])  # fmt: skip
def test_warnings(changes: dict[str, Any], words: str) -> None:
    assert any(words in text for text in problem_warnings(problem(**changes)))


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("name, value, words", [
    ("damper.mu", 0.0, "mu = 0"), ("damper.normal_load", 0.0, "normal load is 0"),
    ("damper.kt", 0.0, "kt = 0, so no sliding changes its friction force"),
])  # fmt: skip
def test_warnings_of_contacts_that_do_nothing(name: str, value: float, words: str) -> None:
    assert any(words in text for text in problem_warnings(problem().with_parameter(name, value)))


def test_hertz_taken_for_radians_is_suspected() -> None:
    assert problem_warnings(problem(), (2.0, 15.0)) == []
    (text,) = problem_warnings(problem(), (0.3, 2.0))
    assert "meant in Hz" in text
    assert problem_warnings(problem(), (8.0, 15.0)) == []  # the stuck resonance lies there
    assert any("2 pi applied twice" in text for text in problem_warnings(problem(), (30.0, 90.0)))


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_a_gap_that_never_closes_is_suspected() -> None:
    structure = ss.MatrixStructure(M=np.eye(2), K=np.diag([40.0, 40.0]), dofs=["x", "y"])
    pair = ss.ContactPair(
        name="tip", contact=ss.FrictionContact(kt=1.0, mu=0.3, kn=10.0, gap=1e4), tangential="x", normal="y"
    )
    p = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="y", cos=100.0)], harmonics=ss.Harmonics(range(6)))
    assert any("never close" in text or "hardly ever close" in text for text in problem_warnings(p))


@pytest.mark.parametrize("span", [(2.0, 2.0), (-1.0, 3.0), (0.0, 3.0), (np.nan, 3.0)])
def test_ranges(span: tuple[float, float]) -> None:
    assert len(range_faults(*span)) == 1
    with pytest.raises(ss.InputError):
        ss.forced_response(problem(), omega=span)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_default_outputs_hold_every_loaded_and_contact_dof() -> None:
    n = 130
    names = [f"x{i}" for i in range(n)]
    structure = ss.MatrixStructure(M=np.eye(n), C=np.eye(n), K=40.0 * np.eye(n), dofs=names)
    contact = ss.FrictionContact(kt=1.0, mu=0.3, kn=2.0, gap=-4.0)
    pair = ss.ContactPair(
        name="tip",
        contact=contact,
        tangential={"x3": 1.0, "x121": -1.0},
        normal="x120",
        rubbing=ss.RubbingMotion(velocity=1.0),
    )
    p = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x110", sin=1.0)], harmonics=[0, 1])
    assert p.outputs == (*names[:100], "x110", "x120", "x121")
    assert ss.Problem(structure, loads=[ss.Load(dof="x110", sin=1.0)], outputs=["x5"]).outputs == ("x5",)


def test_loads_by_amplitude_and_phase_as_in_a_case_file() -> None:
    table = LoadTable(dof="x", amplitude=3.0, phase="-90 deg")
    assert ss.Load(dof="x", amplitude=3.0, phase=-np.pi / 2) == build_load(ReadTable((), table, frozenset()))[0]
    by_size = ss.Load(dof="x", amplitude=3.0, phase=0.7)
    tau = np.linspace(0.0, 6.0, 13)
    np.testing.assert_allclose(by_size.cos * np.cos(tau) + by_size.sin * np.sin(tau), 3.0 * np.cos(tau + 0.7))
    assert (by_size.amplitude, by_size.phase) == pytest.approx((3.0, 0.7))
    assert replace(by_size, cos=1.0).cos == 1.0
    for given, words in (
        ({"amplitude": 1.0, "sin": 2.0}, "keep one form"), ({"phase": 1.0}, "without amplitude"),
        ({"amplitude": "a"}, "found 'a'"), ({"sin": 1j}, "expected a finite number"),
        ({"harmonic": 1.5}, "whole number"),
    ):  # fmt: skip
        with pytest.raises(ss.InputError, match=words):
            ss.Load(dof="x", **given)


def test_one_thing_stands_for_a_list_of_one() -> None:
    p = problem()
    alone = problem(contacts=p.contacts[0], loads=p.loads[0], harmonics=10, outputs="x")
    assert (alone.contacts, alone.loads, alone.harmonics, alone.outputs) == (p.contacts, p.loads, p.harmonics, ("x",))


def test_a_surface_cannot_move_along_a_port_that_is_not_there() -> None:
    law = ss.SampledLaw(force=lambda q, velocity: q**3, ports=("along",))
    pair = ss.ContactPair(
        name="spring", contact=law, ports={"along": "x"}, rubbing=ss.RubbingMotion(normal_cos={1: 0.1})
    )
    structure = ss.MatrixStructure(M=[[1.0]], K=[[9.0]], dofs=["x"], loss_factor=0.1)
    with raises_fault("contact", "spring", "rubbing", says="a port called 'normal', which its law"):
        ss.Problem(structure, contacts=pair, told=None)


@pytest.mark.parametrize("structure", [3, "beam", ss.MatrixStructure])
def test_what_is_no_structure_is_told_with_what_else_is_wrong(structure: Any) -> None:
    with pytest.raises(ss.InputError) as raised:
        ss.Problem(structure, loads=[3], harmonics=[0, 1])
    first, *others = raised.value.faults
    assert first.where == ("structure",)
    assert first.expected == "one such as ss.MatrixStructure(M=..., K=..., dofs=...)"
    assert [fault.where[0] for fault in others] == ["loads"]
