"""Closed forms of friction contacts and oscillators, shared by ``slipstick verify`` and the tests.

Notation of THEORY.md: ``x`` tangential, ``y`` normal relative motion over ``tau = omega t``, ``v = velocity / omega``,
``N`` a constant normal load, ``b = mu N``. Friction forces resist the motion (they act on the left-hand side).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.special import lambertw

PI = np.pi


@dataclass(frozen=True, kw_only=True)
class Masing:
    """First harmonic and energy of the Masing loop."""

    energy: float
    cos: float
    sin: float


def masing(A: float, kt: float, b: float) -> Masing:
    """CF1: no rubbing, ``x = A cos tau`` with ``A > b / kt``: friction force coefficients and energy a period."""
    theta = np.arccos(1 - 2 * b / (kt * A))
    return Masing(
        energy=4 * b * (A - b / kt),
        cos=kt * A / PI * (theta - np.sin(2 * theta) / 2),
        sin=-4 * b / PI * (1 - b / (kt * A)),
    )


def rigid_coulomb(A: float, v: float, b: float) -> tuple[float, float]:
    """CF2: rigid friction under rubbing, ``x = A sin tau``, ``|v| < A``: constant and cosine coefficient."""
    return 2 * b / PI * np.arcsin(v / A), 4 * b / PI * np.sqrt(1 - (v / A) ** 2)


def sticks_a_period(A: float, v: float, kt: float, b: float) -> int:
    """CF3: number of stick intervals a period for ``x = A sin tau``, v > 0, constant normal load."""
    if v >= A:
        return 0
    return 1 if kt * (np.sqrt(A**2 - v**2) - v * np.arccos(v / A)) < b else 2


def one_stick(A: float, v: float, kt: float, b: float) -> tuple[float, float, float]:
    """CF3: start and end of the stick interval and the constant friction force, where there is one stick a period."""
    start = np.arccos(-v / A)

    def moved(tau: float) -> float:
        return A * np.sin(tau) + v * tau - A * np.sin(start) - v * start

    end = brentq(moved, start + np.arccos(v / A), start + 2 * PI, xtol=1e-15)
    stuck = (
        A * (np.cos(start) - np.cos(end))
        + v * (end**2 - start**2) / 2
        - (A * np.sin(start) + v * start) * (end - start)
    )
    return start, end, b + kt / (2 * PI) * stuck


def slow_rubbing(A: float, kt: float, b: float) -> tuple[float, float]:
    """CF4: the limit v -> 0+ for ``x = A sin tau``, ``kt A < b``: constant and sine coefficient."""
    return b - kt * A, kt * A


def slip_power(mu: float, N: float, velocity: float, kn: float, A: float, y1: float, omega: float) -> float:
    """CF5: power in full slip with ``x = A sin tau``, ``y = y1 cos tau``, velocity > 0."""
    return mu * N * velocity + mu * kn * y1 * A * omega / 2


def normal_vibration_slip_velocity(mu: float, kn: float, kt: float, y1: float, omega: float) -> float:
    """CF6: smallest rubbing velocity without stick where only the normal load vibrates, ``y = y1 cos tau``."""
    return mu * kn / kt * y1 * omega


def normal_vibration_slow(mu: float, N: float, kn: float, y1: float) -> float:
    """CF6: constant friction force in the limit of slow rubbing: the least limit over the period."""
    return mu * (N - kn * y1)


def separation(Y0: float, Yc: float, gap: float, kn: float) -> tuple[float, float]:
    """CF7: constant and cosine coefficient of the normal force for ``y = Y0 + Yc cos tau`` that leaves contact."""
    beta = np.arccos((gap - Y0) / Yc)
    constant = kn / PI * ((Y0 - gap) * beta + Yc * np.sin(beta))
    return constant, kn / PI * (2 * (Y0 - gap) * np.sin(beta) + Yc * (beta + np.sin(2 * beta) / 2))


def temperature_rational(R: float, N: float, velocity: float, mu0: float, a: float) -> float:
    """CF8: temperature rise where ``mu = mu0 / (1 + a rise)``, in full slip: a quadratic."""
    q = R * N * velocity * mu0
    return q if a == 0 else (-1 + np.sqrt(1 + 4 * a * q)) / (2 * a)


def temperature_exponential(R: float, N: float, velocity: float, mu0: float, b: float) -> float:
    """CF8: temperature rise where ``mu = mu0 exp(-b rise)``, in full slip: a Lambert W."""
    return float(lambertw(b * R * N * velocity * mu0).real / b)


def den_hartog(m: float, k: float, p: float, b: float, omega: float) -> float:
    """CF9: amplitude of the undamped oscillator with rigid Coulomb friction in non-stop motion (Den Hartog 1931)."""
    ratio = omega / np.sqrt(k / m)
    direct = 1 / (1 - ratio**2)
    friction = np.sin(PI / ratio) / (ratio * (1 + np.cos(PI / ratio)))
    return p / k * np.sqrt(direct**2 - (b / p * friction) ** 2)


def slip_threshold(m: float, c: float, k: float, p: float, omega: float) -> float:
    """CF10: smallest rubbing velocity at which the oscillator under ``p sin omega t`` never sticks."""
    return omega * p / abs(k - m * omega**2 + 1j * omega * c)
