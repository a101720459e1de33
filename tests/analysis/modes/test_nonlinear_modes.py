from __future__ import annotations

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import closed, damper, one_mass

import slipstick as ss
from slipstick.analysis.modes.free_problem import free_problem
from slipstick.balance import contact_jacobian
from slipstick.structure.modal import LoadShape
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

ONE_HARMONIC = {
    2.0: (11.832159566, 0.016903085), 2.5: (11.775325624, 0.034615204), 4.0: (10.131485384, 0.168589167),
    8.0: (8.076606885, 0.229709856), 80.0: (6.393288986, 0.076606407),
}  # fmt: skip
TEN_HARMONICS = {
    2.5: (11.777177873, 0.034003784), 4.0: (10.163696071, 0.165599514), 8.0: (8.071187923, 0.232504679),
    80.0: (6.389147862, 0.076838470),
}  # fmt: skip


def followed(last: float, harmonics=(0, 1), first: float = 1.0, **more) -> ss.Branch:
    return ss.nonlinear_modes(oscillator(harmonics=harmonics), amplitude=(first, last), **more)


@pytest.mark.parametrize("a", ONE_HARMONIC)
def test_one_harmonic_is_the_closed_form(a):
    d = followed(a).dataset
    assert (float(d.omega[-1]), float(d.modal_damping[-1])) == pytest.approx(ONE_HARMONIC[a], rel=4e-8)
    omega, damping = closed(a)
    assert float(d.omega[-1]) == pytest.approx(omega, rel=1e-11)
    assert float(d.modal_damping[-1]) == pytest.approx(damping, rel=1e-9)
    assert float(d.modal_amplitude[-1]) == pytest.approx(a, rel=1e-12)


@pytest.mark.parametrize("a", TEN_HARMONICS)
def test_ten_harmonics(a):
    d = followed(a, range(10)).dataset
    assert (float(d.omega[-1]), float(d.modal_damping[-1])) == pytest.approx(TEN_HARMONICS[a], rel=4e-8)


def test_power_balance_for_any_number_of_harmonics():
    """What is taken of damping, xi - c, feeds exactly what friction dissipates."""
    branch = followed(20.0, range(10), first=2.5)
    d, m = branch.dataset, np.repeat(np.arange(1, 10), 2)
    for k in range(0, len(branch), 7):
        X, w = d.displacement.values[k, 0], float(d.omega[k])
        square = 0.5 * np.sum((m * w * X[1:]) ** 2)  # mean of the velocity squared
        xi = 2.0 * float(d.modal_damping[k]) * w
        assert (xi - 0.4) * square == pytest.approx(float(d.dissipated_power[k, 0]), rel=1e-8)


def test_forced_peaks_of_all_load_levels():
    """Predicted from one curve, against peaks of forced curves: to a per cent though the damping is 10 to 20 %."""
    branch = followed(20.0, range(10), load_factors=(1.0, 2.0, 2.8))
    d = branch.dataset
    points = np.flatnonzero(d.kind.values == "requested")
    predicted = [(float(d.omega[k]), float(d.amplitude[k, 0])) for k in points]
    assert np.allclose(predicted, [(10.8139, 3.3414), (8.9182, 5.8023), (7.3980, 11.7099)], atol=1e-4)
    assert d.load_factor.values[points] == pytest.approx([1.0, 2.0, 2.8])
    for mine, load in zip(predicted, (100.0, 200.0, 280.0), strict=True):
        forced = ss.forced_response(oscillator(load=load, harmonics=range(10)), omega=(4.0, 15.0))
        assert mine == pytest.approx(max(forced.peaks("x"), key=lambda peak: peak[1]), rel=1e-2)
    assert any("it gives forced peaks to about one per cent, but not free decay" in text for text in branch.warnings)


def chain(velocity: float = 0.0) -> ss.Problem:
    """Three masses by two modes with a residual, one on the ground by a contact with a normal direction."""
    K = np.array([[60.0, -20.0, 0.0], [-20.0, 50.0, -10.0], [0.0, -10.0, 90.0]])
    square, shapes = np.linalg.eigh(K)
    modal = ss.ModalStructure(
        omega=np.sqrt(square[:2]), mode_shapes=shapes[:, :2], static_compliance=np.linalg.inv(K), dofs=["a", "b", "c"],
        loss_factor=0.02,
    )  # fmt: skip
    law = ss.FrictionContact(kt=5.0, mu=0.3, kn=5.0, normal_load=2.0)
    rubbing = ss.RubbingMotion(velocity=velocity)
    pair = ss.ContactPair(name="rub", tangential="a", normal="c", contact=law, rubbing=rubbing)
    return ss.Problem(modal, contacts=pair, loads=ss.Load(dof="b", sin=1.0), harmonics=range(6))


