"""A contact state of a user's own, with no line of it in the package: friction that is polished away by its own power.

``mu = z mu_0`` with ``dz/dt = (1 - P / P_0 - z) / T``: for a power that follows z in proportion, an exponential.
"""

import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.heated import assert_difference
from helpers.problems import first_point
from helpers.resolved import resolved
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.analysis.curve.state_continuation import SlowRates, relaxed
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.balance.parameters import parameter_path
from slipstick.results.record import contact_states
from slipstick.solve.newton import newton
from slipstick.state.contact_state import ContactState, Rate, Sampled, StateModel, StateVariable
from slipstick.verify.cases import oscillator

MU, LOAD = 0.3, 800.0
POWER = 2000.0  # at which nothing is left
CURVE = ss.FrictionCurve(temperature=[0.0, 200.0, 5000.0], mu=[0.3, 0.25, 0.2])


@dataclass(frozen=True, kw_only=True)
class Polish(StateModel, ContactState):
    variable = StateVariable("polish", "1", "share of the friction coefficient that is left")

    power: float = POWER
    time: float = 1.0
    first: float = 1.0
    slow: bool = False
    limits: tuple = (0.0, 1.0)
    batch: int = 0
    names: tuple = ()

    def of(self, laws, names):
        own = [replace(self, names=tuple(own), batch=k) for k, own in enumerate(names)]
        return own[::-1]  # in no order of theirs

    @property
    def start(self):
        return np.full(len(self.names), self.first)

    def parameters(self, z, given):
        return {"mu": Sampled(z * given["mu"], given["mu"])}

    def by_given(self, name, z):
        return z

    def rate(self, z, power):
        one = np.ones(z.size)
        return Rate((1.0 - power / self.power - z) / self.time, -one / self.time, -one / self.power / self.time)


def polished(velocity=10.0, **options):
    return replace(oscillator(velocity=velocity), states=[Polish(**options)])


def two_contacts(**options):
    K = [[60.0, -20.0, 0.0], [-20.0, 50.0, 3.0], [0.0, 3.0, 400.0]]
    structure = ss.MatrixStructure(M=np.eye(3), C=0.4 * np.eye(3), K=K, dofs=["x1", "x2", "y2"])
    rub = ss.RubbingMotion(velocity=6.0, cos={1: 0.3})
    a = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=80.0)
    b = ss.FrictionContact(kt=80.0, mu=0.3, kn=50.0, gap=-1.0)
    contacts = [
        ss.ContactPair(name="a", contact=a, tangential="x1", rubbing=rub),
        ss.ContactPair(name="b", contact=b, tangential="x2", normal="y2", rubbing=rub),
    ]
    loads = [ss.Load(dof="x1", sin=60.0), ss.Load(dof="y2", cos=150.0)]
    states = [Polish(power=600.0, **options)]
    return ss.Problem(structure, contacts=contacts, loads=loads, harmonics=range(5), states=states)


@pytest.mark.parametrize("seed", range(3))
def test_derivatives_of_the_fast_state(seed):
    problem = two_contacts()
    balance = Balance(problem)
    system, x = FrequencySystem(balance, problem.inputs), 0.5 * np.random.default_rng(seed).normal(size=balance.size)
    z = system.evaluate(x, 5.3).context
    assert z.min() < 0.8
    at = system.evaluate(x, 5.3, z)
    for k in range(balance.size):
        unit = np.eye(balance.size)[k]
        assert_difference(at.jacobian.matrix[:, k], lambda h, u=unit: system.evaluate(x + h * u, 5.3, z).residual)
    assert_difference(at.parameter_derivative, lambda h: system.evaluate(x, 5.3 + h, z).residual)
    for name in ("a.mu", "friction", "b.kt", "*.velocity", "a.normal_load"):
        along, value = ParameterSystem(balance, parameter_path(problem, name), 5.3), problem.parameter(name)
        exact = along.evaluate(x, value, z).parameter_derivative
        assert_difference(exact, lambda h, s=along, v=value: s.evaluate(x, v + h * abs(v), z).residual / abs(v))


def test_curve_of_the_fast_state_is_a_fixed_point():
    """Every point is what a plain problem with that friction coefficient gives, and the power explains it."""
    branch = ss.forced_response(polished(), omega=(7.0, 9.0), at=[8.0])
    assert branch.outcome is ss.Outcome.COMPLETED
    d = branch.dataset
    z, power = d["polish"].to_numpy(), d["dissipated_power"].to_numpy()
    assert z.min() < 0.7
    np.testing.assert_allclose(z, 1.0 - power / POWER, rtol=1e-10)
    np.testing.assert_allclose(d["friction_coefficient"], MU * z, rtol=1e-12)
    assert d["polish"].attrs == {"units": "1", "long_name": "share of the friction coefficient that is left"}
    at, left = branch.at(8.0), 1.0
    for _ in range(30):
        plain = oscillator(velocity=10.0).with_parameter("damper.mu", MU * left)
        x = first_point(plain, 8.0)
        own = FrequencySystem(Balance(plain), plain.inputs).evaluate(x, 8.0).detail.responses[0].work[0]
        left = 0.5 * (left + 1.0 - 8.0 * own / POWER)
    assert z[at, 0] == pytest.approx(left, rel=1e-8)
    np.testing.assert_allclose(d["displacement"].to_numpy()[at, 0], x, atol=1e-7)
    alone = ss.steady_response(polished(), omega=[8.0, 8.2], guess=branch).dataset
    np.testing.assert_allclose(alone["polish"][0], d["polish"][at], rtol=1e-9)


