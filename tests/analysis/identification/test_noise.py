"""Standard errors under noise of several kinds, and what in residuals is no noise."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.identification.kinds import Vibration
from slipstick.analysis.identification.noise import robust, too_large, whiteness, without_levels

TRUE = {"damper.kt": 100.0, "damper.mu": 0.3, "damping": 1.0}
START = {"damper.kt": 90.0, "damper.mu": 0.27, "damping": 1.1}
LEVELS, FREQUENCIES = [2.0, 5.0, 10.0], np.linspace(6.0, 13.0, 12)


def problem(**contact: float) -> ss.Problem:
    """Slipping in some points of the highest levels only: they alone tell friction."""
    return one_mass(damper(**({"normal_load": 20.0} | contact)), harmonics=range(6))


@cache
def response() -> np.ndarray:
    """Complex amplitudes (level, frequency)."""
    rows = []
    for level in LEVELS:
        branch = ss.steady_response(problem().with_parameter("load.x.amplitude", level), omega=FREQUENCIES)
        c, s = branch.dataset.displacement.values[:, 0, 1:3].T
        rows.append(c - 1j * s)
    return np.array(rows)


def measured(z: np.ndarray) -> xr.Dataset:
    return xr.Dataset(
        {"displacement": (("load.x.amplitude", "omega", "dof"), z[..., None])},
        coords={"load.x.amplitude": LEVELS, "omega": FREQUENCIES, "dof": ["x"]},
    )


def noisy(kind: str, seed: int) -> xr.Dataset:
    z = response()
    rng = np.random.default_rng(seed)
    size = {"relative": np.abs(z), "equal": np.sqrt(np.mean(np.abs(z) ** 2))}[kind]
    noise = (rng.standard_normal(z.shape) + 1j * rng.standard_normal(z.shape)) / np.sqrt(2.0)
    return measured(z + 0.01 * size * noise)


def over_standard_errors(kind: str, seeds: range) -> np.ndarray:
    """Root mean square of the errors over what is said of them, by parameter."""
    off = []
    for seed in seeds:
        found = ss.identify(problem(), noisy(kind, seed), START)
        assert (found.weights != "") == (kind == "relative")
        assert not found.warnings
        off.append([(found.values[name] - TRUE[name]) / found.standard_errors[name] for name in TRUE])
    return np.sqrt(np.mean(np.square(off), axis=0))


@pytest.mark.verify
@pytest.mark.parametrize("kind", ["relative", "equal"])
def test_errors_are_as_large_as_they_are_said_to_be(kind: str) -> None:
    """Ten seeds: within the spread of a chi square of ten, 0.6 to 1.5 at 99 %."""
    share = over_standard_errors(kind, range(10))
    assert np.all((share > 0.6) & (share < 1.6)), share


def test_noise_that_grows_with_what_is_measured() -> None:
    """Found from what is left, or given: the same weights, and the values of least squares with these."""
    data = noisy("relative", 0)
    found = ss.identify(problem(), data, START)
    told = ss.identify(problem(), data, START, relative_noise=0.01)
    assert found.relative_noise == pytest.approx(0.01, rel=0.2)
    assert "of each complex number" in found.weights
    assert told.reduced_chi_square == pytest.approx((found.relative_noise / 0.01) ** 2, rel=0.02)
    for name, value in TRUE.items():
        assert abs(found.values[name] - value) < 3.0 * found.standard_errors[name]
        assert told.values[name] == pytest.approx(found.values[name], rel=1e-4)
        ratio = found.standard_errors[name] / told.standard_errors[name]
        assert ratio == pytest.approx(found.relative_noise / 0.01, rel=0.02)
    spread = told.dataset.standard_deviation.values[..., 0, 1]
    fitted = told.dataset.fitted.values
    np.testing.assert_allclose(spread, 0.01 * np.hypot(fitted[..., 0, 1], fitted[..., 0, 2]) / np.sqrt(2), rtol=1e-2)
    assert found.dataset.attrs["weights"] in found.summary()
    with raises_fault("relative_noise", says="between 0 and 1"):
        ss.identify(problem(), data, START, relative_noise=1.0)


def test_noise_larger_than_what_was_given_makes_errors_larger() -> None:
    data = noisy("relative", 0)
    right = ss.identify(problem(), data, TRUE, relative_noise=0.01)
    with pytest.warns(ss.SlipstickWarning, match="times the noise that was given"):
        small = ss.identify(problem(), data, TRUE, relative_noise=0.001)
    for name in TRUE:
        expected = right.standard_errors[name] * np.sqrt(right.reduced_chi_square)
        assert small.standard_errors[name] == pytest.approx(expected, rel=1e-3)


def test_what_the_model_lacks_is_not_white() -> None:
    """Smooth changes of 3 % over frequency, as of another law: no noise, and standard errors grow."""
    smooth = 1.0 + 0.03 * np.sin(FREQUENCIES)
    with pytest.warns(ss.SlipstickWarning, match="the residual is not white") as caught:
        found = ss.identify(problem(), measured(response() * smooth), TRUE)
    assert [str(each.message) for each in caught] == [*found.warnings]
    assert found.warnings[0] in found.summary()
    assert found.converged


def linear(m: int, n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (m, n) and residuals of a linear fit of white noise."""
    rng = np.random.default_rng(seed)
    J, noise = rng.standard_normal((m, n)), rng.standard_normal(m)
    return J, noise - J @ np.linalg.lstsq(J, noise, rcond=None)[0]


