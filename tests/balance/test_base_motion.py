"""A support that moves: against closed forms, absolute coordinates, central differences and integration in time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.base_motion import BaseReceptance
from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.balance.jacobian_backends import BACKENDS
from slipstick.balance.parameters import known_parameters, parameter_path, parameter_units
from slipstick.cli.examples import example
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.structure.modal import LoadShape

M, C, K, U = 1.5, 0.4, 40.0, 2.0
ONE = ss.MatrixStructure(M=[[M]], C=[[C]], K=[[K]], dofs=["x"])
TWO = ss.MatrixStructure(
    M=[[2.0, 0.1], [0.1, 1.0]], C=[[0.5, -0.2], [-0.2, 0.2]], K=[[70.0, -30.0], [-30.0, 30.0]], dofs=["x1", "x2"]
)
BOTH = {"x1": 1.0, "x2": 1.0}
CONTACT = ss.FrictionContact(kt=30.0, mu=0.3, normal_load=20.0)


def moved(motion: str = "displacement", **given: float) -> ss.Load:
    return ss.Load(base=BOTH, motion=motion, **(given or {"cos": 0.7, "sin": U}))  # type: ignore[arg-type]


def rubbed(*loads: ss.Load, structure: object = TWO, **more: object) -> ss.Problem:
    pair = ss.ContactPair(
        name="damper", contact=CONTACT, tangential="x2", rubbing=ss.RubbingMotion(velocity=1.0, cos={2: 0.3})
    )
    given = {"contacts": pair, "loads": loads, "harmonics": range(8), "told": None} | more
    return ss.Problem(structure, **given)  # type: ignore[arg-type]


@pytest.mark.parametrize("order, load_order", [(1, 1), (2, 1), (1, 2)])
def test_transmissibility_of_one_mass(order: int, load_order: int) -> None:
    """Relative: m w^2 U / |Z|; absolute: U |k + i w c| / |Z|."""
    load = ss.Load(base="x", motion="displacement", sin=U, harmonic=order)
    problem = ss.Problem(ONE, loads=load, harmonics=range(5), period_ratio=(1, 1) if load_order == 1 else (1, 2))
    omega = np.array([0.7, 3.0, 5.16, 20.0])
    w = omega * order * problem.load_order
    assert problem.load_order == load_order
    data = ss.linear_response(problem, omega=omega).dataset
    Z = K - M * w**2 + 1j * w * C
    assert data.amplitude.values[:, 0] == pytest.approx(M * w**2 * U / np.abs(Z), rel=1e-12)
    m = order * load_order
    c, s = (data.displacement.sel(coefficient=f"{part}{m}").values[:, 0] for part in "cs")
    absolute = np.hypot(c, s + U)
    assert absolute == pytest.approx(U * np.abs(K + 1j * w * C) / np.abs(Z), rel=1e-12)


def test_acceleration_and_weight() -> None:
    loads = [
        ss.Load(base="x", motion="acceleration", cos=U),
        ss.Load(base="x", motion="acceleration", harmonic=0, cos=-9.81),
    ]
    w = np.array([0.7, 3.0, 20.0])
    data = ss.linear_response(ss.Problem(ONE, loads=loads, harmonics=[0, 1]), omega=w).dataset
    assert data.amplitude.values[:, 0] == pytest.approx(M * U / np.abs(K - M * w**2 + 1j * w * C), rel=1e-12)
    assert data["mean"].values[:, 0] == pytest.approx(M * 9.81 / K)


def test_two_masses_closed_form() -> None:
    w = np.array([1.0, 4.0, 6.0, 9.0])
    data = ss.linear_response(ss.Problem(TWO, loads=moved(), harmonics=[0, 1]), omega=w).dataset
    for k, value in enumerate(w):
        Z = TWO.K - value**2 * TWO.M + 1j * value * TWO.C
        q = np.linalg.solve(Z, value**2 * TWO.M @ [1.0, 1.0] * (0.7 - 1j * U))
        assert data.amplitude.values[k] == pytest.approx(np.abs(q), rel=1e-11)


@pytest.mark.parametrize("omega", [2.0, 5.5])
def test_the_same_in_absolute_coordinates(omega: float) -> None:
    """Springs and dampers to ground pull by k u + c u', the opposing surface moves with the support."""
    relative = ss.forced_response(rubbed(moved()), omega=(omega, 1.01 * omega))
    c, s = TWO.K @ [1.0, 1.0], omega * TWO.C @ [1.0, 1.0]
    forces = [ss.Load(dof=dof, cos=c[i] * 0.7 + s[i] * U, sin=c[i] * U - s[i] * 0.7) for i, dof in enumerate(BOTH)]
    pair = ss.ContactPair(
        name="damper", contact=CONTACT, tangential="x2",
        rubbing=ss.RubbingMotion(velocity=1.0, cos={1: -0.7, 2: 0.3}, sin={1: -U}),
    )  # fmt: skip
    absolute = ss.forced_response(rubbed(*forces, contacts=pair), omega=(omega, 1.01 * omega))
    one, other = (branch.dataset.displacement.values[0] for branch in (relative, absolute))
    u = np.zeros(15)
    u[1:3] = 0.7, U
    assert one == pytest.approx(other - u, abs=1e-8)
    assert float(relative.dataset.slip_fraction[0, 0]) > 0.1


