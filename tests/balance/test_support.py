"""Structures that nothing but their contacts holds, against closed forms of linear structures with springs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.physics_checks import problem_warnings
from slipstick.typing import Array

M, K = np.eye(2), np.array([[40.0, -40.0], [-40.0, 40.0]])
C = np.array([[0.3, -0.1], [-0.1, 0.3]])  # couples the modes
G = np.array([[0.0, 1.0], [-1.0, 0.0]])
KN, STUCK = 30.0, 50.0

pytestmark = pytest.mark.filterwarnings("ignore:contact 'c'. kt = 0")


def pair(**options: Any) -> ss.MatrixStructure:
    return ss.MatrixStructure(**{"M": M, "C": C, "K": K, "dofs": ["a", "b"]} | options)


HOLDS = r"no contact holds the structure in harmonic 0.*ss\.models\.free_structure"
PRESSED = ss.Load(dof="a", harmonic=0, cos=100.0)


def spring() -> ss.ContactPair:
    """A contact without friction that does not open while it is pressed: a spring to the ground."""
    law = ss.FrictionContact(kt=0.0, mu=0.0, kn=KN, gap=-1.0)
    return ss.ContactPair(name="c", contact=law, tangential="b", normal="a")


def stuck() -> ss.ContactPair:
    """Friction that never slips."""
    return ss.ContactPair(name="c", contact=ss.FrictionContact(kt=STUCK, mu=0.5, normal_load=1e6), tangential="a")


def problem(contact: ss.ContactPair, *loads: ss.Load, structure: ss.MatrixStructure | None = None) -> ss.Problem:
    pressed = [PRESSED] if contact.normal is not None else []
    loads = (ss.Load(dof="b", cos=2.0), *pressed, *loads)
    return ss.Problem(structure or pair(), contacts=contact, loads=loads, harmonics=3)


def closed(w: float, k: float, damping: Array = C) -> Array:
    Z = K - w * w * M + 1j * w * damping + np.diag([k, 0.0])
    return np.linalg.solve(Z, np.array([0.0, 2.0]))


def phasors(branch: ss.Branch, w: float) -> Array:
    X = np.asarray(branch.dataset.displacement[branch.at(w)])
    return X[:, 1] - 1j * X[:, 2]


@pytest.mark.parametrize(("contact", "k"), [(spring(), KN), (stuck(), STUCK)])
def test_a_contact_that_holds_a_free_body_is_a_spring(contact: ss.ContactPair, k: float) -> None:
    at = [1.5, 3.0, 7.0, 11.0]
    branch = ss.forced_response(problem(contact), omega=(1.0, 12.0), at=at)
    assert branch.outcome is ss.Outcome.COMPLETED
    for w in at:
        exact = closed(w, k)
        assert phasors(branch, w) == pytest.approx(exact, abs=1e-8 * np.abs(exact).max())
    linear = ss.linear_response(problem(contact), omega=at, state="stuck").dataset.displacement
    for w, X in zip(at, np.asarray(linear), strict=True):
        assert X[:, 1] - 1j * X[:, 2] == pytest.approx(closed(w, k), abs=1e-10)


def test_the_mean_of_a_free_body_on_a_spring() -> None:
    loads = ss.Load(dof="b", harmonic=0, cos=5.0)
    branch = ss.steady_response(problem(spring(), loads), omega=7.0)
    exact = np.linalg.solve(K + np.diag([KN, 0.0]), np.array([100.0 - KN, 5.0]))
    assert np.asarray(branch.dataset["mean"][0]) == pytest.approx(exact, rel=1e-8)


def test_friction_leaves_out_rigid_motion_in_the_mean() -> None:
    """A pair of static forces in balance stretches the spring; where friction holds the body is left open."""
    loads = ss.Load(dof="b", harmonic=0, cos=5.0), ss.Load(dof="a", harmonic=0, cos=-5.0)
    branch = ss.steady_response(problem(stuck(), *loads), omega=7.0)
    assert np.asarray(branch.dataset["mean"][0]) == pytest.approx([-0.0625, 0.0625], rel=1e-8)


@pytest.mark.parametrize("options", [{"speed": 1.5}, {"engine_order": 2}])
@pytest.mark.parametrize(("contact", "k"), [(spring(), KN), (stuck(), STUCK)])
def test_gyroscopic_bodies(options: dict[str, Any], contact: ss.ContactPair, k: float) -> None:
    structure = pair(gyroscopic=G, **options)
    branch = ss.forced_response(problem(contact, structure=structure), omega=(2.0, 8.0), at=[3.0, 7.0])
    for w in (3.0, 7.0):
        speed = options.get("speed", w / 2.0)
        assert phasors(branch, w) == pytest.approx(closed(w, k, C + speed * G), abs=1e-8)


def test_frequencies_of_free_bodies() -> None:
    """Without damping: two masses on a spring, and whirl; rigid-body motion is left out."""
    assert pair().natural_frequencies == pytest.approx([np.sqrt(80.0)])
    assert pair().damping_ratios == pytest.approx([0.4 / (2.0 * np.sqrt(80.0))])
    # -w^2 (80 - w^2) - (w^2 W)^2 ... : det(K - w^2 + i w W G) = w^4 - 80 w^2 - w^2 W^2
    assert pair(gyroscopic=G, speed=1.5).natural_frequencies == pytest.approx([np.sqrt(80.0 + 1.5**2)])
    # W = w / 2: w^4 - 80 w^2 - w^4 / 4
    assert pair(gyroscopic=G, engine_order=2).natural_frequencies == pytest.approx([np.sqrt(80.0 / 0.75)])


def test_one_mass_on_its_contact_alone() -> None:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[0.0]], dofs=["a"])
    law = ss.FrictionContact(kt=0.0, mu=0.0, kn=KN, gap=-1.0)
    contact = ss.ContactPair(name="c", contact=law, tangential="a", normal="a")
    given = ss.Problem(structure, contacts=contact, loads=[ss.Load(dof="a", cos=2.0), PRESSED], harmonics=3)
    with pytest.warns(ss.SlipstickWarning):
        branch = ss.forced_response(given, omega=(3.0, 8.0), at=[4.0, 7.0])
    for w in (4.0, 7.0):
        assert phasors(branch, w)[0] == pytest.approx(2.0 / (KN - w * w + 0.1j * w), rel=1e-8)


def test_slip_and_lift_off_agree_with_time_integration() -> None:
    """Nonlinear: the contact opens in every period, and the damper slips; another dof is far from all contacts."""
    masses, springs = np.eye(3), np.array([[40.0, -40.0, 0.0], [-40.0, 80.0, -40.0], [0.0, -40.0, 40.0]])
    damping = np.diag([0.8, 0.2, 0.5])
    structure = ss.MatrixStructure(M=masses, C=damping, K=springs, dofs=["a", "b", "c"])
    law = ss.FrictionContact(kt=60.0, mu=0.4, kn=KN, gap=-0.3)
    contact = ss.ContactPair(name="c", contact=law, tangential="b", normal="a")
    loads = [ss.Load(dof="b", cos=6.0), ss.Load(dof="c", harmonic=0, cos=4.0)]
    given = ss.Problem(structure, contacts=contact, loads=loads, harmonics=24)
    branch = ss.steady_response(given, omega=4.0)
    check = branch.check_in_time(0)
    assert check.relative_difference < 2e-3


def test_derivatives_of_far_motion() -> None:
    """By the stiffness that holds it, in the mean and in harmonic 1: central differences."""
    given = problem(spring(), ss.Load(dof="b", harmonic=0, cos=5.0))
    branch = ss.steady_response(given, omega=7.0)
    rates = branch.sensitivity(["c.kn"], dof="b", of="displacement")
    step, sides = 1e-3 * KN, []
    for sign in (1.0, -1.0):
        moved = ss.steady_response(given.with_parameter("c.kn", KN + sign * step), omega=7.0)
        sides.append(np.asarray(moved.dataset.displacement[0, 1]))
    difference = (sides[0] - sides[1]) / (2.0 * step)
    found = np.asarray(rates["displacement"] if "displacement" in rates else rates[next(iter(rates))]).reshape(-1)
    assert found[: difference.size] == pytest.approx(difference, abs=2e-6 * np.abs(difference).max())


def test_what_nothing_holds_is_refused() -> None:
    with pytest.raises(ss.InputError, match=HOLDS):
        ss.linear_response(ss.Problem(pair(), loads=ss.Load(dof="b", cos=2.0)), omega=3.0)
    between = ss.ContactPair(
        name="c", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=9.0), tangential={"a": 1.0, "b": -1.0}
    )
    with pytest.raises(ss.InputError, match=HOLDS):
        ss.forced_response(problem(between), omega=(1.0, 3.0))
    with pytest.raises(ss.InputError, match="where friction alone holds it"):
        ss.steady_response(problem(stuck(), ss.Load(dof="b", harmonic=0, cos=5.0)), omega=3.0)
    with pytest.raises(ss.InputError, match=r"not held.*ss\.models\.free_structure"):
        pair(C=None).by_modes()


def test_mean_friction_that_pushes_a_body_away_is_told() -> None:
    """On a belt friction pulls one way for ever: there is no mean position."""
    law = ss.FrictionContact(kt=STUCK, mu=0.5, normal_load=1.0)
    belt = ss.ContactPair(name="c", contact=law, tangential="a", rubbing=ss.RubbingMotion(velocity=50.0))
    with pytest.warns(ss.SlipstickWarning, match="the mean friction force pushes the structure along"):
        ss.steady_response(problem(belt), omega=3.0)


CASE = """
format = 1
harmonics = "0..3"

