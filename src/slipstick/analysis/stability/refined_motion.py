"""The motion at the contacts once more through the structure, with four times as many harmonics (THEORY.md (11.1)).

The forces at a solution have harmonics beyond those that were kept. What they move is added: the motion becomes
smoother, and the times at which contacts change their states become accurate.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipstick.contact.forces import ContactForces, element_forces
from slipstick.results.truncation import moved
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance
    from slipstick.balance.residual import Detail

WIDER = 4
"""Times the highest harmonic kept."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SmoothMotion:
    """Motion and forces of n contacts in many harmonics, (n, L') each; the rubbing motion is included."""

    harmonics: Harmonics
    X: Array
    Y: Array
    own: tuple[Array, Array]
    """What of X and Y is the rubbing motion."""
    force: tuple[Array, Array]
    """Friction and normal forces that the iteration began with."""
    given: dict[str, Array]
    """``v, kt, mu, kn, gap`` as ``element_forces`` takes them."""


class Iteration:
    """What one iteration needs of a balance, made once a branch."""

    def __init__(self, balance: Balance) -> None:
        self._balance, h = balance, balance.harmonics
        self.wide = Harmonics(range(max(1, WIDER * h.highest) + 1))
        self._kept = self._columns(h.orders)
        self._known: dict[bytes, tuple[Array, NDArray[np.intp]]] = {}

    def truncated(self, x: Array, detail: Detail) -> SmoothMotion:
        """The motion of the contacts at a solution (N,) in the harmonics of the balance."""
        (inputs,), balance = detail.inputs.batches, self._balance
        motion, response = balance.motion(0, x, detail.omega, inputs), detail.responses[0]
        return SmoothMotion(
            harmonics=balance.harmonics, X=motion.Q[0], Y=motion.Q[1], own=(inputs.motion[0], inputs.motion[1]),
            force=(response.force[0], response.force[1]), given={**response.values, "v": motion.drift[0]},
        )  # fmt: skip

    def __call__(self, x: Array, detail: Detail) -> SmoothMotion:
        """The iterated motion of the contacts at a solution (N,)."""
        balance, (batch,), (inputs,) = self._balance, self._balance.batches, detail.inputs.batches
        motion = balance.motion(0, x, detail.omega, inputs)
        given = {**detail.responses[0].values, "v": motion.drift[0]}
        X, Y, *own = (self._spread(part) for part in (*motion.Q, *inputs.motion))
        found: ContactForces = element_forces(self.wide, X, Y, **given)
        further, columns = self._further(x, detail)
        force = np.zeros((balance.n_ports + balance.n_loads, len(columns)))
        for port, coefficients in zip(batch.ports, (found.Fx, found.Fy), strict=True):
            force[port.rows] = coefficients[port.members][:, columns]
        omega = np.array([detail.omega])
        added = moved(balance.receptance, further, force[None], omega, [detail.inputs.structure])[0]
        for port, coefficients in zip(batch.ports, (X, Y), strict=True):
            coefficients[np.ix_(np.arange(batch.count)[port.members], columns)] += added[port.rows, 1:]
        return SmoothMotion(
            harmonics=self.wide, X=X, Y=Y, own=(own[0], own[1]), force=(found.Fx, found.Fy), given=given
        )

    def _further(self, x: Array, detail: Detail) -> tuple[Array, NDArray[np.intp]]:
        """Orders whose motion is not known, and their columns: those left out, and kept ones not in use at a point."""
        h = self._balance.harmonics
        in_use = np.ones(h.n, dtype=bool)
        if detail.adapted is not None:
            used = np.any(x.reshape(self._balance.n_ports, -1) != 0.0, axis=0)
            in_use = used[1::2] | used[2::2]
        key = in_use.tobytes()
        if key not in self._known:
            orders = sorted(set(self.wide.orders) - {0, *h.m[in_use].tolist()})
            self._known[key] = np.array(orders, dtype=float), self._columns(orders)[1:]
        return self._known[key]

    def _columns(self, orders: Iterable[int]) -> NDArray[np.intp]:
        """Places of the coefficients of some orders, 0 the first of them."""
        above = (m for m in orders if m)
        return np.array([0, *(self.wide.index(m, part) for m in above for part in ("c", "s"))], dtype=np.intp)

    def _spread(self, own: Array) -> Array:
        out = np.zeros((len(own), self.wide.size))
        out[:, self._kept] = own
        return out
