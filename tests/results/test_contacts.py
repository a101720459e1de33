"""The contacts of a point, each asked by its own law: loops and states of friction beside other laws, foreign files."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.contact.law import Law, Motion
from slipstick.results.contacts import force_of, friction_contacts

H = ss.Harmonics(range(4))
OMEGA = 6.3
TAU = np.linspace(0.0, 2.0 * np.pi, 401)


def smooth(q, velocity, k, c):
    """A cubic spring and a damper, along one port or two that feel each other."""
    if not isinstance(q, tuple):
        return k * q + 0.3 * k * q**3 + c * velocity
    return k * q[0] + c * velocity[0] + 0.2 * k * q[1] ** 2, k * q[1] + 0.4 * k * q[0] * q[1] + c * velocity[1]


def own_law(ports: tuple[str, ...]) -> ss.SampledLaw:
    return ss.SampledLaw(force=smooth, parameters={"k": 5.0, "c": 0.4}, ports=ports)


class Silent(Law):
    """A linear spring that tells nothing but its forces' coefficients."""

    ports = ("tangential",)
    values: ClassVar[dict[str, float]] = {"stiffness": 7.0}

    def changed(self, **values):
        return self

    def respond(self, motion, values):
        return ss.SampledLaw(
            force=lambda q, velocity, stiffness: stiffness * q, parameters=self.values, ports=self.ports
        ).respond(motion, values)


RUB = ss.RubbingMotion(velocity=0.4, cos={1: 0.05})
LAWS = {
    "sliding": lambda dof: ss.ContactPair(
        name=f"sliding {dof}", tangential=dof, rubbing=RUB, contact=ss.FrictionContact(kt=30.0, mu=0.4, normal_load=3.0)
    ),
    "opening": lambda dof: ss.ContactPair(
        name=f"opening {dof}", tangential=dof, normal="z",
        contact=ss.FrictionContact(kt=20.0, mu=0.3, kn=15.0, gap=0.02),
    ),
    "one port": lambda dof: ss.ContactPair(name=f"one port {dof}", ports={"s": dof}, contact=own_law(("s",))),
    "tangential": lambda dof: ss.ContactPair(
        name=f"tangential {dof}", tangential=dof, contact=own_law(("tangential",)), rubbing=RUB
    ),
    "both ports": lambda dof: ss.ContactPair(
        name=f"both ports {dof}", tangential=dof, normal="z", contact=own_law(("tangential", "normal")),
    ),
    "turned": lambda dof: ss.ContactPair(
        name=f"turned {dof}", tangential=dof, normal="z", contact=own_law(("normal", "tangential")),
    ),
    "friction": lambda dof: ss.ContactPair(
        name=f"friction {dof}", ports={"friction": dof}, contact=own_law(("friction",)),
    ),
}  # fmt: skip


def problem(kinds: tuple[str, ...]) -> ss.Problem:
    K = np.array([[60.0, -20.0, 0.0], [-20.0, 70.0, 5.0], [0.0, 5.0, 90.0]])
    structure = ss.MatrixStructure(M=np.diag([1.0, 1.0, 0.5]), C=0.5 * np.eye(3), K=K, dofs=["a", "b", "z"])
    pairs = [LAWS[kind]("ab"[i % 2]) for i, kind in enumerate(kinds)]
    loads = [ss.Load(dof="a", sin=4.0), ss.Load(dof="z", cos=3.0)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=H)


def point(kinds: tuple[str, ...]) -> ss.Branch:
    found = ss.forced_response(problem(kinds), omega=(OMEGA, OMEGA + 0.05), options={"max_step": 0.05})
    assert found.outcome.ok
    return found


