"""The contact ports of a problem: motion handed out to the laws, forces and tangents gathered from them.

Unknowns are the coefficients of the relative motion at the ports, batch by batch and port by port. A pair (cosine,
sine) is handled as the complex number ``c + i s``, which makes ``x = conj(A) f``; harmonic 0 is one more such number
with a real, static compliance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from slipstick.balance.compliance import Compliance, lossless
from slipstick.balance.inputs import Given
from slipstick.balance.kinds import KINDS, MOST_UNKNOWNS, AnyCompliance, Kind, kind_of
from slipstick.balance.problem import Problem
from slipstick.contact.law import Motion
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.state.contact_state import Carried
from slipstick.structure.dynamic import adjusted
from slipstick.structure.protocol import Receptance
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray

Forces = Sequence[Mapping[int, Array]]
"""For each batch, coefficients (n, L) by port; ports left out are zero."""
Tangents = Sequence[Mapping[tuple[int, int], Array]]
"""For each batch, ``(i, j) -> dF_i/dQ_j`` (n, L, L)."""

_UNDAMPED = 1e-5
"""Imaginary part of a receptance over itself, below which there is as good as no damping."""


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

    def motion(self, k: int, x: Array, omega: float, contact_inputs: Given) -> Motion:
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


class Balance:
    """A problem made ready for the balance.

    Parameters
    ----------
    problem
        The problem; its structure is projected on the contact ports and the loads once.
    kind
        Makes the Jacobians; "dense", "iterative", or "auto": the one that ``balance/kinds.py`` chooses.

    Attributes
    ----------
    layout
        Where its ports stand; its numbers (``batches``, ``harmonics``, ``orders``, ``n_ports``, ``n_contacts``, ``L``,
        ``size``) are those of the balance.
    receptance
        From the contact forces and loads to the contact ports.
    springs
        ``k`` of ``anchor_if_undamped`` (n_ports,), or None.
    """

    def __init__(self, problem: Problem, *, kind: Kind | str = "auto") -> None:
        self._take(problem)
        self.directions = problem.direction_matrix(problem.port_directions)
        self.n_loads = len(problem.load_columns.places)
        self.receptance = self.rows_to(self.directions)
        self._asked, self.kind = kind, kind_of(kind, self.receptance, self.size)
        self.springs: Array | None = None

    def _take(self, problem: Problem) -> None:
        self.problem, self.states, self.layout = problem, problem.contact_states, PortLayout(problem)
        self.harmonics, self.orders, self.batches = self.layout.harmonics, self.layout.orders, self.layout.batches
        self.n_ports, self.n_contacts = self.layout.n_ports, self.layout.n_contacts
        self.L, self.size = self.layout.L, self.layout.size

    def narrowed(self, harmonics: Harmonics) -> Balance:
        """The same with some of the harmonics; the structure is not projected again."""
        narrow = copy(self)
        narrow._take(replace(self.problem, harmonics=harmonics, told=None))
        if self.springs is None:
            narrow.kind = kind_of(self._asked, self.receptance, narrow.size)
        return narrow

    def holding(self) -> Balance:
        """The same with every contact state held where it is handed on."""
        held = copy(self)
        held.states = tuple(state.held() for state in self.states)
        return held

    @property
    def n_states(self) -> int:
        """How many values the contact states have together."""
        return sum(len(state.names) for state in self.states)

    def by_state(self, values: Array | None) -> list[Array | None]:
        """Values (n_states,) of all contact states for each; None where there are none."""
        if values is None or len(self.states) == 1:
            return [values] * len(self.states)
        ends = np.cumsum([len(state.names) for state in self.states])
        return list(np.split(values, ends[:-1]))

    def rows_to(self, rows: Array) -> Receptance:
        """Receptance from the contact forces and loads to other directions ``rows`` (n_dofs, n_rows)."""
        return self.problem.load_columns.receptance(self.problem.structure, rows, self.directions)

    def anchor_if_undamped(self, omega: float) -> None:
        """Write the balance with springs ``i k`` on both sides where the structure has next to no damping.

        There is no such form of an iterative Jacobian: where the choice is free the dense kind is taken.

        ``R = X + B (F - i k X - P)`` with ``B = A (1 + i k A)^-1`` has the same solutions as ``X + A (F - P)`` and goes
        smoothly through the resonances at which an undamped ``A`` is infinite.
        """
        ports = np.arange(self.n_ports)
        compliance = self.kind.compliance(self.receptance, self.orders, omega, None)
        value = compliance.diagonal()[:, 1:]
        if not np.any(np.all(lossless(value, _UNDAMPED), axis=1)):
            return
        if self._asked == "auto" and self.size <= MOST_UNKNOWNS["dense"]:
            self.kind = KINDS["dense"]
        if self.kind.name != "iterative":
            static = np.abs(self.receptance.static[ports, ports])
            self.springs = np.divide(1.0, static, out=np.zeros_like(static), where=static > 0)

    def compliance(
        self,
        omega: float,
        structure: Mapping[str, float] | None = None,
        along: Mapping[str, float] | None = None,
        *,
        anchored: bool = True,
    ) -> AnyCompliance:
        """Receptances at the harmonics of ``omega``, between ports and from loads to ports: ``B``, or plainly ``A``.

        ``structure`` holds parameters of the structure that are not its own, ``along`` a direction in them.
        """
        receptance = adjusted(self.receptance, structure or {})
        compliance = self.kind.compliance(receptance, self.orders, omega, along)
        if anchored and self.springs is not None and isinstance(compliance, Compliance):
            compliance.anchor(self.springs)
        return compliance

    def anchoring(self, x: Array, G: ComplexArray) -> None:
        """Take the force of the springs ``i k`` at unknowns (N,) off the forces on all columns."""
        if self.springs is not None:
            X = np.zeros((self.n_ports, 2 * self.orders.size + 2))
            X[:, 2:] = x.reshape(self.n_ports, -1)[:, 1:]
            G[: self.n_ports] += 1j * self.springs[:, None] * X.view(complex)

    def moved_by(self, forces: Forces, P: Array, compliance: AnyCompliance) -> Array:
        """``A (F - P)`` (N,)."""
        return compliance.answer(self.layout.excitation(forces, P))

    def jacobian(self, tangents: Tangents, compliance: AnyCompliance, states: Sequence[Carried] = ()) -> Jacobian:
        """``I + A dF/dX``, with what contact states add."""
        return self.kind.jacobian(self, tangents, compliance, states)
