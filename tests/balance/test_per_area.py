"""The stiffness per area of contacts between surfaces is a parameter: areas and proportions are kept."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.parameters import parameter_path, parameter_units
from slipstick.errors import InputError

AREAS = np.array([1.0, 2.0, 0.5])
KT = 30.0 * AREAS * np.array([1.0, 1.2, 0.7])


@pytest.fixture
def problem() -> ss.Problem:
    K = np.diag([300.0, 250.0, 200.0])
    structure = ss.MatrixStructure(M=np.eye(3), C=0.01 * K, K=K, dofs=["x", "y", "z"])
    law = ss.PlanarFrictionContact(kt=KT, kn=50.0 * AREAS, mu=0.4, gap=-0.02)
    single = ss.PlanarFrictionContact(kt=20.0, kn=40.0, mu=0.3, gap=-0.02)
    contacts = [
        ss.ContactPair(name="lap 1", contact=law, tangential=("x", "y"), normal="z", area=AREAS),
        ss.ContactPair(name="lap 2", contact=single, tangential=("y", "x"), normal="z", area=0.8),
    ]
    return ss.Problem(structure, contacts=contacts, loads=ss.Load(dof="x", cos=1.0), harmonics=[0, 1], outputs=["x"])


def test_value_is_the_mean_over_the_area_and_changes_keep_proportions(problem: ss.Problem) -> None:
    mean = (KT.sum() + 20.0) / (AREAS.sum() + 0.8)
    assert problem.parameter("lap.kt_per_area") == pytest.approx(mean, rel=1e-14)
    twice = problem.with_parameter("lap.kt_per_area", 2.0 * mean)
    np.testing.assert_allclose(twice.contacts[0].values("kt"), 2.0 * KT, rtol=1e-14)
    assert twice.contacts[1].values("kt")[0] == pytest.approx(40.0, rel=1e-14)
    assert twice.parameter("lap.kt_per_area") == pytest.approx(2.0 * mean, rel=1e-14)
    np.testing.assert_allclose(twice.contacts[0].values("kn"), 50.0 * AREAS, rtol=1e-14)
    one = problem.with_parameter("lap 2.kn_per_area", 10.0)
    assert one.contacts[1].values("kn")[0] == pytest.approx(8.0, rel=1e-14)
    point = problem.with_parameter("lap 1.2.kn_per_area", 7.0)
    np.testing.assert_allclose(point.contacts[0].values("kn"), [50.0, 14.0, 25.0], rtol=1e-14)
    assert parameter_units(problem, "lap.kt_per_area") == "force/length^3"


def test_its_path_is_the_difference_of_what_it_changes(problem: ss.Problem) -> None:
    for name in ("lap.kt_per_area", "lap 1.kn_per_area"):
        value = problem.parameter(name)
        here, slope = parameter_path(problem, name).at(value)
        high, low = (problem.with_parameter(name, value + h).inputs for h in (1e-3, -1e-3))
        for key in ("kt", "kn"):
            np.testing.assert_allclose(here.batches[0].values[key], problem.inputs.batches[0].values[key], rtol=1e-14)
            central = (high.batches[0].values[key] - low.batches[0].values[key]) / 2e-3
            np.testing.assert_allclose(slope.batches[0].values[key], central, rtol=1e-8, atol=1e-8)


def test_where_there_is_no_area_or_a_negative_one_is_asked(problem: ss.Problem) -> None:
    with pytest.raises(InputError, match="a stiffness per area >= 0"):
        problem.with_parameter("lap.kt_per_area", -1.0)
    with pytest.raises(InputError, match=r"no parameter 'lap\.mu_per_area'"):
        problem.parameter("lap.mu_per_area")
    bare = ss.ContactPair(name="tip", contact=ss.FrictionContact(kt=1.0, mu=0.3, normal_load=1.0), tangential="x")
    with pytest.raises(InputError, match=r"no parameter 'tip\.kt_per_area'"):
        ss.Problem(problem.structure, contacts=bare, harmonics=[0, 1]).parameter("tip.kt_per_area")


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_it_is_identified(problem: ss.Problem) -> None:
    name = "lap.kt_per_area"
    truth = problem.parameter(name)
    measured = ss.forced_response(problem, omega=(16.0, 17.0)).dataset.isel(point=slice(0, None, 6))
    found = ss.identify(problem, measured, {name: 1.4 * truth})
    assert found.values[name] == pytest.approx(truth, rel=1e-4)