def assert_truth(found: ss.Branch, kinds: tuple[str, ...]) -> None:
    """Loops are the law's force at that motion, computed directly; their areas are the energies dissipated."""
    d, names = found.dataset.isel(point=0), [str(name) for name in found.dataset["contact"].to_numpy()]
    states = found.states(0) if any(kind in ("sliding", "opening") for kind in kinds) else None
    fine = np.linspace(0.0, 2.0 * np.pi, 20001)
    for i, (kind, name) in enumerate(zip(kinds, names, strict=True)):
        pair, friction = found.problem.contacts[i], kind in ("sliding", "opening")
        U, energy, v = pair.rubbing.coefficients(H), 0.0, float(pair.rubbing.velocity) / OMEGA
        Q = [d[f"contact_{port}"].to_numpy()[i] + (U if p == 0 else 0.0) for p, port in enumerate(pair.contact.ports)]
        for p, port in enumerate(pair.contact.ports):
            if friction and p:
                continue
            loop = found.loop(0, name, port=port, samples=TAU.size)
            drift = v if p == 0 else 0.0
            q = [H.H_minus(TAU) @ X for X in Q]
            np.testing.assert_allclose(loop["total"], q[p] + drift * TAU, atol=1e-12)
            np.testing.assert_allclose(loop["motion"], q[p] - (H.H_minus(TAU) @ U if p == 0 else 0.0), atol=1e-12)
            if friction:
                assert "limit" in loop
                assert np.all(np.abs(loop["force"]) <= loop["limit"] + 1e-12)
                np.testing.assert_array_equal(loop["friction"], loop["force"])
            else:
                rate = [OMEGA * (H.H_minus(TAU) @ H.derivative(X) + (v if j == 0 else 0.0)) for j, X in enumerate(Q)]
                forces = smooth(q[0], rate[0], 5.0, 0.4) if len(Q) == 1 else smooth(tuple(q), tuple(rate), 5.0, 0.4)
                wanted = forces if len(Q) == 1 else forces[p]
                np.testing.assert_allclose(loop["force"], wanted, atol=1e-10 * np.abs(wanted).max())
                assert "limit" not in loop
            own = found.loop(0, name, port=port, samples=fine.size)
            energy += float(np.trapezoid(own["force"], own["total"]))
        power = float(d["dissipated_power"][i]) / OMEGA * 2.0 * np.pi
        assert energy == pytest.approx(power, rel=2e-5, abs=1e-7)
        if states is None:
            continue
        if friction:
            kept = found.contact_forces(0)
            assert states[name] == kept.states[i]
            stuck = sum(end - start for start, end, state in states[name] if state == "stick") / (2.0 * np.pi)
            assert stuck == pytest.approx(float(d["stick_fraction"][i]), abs=1e-9)
            np.testing.assert_allclose(kept.Fx[i], d["friction_force"].to_numpy()[i], atol=1e-9)
        else:
            assert states[name] == [(0.0, 2.0 * np.pi, "unknown")]
            assert np.isnan(found.contact_forces(0).Fx[i]).all()


GRID = [
    kinds
    for count in (1, 2, 3)
    for kinds in permutations(LAWS, count)
]  # fmt: skip


@pytest.mark.parametrize("kinds", [
    ("sliding", "tangential"), ("both ports", "opening"), ("turned", "sliding", "one port"), ("friction", "opening"),
    ("both ports", "tangential"),
])  # fmt: skip
def test_every_contact_answers_by_its_own_law(kinds) -> None:
    assert_truth(point(kinds), kinds)


@pytest.mark.verify(sample=80)
@pytest.mark.parametrize("kinds", GRID)
def test_every_contact_answers_by_its_own_law_in_any_company(kinds) -> None:
    assert_truth(point(kinds), kinds)