@pytest.mark.parametrize("velocity", [0.0, 1.5])
@pytest.mark.parametrize("jacobian", ["dense", "iterative"])
def test_modes_of_reduced_and_rubbing_structures_predict_forced_peaks(velocity, jacobian):
    problem = chain(velocity)
    mode = ss.nonlinear_modes(
        problem, amplitude=(0.01, 3.0), dof="b", load_factors=(2.0,), options={"jacobian": jacobian}
    )
    assert mode.outcome is ss.Outcome.COMPLETED
    d = mode.dataset.sel(dof="b")
    (k,) = np.flatnonzero(d.kind.values == "requested")
    w = float(d.omega[k])
    forced = ss.forced_response(problem.with_parameter("load", 2.0), omega=(0.8 * w, 1.2 * w), peaks_of="b")
    peak = max(forced.peaks("b"), key=lambda peak: peak[1])
    assert (w, float(d.amplitude[k])) == pytest.approx(peak, rel=5e-3)


def test_many_contacts_take_one_solution_a_correction(monkeypatch):
    """Motion, frequency and damping are solved for as one, and neighbours share what prepares the iteration."""
    made, alone = [], []
    prepare, solve = contact_jacobian.Preconditioner.__init__, contact_jacobian.ContactJacobian.solve
    monkeypatch.setattr(
        contact_jacobian.Preconditioner, "__init__", lambda self, *given: (made.append(1), prepare(self, *given))[0]
    )
    monkeypatch.setattr(
        contact_jacobian.ContactJacobian,
        "solve",
        lambda self, *given, **o: (alone.append(1), solve(self, *given, **o))[1],
    )
    given = {"amplitude": (0.01, 3.0), "dof": "b", "load_factors": (0.5, 2.0)}
    found = ss.nonlinear_modes(chain(), **given, options={"jacobian": "iterative"}).dataset
    evaluations = found.attrs["evaluations"]
    assert len(made) < 0.8 * evaluations
    assert len(alone) < 0.1 * evaluations
    dense = ss.nonlinear_modes(chain(), **given, options={"jacobian": "dense"}).dataset
    for name in ("omega", "modal_damping", "modal_amplitude"):
        exact = [data[name].values[data.kind.values == "requested"] for data in (found, dense)]
        assert exact[0] == pytest.approx(exact[1], rel=1e-8)


@pytest.mark.parametrize(
    ("amplitude", "mode", "marched"),
    [
        (29.07, (6.33401, 0.00407), (6.33400, 0.00408)),
        (11.88, (6.35957, 0.00883), (6.35937, 0.00891)),
        (4.80, (6.44807, 0.01489), (6.44716, 0.01546)),
    ],
)
def test_slow_friction_is_the_decay_of_a_march(amplitude, mode, marched):
    """Frequency and decay of free vibration marched in time: with D above 1 % the mode loses a few per cent."""
    problem = one_mass(damper(kt=4.0, mu=0.8, normal_load=10.0), C=None, force=1.0, harmonics=range(6))
    d = ss.nonlinear_modes(problem, amplitude=(1.0, amplitude)).dataset
    found = float(d.omega[-1]), float(d.modal_damping[-1])
    assert found[0] == pytest.approx(mode[0], abs=6e-5)
    assert found[1] == pytest.approx(mode[1], abs=1e-5)
    assert found[0] == pytest.approx(marched[0], rel=2e-4)
    assert found[1] == pytest.approx(marched[1], rel=0.01 if found[1] < 0.01 else 0.04)


