"""The harmonic form: exact where nothing changes, the balance's Jacobian at 0, the published accuracy elsewhere."""

import numpy as np
import pytest
from helpers.floquet import distance
from helpers.oscillator import oscillator
from helpers.stability import point_at, two_dofs

import slipstick as ss
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.analysis.stability.harmonic_form import HarmonicForm
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Balanced, detail

CASES = [
    (0.0, 10.5, [0.57832, 0.05295], 3e-4),
    (10.0, 4.25, [-0.57775, 0.39797], 5e-4),
    (10.0, 9.84, [0.51214 + 0.10726j, 0.51214 - 0.10726j], 6e-5),
    (50.0, 7.0, [0.61959, -0.49604], 2e-4),
]
"""Velocity, frequency, exact multipliers and the published error of the form."""


def watched(problem, omega):
    point = point_at(problem, omega)
    watch = StabilityWatch(Balance(problem))
    return watch, point, watch.form(point.x, point.detail)


@pytest.mark.parametrize(("velocity", "omega", "exact", "error"), CASES)
def test_exponents_are_those_that_were_published(velocity, omega, exact, error) -> None:
    _, _, form = watched(oscillator(velocity), omega)
    period = 2.0 * np.pi / omega
    found = [form.exponent(np.log(complex(m)) / period) for m in exact]
    assert distance(np.exp(np.array(found) * period), exact) < 2.0 * error


def test_at_zero_it_is_the_jacobian_of_the_balance() -> None:
    """The same matrix in complex numbers: its determinant is that of the Jacobian in real ones."""
    problem = two_dofs(ss.RubbingMotion(velocity=1.0))
    _, point, form = watched(problem, 6.0)
    balance = Balance(problem)
    found = detail(balance, point.x, 6.0, problem.inputs)
    jacobian = Balanced(balance, point.x, found, balance.compliance(6.0)).jacobian
    dense = np.column_stack([jacobian.multiply(column) for column in np.eye(balance.size)])
    sign, size = np.linalg.slogdet(form.matrix(0.0))
    assert np.allclose([sign.real, size], np.linalg.slogdet(dense), rtol=1e-9)


@pytest.mark.parametrize("exponent", [0.3 + 1.1j, -0.7, 2.0j, 1e-12])
def test_the_memory_of_a_stick_is_its_integral(exponent) -> None:
    """``h`` of each stick by quadrature."""
    _, _, form = watched(oscillator(10.0), 4.25)
    stick = form.sticks[0]
    tau = stick.start + stick.length * (np.polynomial.legendre.leggauss(60)[0] + 1.0) / 2.0
    weights = np.polynomial.legendre.leggauss(60)[1] * stick.length / 2.0
    k = form.orders
    decay = np.exp(-exponent / form.omega * (tau - stick.start))
    h = np.exp(-1j * np.outer(k, tau)) @ (weights * decay) / (2.0 * np.pi)
    wanted = -form.contacts.kt[0] * np.outer(h, np.exp(1j * k * stick.start))
    alone = HarmonicForm(
        omega=form.omega, orders=k, contacts=form.contacts, fixed=0.0 * form.fixed, sticks=(stick,),
        answers=form.answers, neutral=0,
    )  # fmt: skip
    assert np.abs(alone.contact_answer(exponent)[0, :, 0, :] - wanted).max() < 1e-12


def test_both_methods_are_compared_where_that_is_asked_for() -> None:
    watch, point, _ = watched(oscillator(10.0), 4.25)
    assert np.isnan(watch.at(point.x, point.detail).difference)
    assert 1e-6 < watch.difference(point.x, point.detail, watch.at(point.x, point.detail)) < 2e-3


def test_a_form_that_runs_away_gives_nothing() -> None:
    _, _, form = watched(oscillator(250.0), 6.0)
    assert form.exponent(3.0 + 1.0j) is None
