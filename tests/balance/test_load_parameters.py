"""Amplitude and phase of loads by name: what a name stands for, what a copy holds, what is followed."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.results import corrected

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem, ParameterSystem
from slipstick.balance.parameters import known_parameters, parameter_path, parameter_units
from slipstick.structure.modal import LoadShape

KEPT = ss.Harmonics(range(8))


def problem(*loads: ss.Load, name: str = "damper", **more: object) -> ss.Problem:
    shapes = {"pressure": LoadShape(participation=[2.0, 0.5], static_response=[0.3, 0.1])}
    structure = ss.ModalStructure(
        omega=[3.0, 7.0], mode_shapes=[[1.0, 0.5], [0.6, -1.0]], dofs=["x", "y.z"], loss_factor=0.05, load_shapes=shapes
    )
    pair = ss.ContactPair(
        name=name, contact=ss.FrictionContact(kt=5.0, mu=0.3, normal_load=4.0), tangential="x",
        rubbing=ss.RubbingMotion(velocity=2.0, cos={1: 0.5}),
    )  # fmt: skip
    given = {"contacts": pair, "loads": loads, "harmonics": KEPT} | more
    return ss.Problem(structure, told=None, **given)  # type: ignore[arg-type]


BOTH = (
    ss.Load(dof="x", cos=3.0), ss.Load(dof="y.z", amplitude=2.0, phase=0.5, harmonic=2), ss.Load(dof="x", sin=-4.0),
    ss.Load(dof="y.z", harmonic=0, cos=-1.5), ss.Load(shape="pressure", harmonic=3, cos=1.0),
)  # fmt: skip


def test_names_values_and_units() -> None:
    p = problem(*BOTH, load=2.0)
    named = [name for name in known_parameters(p) if name.startswith("load.")]
    assert named == [
        "load.x.amplitude", "load.x.phase", "load.y.z.2.amplitude", "load.y.z.2.phase", "load.y.z.0.amplitude",
        "load.pressure.amplitude", "load.pressure.phase",
    ]  # fmt: skip
    assert p.parameter("load.x.amplitude") == pytest.approx(5.0)  # of both loads on it, without the factor
    assert p.parameter("load.x.phase") == pytest.approx(np.arctan2(4.0, 3.0))
    assert p.parameter("load.x.1.phase") == p.parameter("load.x.phase")
    assert p.parameter("load.y.z.2.phase") == pytest.approx(0.5)
    assert p.parameter("load.y.z.phase") == pytest.approx(0.5)  # the static load has none
    assert p.parameter("load.y.z.0.amplitude") == 1.5
    found = {name: parameter_units(p, name) for name in ("load.x.amplitude", "load.x.phase", "load.pressure.amplitude",
                                                         "damper.velocity", "*.cos1", "damper.kt", "damper.mu", "load",
                                                         "damper.normal_load")}  # fmt: skip
    assert list(found.values()) == ["force", "rad", "1", "length/time", "length", "force/length", "1", "1", "force"]


def test_copies_hold_one_load_in_place_of_several() -> None:
    p = problem(*BOTH, load=2.0)
    louder = p.with_parameter("load.x.amplitude", 10.0)
    assert len(louder.loads) == 4
    assert (louder.loads[0].cos, louder.loads[0].sin) == pytest.approx((6.0, -8.0))
    assert louder.load_coefficients()[0, 1:3] == pytest.approx([12.0, -16.0])
    turned = p.with_parameter("load.x.phase", 0.0)
    assert (turned.loads[0].cos, turned.loads[0].sin) == pytest.approx((5.0, 0.0))
    static = p.with_parameter("load.y.z.0.amplitude", 3.0)
    assert [load.cos for load in static.loads if load.harmonic == 0] == [-3.0]
    silent = problem(ss.Load(dof="x", sin=0.0)).with_parameter("load.x.amplitude", 2.0)
    assert (silent.loads[0].cos, silent.loads[0].sin) == (2.0, 0.0)


@pytest.mark.parametrize("name, words", [
    ("load.y.z.amplitude", "could be one of 'load.y.z.2.amplitude', 'load.y.z.0.amplitude'; say which"),
    ("load.x.2.phase", "there is no parameter 'load.x.2.phase'; did you mean 'load.x.phase'"),
    ("load.y.z.0.phase", "there is no parameter"), ("load.q.amplitude", "there is no parameter"),
    ("rubbing.kt", "there is no parameter"),
])  # fmt: skip
def test_names_that_stand_for_nothing(name: str, words: str) -> None:
    with pytest.raises(ss.InputError, match=words):
        problem(*BOTH).parameter(name)


def test_several_parameters_are_set_in_one_go_as_one_after_the_other() -> None:
    """Also amplitude and phase of loads that become one, of a contact and of the structure."""
    base = problem(*BOTH)
    values = {
        "load.x.amplitude": 7.0, "load.x.phase": 0.3, "damper.mu": 0.5, "damper.velocity": 4.0, "loss_factor": 0.1,
        "friction": 2.0,
    }  # fmt: skip
    together, each = base.at_parameters(values), base
    for name, value in values.items():
        each = each.at_parameter(name, value)
        assert together.parameter(name) == pytest.approx(value, rel=1e-15)
    np.testing.assert_array_equal(together.inputs.P, each.inputs.P)
    assert together.contacts == each.contacts
    assert (together.loads, together.told, base.parameter("damper.mu")) == (each.loads, None, 0.3)
    with pytest.raises(ss.InputError, match="negative"):
        base.at_parameters({"damper.mu": 0.5, "negative.mu": 1.0})


def test_an_amplitude_is_not_negative() -> None:
    with raises_fault("load.x.amplitude", found="-1", expected="an amplitude >= 0"):
        problem(*BOTH).with_parameter("load.x.amplitude", -1.0)


@pytest.mark.parametrize("name", ["load.x.amplitude", "load.x.phase", "load.y.z.2.amplitude", "load.y.z.2.phase",
                                  "load.y.z.0.amplitude", "load.pressure.amplitude",
                                  "load.pressure.phase"])  # fmt: skip
@pytest.mark.parametrize("ratio, kept", [((1, 1), KEPT), ((2, 1), ss.Harmonics([0, 1, 2, 3, 4, 6]))])
def test_derivatives(name: str, ratio: tuple[int, int], kept: ss.Harmonics) -> None:
    p = problem(*BOTH, load=2.0, period_ratio=ratio, harmonics=kept)
    balance = Balance(p)
    x, omega = 0.3 * np.random.default_rng(1).standard_normal(balance.size), 2.5
    system = ParameterSystem(balance, parameter_path(p, name), omega)

    def residual(value: float) -> np.ndarray:
        return FrequencySystem(balance, p.with_parameter(name, value).inputs).evaluate(x, omega).residual

    for value in (0.0, p.parameter(name), 2.0):
        found = system.evaluate(x, value)
        assert found.residual == pytest.approx(residual(value), abs=1e-13)
        centre, step = max(value, 1e-3), 1e-3
        wanted = (residual(centre + step) - residual(centre - step)) / (2 * step)
        at = system.evaluate(x, centre).parameter_derivative
        assert at == pytest.approx(wanted, abs=1e-6 * np.abs(wanted).max())


def test_the_phase_of_a_single_load_only_shifts_time() -> None:
    p = problem(ss.Load(dof="x", sin=4.0))
    still = p.with_parameter("damper.cos1", 0.0)
    branch = ss.parameter_response(still, "load.x.phase", (-pi / 2, 3 * pi / 2), omega=2.5, peaks_of=())
    assert branch.outcome.ok
    data = branch.dataset
    assert data.parameter.attrs["units"] == "rad"
    assert data.amplitude.values == pytest.approx(data.amplitude.values[:1] + 0.0 * data.amplitude.values, rel=1e-5)
    data = corrected(data)
    assert data.amplitude.values == pytest.approx(np.broadcast_to(data.amplitude.values[0], data.amplitude.shape))
    motion, tau = data.displacement.values, np.linspace(0, 2 * pi, 50)
    for point in (3, data.sizes["point"] // 2, -1):
        shift = float(data.parameter[point]) + pi / 2
        assert motion[point] @ KEPT.H_minus(tau).T == pytest.approx(motion[0] @ KEPT.H_minus(tau + shift).T, abs=1e-8)


def test_two_excitations_out_of_step() -> None:
    """The phase between a load and the rub matters; the curve holds separate problems' solutions and their peak."""
    p = problem(ss.Load(dof="x", sin=4.0))
    branch = ss.parameter_response(p, "load.x.phase", (0.0, 2 * pi), omega=2.5, at=[2.0], peaks_of="y.z")
    assert branch.outcome.ok
    assert np.ptp(branch.dataset.amplitude.values[:, 0]) > 0.01
    alone = ss.forced_response(p.with_parameter("load.x.phase", 2.0), omega=(2.5, 2.6))
    at = branch.at(2.0)
    assert branch.dataset.displacement.values[at] == pytest.approx(alone.dataset.displacement.values[0], abs=1e-9)
    (peak,) = branch.peaks("y.z")
    sizes = [ss.forced_response(p.with_parameter("load.x.phase", peak[0] + d), omega=(2.5, 2.6)) for d in (-0.01, 0.01)]
    assert all(float(s.dataset.amplitude[0, 1]) < peak[1] for s in sizes)


def test_rubbing_is_the_motion_of_all_contacts_unless_one_is_called_so() -> None:
    assert problem().with_parameter("rubbing.cos1", 0.7).contacts[0].rubbing.cos[1] == 0.7
    other = ss.ContactPair(name="other", contact=ss.FrictionContact(kt=5.0, mu=0.3, normal_load=4.0), tangential="x")
    named = problem(name="rubbing")
    both = problem(contacts=[*named.contacts, other]).with_parameter("rubbing.velocity", 7.0)
    assert [pair.rubbing.velocity for pair in both.contacts] == [7.0, 0.0]
    assert "rubbing.cos1" in known_parameters(problem())
