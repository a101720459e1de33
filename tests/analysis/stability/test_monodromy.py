"""Multipliers by exact pieces against those of exact integration in time."""

import numpy as np
import pytest
from helpers.floquet import distance, exact_multipliers
from helpers.oscillator import damper, one_mass, oscillator
from helpers.stability import chain, contact_motion, point_at, two_dofs

import slipstick as ss
from slipstick.analysis.stability.monodromy import multipliers_of, multipliers_of_each

OSCILLATOR = [
    (0.0, 10.5, [0.57832, 0.05295], 6e-5),
    (0.0, 10.78, [0.48039, 0.03716], 5e-5),
    (10.0, 4.25, [-0.57775, 0.39797], 5e-4),
    (10.0, 9.84, [0.51214 + 0.10726j, 0.51214 - 0.10726j], 6e-5),
    (50.0, 7.0, [0.61959, -0.49604], 3e-5),
]
"""Velocity, frequency, exact multipliers and the error of a published computation with ten harmonics."""


@pytest.mark.parametrize(("velocity", "omega", "exact", "error"), OSCILLATOR)
def test_the_oscillator_has_the_published_multipliers(velocity, omega, exact, error) -> None:
    found = point_at(oscillator(velocity), omega, stability=True).stability
    assert distance(found.multipliers, exact) < 2.0 * error
    assert (found.unstable, found.method, found.neutral) == (0, "PW", 0)


MOVING = ss.RubbingMotion(velocity=1.0, cos={1: 0.5, 2: 0.2}, normal_cos={2: 0.3}, normal_sin={1: 0.1})
CASES = {
    "slip, stick and separation": (two_dofs(ss.RubbingMotion(velocity=1.0)), 6.0, 3e-5),
    "no constant velocity": (two_dofs(ss.RubbingMotion()), 6.0, 3e-5),
    "the opposing surface moves both ways": (two_dofs(MOVING), 6.0, 5e-4),
    "period ratio 1/2": (two_dofs(ss.RubbingMotion(cos={1: 0.5}), period_ratio=(1, 2)), 3.0, 6e-4),
    "static residual": (chain(8, gap=-0.05, velocity=1.0), 3.1, 6e-5),
    "static residual, separation and stick": (chain(4, gap=0.02, velocity=0.0), 3.1, 5e-4),
}


@pytest.mark.parametrize("name", CASES)
def test_multipliers_are_those_of_integration_in_time(name) -> None:
    problem, omega, error = CASES[name]
    point = point_at(problem, omega, stability=True)
    exact = exact_multipliers(problem, omega, *contact_motion(problem, point))
    assert exact is not None
    assert distance(point.stability.multipliers, exact[0]) < error


def test_a_contact_stuck_all_period_is_neutral_and_a_spring() -> None:
    """Without slip the oscillator is linear: multipliers of mass, damper and both springs; nothing at 1."""
    problem = one_mass(damper(normal_load=1e6), force=1.0)
    found = point_at(problem, 5.0, stability=True).stability
    exponent = -0.2 + 1j * np.sqrt(140.0 - 0.04)
    wanted = np.exp(np.array([exponent, np.conj(exponent)]) * 2.0 * np.pi / 5.0)
    assert found.neutral == 1
    assert distance(found.multipliers, wanted) < 1e-13
    assert found.multipliers.size == 2


def test_a_contact_that_only_slides_has_the_multipliers_of_its_linear_system() -> None:
    """The friction force follows the normal one: K gets mu kn beside its diagonal, unsymmetric."""
    problem = two_dofs(ss.RubbingMotion(velocity=100.0), gap=-5.0)
    found = point_at(problem, 6.0, stability=True).stability
    K = np.array([[60.0, -15.0 + 0.4 * 60.0], [-15.0, 45.0 + 60.0]])
    A = np.block([[np.zeros((2, 2)), np.eye(2)], [-K, -0.4 * np.eye(2)]])
    wanted = np.exp(np.linalg.eigvals(A) * 2.0 * np.pi / 6.0)
    assert distance(found.multipliers, wanted) < 1e-13


def test_static_modes_change_the_leading_multipliers_little() -> None:
    problem = chain(16, gap=-0.05, velocity=1.0, harmonics=4)
    some, every = (point_at(problem, 3.1, stability=asked).stability for asked in (True, "full"))
    assert some.multipliers.size < every.multipliers.size
    assert np.abs(some.multipliers[:6] - every.multipliers[:6]).max() < 1e-3


@pytest.mark.parametrize("size", [0, 1, 2, 5, 12])
def test_multipliers_are_all_eigenvalues_the_largest_first(size: int) -> None:
    matrix = np.random.default_rng(size).standard_normal((size, size))
    found = multipliers_of(matrix)
    assert found.dtype == complex
    assert np.all(np.diff(np.abs(found)) <= 1e-12)
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(np.linalg.eigvals(matrix)), atol=1e-12)
    (together,) = multipliers_of_each([matrix])
    np.testing.assert_allclose(together, found, atol=1e-12)


def test_a_map_that_is_not_finite_has_no_multipliers() -> None:
    for entry in (np.nan, np.inf):
        with pytest.raises(np.linalg.LinAlgError, match="not finite"):
            multipliers_of(np.array([[1.0, entry], [0.0, 1.0]]))