@pytest.mark.parametrize("kinds", [("sliding", "both ports"), ("both ports", "sliding")])
def test_without_the_problem_friction_is_known_and_other_laws_are_not(kinds, tmp_path: Path) -> None:
    found = point(kinds)
    with pytest.warns(ss.SlipstickWarning, match="SampledLaw"):
        found.save(tmp_path / "r.nc")
    alone, i = ss.load(tmp_path / "r.nc"), kinds.index("sliding")
    assert friction_contacts(alone.table).tolist() == [kind == "sliding" for kind in kinds]
    names = [str(name) for name in alone.dataset["contact"].to_numpy()]
    assert alone.states(0) == found.states(0)
    np.testing.assert_array_equal(alone.loop(0, names[i])["friction"], found.loop(0, names[i])["friction"])
    with pytest.raises(
        ss.InputError, match=r"the law of contact 'both ports .' is not known.*give the problem, ss\.load"
    ):
        alone.loop(0, names[1 - i])
    again = ss.load(tmp_path / "r.nc", found.problem)
    np.testing.assert_array_equal(again.loop(0, names[1 - i])["force"], found.loop(0, names[1 - i])["force"])
    assert [force_of(alone.dataset.isel(point=0), k) for k in (i, 1 - i)] == [
        ("friction_force", True), ("tangential_force", False)
    ]  # fmt: skip


def test_a_law_that_tells_nothing_is_unknown() -> None:
    plain = problem(("sliding",))
    pair = ss.ContactPair(name="silent", tangential="b", contact=Silent())
    both = ss.Problem(plain.structure, contacts=[pair, *plain.contacts], loads=plain.loads, harmonics=H)
    found = ss.forced_response(both, omega=(OMEGA, OMEGA + 0.05))
    assert found.states(0)["silent"] == [(0.0, 2.0 * np.pi, "unknown")]
    with pytest.raises(ss.InputError, match="the law of contact 'silent', a Silent, does not give its force in time"):
        found.loop(0, "silent")
    alone = ss.Problem(plain.structure, contacts=[pair], loads=plain.loads, harmonics=H)
    with pytest.raises(ss.InputError, match="these results hold no friction contact"):
        ss.forced_response(alone, omega=(OMEGA, OMEGA + 0.05)).states(0)


def test_a_law_that_tells_its_states_is_asked() -> None:
    class Telling(Silent):
        def states(self, motion: Motion, values):
            return [[(0.0, 2.0 * np.pi, "open")] for _ in motion.Q[0]]

    plain = problem(())
    pair = ss.ContactPair(name="own", tangential="b", contact=Telling())
    mine = ss.Problem(plain.structure, contacts=[pair], loads=plain.loads, harmonics=H)
    assert ss.forced_response(mine, omega=(OMEGA, OMEGA + 0.05)).states(0) == {"own": [(0.0, 2.0 * np.pi, "open")]}


def test_parameters_called_as_frictions_numbers_stay_apart() -> None:
    """A law whose parameters carry the names of friction's variables is not taken for friction."""
    names = ("tangential_stiffness", "friction_coefficient", "normal_stiffness", "gap")
    law = ss.SampledLaw(
        force=lambda q, velocity, **given: given["tangential_stiffness"] * q, parameters=dict.fromkeys(names, 2.0),
        ports=("tangential",),
    )  # fmt: skip
    plain = problem(("opening",))
    pair = ss.ContactPair(name="alike", tangential="b", contact=law)
    both = ss.Problem(plain.structure, contacts=[pair, *plain.contacts], loads=plain.loads, harmonics=H)
    found = ss.forced_response(both, omega=(OMEGA, OMEGA + 0.05))
    assert friction_contacts(found.table).tolist() == [False, True]
    assert found.dataset["law_gap"].to_numpy()[0].tolist()[0] == 2.0
    loop = found.loop(0, "alike")
    np.testing.assert_allclose(loop["force"], 2.0 * loop["motion"], rtol=1e-12)
    assert found.states(0)["alike"][0][2] == "unknown"


def test_time_integration_and_stability_name_the_law_they_do_not_know() -> None:
    plain = problem(("sliding",))
    pair = ss.ContactPair(name="silent", tangential="b", contact=Silent())
    both = ss.Problem(plain.structure, contacts=[pair, *plain.contacts], loads=plain.loads, harmonics=H)
    found = ss.forced_response(both, omega=(OMEGA, OMEGA + 0.05))
    said = "contact 'silent' follows a law that does not tell its rate in time"
    with raises_fault("time integration", says=said):
        ss.transient(found.problem, OMEGA)
    with raises_fault("time integration", says=said):
        found.check_in_time(0)
    with raises_fault("stability", says=said):
        ss.forced_response(both, omega=(OMEGA, OMEGA + 0.05), stability=True)


