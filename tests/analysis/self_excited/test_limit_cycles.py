"""Limit cycles against exact ones (shooting with exact events), closed forms, time integration and invariances."""

import numpy as np
import pytest
from helpers.floquet import distance
from helpers.stability import brake

import slipstick as ss
from slipstick.results.view import analysis_of

EXACT = {
    0.55: (9.994471, (0.856465, 0.654091, -0.111258), 5e-6, 7e-5),
    0.60: (9.997968, (0.855578, 0.484814, -0.452871), 7e-8, 1e-5),
    0.70: (10.008139, (0.856545, -0.605612, 0.216157), 8e-6, 4e-5),
}
"""Frequency and multipliers by mu, by shooting with exact events; errors of ten harmonics."""
_DIGIT = 5e-7
"""Half of the last digit of those frequencies."""


@pytest.fixture(scope="module")
def squeal():
    return ss.limit_cycles(brake(), "pad.mu", (0.4, 0.8), at=tuple(EXACT))


@pytest.mark.parametrize("mu", EXACT)
def test_cycles_are_the_exact_ones(squeal, mu):
    omega, multipliers, error, spread = EXACT[mu]
    point = squeal.at(mu)
    data = squeal.dataset.isel(point=point)
    assert float(data.parameter) == mu
    assert int(data.branch_part) == 1
    assert abs(float(data.omega) - omega) < 1.2 * error + _DIGIT
    found = [complex(*m) for m in data.multiplier.values if np.isfinite(m[0])]
    assert len(found) == len(multipliers)  # the one of a shift in time is left out
    assert distance(found, multipliers) < 2.0 * spread
    assert int(data.stable) == 1
    assert float(data.hill_pw_difference) < 1e-3


def test_time_integration_comes_to_the_cycle_from_rest(squeal):
    """With the exact frequency the motion repeats: nothing of the balance is in this."""
    point, omega = squeal.at(0.7), EXACT[0.7][0]
    data = squeal.dataset.isel(point=point)
    problem = brake(mu=0.7)
    found = ss.transient(problem, omega, method="march", periods=120, tolerance=1e-15)
    assert found.change < 2.0 * np.pi * _DIGIT
    np.testing.assert_allclose(found.amplitude, data.amplitude.values, rtol=5e-5)
    np.testing.assert_allclose(found.mean, data["mean"].values, rtol=5e-5)
    np.testing.assert_allclose(found.power, data.dissipated_power.values, rtol=5e-5)
    check = squeal.check_in_time(point)
    assert check.converged
    assert check.relative_difference < 2e-5


def at(branch, mu):
    data = branch.dataset.isel(point=branch.at(mu))
    assert float(data.parameter) == mu
    assert int(data.branch_part) == 1
    return float(data.omega), data.amplitude.values, data.multiplier_max.values


def test_the_same_however_it_is_given(squeal):
    """Two half pads, modes instead of matrices, five times the length; from a longer range."""
    omega, amplitude, multiplier = at(squeal, 0.6)
    squared, shapes = np.linalg.eigh([[100.0, -20.0], [-20.0, 60.0]])
    modal = ss.ModalStructure(
        omega=np.sqrt(squared), mode_shapes=shapes, static_compliance=(shapes / squared) @ shapes.T, dofs=["x", "y"],
        damping_ratio=0.25 / np.sqrt(squared),
    )  # fmt: skip
    for problem, parameter, factor in (
        (brake(pads=2), "*.mu", 1.0), (brake(structure=modal), "pad.mu", 1.0), (brake(scale=5.0), "pad.mu", 5.0),
        (brake(velocity=-1.0), "pad.mu", None),
    ):  # fmt: skip
        if factor is None:  # sliding the other way lifts off where this one digs in
            branch = ss.limit_cycles(problem, parameter, (0.3, 0.62))
            assert branch.outcome is ss.Outcome.COMPLETED
            assert "stable" in branch.message
            continue
        other = at(ss.limit_cycles(problem, parameter, (0.3, 0.62), at=0.6), 0.6)
        assert other[0] == pytest.approx(omega, rel=1e-9)
        np.testing.assert_allclose(other[1], factor * amplitude, rtol=1e-8)
        assert other[2] == pytest.approx(multiplier, rel=1e-6)