def test_what_is_told_of_white_noise_is_told_rarely() -> None:
    """A thousand fits of white noise: the correlation has mean 0 and deviation 1, and is told in one of a thousand."""
    pairs = np.column_stack([np.arange(39), np.arange(1, 40)])
    found = []
    for seed in range(1000):
        J, left = linear(40, 5, seed)
        deviation = float(np.sqrt(left @ left / 35))
        found.append(whiteness(pairs, left, J, deviation))
    z = np.array([each.deviations for each in found])
    assert abs(z.mean()) < 0.1
    assert z.std() == pytest.approx(1.0, abs=0.1)
    assert sum(each.significant for each in found) <= 3
    assert whiteness(pairs, np.sin(0.3 * np.arange(40)), np.ones((40, 1)), 0.7).significant


def test_errors_from_the_residuals_are_those_of_the_noise_on_average() -> None:
    """Of equal noise; of noise that is large where one parameter is determined they are larger, as they should."""
    factors, told = [], 0
    for seed in range(300):
        J, left = linear(40, 2, seed)
        gain = np.linalg.pinv(J)
        found = robust(gain, left, J, 1.0)
        factors.append(found.factor**2)
        told += int(found.significant.any())
    assert np.mean(factors) == pytest.approx(1.0, abs=0.05)
    assert told <= 5
    J = np.zeros((120, 2))
    J[:60, 0], J[60:, 1] = 1.0, 1.0
    noise = np.random.default_rng(0).standard_normal(120) * np.repeat([0.1, 3.0], 60)
    left = noise - J @ np.linalg.lstsq(J, noise, rcond=None)[0]
    found = robust(np.linalg.pinv(J), left, J, float(np.sqrt(left @ left / 118)))
    assert found.significant.tolist() == [False, True]
    assert found.factor[1] > 1.3


def test_a_level_left_out() -> None:
    """Against the linear fit without it; told where the level does not agree."""
    rng = np.random.default_rng(1)
    omega, level = np.tile(np.arange(1.0, 11.0), 3), np.repeat([1.0, 2.0, 3.0], 10)
    points = Vibration(omega=omega, conditions={"load": level}, dofs=("x",), values=np.ones((30, 1)), noise=None)
    used, J = np.ones((30, 1), dtype=bool), rng.standard_normal((30, 2))
    for shift, told in ((0.0, [False] * 3), (8.0, [False, False, True])):
        data = rng.standard_normal(30) + shift * J[:, 0] * (level == 3.0)
        p = np.linalg.lstsq(J, data, rcond=None)[0]
        found = without_levels(points, used, J @ p - data, J, 1.0, 28)
        for each, value in zip(found, [1.0, 2.0, 3.0], strict=True):
            kept = level != value
            np.testing.assert_allclose(p + each.shift, np.linalg.lstsq(J[kept], data[kept], rcond=None)[0])
        assert found[2].level == "load = 3"
        assert found[2].significant == told[2]
    assert not too_large(1.3, 60)
    assert too_large(2.0, 60)


def test_a_parameter_without_effect_has_no_residuals_to_compare() -> None:
    """As the friction coefficient of a test in which all stick; the errors of the others are as without it."""
    rng = np.random.default_rng(3)
    J, left = np.c_[np.linspace(1.0, 2.0, 20), np.zeros(20)], rng.standard_normal(20)
    gain = np.vstack([J[:, 0] / (J[:, 0] @ J[:, 0]), np.zeros(20)])
    both, alone = robust(gain, left, J, 1.0), robust(gain[:1], left, J[:, :1], 1.0)
    assert both.factor.tolist() == [pytest.approx(alone.factor[0], rel=1e-12), 1.0]
    assert both.significant.tolist() == [alone.significant[0], False]