@pytest.mark.parametrize("kinds", [("sliding", "tangential"), ("tangential", "opening"), ("both ports",)])
def test_friction_and_other_laws_are_checked_in_time(kinds) -> None:
    """What differs from the integration in time is what the harmonics left out add."""
    given = problem(kinds)
    found = ss.forced_response(replace(given, harmonics=ss.Harmonics(range(16))), omega=(OMEGA, OMEGA + 0.05))
    check = found.check_in_time(0)
    assert check.converged
    assert check.relative_difference < 3.0 * found.dataset.truncation.values[0] + 1e-9


BAD = [np.nan, np.inf, 1e200, -1e308]


@pytest.mark.parametrize("value", BAD)
@pytest.mark.parametrize(
    "name",
    [
        "contact_tangential",
        "contact_normal",
        "normal_motion",
        "gap",
        "friction_coefficient",
        "rubbing_velocity",
        "omega",
    ],
)
def test_numbers_that_are_none_end_in_a_fault(name: str, value: float, tmp_path: Path) -> None:
    """A file of nan and absurd numbers: loops, states and report end, with a fault or without what they spoil."""
    made = _opening()
    spoilt = made.dataset[name].to_numpy().copy()
    spoilt[1, ...] = value
    data = made.dataset.assign({name: (made.dataset[name].dims, spoilt)})
    path = ss.Branch.from_dataset(data).save(tmp_path / "r.nc")
    again = ss.load(path)
    for ask in (again.states, again.loop, again.contact_forces, again.plot.loop, again.plot.states):
        with pytest.raises(ss.InputError):
            ask(1)
    assert again.states(0) == made.states(0)
    if name != "omega":
        again.report(tmp_path / "r.html")


_KEPT: list[ss.Branch] = []


def _opening() -> ss.Branch:
    if not _KEPT:
        _KEPT.append(point(("opening",)))
    return _KEPT[0]


@pytest.mark.parametrize("value", BAD)
def test_a_displacement_without_number_spoils_no_contact(value: float, tmp_path: Path) -> None:
    made = _opening()
    spoilt = made.dataset["displacement"].to_numpy().copy()
    spoilt[:, 0, 3] = value
    data = made.dataset.assign(displacement=(made.dataset["displacement"].dims, spoilt))
    again = ss.load(ss.Branch.from_dataset(data).save(tmp_path / "r.nc"))
    assert again.states(0) == made.states(0)
    np.testing.assert_array_equal(again.loop(0)["friction"], made.loop(0)["friction"])
    again.report(tmp_path / "r.html")


def test_figures_of_contacts_of_all_kinds() -> None:
    kinds = ("sliding", "both ports", "tangential")
    found = point(kinds)
    names = [str(name) for name in found.dataset["contact"].to_numpy()]
    assert found.plot.states(0).get_legend() is not None
    for name in names:
        (line,) = found.plot.loop(0, name).lines
        np.testing.assert_array_equal(line.get_ydata(), found.loop(0, name)["force"])
        assert ("Friction" in found.plot.loop(0, name).get_ylabel()) == (name == names[0])
        right = found.plot.loops(0, name)[1]
        area = np.trapezoid(found.loop(0, name)["force"], found.loop(0, name)["total"])
        assert float(right.get_title().split("= ")[-1].split()[0]) == pytest.approx(area, rel=2e-3)
        heights = [bar.get_height() for bar in found.plot.spectrum(0, contact=name).patches]
        force = found.dataset["friction_force" if name == names[0] else "tangential_force"].to_numpy()
        F = force[0, names.index(name)]
        np.testing.assert_allclose(heights, [abs(F[0]), *np.hypot(F[1::2], F[2::2])], rtol=1e-12)
        assert np.isfinite(found.plot.history(0, contact=name).lines[0].get_ydata()).all()
    with pytest.raises(ss.InputError, match="is no friction contact"):
        found.plot.fractions(names[1])