def test_time_integration_agrees() -> None:
    loads = moved(), moved("acceleration", harmonic=0, cos=-3.0)
    branch = ss.forced_response(rubbed(*loads, harmonics=range(16)), omega=(2.0, 8.0))
    assert branch.outcome.ok
    for point in (2, len(branch) // 2, len(branch) - 2):
        check = branch.check_in_time(point)
        assert check.converged
        assert check.relative_difference < 2e-3


@pytest.mark.parametrize("ratio, kept", [((1, 1), range(8)), ((2, 1), [0, 1, 2, 3, 4, 6])])
def test_derivative_by_frequency(ratio: tuple[int, int], kept: object) -> None:
    load = ss.Load(dof="x1", cos=3.0)
    problem = rubbed(moved(), moved("acceleration", cos=1.0), load, period_ratio=ratio, harmonics=kept,
                     structure=TWO.changed(loss_factor=0.05))  # fmt: skip
    balance = Balance(problem)
    system = FrequencySystem(balance, problem.inputs)
    x, omega, step = np.random.default_rng(1).standard_normal(balance.size), 2.5, 1e-5
    wanted = (system.evaluate(x, omega + step).residual - system.evaluate(x, omega - step).residual) / (2 * step)
    found = system.evaluate(x, omega).parameter_derivative
    assert found == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())


def test_products_know_the_support() -> None:
    """The Jacobian of many contacts asks the modes; its compliance and the derivatives are those written out."""
    modes = np.array([[1.0, 0.5], [0.6, -1.0]])
    shape = LoadShape(participation=[2.0, 0.5], static_response=[0.3, 0.1])
    structure = ss.ModalStructure(
        omega=[3.0, 7.0], mode_shapes=modes, dofs=["x1", "x2"], loss_factor=0.05, load_shapes={"base x": shape}
    )
    loads = [ss.Load(base="x", motion=motion, cos=1.0, sin=0.5) for motion in ("displacement", "acceleration")]
    problem = rubbed(*loads, ss.Load(dof="x1", cos=1.0), structure=structure)
    receptance, orders = Balance(problem).receptance, np.arange(1.0, 8.0)
    dense = BACKENDS["dense"].compliance(receptance, orders, 2.5, None)
    products = BACKENDS["iterative"].compliance(receptance, orders, 2.5, None)
    G = np.random.default_rng(2).standard_normal((4, 16)).view(complex)
    assert products.answer(G) == pytest.approx(dense.answer(G), rel=1e-10)
    assert products.rate(G) == pytest.approx(dense.rate(G), rel=1e-10)
    rng = np.random.default_rng(3)
    x, on_ports, P = rng.normal(size=(1, 15)), rng.normal(size=(2, 1, 15)), rng.normal(size=(3, 15))
    springs = rng.uniform(size=(2, 1))
    both = (of.residual_with_slope(x, on_ports, P, *springs) for of in (products, dense))
    assert all(one == pytest.approx(other, rel=1e-10) for one, other in zip(*both, strict=True))


