"""Loss factor and viscous damping followed by name: derivatives, and curves against separate problems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.balance.parameters import known_parameters, parameter_path, parameter_units, product_warnings
from slipstick.structure.modal import LoadShape

CHAIN = np.array([[60.0, -20.0, 0.0], [-20.0, 50.0, -30.0], [0.0, -30.0, 45.0]])


def structure(kind: str) -> object:
    dofs = ["x", "y", "z"]
    if kind == "modal":
        shape = LoadShape(participation=[1.0, -0.4], static_response=[0.05, 0.06, 0.08])
        modes = np.array([[0.3, 0.7], [0.6, 0.3], [0.7, -0.6]])
        omega = np.array([3.6, 7.1])
        return ss.ModalStructure(
            omega=omega, mode_shapes=modes, static_compliance=(modes / omega**2) @ modes.T + 0.003 * np.eye(3),
            dofs=dofs, loss_factor=0.05, damping_ratio=[0.02, 0.04], load_shapes={"wind": shape},
        )  # fmt: skip
    C = 0.01 * CHAIN + (np.diag([0.0, 0.3, 0.0]) if kind == "poles" else 0.0)
    return ss.MatrixStructure(M=np.eye(3), C=C, K=CHAIN, dofs=dofs, loss_factor=0.05, load_shapes={"wind": [1.0, 1, 1]})


def problem(kind: str = "modal") -> ss.Problem:
    """A contact with a normal direction; outputs beside it, which need the receptance too."""
    pair = ss.ContactPair(
        name="rub", contact=ss.FrictionContact(kt=20.0, mu=0.4, kn=30.0, gap=-0.1), tangential="x", normal="y",
        rubbing=ss.RubbingMotion(velocity=3.0),
    )  # fmt: skip
    loads = [ss.Load(shape="wind", sin=3.0), ss.Load(dof="z", cos=1.0)]
    return ss.Problem(structure(kind), contacts=pair, loads=loads, harmonics=range(7), told=None)  # type: ignore[arg-type]


def difference(f, at: float, step: float = 1e-4) -> np.ndarray:  # type: ignore[no-untyped-def]
    return (8 * (f(at + step) - f(at - step)) - (f(at + 2 * step) - f(at - 2 * step))) / (12 * step)


@pytest.mark.parametrize("anchored", [False, True])
@pytest.mark.parametrize("name, value", [("loss_factor", 0.12), ("damping", 1.0), ("damping", 2.5)])
@pytest.mark.parametrize("kind", ["modal", "modes", "poles"])
def test_derivatives(kind: str, name: str, value: float, anchored: bool) -> None:
    p = problem(kind)
    assert name in known_parameters(p)
    assert parameter_units(p, name) == "1"
    balance, omega = Balance(p), 3.3
    if anchored:
        balance.springs = 1.0 / np.diag(balance.receptance.static)
    x = 0.3 * np.random.default_rng(1).standard_normal(balance.size)
    system = ParameterSystem(balance, parameter_path(p, name), omega)

    def residual(at: float) -> np.ndarray:
        other = p.with_parameter(name, at)
        separate = Balance(other)
        separate.springs = balance.springs
        return FrequencySystem(separate, other.inputs).evaluate(x, omega).residual

    found = system.evaluate(x, value)
    assert found.residual == pytest.approx(residual(value), abs=1e-11)
    wanted = difference(residual, value)
    assert found.parameter_derivative == pytest.approx(wanted, abs=1e-7 * np.abs(wanted).max())
    for column in (0, 5, balance.size - 1):
        unit = np.eye(balance.size)[column]
        wanted = difference(lambda s, unit=unit: system.evaluate(x + s * unit, value).residual, 0.0)
        assert found.jacobian.matrix[:, column] == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("kind, name, span", [
    *((kind, *one) for kind in ("modal", "poles") for one in (("loss_factor", (0.3, 0.0)), ("damping", (0.2, 4.0)))),
    ("modal", "mode1.omega", (4.0, 3.0)),
])  # fmt: skip
def test_curves_hold_the_solutions_of_separate_problems(kind: str, name: str, span: tuple[float, float]) -> None:
    p, middle = problem(kind), 0.6 * span[0] + 0.4 * span[1]
    branch = ss.parameter_response(p, name, span, omega=3.5, at=[middle])
    assert branch.outcome.ok
    for point in (0, branch.at(middle), len(branch) - 1):
        value = float(branch.dataset.parameter[point])
        alone = ss.forced_response(p.with_parameter(name, value), omega=(3.5, 3.6)).dataset
        for variable in ("displacement", "truncation", "amplitude", "friction_force"):
            found = branch.dataset[variable].values[point]
            assert found == pytest.approx(alone[variable].values[0], rel=1e-6, abs=1e-8), variable
    assert branch.check_in_time(branch.at(middle)).converged


def test_a_peak_over_damping_is_one() -> None:
    """Beside the contact an amplitude has an extreme over damping; the located one is higher than its neighbours."""
    p = problem("poles")
    branch = ss.parameter_response(p, "damping", (0.0, 12.0), omega=5.9)
    found = [(value, size, k) for k, dof in enumerate(("x", "y", "z")) for value, size in branch.peaks(dof)]
    assert found
    for value, size, k in found:
        for beside in (value - 0.05, value + 0.05):
            alone = ss.forced_response(p.with_parameter("damping", beside), omega=(5.9, 6.0)).dataset
            assert float(alone.amplitude[0, k]) < size


def test_a_factor_survives_the_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    """Over damping from a structure whose own factor is not 1: the file's problem is the same at every point."""
    p = problem("modes").with_parameter("damping", 2.0)
    branch = ss.parameter_response(p, "damping", (1.0, 3.0), omega=3.5)
    again = ss.load(branch.save(tmp_path / "r.nc"))
    assert again.problem is not None
    assert again.problem.parameter("damping") == 2.0
    assert again.check_in_time(len(again) - 1).relative_difference < 0.02
    assert again.dataset.parameter.attrs["units"] == "1"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("belt.speed", "there are damper.velocity, shroud.velocity"),
        ("dampr.speed", "did you mean 'damper.velocity'"),
        ("damper.nu", "did you mean 'damper.mu'"),
        ("damper.speed", "did you mean 'damper.velocity'"),
        ("damper.width", "damper has kt, mu, kn, gap, normal_load, velocity"),
        ("load.x.amplitud", "did you mean 'load.x.amplitude'"),
        ("amplitude", "did you mean 'load.x.amplitude'"),
        ("los_factor", "did you mean 'loss_factor'"),
        ("omega", "a response follows the frequency"),
    ],
)
def test_an_unknown_name_is_answered_by_what_was_meant(name: str, words: str) -> None:
    contact = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0)
    pairs = [ss.ContactPair(name=name, tangential="x", contact=contact) for name in ("damper", "shroud")]
    structure = ss.MatrixStructure(M=[[1.0]], K=[[9.0]], dofs=["x"])
    given = ss.Problem(structure, contacts=pairs, loads=ss.Load(dof="x", sin=1.0), harmonics=[0, 1], told=None)
    with pytest.raises(ss.InputError, match=f"there is no parameter '{name}'; {words}"):
        given.parameter(name)


