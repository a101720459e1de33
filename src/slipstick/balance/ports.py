"""The contact ports of a problem: motion handed out to the laws, forces and tangents gathered from them.

Unknowns are the coefficients of the relative motion at the ports, batch by batch and port by port. A pair (cosine,
sine) is handled as the complex number ``c + i s``, which makes ``x = conj(A) f``; harmonic 0 is one more such number
with a real, static compliance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from slipstick.balance.inputs import ContactInputs
from slipstick.balance.problem import Problem
from slipstick.contact.law import Motion
from slipstick.typing import Array, ComplexArray

Forces = Sequence[Mapping[int, Array]]
"""For each batch, coefficients (n, L) by port; ports left out are zero."""
Tangents = Sequence[Mapping[tuple[int, int], Array]]
"""For each batch, ``(i, j) -> dF_i/dQ_j`` (n, L, L)."""


class PortLayout:
    """Where the ports of a problem's contacts stand among the unknowns, at the problem's harmonics.

    Attributes
    ----------
    batches
        The contacts, one ``Batch`` for each kind of law.
    orders
        Harmonics above 0, as floats.
    n_ports, n_contacts, L, size
        Numbers of ports, of contacts, of coefficients of each port, and of unknowns ``N = n_ports L``.
    """

    def __init__(self, problem: Problem) -> None:
        self.harmonics, self.batches = problem.harmonics, problem.batches
        self.orders, self.L = self.harmonics.m.astype(float), self.harmonics.size
        self.n_ports, self.n_contacts = len(problem.port_directions), len(problem.elements)
        self.size = self.n_ports * self.L

    def motion(self, k: int, x: Array, omega: float, contact_inputs: ContactInputs) -> Motion:
        """Motion of batch ``k`` at unknowns (N,), the rubbing motion included."""
        batch, X = self.batches[k], x.reshape(self.n_ports, self.L)
        moved = []
        for port, rubbing in zip(batch.ports, contact_inputs.motion, strict=True):
            if port.size == batch.count:
                moved.append(X[port.rows] + rubbing)
            else:
                Q = rubbing.copy()
                if port.size:
                    Q[port.members] += X[port.rows]
                moved.append(Q)
        return Motion(
            self.harmonics, omega, tuple(moved), contact_inputs.drift(omega), contact_inputs.velocity_per_omega
        )

    def spread(self, dx: Array) -> list[dict[int, Array]]:
        """Changes of the motion (n, L) by batch and port, of changes (N,) of the unknowns."""
        dX = dx.reshape(self.n_ports, self.L)
        by_batch: list[dict[int, Array]] = []
        for batch in self.batches:
            moved: dict[int, Array] = {}
            for i, port in enumerate(batch.ports):
                if port.size == batch.count:
                    moved[i] = dX[port.rows]
                elif port.size:
                    moved[i] = np.zeros((batch.count, self.L))
                    moved[i][port.members] = dX[port.rows]
            by_batch.append(moved)
        return by_batch

    def excitation(self, forces: Forces, P: Array | None = None) -> ComplexArray:
        """``F - P`` on all columns as complex numbers (n_columns, n + 1); without loads, on the ports alone."""
        G = np.zeros((self.n_ports + (0 if P is None else len(P)), 2 * self.orders.size + 2))
        for batch, by_port in zip(self.batches, forces, strict=True):
            for i, force in by_port.items():
                port = batch.ports[i]
                if port.size:
                    F = force if port.size == batch.count else force[port.members]
                    G[port.rows, 2:], G[port.rows, 0] = F[:, 1:], F[:, 0]
        if P is not None and len(P):
            loads = G[self.n_ports :]
            np.negative(P[:, 1:], out=loads[:, 2:])
            np.negative(P[:, 0], out=loads[:, 0])
        return G.view(complex)

    def real(self, z: ComplexArray) -> Array:
        """Complex numbers (rows, n + 1) as coefficients (rows * L,)."""
        pairs = z.view(float)
        out = np.empty((len(z), self.L))
        out[:, 0], out[:, 1:] = pairs[:, 0], pairs[:, 2:]
        return out.reshape(-1)