@pytest.mark.parametrize("name", ["load.base 1.amplitude", "load.base 2.phase", "load.base 1.phase", "loss_factor"])
def test_derivative_by_its_parameters(name: str) -> None:
    problem = rubbed(moved(), moved("acceleration", cos=1.0), structure=TWO.changed(loss_factor=0.05))
    balance = Balance(problem)
    x, omega, step = np.random.default_rng(1).standard_normal(balance.size), 2.5, 1e-4
    system, value = ParameterSystem(balance, parameter_path(problem, name), omega), problem.parameter(name)

    def residual(at: float) -> np.ndarray:
        changed = problem.with_parameter(name, at)
        return FrequencySystem(Balance(changed), changed.inputs).evaluate(x, omega).residual

    wanted = (residual(value + step) - residual(value - step)) / (2 * step)
    assert system.evaluate(x, value).parameter_derivative == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


def test_sums_over_modes_serve_a_support_too() -> None:
    """All orders of one and of many frequencies at once, and order 0, are what ``at`` gives one by one."""
    rng = np.random.default_rng(3)
    modes = ss.ModalStructure(
        omega=[1.0, 2.0, 4.0], mode_shapes=rng.normal(size=(4, 3)), dofs=["a", "b", "c", "d"], damping_ratio=0.02
    )
    plain, orders, omega = modes.project(np.eye(4), np.eye(4)), np.array([1, 3]), np.array([0.7, 1.9])
    moved = BaseReceptance(plain, [None, None, "displacement", "acceleration"])
    value, slope = moved.at(orders, omega)
    many = np.empty((2, 2, 4, 4, 3), dtype=complex)
    moved.conjugates_of(orders, omega, many)
    for i, w in enumerate(omega):
        for found in (moved.conjugates(orders, float(w)), many[i]):
            np.testing.assert_allclose(found[0, :, :, 1:].conj(), value[i].transpose(2, 1, 0), rtol=1e-12)
            np.testing.assert_allclose(found[1, :, :, 1:].conj(), slope[i].transpose(2, 1, 0), rtol=1e-11)
            np.testing.assert_allclose(found[0, :, :, 0], moved.static.T, rtol=1e-12)
            np.testing.assert_array_equal(found[1, :, :, 0], 0.0)
    forces = plain.at(orders, omega)[0] * [1.0, 1.0, 0.0, -1.0]
    forces[..., 2] = plain.at(orders, omega)[0][..., 2] * (omega[:, None] * orders)[..., None] ** 2
    np.testing.assert_allclose(value, forces, rtol=1e-12)


def test_names_and_units() -> None:
    two = rubbed(moved(), moved(harmonic=2, cos=1.0), moved("acceleration", cos=1.0))
    named = [name for name in known_parameters(two) if name.endswith("amplitude")]
    assert named == ["load.base 1.1.amplitude", "load.base 1.2.amplitude", "load.base 2.amplitude"]
    assert [parameter_units(two, name) for name in named] == ["length", "length", "length/time^2"]
    one = rubbed(moved())
    assert one.parameter("load.base.amplitude") == pytest.approx(np.hypot(0.7, U))
    branch = ss.parameter_response(one, "load.base.amplitude", (0.5, 1.0), omega=3.0)
    direct = ss.forced_response(one.with_parameter("load.base.amplitude", 1.0), omega=(3.0, 3.1))
    assert branch.dataset.displacement.values[-1] == pytest.approx(direct.dataset.displacement.values[0], abs=1e-8)


