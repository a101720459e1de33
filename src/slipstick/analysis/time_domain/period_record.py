"""What one period of a time integration amounts to: harmonic coefficients, extremes, power, state fractions.

Coefficients are integrals over the pieces between state changes by Gauss quadrature on the exact polynomials of each
piece: kinks cost no accuracy, and no sampling theorem is involved.
"""

from __future__ import annotations

import numpy as np

from slipstick.analysis.time_domain.event_integrator import Piece, StateChange, Stepper
from slipstick.analysis.time_domain.piecewise import LinearPiece, State
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_NODES, _WEIGHTS = (_NODES + 1) / 2, _WEIGHTS / 2
_PARTS = 4
"""Of the steps of laws that switch, which are long: extremes are those of a cubic in each."""


class PeriodRecord:
    """Collects the pieces of one period; state lives here because the pieces come one by one."""

    def __init__(self, stepper: Stepper, harmonics: Harmonics) -> None:
        system = stepper.model.system
        self._stepper, self._harmonics, self._nc = stepper, harmonics, system.n_contacts
        self._n_motions = len(system.equations.rows)
        self._law_ports = system.laws.n_ports
        self._integral = np.zeros((harmonics.size, self._n_motions + 2 * self._nc))
        self._time_in_state = np.zeros((self._nc, len(State)))
        self.time_in_regime = [np.zeros(len(contact.regimes.names)) for contact in system.laws.switching]
        """Fractions of the period in the regimes of each contact whose law switches."""
        self.work = np.zeros(self._nc)
        """Energy a period / (2 pi) of each friction contact."""
        self.law_work = np.zeros(system.laws.n_ports)
        """The same along each port of other laws."""
        self.tau: list[float] = []
        self.changes: list[StateChange] = []
        self._values: list[Array] = []
        self._slopes: list[Array] = []
        self._widths: list[float] = []

    def add(self, item: Piece | StateChange) -> None:
        """Takes the next piece or state change."""
        if isinstance(item, StateChange):
            self.changes.append(item)
            return
        linear, step = item.linear, self._stepper.step
        rows, split = _recorded(linear)
        path = self._stepper.path(item)
        powers = self._stepper.seen_path(item) @ rows
        values, _, rates = np.split(
            np.vander(item.fraction * _NODES, len(path), increasing=True) @ powers, split, axis=1
        )
        width = item.fraction * step
        H = self._harmonics.H_plus(item.tau + width * _NODES) * (_WEIGHTS * width / np.pi)[:, None]
        self._integral += H.T @ values
        fx = values[:, self._n_motions : self._n_motions + self._nc]
        self.work += (_WEIGHTS * width / (2 * np.pi)) @ (fx * rates)
        if self._law_ports:
            z, model = np.vander(item.fraction * _NODES, len(path), increasing=True) @ path, self._stepper.model
            q, velocity, memory = model.law_motion(linear, z)
            forces = model.system.laws.rate(q, velocity, memory, linear.regimes)[0]
            self.law_work += (_WEIGHTS * width / (2 * np.pi)) @ (forces * velocity) / model.system.omega
        for j, state in enumerate(item.states[: self._nc]):
            self._time_in_state[j, state] += width / (2 * np.pi)
        for own, regime in zip(self.time_in_regime, linear.regimes, strict=True):
            own[regime] += width / (2 * np.pi)
        parts = _PARTS if linear.regimes else 1
        at = item.fraction * np.arange(parts + 1) / parts
        values, slopes, _ = np.split(np.vander(at, len(path), increasing=True) @ powers, split, axis=1)
        for k in range(parts):
            self.tau.append(item.tau + at[k] * step)
            self._widths.append(width / parts)
            self._values.append(values[k : k + 2])
            self._slopes.append(slopes[k : k + 2])

    @property
    def fractions(self) -> Array:
        """Fraction of the period in each ``State``, (n_contacts, 4)."""
        return self._time_in_state

    @property
    def coefficients(self) -> tuple[Array, Array, Array]:
        """Coefficients of the motions (n_rows, L), the friction and the normal forces (n_contacts, L)."""
        motions, fx, fy = np.split(self._integral.T, [self._n_motions, self._n_motions + self._nc])
        return motions, fx, fy

    def series(self) -> tuple[Array, Array, Array, Array]:
        """Phase (n,), motions (n, n_rows), friction and normal forces (n, n_contacts), at the starts of the pieces."""
        first = np.array([values[0] for values in self._values])
        motions, fx, fy = np.split(first, [self._n_motions, self._n_motions + self._nc], axis=1)
        return np.array(self.tau), motions, fx, fy

    def extremes(self) -> tuple[Array, Array]:
        """Smallest and largest value of each motion over the period, from the cubic of each piece."""
        values = np.array(self._values)[:, :, : self._n_motions]
        a, b = values[:, 0], values[:, 1]
        width = np.array(self._widths)[:, None]
        da, db = (np.array(self._slopes)[:, k] * width for k in (0, 1))
        low, high = np.minimum(a, b).min(axis=0), np.maximum(a, b).max(axis=0)
        c3, c2 = da + db - 2 * (b - a), 3 * (b - a) - 2 * da - db
        turns = da * db < 0
        with np.errstate(all="ignore"):
            root = np.sqrt(np.maximum(c2**2 - 3 * c3 * da, 0.0))
            # the stable form of the root of 3 c3 s^2 + 2 c2 s + da that lies in (0, 1)
            s = np.where(da > 0, -da / (c2 - root), -da / (c2 + root))
            inner = np.where(turns, a + s * (da + s * (c2 + s * c3)), a)
        inner = np.where(np.isfinite(inner) & turns, inner, a)
        return np.minimum(low, inner.min(axis=0)), np.maximum(high, inner.max(axis=0))


def _recorded(linear: LinearPiece) -> tuple[Array, list[int]]:
    """Columns that z is looked at along: motions and forces, rates of the motions, rates of the contacts; where they
    are split."""
    if "recorded" not in linear.cache:
        parts = [np.vstack([linear.motion, linear.fx, linear.fy]), linear.rates_of(linear.motion), linear.rate]
        split = np.cumsum([len(part) for part in parts])[:-1].tolist()
        linear.cache["recorded"] = np.ascontiguousarray(np.vstack(parts).T), split
    return linear.cache["recorded"]  # type: ignore[return-value]