def test_over_another_parameter_and_backwards():
    """More damping from the stable side: the cycle at the other values is the same."""
    exact = EXACT[0.6]
    branch = ss.limit_cycles(brake(mu=0.6, damping=0.5), "damping", (2.5, 0.9), at=1.0)
    hopf = branch.bifurcations()[-1]
    assert hopf.kind == "Hopf"
    # c^2 100 = 20 (24 - 20) at the Hopf point
    assert hopf.value * 0.5 == pytest.approx(np.sqrt(0.8), rel=1e-9)
    assert float(branch.dataset.omega[branch.at(1.0)]) == pytest.approx(exact[0], abs=1e-6)


def test_nothing_begins_by_itself_in_a_stable_range():
    branch = ss.limit_cycles(brake(), "pad.mu", (0.1, 0.5))
    assert branch.outcome is ss.Outcome.COMPLETED
    assert "steady sliding is stable over the whole range of pad.mu" in branch.message
    assert set(branch.dataset.branch_part.values) == {2}


def test_an_unstable_range_says_where_to_begin():
    branch = ss.limit_cycles(brake(), "pad.mu", (0.6, 0.7))
    assert branch.outcome is ss.Outcome.NO_FIRST_POINT
    assert "begin where it is stable" in branch.message


def test_a_branch_is_stored_drawn_and_reported(squeal, tmp_path):
    again = ss.load(squeal.save(tmp_path / "squeal.nc"))
    assert analysis_of(again.dataset) == "cycles"
    shaken = ss.forced_response(brake_shaken(), omega=(5.0, 6.0), options={"max_points": 2})
    assert analysis_of(shaken.dataset) == "response"
    np.testing.assert_array_equal(again.dataset.omega, squeal.dataset.omega)
    axes = squeal.plot.response("y")
    assert "Hopf" in axes.get_legend_handles_labels()[1]
    assert squeal.report(tmp_path / "squeal.html").stat().st_size > 10_000


def test_what_is_not_known_of_limit_cycles_is_refused(squeal):
    with pytest.raises(ss.InputError, match="integrate in time"):
        squeal.subharmonic(3)


def brake_shaken():
    base = brake()
    return ss.Problem(
        base.structure, contacts=base.contacts, loads=[*base.loads, ss.Load(dof="y", sin=10.0)], harmonics=range(4)
    )


def heated():
    base = brake()
    curve = ss.FrictionCurve(temperature=[20.0, 400.0], mu=[0.6, 0.4])
    thermal = ss.ThermalModel(curve=curve, background=20.0, resistance=1e-3)
    return ss.Problem(base.structure, contacts=base.contacts, loads=base.loads, harmonics=range(4), thermal=thermal)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize(
    ("problem", "parameter", "said"),
    [
        (brake_shaken, "pad.mu", "load 'y': it excites at harmonic 1; expected harmonic 0 alone"),
        (lambda: brake(cos={1: 0.1}), "pad.mu", "the rubbing motion has cos1; expected a constant velocity alone"),
        (lambda: brake(), "pad.cos1", "the rubbing motion has cos1; expected a constant velocity alone"),
        (heated, "pad.kt", "heated contacts is not known"),
        (lambda: brake(harmonics=1), "pad.mu", "harmonic 1 is left out"),
    ],
)
def test_what_varies_by_itself_is_refused(problem, parameter, said):
    with pytest.raises(ss.InputError) as caught:
        ss.limit_cycles(problem(), parameter, (0.4, 0.6))
    assert said in str(caught.value)


def test_options_that_mean_nothing_here_are_refused():
    for options in ({"jacobian": "iterative"}, {"adapt_harmonics": 1e-3}):
        with pytest.raises(ss.InputError, match="limit cycles are computed with"):
            ss.limit_cycles(brake(), "pad.mu", (0.4, 0.6), options=options)
