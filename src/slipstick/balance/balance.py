"""A problem made ready for the balance: its ports, receptances at a frequency, and the Jacobian made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.compliance import Compliance, lossless
from slipstick.balance.jacobian_backends import BACKENDS, MOST_UNKNOWNS, AnyCompliance, JacobianBackend, backend_of
from slipstick.balance.layout import Forces, PortLayout, Tangents
from slipstick.balance.problem import Problem
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.state.contact_state import Carried
from slipstick.structure.receptance import Factors, Receptance
from slipstick.structure.residuals import own_compliance
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.stuck_structure import StuckStructure

_UNDAMPED = 1e-5
"""Imaginary part of a receptance over its magnitude, below which the structure counts as undamped."""

_UNSUPPORTED = 1e12
"""Condition number of harmonic 0 above which the structure is not supported."""


_NONE = np.empty(0)


class Pulse:
    """Calls ``felt``, where it is set, at every evaluation of a balance."""

    felt: Callable[[], None] | None = None


class Balance:
    """A problem made ready for the balance.

    Parameters
    ----------
    problem
        The problem; its structure is projected on the contact ports and the loads once.
    backend
        Makes the Jacobians; "dense", "iterative", or "auto": the one that ``balance/jacobian_backends.py`` chooses.

    Attributes
    ----------
    layout
        Places of the ports; its numbers (``batches``, ``harmonics``, ``orders``, ``n_ports``, ``n_contacts``, ``L``,
        ``size``) are those of the balance.
    receptance
        From the contact forces and loads to the contact ports.
    pulse
        Of this balance and of those made from it.
    springs
        ``k`` of ``anchor_if_undamped`` (n_ports,), or None.
    support_springs
        Reference springs in harmonic 0 of a structure that only its contacts hold (n_ports,), or None.
    linear_known
        The latest linear motions, see ``balance.scaling.motions_at``.
    """

    def __init__(self, problem: Problem, *, backend: JacobianBackend | str = "auto") -> None:
        self.pulse = Pulse()
        self._take(problem)
        self.directions = problem.direction_matrix(problem.port_directions)
        self.n_loads = len(problem.load_columns.places)
        self.receptance = self.rows_to(self.directions)
        self._asked, self.backend = backend, backend_of(backend, self.receptance, self.size)
        self.springs: Array | None = None
        self.support_springs = None if problem.support is None else problem.support.springs
        self.linear_known: tuple[tuple[Any, ...], float, dict[str, Array]] | None = None
        self._stuck_known: list[StuckStructure | None] = []
        self._compliance_known: tuple[tuple[Any, ...], AnyCompliance] | None = None

    def _take(self, problem: Problem) -> None:
        self.problem, self.states, self.layout = problem, problem.contact_states, PortLayout(problem)
        self.harmonics, self.orders, self.batches = self.layout.harmonics, self.layout.orders, self.layout.batches
        self.n_ports, self.n_contacts = self.layout.n_ports, self.layout.n_contacts
        self.L, self.size = self.layout.L, self.layout.size

    def narrowed(self, harmonics: Harmonics) -> Balance:
        """The balance with some of the harmonics; the structure is not projected again."""
        narrow = copy(self)
        narrow.linear_known = narrow._compliance_known = None
        narrow._take(self.problem.narrowed(harmonics))
        if self.springs is None:
            narrow.backend = backend_of(self._asked, self.receptance, narrow.size)
        return narrow

    def nearly(self) -> Balance | None:
        """The balance without the far coupling by residuals that are solved for; None where there are none."""
        receptance = self.receptance.nearly()
        if receptance is self.receptance:
            return None
        near = copy(self)
        near.linear_known = near._compliance_known = None
        near.receptance, near._stuck_known = receptance, []
        return near

    def holding(self) -> Balance:
        """The balance with every contact state held at the value that is passed on."""
        held = copy(self)
        held.linear_known = None
        held.states = tuple(state.held() for state in self.states)
        return held

    def stuck(self, free: Factors) -> StuckStructure | None:
        """See ``stuck_structure``; made once, with the contacts and the structure as the problem has them."""
        if not self._stuck_known:
            from slipstick.balance.stuck_structure import stuck_structure

            self._stuck_known.append(stuck_structure(self, free))
        return self._stuck_known[0]

    @property
    def n_states(self) -> int:
        """Number of values of all contact states."""
        return sum(len(state.names) for state in self.states)

    def by_state(self, values: Array | None) -> list[Array | None]:
        """Values of each contact state from those of all (n_states,); None where there are none."""
        if values is None or len(self.states) == 1:
            return [values] * len(self.states)
        ends = np.cumsum([len(state.names) for state in self.states])
        return list(np.split(values, ends[:-1]))

    def rows_to(self, rows: Array) -> Receptance:
        """Receptance from the contact forces and loads to other directions ``rows`` (n_dofs, n_rows)."""
        return self.problem.load_columns.receptance(self.problem.supported_structure, rows, self.directions)

    def anchor_if_undamped(self, omega: float) -> None:
        """Write the balance with springs ``i k`` on both sides where the structure has hardly any damping.

        An iterative Jacobian has no such form: the dense one is used where the choice is free.

        ``R = X + B (F - i k X - P)`` with ``B = A (1 + i k A)^-1`` has the same solutions as ``X + A (F - P)`` and goes
        smoothly through the resonances at which an undamped ``A`` is infinite.
        """
        compliance = self.backend.compliance(self.receptance, self.orders, omega, None)
        value = compliance.diagonal()[:, 1:]
        if not np.any(np.all(lossless(value, _UNDAMPED), axis=1)):
            return
        if self._asked == "auto" and self.size <= MOST_UNKNOWNS["dense"]:
            self.backend = BACKENDS["dense"]
        if self.backend.name != "iterative":
            static = np.abs(own_compliance(self.receptance.static))
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

        ``structure`` holds parameters of the structure that are not its own, ``along`` a direction in them. Without a
        direction the latest is kept: iterations at a fixed frequency ask for the same one.
        """
        key = omega, dict(structure or {}), anchored, self.backend.name, self.springs is None
        if not along and self._compliance_known is not None and self._compliance_known[0] == key:
            return self._compliance_known[1]
        receptance = self.receptance.adjusted(structure or {})
        compliance = self.backend.compliance(receptance, self.orders, omega, along)
        if anchored and self.springs is not None and isinstance(compliance, Compliance):
            compliance.anchor(self.springs)
        if not along:
            self._compliance_known = key, compliance
        return compliance

    @property
    def anchors(self) -> tuple[Array, Array]:
        """``springs`` and ``support_springs``, empty where there are none."""
        return (
            _NONE if self.springs is None else self.springs,
            _NONE if self.support_springs is None else self.support_springs,
        )

    def anchor(self, x: Array, G: ComplexArray) -> None:
        """Subtract the force of the springs ``i k`` at unknowns (N,) from the forces on all columns."""
        if self.springs is not None:
            X = np.zeros((self.n_ports, 2 * self.orders.size + 2))
            X[:, 2:] = x.reshape(self.n_ports, -1)[:, 1:]
            G[: self.n_ports] += 1j * self.springs[:, None] * X.view(complex)

    def subtract_support(self, x: Array, G: ComplexArray) -> None:
        """Subtract the force of the reference springs in harmonic 0 from the forces on all columns."""
        if self.support_springs is not None:
            G[: self.n_ports, 0] -= self.support_springs * x.reshape(self.n_ports, self.L)[:, 0]

    def is_unsupported(self, tangents: Tangents | Array) -> bool:
        """Whether a structure that only its contacts hold is not supported in harmonic 0.

        By their tangents by batch, or their stiffness (n_ports, n_ports).
        """
        if self.support_springs is None:
            return False
        K = -np.diag(self.support_springs)
        if isinstance(tangents, np.ndarray):
            K += tangents
        else:
            for batch, by_ports in zip(self.batches, tangents, strict=True):
                for pair, tangent in by_ports.items():
                    members, felt, moving = batch.couplings[pair]
                    np.add.at(K, (felt, moving), tangent[members, 0, 0])
        still = np.eye(self.n_ports) + self.receptance.static[:, : self.n_ports] @ K
        return not np.linalg.cond(still) < _UNSUPPORTED

    def moved_by(self, forces: Forces, P: Array, compliance: AnyCompliance) -> Array:
        """``A (F - P)`` (N,)."""
        return compliance.answer(self.layout.excitation(forces, P))

    def jacobian(self, tangents: Tangents, compliance: AnyCompliance, states: Sequence[Carried] = ()) -> Jacobian:
        """``I + A dF/dX``, with what contact states add."""
        return self.backend.jacobian(self, tangents, compliance, states)