def test_one_more_mode_and_its_results(tmp_path):
    branch = ss.nonlinear_modes(chain(), amplitude=(0.01, 0.1), mode=2, dof="a")
    assert branch.dataset.attrs["mode"] == 2
    again = ss.load(branch.save(tmp_path / "mode.nc"))
    assert again.dataset.modal_damping.values == pytest.approx(branch.dataset.modal_damping.values)
    assert branch.states(0)["rub"][0][2] == "stick"
    with pytest.raises(ss.InputError, match="it is a free vibration"):
        again.sensitivity()


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"mode": 3}, "mode: found 3; expected a number from 1 to 2"),
        ({"amplitude": (0.0, 1.0)}, "amplitude: found 0 to 1; expected two different amplitudes > 0"),
        ({"load_factors": -1.0}, "load_factors: found -1"),
        ({"dof": "z"}, "there is no output"),
    ],
)
def test_wrong_arguments(change, sentence):
    with pytest.raises(ss.InputError, match=sentence):
        ss.nonlinear_modes(chain(), **({"amplitude": (0.01, 0.1)} | change))


def test_a_travelling_wave_is_refused_and_what_tells_its_mode_is_said():
    sector = ss.CyclicStructure(M=[[1.0]], K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=4)
    law = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
    pair = ss.ContactPair(name="c", tangential={"x": 1.0, "x@next": -1.0}, contact=law)
    problem = ss.Problem(sector.travelling_wave(1), contacts=pair, harmonics=[0, 1])
    with raises_fault("problem", says="take limit cycles of its sector"):
        ss.nonlinear_modes(problem, amplitude=(1.0, 2.0))


def test_motions_that_free_vibration_has_not_are_refused():
    with raises_fault("contact", "damper", says="moves periodically"):
        ss.nonlinear_modes(oscillator(cos={1: 2.0}), amplitude=(1.0, 2.0))
    turning = [[0.0, 1.0], [-1.0, 0.0]]
    coupled = ss.MatrixStructure(
        M=np.eye(2), K=[[2.0, -1.0], [-1.0, 3.0]], gyroscopic=turning, speed=1.0, dofs=["a", "b"]
    )  # fmt: skip
    law = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
    problem = ss.Problem(coupled, contacts=ss.ContactPair(name="c", tangential="a", contact=law), harmonics=[0, 1])
    with pytest.raises(ss.InputError, match="whose modes are complex"):
        ss.nonlinear_modes(problem, amplitude=(1.0, 2.0))


def test_modes_of_one_frequency():
    """Of two equal oscillators one has a damper: each vibrates alone, as if the other were not there."""
    damper = ss.FrictionContact(kt=20.0, mu=0.4, normal_load=20.0)
    pair = ss.ContactPair(name="damper", contact=damper, tangential="a")

    def ends(n, mode, dof):
        structure = ss.MatrixStructure(M=np.eye(n), C=0.1 * np.eye(n), K=40.0 * np.eye(n), dofs=["a", "b"][:n])
        problem = ss.Problem(structure, contacts=pair, loads=ss.Load(dof="a", cos=1.0), harmonics=range(4))
        found = ss.nonlinear_modes(problem, amplitude=(0.05, 20.0), mode=mode, dof=dof)
        assert found.outcome is ss.Outcome.COMPLETED, found.message
        return found.dataset.omega.values[[0, -1]], found.dataset.modal_damping.values[[0, -1]]

    alone, both = ends(1, 1, "a"), ends(2, 1, "a")
    assert both[0] == pytest.approx(alone[0], rel=1e-9)
    assert both[1] == pytest.approx(alone[1], rel=1e-7)
    omega, damping = ends(2, 2, "b")
    assert omega == pytest.approx(np.sqrt(40.0))
    assert damping == pytest.approx(0.1 / (2.0 * np.sqrt(40.0)), rel=1e-6)


def two_masses(**contact) -> ss.Problem:
    """A light mass on a stiff contact, hung to a heavy one."""
    structure = ss.MatrixStructure(M=np.diag([0.02, 1.0]), K=[[40.0, -40.0], [-40.0, 640.0]], dofs=["a", "b"])
    pair = ss.ContactPair(name="foot", tangential="a", contact=ss.FrictionContact(**contact))
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="b", sin=1.0), harmonics=range(8))


@pytest.mark.parametrize(
    ("mode", "dof", "ends"), [(1, "a", (0.01, 0.05)), (1, "b", (0.1, 0.5)), (2, "a", (0.01, 0.05))]
)
def test_a_stiff_contact_that_sticks_begins_as_the_linear_mode_with_its_stiffness(mode, dof, ends):
    branch = ss.nonlinear_modes(two_masses(kt=400.0, mu=0.5, normal_load=100.0), amplitude=ends, mode=mode, dof=dof)
    assert branch.outcome is ss.Outcome.COMPLETED
    d = branch.dataset.sel(dof=dof)
    square = np.linalg.eigvals(np.diag([50.0, 1.0]) @ [[440.0, -40.0], [-40.0, 640.0]])
    assert d.omega.values == pytest.approx(np.sqrt(np.sort(square)[mode - 1]), rel=1e-9)
    assert np.abs(d.modal_damping.values).max() < 1e-9
    assert (float(d.amplitude[0]), float(d.amplitude[-1])) == pytest.approx(ends, rel=1e-9)


