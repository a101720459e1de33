"""Friction in two directions in time where the structure answers forces at once: a static residual.

A residual is what stiff modes leave behind: motion with them tends to the one with it as the square of their
frequencies. Along a line the contact is that of one direction, which is solved for elsewhere. What the multipliers are
held against is the period map, differenced, and a balance in many harmonics.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from helpers.floquet import distance
from test_planar_stability_in_time import Shot, multipliers

import slipstick as ss
from slipstick.analysis.time_domain.event_integrator import StateChange, Stepper
from slipstick.analysis.time_domain.initial_state import start_at_rest
from slipstick.analysis.time_domain.piecewise import Combination, PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import one_period
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.typing import Array

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

STEPS = 24
"""Fewer than by default: each is cut where it has to be."""
OMEGA = np.array([5.0, 7.0, 9.0])
SHAPES = np.array([[1.0, 0.2, 0.1], [-0.3, 1.0, 0.2], [0.1, -0.2, 1.0]])
RESIDUAL = 0.02 * np.array([[1.0, 0.3, 0.25], [0.3, 0.8, -0.2], [0.25, -0.2, 1.2]])
STRAIGHT = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
"""What of matrices leaves y out of the motion of x and z."""


def structure(
    stiff: float | None = None, shapes: Array = SHAPES, residual: Array = RESIDUAL, damping: float = 0.03
) -> ss.ModalStructure:
    """Three modes with a residual, or with three stiff modes in its place."""
    if stiff is None:
        static = shapes @ np.diag(1.0 / OMEGA**2) @ shapes.T + residual
        return ss.ModalStructure(
            omega=OMEGA, mode_shapes=shapes, dofs=list("xyz"), damping_ratio=damping, static_compliance=static
        )
    return ss.ModalStructure(
        omega=[*OMEGA, *[stiff] * 3], mode_shapes=np.hstack([shapes, stiff * np.linalg.cholesky(residual)]),
        dofs=list("xyz"), damping_ratio=[damping] * 3 + [18.0 / stiff] * 3,
    )  # fmt: skip


def problem(
    body: ss.ModalStructure, *, law: type = ss.PlanarFrictionContact, gap: float = -1.5,
    v: tuple[float, float] = (0.0, 0.0), load: float = 40.0, across: float = 24.0, orders: int = 10,
) -> ss.Problem:  # fmt: skip
    """A contact on x, y and z, or on x and z alone."""
    planar = law is ss.PlanarFrictionContact
    contact = law(kt=30.0, mu=0.4, kn=20.0, gap=gap)
    pair = ss.ContactPair(
        name="foot", contact=contact, tangential=("x", "y") if planar else "x", normal="z",
        rubbing=ss.RubbingMotion(velocity=v if planar else v[0]),
    )  # fmt: skip
    loads = [ss.Load(dof="x", sin=load), ss.Load(dof="y", cos=across), ss.Load(dof="z", cos=20.0)]
    return ss.Problem(body, contacts=pair, loads=loads, harmonics=range(orders + 1))


@pytest.mark.verify
@pytest.mark.parametrize(("gap", "v"), [(-0.3, (1.0, 2.0)), (-1.5, (0.0, 0.0))])
def test_it_is_what_stiff_modes_tend_to(gap: float, v: tuple[float, float]) -> None:
    exact = ss.transient(problem(structure(), gap=gap, v=v), 6.0)
    assert exact.converged
    soft, stiff = (ss.transient(problem(structure(k), gap=gap, v=v), 6.0, tolerance=1e-8) for k in (120.0, 240.0))
    for of in ("amplitude", "mean", "power"):
        a, b, limit = (getattr(one, of) for one in (soft, stiff, exact))
        off, nearer, left = (np.abs(one - limit).max() for one in (a, b, (4.0 * b - a) / 3.0))
        assert 3.3 < off / nearer < 5.0, of  # the square of two
        assert left < 0.2 * nearer, of  # what they tend to by that square


def straight(law: type, gap: float, v: float) -> ss.Problem:
    body = structure(shapes=SHAPES * STRAIGHT, residual=RESIDUAL * STRAIGHT)
    return problem(body, law=law, gap=gap, v=(v, 0.0), across=0.0)


@pytest.mark.parametrize(
    ("gap", "v"), [(-0.3, 2.0), *(pytest.param(*at, marks=pytest.mark.verify) for at in ((-1.5, 0.0), (-1.5, 2.0)))]
)
def test_along_a_line_it_is_the_contact_of_one_direction(gap: float, v: float) -> None:
    one, two = (
        ss.transient(straight(law, gap, v), 6.0, steps=STEPS) for law in (ss.FrictionContact, ss.PlanarFrictionContact)
    )
    np.testing.assert_allclose(two.coefficients, one.coefficients, atol=1e-9)
    np.testing.assert_allclose(two.power, one.power, rtol=1e-9)
    shares = one.fractions.copy()
    shares[:, 2:] = shares[:, 2:].sum(), 0.0
    np.testing.assert_allclose(two.fractions, shares, atol=1e-6)


@pytest.mark.verify
def test_points_of_a_balance_and_their_multipliers() -> None:
    """Slip all the time, slip and separation, and stick: in time, by pieces, and by the period map."""
    for gap, v in ((-1.5, (1.0, 2.0)), (-0.3, (1.0, 2.0)), (-1.5, (0.0, 0.0))):
        asked = problem(structure(), gap=gap, v=v)
        branch = ss.steady_response(asked, omega=6.0, stability=True)
        assert branch.check_in_time(0).relative_difference < 1e-3  # 10 harmonics are kept
        assert branch.dataset["stability_method"].to_numpy()[0] == "PW"
        shot = Shot(asked, 6.0, branch)
        assert shot.change < 1e-10
        assert distance(multipliers(branch), np.linalg.eigvals(shot.map)) < 1e-3


def test_the_period_map_has_the_jumps_of_velocities() -> None:
    """From rest: stick, slip, separation and back, differenced."""
    asked = problem(structure(), gap=-0.2, load=4.0, across=2.4)
    stepper = Stepper(PiecewiseLinear(friction_system(asked, 6.0)), STEPS)
    z, states = start_at_rest(stepper)
    met = {item.after for item in stepper.period(z, states) if isinstance(item, StateChange)}
    assert met == {0, 1, 2, 3}
    compared(stepper, z, states, (0, 4))


def compared(stepper: Stepper, z: Array, states: Combination, columns: Iterable[int]) -> None:
    """Columns of the derivative of the period map against differences.

    Their step is so long that the places of changes, known to rounding, are not seen in them.
    """
    Phi, system = one_period(stepper, z, states, True), stepper.model.system
    assert Phi is not None
    after = stepper.states
    kept, rows = system.unknowns(states), system.unknowns(after)
    step = 3e-6 * np.abs(stepper.z[: 2 * system.n]).max()
    for column in columns:
        ends = []
        for way in (step, -step):
            moved = z.copy()
            moved[kept[column]] += way
            one_period(stepper, moved, states, False)
            ends.append(stepper.z)
        slope = stepper.difference(ends[1], ends[0], after)[rows] / (2.0 * step)
        np.testing.assert_allclose(Phi[rows, kept[column]], slope, atol=1e-6 * np.abs(Phi[rows]).max())


def test_long_runs_know_it() -> None:
    """Of a structure with a residual: shares of states, dissipated power, section, balance of energy."""
    asked = problem(structure(damping=0.2), gap=-0.3, v=(1.0, 2.0))
    run = ss.runs.run_up(asked, 6.0, periods=2, steps=STEPS).dataset
    end = ss.transient(asked, 6.0, method="march", periods=1, steps=STEPS)
    last = {name: run[name].to_numpy()[-1] for name in run.data_vars if run[name].dims[:1] == ("period",)}
    shares = [last[f"{state}_fraction"][0] for state in ("separation", "stick", "slip")]
    np.testing.assert_allclose(shares, end.fractions[0, :3], atol=1e-6)
    np.testing.assert_allclose(last["dissipated_power"], end.power, rtol=1e-6)
    np.testing.assert_allclose(run["section_displacement"].to_numpy()[-2], end.displacement[0], atol=1e-6)
    assert last["energy_error"] < 1e-9
    assert {"separation", "slip"} <= set(run["change_after"].to_numpy().tolist())


def test_the_speed_may_grow() -> None:
    """Along a line the sweep is that of a contact of one direction behind the same residual."""
    plane, line = (
        ss.runs.run_up(straight(law, -1.5, 0.5), omega=(4.0, 5.5), rate=0.5).dataset
        for law in (ss.PlanarFrictionContact, ss.FrictionContact)
    )
    np.testing.assert_allclose(plane["amplitude"], line["amplitude"], atol=1e-8)
    np.testing.assert_allclose(plane["section_displacement"], line["section_displacement"], atol=1e-8)
    assert float(plane["energy_error"].max()) < 1e-9


def beside(law: type) -> ss.Problem:
    """A contact in a plane beside one along a line, on a structure that couples them at once."""
    rng = np.random.default_rng(5)
    omega, shapes = np.array([5.0, 7.0, 9.0, 6.5]), rng.normal(size=(5, 4)) * 0.6 + np.eye(5)[:, :4]
    root = rng.normal(size=(5, 5))
    static = shapes @ np.diag(1.0 / omega**2) @ shapes.T + 0.02 * (root @ root.T / 5 + 0.4 * np.eye(5))
    body = ss.ModalStructure(
        omega=omega, mode_shapes=shapes, dofs=list("xyzwu"), damping_ratio=0.05, static_compliance=static
    )
    pairs = [
        ss.ContactPair(
            name="foot", contact=ss.PlanarFrictionContact(kt=30.0, mu=0.4, kn=20.0, gap=-0.5), tangential=("x", "y"),
            normal="z", rubbing=ss.RubbingMotion(velocity=(1.0, 2.0)),
        ),
        ss.ContactPair(name="pad", contact=law(kt=25.0, mu=0.5, kn=15.0, gap=-0.4), tangential="w", normal="u"),
    ]  # fmt: skip
    loads = [
        ss.Load(dof="x", sin=20.0), ss.Load(dof="y", cos=14.0), ss.Load(dof="z", cos=8.0), ss.Load(dof="w", cos=20.0),
        ss.Load(dof="u", sin=8.0),
    ]  # fmt: skip
    return ss.Problem(body, contacts=pairs, loads=loads, harmonics=range(11))


def test_beside_contacts_of_one_direction() -> None:
    """That one may as well be a contact in a plane without the other direction."""
    one, two = (
        ss.transient(beside(law), 6.0, method="march", periods=1, steps=STEPS)
        for law in (ss.FrictionContact, ss.PlanarFrictionContact)
    )
    np.testing.assert_allclose(one.coefficients, two.coefficients, atol=1e-8)
    np.testing.assert_allclose(one.power, two.power, rtol=1e-8)
    assert np.all(one.fractions[1] > 0.05)  # separation, stick, slip one way and the other


@pytest.mark.verify
def test_multipliers_beside_contacts_of_one_direction() -> None:
    one, two = (
        ss.steady_response(beside(law), omega=6.0, stability=True)
        for law in (ss.FrictionContact, ss.PlanarFrictionContact)
    )
    assert distance(multipliers(one), multipliers(two)) < 1e-4


@pytest.mark.verify
def test_reduced_bodies_are_known_in_time() -> None:
    """Two points of a surface of a finite element body, one slips: check in time over two periods and multipliers."""
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (4, 2, 1), "hex20"))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    model = assemble_mesh(mesh, source="beam", material=steel, fixed=["x0"])
    body = ss.reduced_body(model, surface="y1", contacts=2, modes=4)
    law = ss.PlanarFrictionContact(kt=4e5, mu=0.4, kn=3e5, normal_load=6.0)
    pairs = ss.surface_contacts(body, "a", contact=law, direction=(1.0, 0.0, 0.0), normal=True)
    loads = [ss.Load(dof="c2z", cos=3.7), ss.Load(dof="c2x", sin=40.0), ss.Load(dof="c2y", sin=1.0)]
    omega = 0.6 * float(body.structure.natural_frequencies[0])
    asked = ss.Problem(body.structure, contacts=pairs, loads=loads, harmonics=range(6))
    branch = ss.steady_response(asked, omega=omega, stability=True)
    assert branch.dataset["stability_method"].to_numpy()[0] == "PW"
    assert int(branch.dataset["stable"][0]) == 1
    assert branch.dataset["slip_fraction"].to_numpy()[0, 1] > 0.5
    assert branch.check_in_time(0, method="march", periods=1).relative_difference < 0.01  # 5 harmonics are kept


@pytest.mark.parametrize("law", [ss.FrictionContact, pytest.param(ss.PlanarFrictionContact, marks=pytest.mark.verify)])
def test_a_change_that_another_one_brings_about_moves_with_it(law: type) -> None:
    """Where one contact begins to slip, velocities jump, and its neighbour sticks at that instant."""
    shapes, residual = np.array([[1.0, 0.3], [-0.2, 1.0]]), np.array([[0.02, -0.015], [-0.015, 0.02]])
    body = ss.ModalStructure(
        omega=[4.0, 7.0], mode_shapes=shapes, dofs=["x", "u"], damping_ratio=0.1,
        static_compliance=shapes @ np.diag([1.0 / 16.0, 1.0 / 49.0]) @ shapes.T + residual,
    )  # fmt: skip
    contact, phase = law(kt=80.0, mu=0.4, normal_load=10.0), 1.3 * np.pi
    loads = [ss.Load(dof="x", sin=20.0), ss.Load(dof="u", cos=25.0 * np.cos(phase), sin=25.0 * np.sin(phase))]
    pairs = [ss.ContactPair(name=dof, contact=contact, tangential=dof) for dof in ("x", "u")]
    asked = ss.Problem(body, contacts=pairs, loads=loads, harmonics=range(4))
    stepper = Stepper(PiecewiseLinear(friction_system(asked, 3.0)), STEPS)
    one_period(stepper, *start_at_rest(stepper), False)
    z, states = stepper.z, stepper.states
    changes = [item for item in stepper.period(z, states) if isinstance(item, StateChange)]
    assert min(change.value for change in changes) < -0.01
    compared(stepper, z, states, range(len(stepper.model.system.unknowns(states))))