def test_what_a_structure_does_not_have_is_no_parameter() -> None:
    bare = ss.Problem(ss.MatrixStructure(M=[[1.0]], K=[[9.0]], dofs=["x"]), told=None)
    assert bare.parameter("loss_factor") == 0.0
    with pytest.raises(ss.InputError, match="there is no parameter 'damping'"):
        bare.parameter("damping")
    with raises_fault("loss_factor", found="-1.0", expected="a number >= 0"):
        bare.with_parameter("loss_factor", -1.0)


BLOCKS = ["tip 1", "tip 2", "foot 1"]


def blocks(**given: object) -> ss.Problem:
    """A block of two contacts and one of one, as ``ss.surface_contacts`` names them."""
    contacts = [
        ss.ContactPair(
            name=name, contact=ss.FrictionContact(kt=20.0, mu=mu, normal_load=1.5), tangential=dof,
            rubbing=ss.RubbingMotion(velocity=1.0),
        )
        for name, mu, dof in zip(BLOCKS, (0.3, 0.5, 0.4), "xyz", strict=True)
    ]  # fmt: skip
    asked = {"harmonics": range(4), "told": None, "outputs": ["x", "z"], **given}
    return ss.Problem(structure("modal"), contacts=contacts, loads=[ss.Load(dof="z", cos=2.0)], **asked)