@pytest.mark.parametrize("ends", [(0.05, 2.0), (2.0, 0.05)])
def test_the_range_is_that_of_harmonic_1_at_the_output(ends):
    """Also where contacts slip at the first amplitude, and where the output is not the dof with the contact."""
    problem = two_masses(kt=40.0, mu=0.5, normal_load=1.0)
    d = ss.nonlinear_modes(problem, amplitude=ends, dof="b").dataset.sel(dof="b")
    harmonic_1 = np.hypot(*d.displacement.values[:, 1:3].T)
    assert harmonic_1[[0, -1]] == pytest.approx(ends, rel=1e-8)
    assert d.modal_amplitude.values == pytest.approx(harmonic_1, rel=1e-8)
    assert np.abs(d.displacement.values[:, 2]).max() < 1e-9 * harmonic_1.max()
    assert d.displacement.values[:, 1].min() > 0.0


@pytest.mark.parametrize("loss", [0.0, 0.03])
def test_the_least_damping_of_other_modes_is_that_of_the_eigenvalues(loss):
    omega, ratio = np.array([1.0, 1.7, 3.1]), np.array([0.02, 0.005, 0.01])
    shapes = np.random.default_rng(5).normal(size=(2, 3))
    structure = ss.ModalStructure(
        omega=omega, mode_shapes=shapes, dofs=["a", "b"], damping_ratio=ratio, loss_factor=loss
    )
    law = ss.FrictionContact(kt=0.4, mu=0.3, normal_load=1.0)
    grip = ss.ContactPair(name="grip", contact=law, tangential={"a": 1.0, "b": -1.0})
    _, linear = free_problem(ss.Problem(structure, contacts=grip, harmonics=[0, 1, 5]), 0, "a")
    assert free_problem(ss.Problem(structure, contacts=grip, harmonics=[0, 1]), 0, "a")[1].least == np.inf
    r = shapes[0] - shapes[1]
    K = np.diag(omega**2).astype(complex) + 0.4 * np.outer(r, r)
    exact = []
    for number in (1, 2):
        s = 1j * np.sqrt(np.linalg.eigvalsh(K.real)[number])
        for _ in range(50):  # the quadratic eigenvalue problem, mode by mode
            full = K + 1j * loss * np.diag(omega**2) + s * np.diag(2.0 * ratio * omega)
            values = np.linalg.eigvals(full)
            s = 1j * np.sqrt(values[np.argmin(np.abs(values + s**2))])
        exact.append(-2.0 * s.real)
    assert linear.least == pytest.approx(min(exact), rel=2e-3)


@pytest.mark.parametrize("by_shape", [False, True])
def test_weight_as_an_acceleration_of_the_support_is_a_static_load(by_shape):
    structure = ss.MatrixStructure(M=[[2.0]], C=[[0.05]], K=[[40.0]], dofs=["x"])
    if by_shape:
        structure = ss.ModalStructure(
            omega=[np.sqrt(20.0)], mode_shapes=[[np.sqrt(0.5)]], dofs=["x"], damping_ratio=0.003,
            load_shapes={"base x": LoadShape(participation=[np.sqrt(2.0)], static_response=[2.0 / 40.0])},
        )  # fmt: skip
    law = ss.FrictionContact(kn=50.0, gap=-0.05)
    foot = ss.ContactPair(name="foot", contact=law, normal={"x": 1.0})
    still = {"dof": "x", "cos": -2.0 * 3.0}, {"base": "x", "motion": "acceleration", "cos": 3.0}
    found = [
        ss.nonlinear_modes(
            ss.Problem(structure, contacts=foot, loads=ss.Load(**load, harmonic=0), harmonics=range(6)),
            amplitude=(0.01, 0.3),
        ).dataset
        for load in still
    ]
    assert found[1].omega.values == pytest.approx(found[0].omega.values, rel=1e-12)
    assert np.ptp(found[0].omega.values) > 0.1