def test_results_say_that_they_are_relative(tmp_path: Path) -> None:
    branch = ss.forced_response(rubbed(moved()), omega=(2.0, 3.0), options={"max_points": 4})
    branch.save(tmp_path / "r.nc")
    back = ss.load(tmp_path / "r.nc")
    for data in (branch.dataset, back.dataset):
        assert data.attrs["coordinates_of_motion"] == "relative to the moving support"
        for name in ("displacement", "amplitude", "mean"):
            assert data[name].attrs["long_name"].endswith("relative to the moving support")
    assert back.problem == branch.problem or back.problem.loads == branch.problem.loads
    still = ss.forced_response(rubbed(ss.Load(dof="x1", cos=1.0)), omega=(2.0, 3.0), options={"max_points": 4})
    assert "coordinates_of_motion" not in still.dataset.attrs


def test_a_reduced_model() -> None:
    """Against a direct solution of the full matrices; a held node's inertia is not in them."""
    beam = MeshModel(mesh=box((0.1, 0.01, 0.02), (6, 1, 1), "hex20"))
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    model = assemble_mesh(beam, source="beam", material=steel, fixed=["x0"])
    body = ss.reduced_body(model, keep=[model.dofs[-2]], modes=20, base=["y", "z"], loss_factor=0.01)
    assert body.structure.load_shapes == ("base y", "base z")
    problem = ss.Problem(
        body.structure, loads=ss.Load(base="y", motion="displacement", cos=1e-3), harmonics=[0, 1], told=None
    )
    w = np.array([0.3, 1.02]) * body.structure.natural_frequencies[0]
    found = ss.linear_response(problem, omega=w).dataset.amplitude.values[:, 0]
    from scipy.sparse.linalg import spsolve

    for k, value in enumerate(w):
        r = (model.dof_components == 1).astype(float)
        Z = (model.K * (1 + 0.01j) - value**2 * model.M).tocsc()
        q = spsolve(Z, (value**2 * 1e-3 * (model.M @ r)).astype(complex))
        assert found[k] == pytest.approx(abs(q[model.index(model.dofs[-2])]), rel=1e-6)
    with raises_fault("load", 0, "base", says="load shape 'base x'"):
        ss.Problem(body.structure, loads=ss.Load(base="x", motion="displacement", cos=1.0), harmonics=[0, 1])


@pytest.mark.parametrize("given, words", [
    ({"base": "x1"}, 'base is given without motion; give both'),
    ({"dof": "x1", "motion": "displacement"}, "motion is given without base"),
    ({"base": {}, "motion": "displacement"}, "expected dofs with their motion"),
    ({"base": {"x1": 0.0}, "motion": "displacement"}, "expected dofs with their motion"),
    ({"base": {"x3": 1.0}, "motion": "displacement"}, "there is no dof 'x3' in the structure; there are x1, x2"),
    ({"base": "x1", "dof": "x1", "motion": "displacement"}, "base is given together with dof; keep one of them"),
    ({"base": "x1", "motion": "displacement", "harmonic": 0}, "a constant displacement of the support moves nothing"),
])  # fmt: skip
def test_faults(given: dict[str, object], words: str) -> None:
    with pytest.raises(ss.InputError, match=words):
        rubbed(ss.Load(**given, cos=1.0))  # type: ignore[arg-type]


def test_in_a_case_file() -> None:
    text = example("oscillator").path.read_text(encoding="utf-8")
    load = '[[load]]\nbase = "x"\nmotion = "displacement"\namplitude = 2.0\nphase = "-90 deg"\n'
    case = ss.Case.from_text(text.replace(text[text.index("[[load]]") : text.index("[[contact]]")], load))
    (found,) = case.problem().loads
    assert (found.base, found.motion, found.sin) == ("x", "displacement", 2.0)
    for old, new, words in (
        ('motion = "displacement"\n', "", "base is given without motion"),
        ('base = "x"\n', 'base = { y = 1.0 }\n', r"\[\[load\]\].* base: there is no dof 'y' in the structure"),
        ('"displacement"', '"velocity"', "motion"),
        ('base = "x"', 'base = "x"\ndof = "x"', "base is given together with dof; keep one of them"),
    ):  # fmt: skip
        with pytest.raises(ss.InputError, match=words):
            ss.Case.from_text(case.text.replace(old, new))
