"""The periodic state of a structure of many modes by Newton's method on its slow modes alone (THEORY.md (12.3)).

Modes far above the forcing follow the forces on them nearly as static flexibilities. With these instead of them the
period map and its derivative are small. Its periodic state, the fast modes added to it, is carried over a period of
the whole structure; what is missing there is corrected by the derivative of the small map, and mode by mode for what
the fast modes do beside following. This is repeated until the period of the whole structure closes: what was left out
costs periods, not accuracy.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from slipstick.analysis.time_domain.event_integrator import Stepper
from slipstick.analysis.time_domain.initial_state import with_forces
from slipstick.analysis.time_domain.piecewise import Combination, PiecewiseLinear
from slipstick.typing import Array, IntArray

_FAST = 64.0
"""Frequency of fast modes over that of the fastest forcing, at least."""
_FEWEST_FAST = 24
"""So many have to be fast."""


@dataclass(frozen=True, eq=False)
class SlowModes:
    """A system without the dynamics of its fast modes, and what brings the states of both together."""

    whole: Stepper
    stepper: Stepper
    """Of the slow modes."""
    slow: IntArray
    """Numbers of the slow modes, (k,)."""
    fast: IntArray
    stiffness: Array
    """Of the fast modes, per unit of tau, (n - k,)."""
    damping: Array

    @classmethod
    def of(cls, whole: Stepper) -> SlowModes | None:
        """None where too few modes are fast, or modes are coupled beside the contacts, or laws other than friction act:
        they are not known where a structure answers at once."""
        system = whole.model.system
        own = whole.model.modal_rates
        if own is None or system.laws:
            return None
        K, C = own
        is_fast = (_FAST * max(1, *system.orders, 1)) ** 2 < K
        fast, slow = np.flatnonzero(is_fast), np.flatnonzero(~is_fast)
        if len(fast) < max(_FEWEST_FAST, len(slow)):
            return None
        e = system.equations
        left = e.columns[fast] / (system.omega**2 * K[fast, None])
        equations = replace(
            e, M=e.M[np.ix_(slow, slow)], C=e.C[np.ix_(slow, slow)], K=e.K[np.ix_(slow, slow)], rows=e.rows[:, slow],
            columns=e.columns[slow], feedthrough=e.feedthrough + e.rows[:, fast] @ left,
        )  # fmt: skip
        few = Stepper(PiecewiseLinear(replace(system, equations=equations)))
        return cls(whole, few, slow, fast, K[fast], C[fast])

    def restricted(self, z: Array, states: Combination) -> Array:
        """The small state, with the friction forces that contacts have."""
        return with_forces(self.stepper, self._parts(z)[0], states, self.whole.model(states).fx @ z)[0]

    def followed(self, few: Array, states: Combination) -> Array:
        """The state of all modes whose fast ones follow the forces on them."""
        linear = self.stepper.model(states)
        left = self.whole.model.loaded_columns[self.fast] / self.stiffness[:, None]
        forces = linear.acting @ np.stack([few, linear.A @ few], axis=1)
        return self._joined(few, (left @ forces).T.reshape(-1))

    def corrected(
        self, z: Array, end: Array, states: Combination, Phi: Array, shares: Mapping[Combination, float]
    ) -> Array:
        """Start of a period that closes better than one from z to ``end``.

        ``Phi`` is the derivative of the small period map, ``shares`` how much of the period each combination takes.
        """
        (few, fast), (few_end, fast_end) = self._parts(z), self._parts(end)
        keep = self.stepper.model.system.unknowns(states)
        step = np.zeros(len(few))
        matrix, missing = np.eye(len(keep)) - Phi[np.ix_(keep, keep)], few_end - few
        step[keep] = np.linalg.lstsq(matrix, missing[keep], rcond=1e-13)[0]
        return self._joined(few + step, fast + self._alone(shares, fast_end - fast))

    def _alone(self, shares: Mapping[Combination, float], missing: Array) -> Array:
        """Start of free vibrations of the fast modes, each for itself, that change by ``-missing`` in a period."""
        from scipy.linalg import expm

        model, count = self.whole.model, len(self.fast)
        loaded, stiffness = model.loaded_columns[self.fast], self.stiffness.copy()
        for states, share in shares.items():
            stiffness -= share * np.sum(loaded * model(states).acting[:, self.fast].T, axis=1)
        A = np.zeros((count, 2, 2))
        A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = 1.0, -stiffness, -self.damping
        matrix = np.eye(2) - expm(2.0 * np.pi * A)
        return np.linalg.solve(matrix, missing.reshape(2, count).T[:, :, None])[:, :, 0].T.reshape(-1)

    def _parts(self, z: Array) -> tuple[Array, Array]:
        """The small state, and motion and velocity of the fast modes."""
        n = self.whole.model.system.n
        few = np.concatenate([z[self.slow], z[n + self.slow], z[2 * n :]])
        return few, np.concatenate([z[self.fast], z[n + self.fast]])

    def _joined(self, few: Array, fast: Array) -> Array:
        n, k, out = self.whole.model.system.n, len(self.slow), np.empty(self.whole.model.system.size)
        out[self.slow], out[n + self.slow], out[2 * n :] = few[:k], few[k : 2 * k], few[2 * k :]
        out[self.fast], out[n + self.fast] = np.split(fast, 2)
        return out