def test_permanent_slip_in_closed_form():
    """P = z mu_0 N v whatever the motion: z = 1 / (1 + mu_0 N v / P_0) fast, an exponential on slow time."""
    v, omega = 260.0, 6.0  # beyond p/c: no stick
    problem, most = polished(v, power=1e5), MU * LOAD * 260.0
    x = first_point(problem, omega)
    found = FrequencySystem(Balance(problem), problem.inputs).evaluate(x, omega).detail.states[0]
    rest = 1.0 / (1.0 + most / 1e5)
    assert found.values[0] == pytest.approx(rest, rel=1e-11)
    assert x[0] == pytest.approx(-rest * MU * LOAD / 40.0, rel=1e-11)

    slow = polished(v, power=1e5, slow=True, time=50.0)
    rates = SlowRates(Balance(slow), slow.inputs, omega, first_point(slow, omega))
    way = solve_ivp(lambda t, z: rates(z), (0.0, 40.0), [1.0], rtol=1e-10, atol=1e-12)
    assert way.y[0, -1] == pytest.approx(rest + (1.0 - rest) * np.exp(-40.0 / (50.0 * rest)), rel=1e-8)

    x, detail = relaxed(Balance(problem), problem.inputs, omega, x, np.array([0.9]))
    assert detail.states[0].values[0] == pytest.approx(rest, rel=1e-9)


def test_the_slow_state_is_held_where_it_is_handed_on():
    plain, slow = oscillator(velocity=10.0), polished(slow=True)
    x, omega = first_point(plain, 8.0), 8.0
    system = FrequencySystem(Balance(slow), slow.inputs)
    for z in (1.0, 0.6):
        own = plain.with_parameter("damper.mu", MU * z)
        expected = FrequencySystem(Balance(own), own.inputs).evaluate(x, omega)
        at = system.evaluate(x, omega, np.array([z]))
        np.testing.assert_allclose(at.residual, expected.residual, rtol=1e-13)
        np.testing.assert_allclose(at.jacobian.matrix, expected.jacobian.matrix, rtol=1e-13)
        np.testing.assert_allclose(at.parameter_derivative, expected.parameter_derivative, rtol=1e-13)
        assert at.context == [z]
    curves = [ss.forced_response(p, omega=(7.0, 9.0)).dataset for p in (polished(slow=True, first=0.6), own)]
    np.testing.assert_allclose(curves[0]["amplitude"], curves[1]["amplitude"], rtol=1e-12)
    assert np.all(curves[0]["polish"] == 0.6)


def test_a_guess_moves_no_slow_state():
    worn = ss.forced_response(polished(slow=True, first=0.6), omega=(7.9, 8.1))
    alone = ss.steady_response(polished(slow=True), omega=[8.0], guess=worn).dataset
    assert alone["polish"].item() == 1.0
    np.testing.assert_array_equal(contact_states(worn.table, Balance(worn.problem), 3), [0.6])


def test_equilibrium_where_plain_newton_goes_round_in_circles():
    """A power of four times what leaves nothing: the Newton step from z = 1 ends where no friction is left."""
    problem = polished(2.0)
    x = np.zeros(problem.harmonics.size)
    x[2] = 5.0
    at = FrequencySystem(Balance(problem), problem.inputs).evaluate(x, 11.0).detail.states[0]
    assert at.state.rate(at.state.start, at.power.value / at.values).value[0] < -2.0
    assert abs(at.rate.value[0]) < 1e-10
    assert 0.0 < at.values[0] < 0.5


def test_with_heat_on_the_same_contacts():
    """What is left of the friction coefficient scales its curve over temperature, as the factor on it does."""
    hot = replace(oscillator(velocity=2.0), thermal=ss.ThermalModel(curve=CURVE, background=20.0, resistance=0.05))
    both = replace(hot, states=[Polish(slow=True, first=0.7)])
    first, second = (ss.forced_response(p, omega=(9.0, 10.0)) for p in (both, replace(hot, friction=0.7)))
    for name in ("amplitude", "temperature", "friction_coefficient"):
        np.testing.assert_allclose(first.dataset[name], second.dataset[name], rtol=1e-12)
    by = [branch.sensitivity(["friction", "damper.kt"]) for branch in (first, second)]
    for name in ("amplitude", "temperature"):
        np.testing.assert_allclose(by[0][name][1], by[1][name][1], rtol=1e-9)
        np.testing.assert_allclose(by[0][name][0], 0.7 * by[1][name][0], rtol=1e-9)
    with raises_fault("states", says="are both fast states of contacts of one law"):
        replace(hot, states=[Polish()])
    with raises_fault("states", says="two contact states are called 'polish'"):
        replace(hot, states=[Polish(slow=True), Polish(slow=True)])


