"""One period's coefficients, extremes, power and fractions against dense samples of the same pieces."""

import numpy as np
import pytest

from slipstick.analysis.time_domain.event_integrator import Piece, Stepper
from slipstick.analysis.time_domain.initial_state import start_at_rest
from slipstick.analysis.time_domain.period_record import PeriodRecord
from slipstick.analysis.time_domain.piecewise import PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system
from slipstick.analysis.time_domain.shooting import periods
from slipstick.verify.cases import oscillator

OMEGA, VELOCITY = 4.2, 10.0


@pytest.fixture(scope="module")
def recorded():
    """The record of a periodic motion, and dense samples of its pieces: phase, motion, friction force."""
    problem = oscillator(velocity=VELOCITY)
    stepper = Stepper(PiecewiseLinear(friction_system(problem, OMEGA)))
    z, states = start_at_rest(stepper)
    for end in periods(stepper, z, states, shooting=True):
        if end.change < 1e-12:
            break
    record, samples = PeriodRecord(stepper, problem.harmonics), []
    for item in stepper.period(end.z, end.states):
        record.add(item)
        if isinstance(item, Piece):
            for s in np.linspace(0.0, item.fraction, 40):
                state = s ** np.arange(stepper.degree + 1) @ stepper.powers(item.linear, item.start)
                samples.append((item.tau + s * stepper.step, item.linear.motion[0] @ state, item.linear.fx[0] @ state))
    return problem, record, np.array(samples).T


def trapezoid(t, values):
    return np.sum(np.diff(t)[:, None] * (values[1:] + values[:-1]) / 2, axis=0)


def test_coefficients(recorded):
    problem, record, (t, x, f) = recorded
    H = problem.harmonics.H_plus(t) / np.pi
    motions, friction, _ = record.coefficients
    np.testing.assert_allclose(motions[0], trapezoid(t, x[:, None] * H), atol=1e-6 * np.abs(x).max())
    np.testing.assert_allclose(friction[0], trapezoid(t, f[:, None] * H), atol=1e-6 * 240.0)


def test_extremes_power_and_fractions(recorded):
    _, record, (t, x, f) = recorded
    low, high = record.extremes()
    assert low[0] == pytest.approx(x.min(), abs=1e-7 * np.ptp(x))
    assert high[0] == pytest.approx(x.max(), abs=1e-7 * np.ptp(x))
    np.testing.assert_allclose(record.fractions.sum(axis=1), 1.0, atol=1e-12)
    work = np.sum(0.5 * (f[1:] + f[:-1]) * (np.diff(x) + VELOCITY / OMEGA * np.diff(t))) / (2 * np.pi)
    assert record.work[0] == pytest.approx(work, rel=1e-6)


def test_series_are_the_starts_of_the_pieces(recorded):
    _, record, (t, x, f) = recorded
    tau, motions, friction, _ = record.series()
    np.testing.assert_allclose(motions[:, 0], np.interp(tau, t, x), atol=1e-9 * np.abs(x).max())
    np.testing.assert_allclose(friction[:, 0], np.interp(tau, t, f), atol=1e-6 * 240.0)
    assert record.tau == sorted(record.tau)


@pytest.mark.parametrize("seed", range(20))
def test_the_extreme_within_a_piece_is_that_of_its_cubic(recorded, seed):
    """A piece with ends, slopes and width at random, whose inner extremes numpy's roots give."""
    problem, _, _ = recorded
    record = PeriodRecord(Stepper(PiecewiseLinear(friction_system(problem, OMEGA))), problem.harmonics)
    rng = np.random.default_rng(seed)
    a, b, da, db = rng.standard_normal(4)
    width = rng.uniform(0.1, 0.5)
    n = record._n_motions
    record._values.append(np.tile([[a], [b]], (1, n + 2)))
    record._slopes.append(np.tile([[da / width], [-abs(db) * np.sign(da) / width]], (1, n)))
    record.tau.append(0.0)
    record._widths.append(width)
    db = -abs(db) * np.sign(da)
    cubic = np.polynomial.Polynomial([a, da, 3 * (b - a) - 2 * da - db, da + db - 2 * (b - a)])
    turns = [s.real for s in cubic.deriv().roots() if abs(s.imag) < 1e-12 and 0.0 < s.real < 1.0]
    expected = [a, b, *map(cubic, turns)]
    low, high = record.extremes()
    assert low[0] == pytest.approx(min(expected), abs=1e-12)
    assert high[0] == pytest.approx(max(expected), abs=1e-12)
