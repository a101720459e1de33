"""Load steps of temperature and of supports that move, against closed forms of bars."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.sparse import csr_array, diags_array

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import elastic_model
from slipstick.importers.import_model import ImportedModel

E, A, L, ALPHA, COLD = 2e11, 1e-4, 0.2, 1.2e-5, 20.0
STEEL = ss.Material(young=E, poisson=0.0, density=7800.0, expansion=ALPHA, reference=COLD)
EA = E * A


def bar(fixed=("x0",), material=STEEL) -> ImportedModel:
    return elastic_model(box((L, 0.01, 0.01), (10, 1, 1), "hex8"), material, list(fixed))


def end_of(mesh: Mesh, axis: str) -> dict[str, float]:
    """The mean of the four nodes at the end: a force on it is spread evenly."""
    return {f"n{label}{axis}": 0.25 for label in mesh.labels[mesh.surface("x1").nodes]}


def problem(contact: ss.FrictionContact, model=None, **options) -> ss.Problem:
    model = bar() if model is None else model
    along = end_of(model.mesh, "x")
    options = {"temperature": {"hot": 120.0, "warm": {"all": 70.0}}, "displacement": {"jaw": {"x0": "x"}}} | options
    body = ss.reduced_body(model, keep=[*along], modes=6, loss_factor=0.01, **{"stress": "all"} | options)
    direction = {"normal": along} if contact is STOP else {"tangential": along}
    end = ss.ContactPair(name="end", contact=contact, **direction)
    first = next(iter(along))
    return ss.Problem(body.structure, contacts=end, loads=ss.Load(dof=first, cos=1.0), harmonics=3, outputs=[first])


GAP, KN = 5e-5, 3e8
STOP = ss.FrictionContact(kn=KN, gap=GAP)


def pressed(heated: float, moved: float = 0.0) -> float:
    return max(0.0, (ALPHA * heated * L + moved - GAP) / (L / EA + 1.0 / KN))


def test_a_heated_bar_closes_a_gap_and_presses():
    steps = [
        ss.LoadStep(name="warm", temperature="warm"),
        ss.LoadStep(name="half", temperature={"hot": 0.5}),
        ss.LoadStep(name="hot", temperature="hot"),
        ss.LoadStep(name="pushed", displacement={"jaw": 2e-5}),
        ss.LoadStep(name="cold", temperature={}),
        ss.LoadStep(name="back", displacement={"jaw": 0.0}),
    ]
    state = ss.preload(problem(STOP), steps)
    wanted = [pressed(50.0), pressed(50.0), pressed(100.0), pressed(100.0, 2e-5), pressed(0.0, 2e-5), 0.0]
    np.testing.assert_allclose(state.dataset.normal_force.values[:, 0], wanted, rtol=1e-7, atol=1e-6)
    end = state.dataset.displacement.values[:, 0]
    np.testing.assert_allclose(end[:4], GAP + np.array(wanted[:4]) / KN, rtol=1e-7)
    np.testing.assert_allclose(end[4:], [2e-5, 0.0], atol=1e-12)
    assert state.loads == ()


@pytest.mark.parametrize("residuals", ["written", "solved"])
def test_stress_is_that_of_the_strain_that_is_held_back(residuals):
    """Hot and pushed, then vibrating: ``-N / A`` everywhere; the strain has its thermal part."""
    made = problem(STOP, residuals=residuals)
    state = ss.preload(made, ss.LoadStep(temperature="hot", displacement={"jaw": 2e-5}))
    found = ss.steady_response(made.preloaded(state), omega=100.0).stress().isel(point=0).sel(coefficient="0")
    N = pressed(100.0, 2e-5)
    np.testing.assert_allclose(found.stress.sel(component="xx"), -N / A, rtol=1e-4)
    np.testing.assert_allclose(found.strain.sel(component="xx"), -N / EA + ALPHA * 100.0, rtol=1e-4)
    last = found.isel(place=-1)  # away from the root, which cannot grow across
    np.testing.assert_allclose(last.stress.sel(component=["yy", "zz", "xy"]), 0.0, atol=1e-4 * N / A)
    np.testing.assert_allclose(last.strain.sel(component="yy"), ALPHA * 100.0, rtol=1e-4)


def test_stress_survives_saving(tmp_path):
    made = problem(STOP)
    hot = made.preloaded(ss.preload(made, ss.LoadStep(temperature="hot")))
    branch = ss.steady_response(hot, omega=100.0)
    again = ss.load(branch.save(tmp_path / "hot.nc"))
    np.testing.assert_array_equal(again.stress().stress, branch.stress().stress)
    assert abs(branch.stress().stress.sel(component="xx", coefficient="0")).min() > 1e7


KT, MU, N0 = 4e7, 0.3, 2000.0
FOOT = ss.FrictionContact(kt=KT, mu=MU, normal_load=N0)


def test_a_pulled_bar_sticks_and_slips():
    """Its end rubs: ``F = u / (L / EA + 1 / kt)`` up to ``mu N``, then down by twice that as it returns."""
    series, limit = 1.0 / (L / EA + 1.0 / KT), MU * N0
    path = [0.5 * limit / series, 3.0 * limit / series, 2.0 * limit / series, 0.0]
    state = ss.preload(problem(FOOT), [ss.LoadStep(displacement={"jaw": u}) for u in path])
    wanted = [0.5 * limit, limit, 0.0, -limit]
    np.testing.assert_allclose(state.dataset.friction_force.values[:, 0, 0], wanted, rtol=1e-8, atol=1e-6 * limit)
    assert state.dataset.state.values[:, 0].tolist() == ["stick", "slip", "stick", "slip"]
    end = state.dataset.displacement.values[:, 0]
    np.testing.assert_allclose(end, np.array(path) - np.array(wanted) * L / EA, rtol=1e-8)


@pytest.mark.parametrize("residuals", ["written", "solved"])
def test_a_bar_held_at_both_ends_is_stretched(residuals):
    """The middle moves half as far; strain ``u / L`` at the supports too, and the surface moves with them."""
    model = bar(("x0", "x1"))
    middle = f"n{model.mesh.labels[np.argmin(np.abs(model.mesh.nodes[:, 0] - L / 2))]}x"
    jaw = {"jaw": {"x1": [1.0, 0.0, 0.0]}}
    body = ss.reduced_body(model, keep=[middle], modes=5, displacement=jaw, stress="all", residuals=residuals)
    foot = ss.ContactPair(name="foot", contact=ss.FrictionContact(kt=1.0, mu=0.1, normal_load=1e-3), tangential=middle)
    made = ss.Problem(body.structure, contacts=foot, loads=ss.Load(dof=middle, cos=1.0), harmonics=1, outputs=middle)
    state = ss.preload(made, ss.LoadStep(displacement={"jaw": 1e-5}))
    assert state.dataset.displacement.item() == pytest.approx(5e-6, rel=1e-5)
    np.testing.assert_allclose(body.structure.strains.loads["displacement jaw"].reshape(-1, 6)[:, 0], 1 / L, rtol=1e-6)
    skin = body.structure.skin
    np.testing.assert_allclose(skin.loads["displacement jaw"].reshape(-1, 3)[:, 0], skin.nodes[:, 0] / L, atol=1e-6)


def test_a_support_turns_by_its_dofs():
    """All four nodes of the root turn about y: the tip moves by the length times the angle."""
    model = bar()
    mesh = model.mesh
    turn = {}
    for node in mesh.surface("x0").nodes:
        turn[f"n{mesh.labels[node]}x"] = float(mesh.nodes[node, 2] - mesh.nodes[:, 2].mean())
    tip = f"n{mesh.labels[np.argmax(mesh.nodes[:, 0])]}z"
    body = ss.reduced_body(model, keep=[tip], modes=5, displacement={"turn": turn})
    moved = body.structure.shapes["displacement turn"].static_response
    assert moved[0] == pytest.approx(-L, rel=1e-9)


def test_faults_of_steps():
    made = problem(STOP)
    with raises_fault("steps", 1, "temperature", "hott", remedy="did you mean 'hot'?"):
        ss.preload(made, [ss.LoadStep(temperature="hot"), ss.LoadStep(temperature="hott")])
    with raises_fault("steps", 0, "displacement", "jew", says="the structure has no displacement 'jew'"):
        ss.preload(made, ss.LoadStep(displacement={"jew": 1e-5}))
    with raises_fault("load step", "heat", "temperature", "hot", found="'a'"):
        ss.LoadStep(name="heat", temperature={"hot": "a"})
    with raises_fault("load step", "heat", "displacement", found="1e-05"):
        ss.LoadStep(name="heat", displacement=1e-5)
    plain = problem(STOP, temperature=None, displacement=None)
    with raises_fault("steps", 0, "temperature", "hot", remedy='give ss.reduced_body temperature={"hot": ...}'):
        ss.preload(plain, ss.LoadStep(temperature="hot"))
    with raises_fault("load", 0, "harmonic", found="1"):
        ss.Problem(made.structure, contacts=made.contacts, loads=ss.Load(shape="displacement jaw", cos=1e-5))


@pytest.mark.parametrize(
    ("given", "where", "says"),
    [
        ({"temperature": {"hot": {"x7": 3.0}}}, ("temperature", "hot", "x7"), "there is no node set 'x7'"),
        ({"temperature": {"hot": {"x0": 3.0}}}, ("temperature", "hot"), "40 nodes have no temperature"),
        ({"temperature": 120.0}, ("temperature",), "found 120.0"),
        ({"temperature": {"cold": 20.0}}, ("temperature", "cold"), "has no thermal strain anywhere"),
        ({"initial_temperature": 20.0, "temperature": None}, ("initial_temperature",), "is given without temperature"),
        ({"displacement": {"jaw": {"x7": "x"}}}, ("displacement", "jaw", "x7"), "no node set or held dof 'x7'"),
        ({"displacement": {"jaw": {"x1": "x"}}}, ("displacement", "jaw"), "4 of the dofs that move are not held"),
        ({"displacement": {"jaw": {"x0": "u"}}}, ("displacement", "jaw", "x0"), "three numbers"),
        ({"displacement": {"jaw": {"x0": [0, 0, 0]}}}, ("displacement", "jaw"), "node sets or surfaces"),
        ({"displacement": {"jaw": "x0"}}, ("displacement", "jaw"), "node sets or surfaces"),
    ],
)  # fmt: skip
def test_faults_of_bodies(given, where, says):
    with raises_fault(*where, says=says):
        problem(STOP, **given)


def test_a_body_without_expansion_has_no_temperature_field():
    model = bar(material=ss.Material(young=E, poisson=0.0, density=7800.0))
    with raises_fault("temperature", "hot", "materials", "all", "expansion", says="is missing"):
        problem(STOP, model)


def test_a_contact_on_a_moving_support_is_refused():
    model = bar()
    with raises_fault("displacement", "jaw", says="contacts lie on it, the first of them c1"):
        ss.reduced_body(model, surface="z1", contacts=8, modes=5, displacement={"jaw": {"x0": "z"}})


def test_the_stiffness_of_the_steps_is_told():
    table = [(20.0, 2e11), (200.0, 1e11)]
    model = bar(material=ss.Material(young=table, poisson=0.0, density=7800.0, expansion=ALPHA, reference=20.0))
    keep = [*end_of(model.mesh, "x")]
    body = ss.reduced_body(model, keep=keep, modes=5, temperature={"hot": 120.0})
    assert "others are those of hot" in body.notes[-1]
    hot = ss.reduced_body(ss.models.at_temperature(model, 120.0), keep=keep, modes=5, temperature={"hot": 120.0})
    assert hot.notes == ("stiffness at a temperature of 120; that of thermal stress is left out",)
    compliance = np.full(4, 0.25) @ hot.structure.static_compliance @ np.full(4, 0.25)
    assert compliance == pytest.approx(L / (A * (2e11 - 1e11 * 100.0 / 180.0)), rel=1e-9)
    grown = hot.structure.shapes["temperature hot"].static_response
    np.testing.assert_allclose(grown, ALPHA * 100.0 * L, rtol=1e-9)


def test_springs_to_ground_stay_where_they_are():
    model = bar()
    spring = np.zeros(model.n_dofs)
    spring[model.index(next(iter(end_of(model.mesh, "x"))))] = 1e9
    stiff = replace(model, K=csr_array(model.K + diags_array(spring)))
    with pytest.warns(
        ss.SlipstickWarning, match="do not make all of the forces between the body and what holds it along x"
    ):
        problem(STOP, stiff)


def test_a_support_that_moves_at_speed_is_told():
    turning = ss.at_speed(bar(), 10.0, axis={"point": (0, 0, 0), "direction": (0, 1, 0)})
    with pytest.warns(ss.SlipstickWarning, match="supports move against the stiffness at rest"):
        problem(STOP, turning, stress=None)
