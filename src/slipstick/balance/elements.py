"""Tangents of one batch of contacts as a block for each element."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance
    from slipstick.state.contact_state import Carried


class Elements:
    """The elements of one batch: their port numbers (n, p), -1 where there is none, and ``dF/dX`` (n, p L, p L)."""

    def __init__(self, balance: Balance, k: int, tangents: Mapping[tuple[int, int], Array]) -> None:
        batch, L = balance.batches[k], balance.L
        n, p = batch.count, len(batch.ports)
        self.shape = n, p, L
        self.rows = np.full((n, p), -1)
        for i, port in enumerate(batch.ports):
            self.rows[port.members, i] = np.arange(balance.n_ports)[port.rows]
        tangent = np.zeros((n, p, L, p, L))
        for (i, j), part in tangents.items():
            tangent[:, i, :, j, :] = part * self._here(i, j)
        self.tangent = tangent.reshape(n, p * L, p * L)
        self.local = self.tangent  # as far as an element answers to its own motion
        self.fed_back: tuple[Array, Array, Array] | None = None

    def _here(self, *ports: int) -> Array:
        return np.asarray(np.all(self.rows[:, list(ports)] >= 0, axis=1), dtype=float)[:, None, None]

    def feed_back(self, carried: Carried) -> None:
        """Add what a state does: powers by motion (n, p L), gain (n, n), forces by the state (n, p L)."""
        n, p, L = self.shape
        power, force = np.zeros((n, p, L)), np.zeros((n, p, L))
        for j, part in carried.power.by_motion.items():
            power[:, j] = part * self._here(j)[:, 0]
        for i, part in carried.force_by_value.items():
            force[:, i] = part * self._here(i)[:, 0]
        rows, columns, gain = power.reshape(n, -1), force.reshape(n, -1), carried.gain
        self.fed_back = rows, gain, columns
        self.local = self.tangent + np.diag(gain)[:, None, None] * columns[:, :, None] * rows[:, None, :]

    def gather(self, X: Array) -> Array:
        """Values (n, p L) of the elements from those of all ports (n_ports + 1, L), whose last row is zero."""
        return X[self.rows].reshape(len(self.rows), -1)

    def at_ports(self, shapes: Array) -> Array:
        """Mode shapes (n_ports, q) at the ports of the elements, (n, p, q); zero where there is none."""
        return np.asarray(shapes[self.rows] * (self.rows >= 0)[:, :, None])

    def stiffness(self) -> Array:
        """Largest stiffness at each port, (n, p)."""
        return np.asarray(np.abs(self.local).max(axis=2).reshape(self.shape).max(axis=2))

    def scatter(self, values: Array, out: Array) -> None:
        """Values (n, p L) of the elements into those of all ports (n_ports + 1, L)."""
        out[self.rows] = values.reshape(self.shape)

    def forces(self, q: Array, *, transposed: bool = False) -> Array:
        """``dF/dX q`` for motion (n, p L) of the elements, or with the transpose."""
        tangent = self.tangent.transpose(0, 2, 1) if transposed else self.tangent
        forces = (tangent @ q[:, :, None])[:, :, 0]
        if self.fed_back is not None:
            rows, gain, columns = self.fed_back
            if transposed:
                forces += (gain.T @ np.einsum("nk,nk->n", columns, q))[:, None] * rows
            else:
                forces += (gain @ np.einsum("nk,nk->n", rows, q))[:, None] * columns
        return forces
