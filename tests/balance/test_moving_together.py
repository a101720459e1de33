"""Contacts of one pair that move together have their unknowns in common, and answer as those that have their own."""

from dataclasses import replace

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.results.record import unknowns

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

K = np.array([[300.0, -100.0, 0.0], [-100.0, 250.0, -50.0], [0.0, -50.0, 200.0]])
DOFS = ["x", "y", "z"]
AREAS = np.array([1.0, 2.0, 0.5, 0.8])
GAPS = np.array([-0.04, -0.02, -0.003, 0.001])
LOADS = [ss.Load(dof="x", cos=3.0), ss.Load(dof="z", harmonic=0, cos=2.0), ss.Load(dof="z", sin=1.0)]


def matrices() -> ss.MatrixStructure:
    return ss.MatrixStructure(M=np.eye(3), C=0.01 * K, K=K, dofs=DOFS)


def modes() -> ss.ModalStructure:
    squared, shapes = np.linalg.eigh(K)
    return ss.ModalStructure(omega=np.sqrt(squared), mode_shapes=shapes, dofs=DOFS, damping_ratio=0.05)


def both(law: type, structure: object, **given: object) -> tuple[ss.Problem, ss.Problem]:
    """The same contacts with unknowns in common, and with their own."""
    planar = law is ss.PlanarFrictionContact
    pair = ss.ContactPair(
        name="patch",
        contact=law(kt=30.0 * AREAS, kn=50.0 * AREAS, mu=0.4, gap=GAPS),
        tangential=("x", "y") if planar else "x",
        normal="z",
        area=AREAS,
    )
    other = ss.ContactPair(
        name="other", contact=law(kt=20.0, kn=40.0, mu=0.3, gap=-0.02), tangential=("y", "x") if planar else "y",
        normal={"z": -1.0},
    )  # fmt: skip
    problem = ss.Problem(structure, contacts=[pair, other], loads=LOADS, harmonics=[0, 1, 2], outputs=DOFS, **given)
    return problem, replace(problem, contacts=[replace(pair, area=None), other])


def largest(one: ss.Branch, other: ss.Branch, name: str) -> float:
    a, b = (np.asarray(branch.dataset[name].values, dtype=float) for branch in (one, other))
    return float(np.nanmax(np.abs(a - b)) / np.nanmax(np.abs(b)))


@pytest.mark.parametrize("law", [ss.PlanarFrictionContact, ss.FrictionContact])
@pytest.mark.parametrize("jacobian", ["dense", "iterative"])
def test_unknowns_in_common_change_no_result(law: type, jacobian: str) -> None:
    together, apart = both(law, modes())
    found = [
        ss.steady_response(p, omega=w, options={"jacobian": jacobian}) for w in (12.0, 17.0) for p in (together, apart)
    ]
    for one, other in (found[:2], found[2:]):
        for name in (
            "displacement",
            "friction_force",
            "normal_force",
            "dissipated_power",
            "contact_normal",
            "stick_fraction",
        ):
            assert largest(one, other, name) < 1e-7, name
        assert largest(one, other, "truncation") < 1e-6
    ports = len(together.port_directions)
    assert (ports, len(apart.port_directions)) == ((6, 15) if law is ss.PlanarFrictionContact else (4, 10))
    assert ports == sum(pair.n_ports for pair in together.contacts)


def test_the_truncation_of_stiff_contacts_counts_all_of_them() -> None:
    """What passes to further orders, and what comes back, is the sum of all contacts on a direction."""
    found = []
    for problem in both(ss.PlanarFrictionContact, modes()):
        pair, other = problem.contacts
        stiff = pair.contact.changed(kt=3e4 * AREAS, kn=5e4 * AREAS, gap=1e-3 * GAPS)
        problem = replace(problem, contacts=[replace(pair, contact=stiff), other])
        found.append(ss.steady_response(problem, omega=12.0))
    assert found[1].dataset.truncation[0] > 1e-4
    assert largest(*found, "truncation") < 1e-5


@pytest.mark.parametrize("law", [ss.PlanarFrictionContact, ss.FrictionContact])
def test_unknowns_of_results_begin_another_branch(law: type) -> None:
    together, _ = both(law, matrices())
    branch = ss.steady_response(together, omega=15.0)
    guess = unknowns(branch.table, together, 0)
    balance = Balance(together)
    assert guess.shape == (balance.n_ports, balance.L)
    again = ss.steady_response(together, omega=15.0, guess=guess)
    assert largest(again, branch, "displacement") < 1e-9


def test_stability_and_sensitivity_are_those_of_contacts_apart() -> None:
    found = [ss.steady_response(p, omega=14.0, stability=True) for p in both(ss.FrictionContact, matrices())]
    multipliers = [np.nanmax(np.abs(branch.dataset.multiplier.values[0])) for branch in found]
    assert multipliers[0] == pytest.approx(multipliers[1], rel=1e-6)
    slopes = [branch.sensitivity(["patch.mu", "other.kt"], points=[0], of="displacement") for branch in found]
    assert np.allclose(slopes[0].displacement, slopes[1].displacement, rtol=1e-6, atol=1e-9)


@pytest.mark.verify
def test_motion_in_time_is_that_of_contacts_apart() -> None:
    found = [ss.steady_response(p, omega=14.0) for p in both(ss.FrictionContact, matrices())]
    checks = [branch.check_in_time(0).amplitude_in_time[0] for branch in found]
    assert checks[0] == pytest.approx(checks[1], rel=1e-6)


@pytest.mark.parametrize("state", ["stuck", "free"])
def test_linear_response_with_held_contacts(state: str) -> None:
    found = [
        ss.linear_response(p, omega=np.linspace(10.0, 20.0, 21), state=state)
        for p in both(ss.FrictionContact, matrices())
    ]
    assert largest(*found, "displacement") < 1e-12


def test_undamped_structures_have_one_anchor_for_each_port() -> None:
    undamped = ss.MatrixStructure(M=np.eye(3), C=np.zeros((3, 3)), K=K, dofs=DOFS)
    found = [ss.steady_response(p, omega=12.0) for p in both(ss.PlanarFrictionContact, undamped)]
    assert largest(*found, "displacement") < 1e-7


def test_preload_is_that_of_contacts_apart() -> None:
    states = [
        ss.preload(p, ss.LoadStep(name="press", loads=LOADS[1])) for p in both(ss.PlanarFrictionContact, matrices())
    ]
    a, b = (state.dataset for state in states)
    for name in ("normal_force", "friction_force", "gap", "displacement"):
        assert np.allclose(a[name], b[name], rtol=1e-10, atol=1e-12), name


def test_nonlinear_modes() -> None:
    found = [ss.nonlinear_modes(p, amplitude=(1e-3, 2e-2), dof="x").dataset for p in both(ss.FrictionContact, modes())]
    sizes = np.linspace(2e-3, 1.9e-2, 30)
    for name, allowed in (("omega", 1e-4), ("modal_damping", 5e-3)):  # straight lines between points
        a, b = (np.interp(sizes, d.modal_amplitude, d[name]) for d in found)
        assert np.max(np.abs(a / b - 1.0)) < allowed