[structure]
kind = "matrices"
dofs = ["a", "b"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.3, -0.1], [-0.1, 0.3]]
stiffness = [[40.0, -40.0], [-40.0, 40.0]]

[[contact]]
name = "c"
tangential = "a"
kt = 50.0
mu = 0.5
normal_load = 1e6

[[load]]
dof = "b"
cos = 2.0

[response]
from = 1.0
to = 12.0
at = [3.0, 7.0]
"""


def test_a_case_file(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(CASE)
    branch = ss.Case.from_file(tmp_path / "case.toml").run()
    for w in (3.0, 7.0):
        assert phasors(branch, w) == pytest.approx(closed(w, STUCK), abs=1e-8)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # of the soft ground
@pytest.mark.parametrize("limit", [0.3, 1.5, 3.0, 4.5, 6.0, 12.0])
def test_friction_that_slips_fixes_no_mean_whatever_its_limit(limit: float) -> None:
    """As with a ground spring that is soft enough to change nothing: no rounding of the limit decides."""
    law = ss.FrictionContact(kt=60.0, mu=0.3, normal_load=limit / 0.3)
    contact = ss.ContactPair(name="c", contact=law, tangential="a")

    def amplitudes(ground: float) -> Array:
        structure = ss.MatrixStructure(M=M, C=C, K=K + ground * np.eye(2), dofs=["a", "b"])
        given = ss.Problem(structure, contacts=contact, loads=ss.Load(dof="a", sin=8.0), harmonics=range(6))
        return np.asarray(ss.steady_response(given, omega=4.0).dataset.amplitude[0])

    assert amplitudes(0.0) == pytest.approx(amplitudes(1e-5), rel=1e-5)


@pytest.mark.parametrize("gap", [0.0, 0.5])
def test_a_contact_open_at_rest_holds_what_is_pressed_on_it(gap: float) -> None:
    """A spring while it is closed; the body lies on it, by the load over its stiffness beyond the gap."""
    law = ss.FrictionContact(kn=100.0, gap=gap)
    loads = [ss.Load(dof="a", cos=8.0), ss.Load(dof="a", harmonic=0, cos=50.0)]
    given = ss.Problem(
        pair(), contacts=ss.ContactPair(name="c", contact=law, normal="a"), loads=loads, harmonics=range(4)
    )
    found = ss.steady_response(given, omega=4.0).dataset
    Z = K - 16.0 * M + 4.0j * C + np.diag([100.0, 0.0])
    assert found.displacement.values[0, :, 0] == pytest.approx([0.5 + gap] * 2, rel=1e-9)
    assert found.amplitude.values[0] == pytest.approx(np.abs(np.linalg.solve(Z, [8.0, 0.0])), rel=1e-9)


def test_what_can_only_push_and_nothing_presses_on_is_told() -> None:
    """Nothing, a pull, two contacts on the same side; pressed, or clamped between two, there is nothing to tell."""

    def told(*normals: dict[str, float], load: float = 0.0) -> bool:
        law = ss.FrictionContact(kn=100.0, gap=-1.0)
        contacts = [ss.ContactPair(name=f"c{k}", contact=law, normal=normal) for k, normal in enumerate(normals)]
        loads = [ss.Load(dof="b", cos=2.0), ss.Load(dof="b", harmonic=0, cos=load)]
        given = ss.Problem(pair(), contacts=contacts, loads=loads, harmonics=range(4))
        return any(
            "only contacts hold the structure, and they can only push" in str(each)
            for each in problem_warnings(given, (3.0, 4.0))
        )

    assert told({"a": 1.0})
    assert told({"a": 1.0}, load=-5.0)
    assert told({"a": 1.0}, {"b": 1.0})
    assert not told({"a": 1.0}, load=5.0)
    assert not told({"a": 1.0}, {"b": -1.0})