def test_a_contact_in_one_direction_has_no_second_velocity() -> None:
    with raises_fault(says="no parameter .rub.second_velocity"):
        problem().parameter_target("rub.second_velocity")


@pytest.mark.parametrize("heated", [False, True])
def test_a_constant_normal_load_is_one_parameter_with_friction_unless_heat_changes_it(heated: bool) -> None:
    curve = ss.FrictionCurve(temperature=[0.0, 500.0], mu=[0.3, 0.2])
    thermal = ss.ThermalModel(curve=curve, background=20.0, resistance=0.01) if heated else None
    told = list(product_warnings(one_mass(damper(1.0), thermal=thermal), ["friction", "damper.normal_load"]))
    assert ["cannot be separated" in sentence for sentence in told] == ([] if heated else [True])


def test_a_block_of_contacts_has_parameters() -> None:
    p = blocks()
    assert {"tip.mu", "foot.mu", "tip 1.mu"} <= {*known_parameters(p)}
    assert p.parameter("tip.mu") == pytest.approx(0.4)
    assert [pair.contact.mu for pair in p.with_parameter("tip.mu", 0.2).contacts] == [0.2, 0.2, 0.4]
    with raises_fault(says="did you mean 'tip.mu'"):
        p.parameter("tip.um")
    called = replace(p, contacts=(*p.contacts[:2], replace(p.contacts[2], name="tip")))  # what is called so is meant
    assert [pair.contact.mu for pair in called.with_parameter("tip.mu", 0.2).contacts] == [0.3, 0.5, 0.2]


def test_derivatives_by_a_block_are_those_of_its_contacts_together() -> None:
    p = blocks()
    branch = ss.steady_response(p, omega=3.3)
    both = branch.sensitivity(["tip.mu", "foot.mu"], dof="z").amplitude.values[:, 0]
    of = branch.sensitivity(["tip 1.mu", "tip 2.mu", "foot 1.mu"], dof="z").amplitude.values[:, 0]
    assert both == pytest.approx([of[0] + of[1], of[2]], rel=1e-9)

    def amplitude(more: float) -> float:
        moved = p.with_parameter("tip 1.mu", 0.3 + more).with_parameter("tip 2.mu", 0.5 + more)
        return float(ss.steady_response(moved, omega=3.3).dataset.amplitude.sel(dof="z")[0])

    assert both[0] == pytest.approx((amplitude(1e-4) - amplitude(-1e-4)) / 2e-4, rel=1e-5)


def test_a_block_is_followed_studied_and_identified() -> None:
    p = blocks()
    curve = ss.parameter_response(p, "tip.mu", (0.2, 0.5), omega=3.3, at=[0.4])
    at = curve.dataset.isel(point=int(np.argmin(np.abs(curve.dataset.parameter.values - 0.4))))
    alone = ss.steady_response(p.with_parameter("tip.mu", 0.4), omega=3.3)
    assert at.amplitude.values == pytest.approx(alone.dataset.amplitude.values[0], rel=1e-7)
    grid = ss.study(p, {"tip.mu": [0.2, 0.4]}, omega=(3.0, 4.0))
    one = ss.forced_response(p.with_parameter("tip.mu", 0.4), omega=(3.0, 4.0))
    assert float(grid.peak_amplitude.sel(dof="z")[1]) == pytest.approx(one.peaks("z")[0][1], rel=1e-6)
    true = p.with_parameter("tip.mu", 0.35)
    omega = [3.0, 3.2, 3.4, 3.6, 3.8]
    measured = ss.steady_response(true, omega=omega).dataset[["displacement"]]
    data = xr.Dataset({"amplitude": (("omega", "dof"), ss.steady_response(true, omega=omega).dataset.amplitude.values)},
                      coords={"omega": omega, "dof": measured.dof.values})  # fmt: skip
    fit = ss.identify(p, data, {"tip.mu": 0.25, "foot.mu": 0.5})
    assert [fit.values["tip.mu"], fit.values["foot.mu"]] == pytest.approx([0.35, 0.4], rel=1e-4)