def test_contacts_of_several_laws():
    """One name in results, each law with its own; the derivative is that of the largest of all."""
    plain = oscillator(velocity=2.0)
    smooth = ss.SampledLaw(force=lambda x, velocity, mu: 50.0 * mu * np.tanh(velocity), parameters={"mu": 0.3})
    contacts = [*plain.contacts, ss.ContactPair(name="brush", contact=smooth, ports={"x": "x"})]
    problem = replace(plain, contacts=contacts, states=[Polish(power=8000.0)])
    branch = ss.forced_response(problem, omega=(8.0, 8.2))
    d = branch.dataset
    assert list(d["contact"].values) == ["damper", "brush"]
    np.testing.assert_allclose(d["polish"], 1.0 - d["dissipated_power"] / 8000.0, rtol=1e-10)
    assert d["polish"].values.argmax(axis=1).tolist() == [1] * len(branch)
    found, again = branch.sensitivity("damper.kt"), resolved(branch, 0, "damper.kt", "x")
    assert float(found["amplitude"][0, 0]) == pytest.approx(again["amplitude"], rel=1e-6)
    h, x = 1e-4, branch.guess(0).ravel()
    sides = [problem.at_parameter("damper.kt", 100.0 + side) for side in (h, -h)]
    upper, lower = (
        newton(lambda x, p=p: FrequencySystem(Balance(p), p.inputs).evaluate(x, 8.0), x).evaluation for p in sides
    )
    change = (upper.context[0] - lower.context[0]) / (2.0 * h)
    assert float(found["polish"][0, 0]) == pytest.approx(change, rel=1e-4)


def test_sensitivities_stability_and_peaks():
    problem = polished(2.0, power=8000.0)
    branch = ss.forced_response(problem, omega=(9.9, 10.7), stability=True)
    found = branch.sensitivity(["damper.mu", "damper.velocity"])
    assert "largest share of the friction coefficient that is left" in found["polish"].attrs["long_name"]
    [peak] = np.flatnonzero(branch.dataset["kind"].to_numpy() == "peak")
    for name in ("damper.mu", "damper.velocity"):
        again = resolved(branch, peak, name, "x")
        assert float(found["amplitude"].sel(parameter=name)[peak]) == pytest.approx(again["amplitude"], rel=1e-6)
        change = -again["dissipated_power"] / 8000.0
        assert float(found["polish"].sel(parameter=name)[peak]) == pytest.approx(change, rel=1e-5)
    d = branch.dataset.isel(point=peak)
    held = oscillator(velocity=2.0).with_parameter("damper.mu", float(d["friction_coefficient"][0]))
    omega = float(d["omega"])
    same = ss.forced_response(held, omega=(omega, omega + 0.1), stability=True).dataset.isel(point=0)
    assert float(d["multiplier_max"]) == pytest.approx(float(same["multiplier_max"]), rel=1e-6)
    [(at, height)] = branch.peaks("x")
    tracked = ss.track_peak(problem, "damper.velocity", (2.0, 2.1), dof="x", omega=(9.9, 10.7)).dataset.isel(point=0)
    assert (float(tracked["omega"]), float(tracked["amplitude"][0])) == pytest.approx((at, height), rel=1e-8)


def test_saved_loaded_pickled(tmp_path):
    branch = ss.forced_response(polished(), omega=(8.0, 8.5))
    with pytest.warns(ss.SlipstickWarning, match="states.0: a Polish is code and not numbers"):
        branch.save(tmp_path / "r.nc")
    loaded = ss.load(tmp_path / "r.nc")
    np.testing.assert_array_equal(loaded.dataset["polish"], branch.dataset["polish"])
    assert loaded.problem is None
    own = pickle.loads(pickle.dumps(branch))
    z = own.sensitivity("damper.kt")["polish"].to_numpy()
    np.testing.assert_array_equal(z, branch.sensitivity("damper.kt")["polish"])


def test_what_is_not_known_with_a_state_says_so():
    with raises_fault("time integration", says="leave the state out"):
        ss.transient(polished(), 8.0, periods=2)
    with raises_fault("states", says="self-excited vibration with"):
        ss.limit_cycles(replace(polished(), loads=[]), "damper.velocity", (2.0, 9.0))
    branch = ss.forced_response(polished(power=50.0, limits=(0.5, 1.0)), omega=(2.0, 15.0))
    assert branch.outcome is ss.Outcome.OUTSIDE_TABLE
    assert "temperature" not in branch.message
    assert "leaves its range, 0.5 to 1" in branch.message
    with raises_fault("states", 0, found="1.0"):
        replace(polished(), states=[1.0])


def test_one_state_alone_is_taken_as_a_list_of_one_is():
    model = Polish()
    one, listed = (replace(oscillator(velocity=10.0), states=states) for states in (model, [model]))
    assert one.states == listed.states == (model,)
    assert [state.names for state in one.contact_states] == [("damper",)]
