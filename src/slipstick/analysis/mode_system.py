"""Free vibration made periodic: the balance with one mode prescribed, its frequency and its damping unknown.

``M x'' + (C - xi M) x' + K x + f = 0`` with ``q_r = a cos tau``: ``X + A'(w, xi) F - phi_r a cos tau = 0``, and of the
target mode itself ``w^2 = w_r^2 + Re(g)/a``, ``xi = 2 zeta_r w_r + eta_r w_r^2 / w + Im(g)/(a w)``, ``g`` the force on
it. Unknowns are ``(X / a, w, xi)``, the parameter is ``log a``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, isfinite

import numpy as np

from slipstick.analysis.neighbourhood import FREQUENCY, Move, Neighbourhood
from slipstick.balance.inputs import Inputs
from slipstick.balance.residual import Detail, terms
from slipstick.results.record import Outputs
from slipstick.solve.linear.eliminated import Eliminated
from slipstick.solve.linear.undefined import UndefinedJacobian
from slipstick.solve.newton import Evaluation
from slipstick.structure.modal import ModalStructure
from slipstick.structure.prescribed_mode import XI
from slipstick.typing import Array, ComplexArray


@dataclass(frozen=True, kw_only=True, slots=True)
class ModeDetail(Detail):
    """What a point of a nonlinear mode keeps of its evaluation: besides, its amplitude and what is taken of damping."""

    amplitude: float
    xi: float


@dataclass(frozen=True, kw_only=True)
class TargetMode:
    """The mode that is followed.

    Attributes
    ----------
    number
        Its place, from 0.
    square, loss, viscous
        ``w_r^2``, ``eta_r`` and ``2 zeta_r w_r``.
    scale
        Its shape at the output whose motion the amplitude is.
    """

    number: int
    square: float
    loss: float
    viscous: float
    scale: float

    @classmethod
    def of(cls, structure: ModalStructure, number: int, scale: float) -> TargetMode:
        """Of a structure given by modes."""
        w = float(structure.omega[number])
        loss = float(np.broadcast_to(structure.loss_factor, structure.omega.shape)[number])
        ratio = float(np.broadcast_to(structure.damping_ratio, structure.omega.shape)[number])
        return cls(number=number, square=w * w, loss=loss, viscous=2.0 * ratio * w, scale=scale)


class ModeSystem:
    """The system of equations for ``(X / a, w, xi)`` over ``log a``.

    Parameters
    ----------
    outputs
        Of the balance of a problem with a ``PrescribedMode``, whose last load is the motion of the mode.
    target
        The mode.
    shape
        Of the mode at the ports of the balance, (n_ports,).
    """

    def __init__(self, outputs: Outputs, target: TargetMode, shape: Array) -> None:
        self.outputs, self.balance, self.target = outputs, outputs.balance, target
        self._shape = shape / target.scale
        self._cosine = self.balance.harmonics.index(1, "c")
        self._order = self.balance.harmonics.orders.index(1)
        self._base = self.balance.problem.inputs
        self._zero = self._base.scaled(0.0)

    def start(self) -> Array:
        """The linear motion of the mode without contacts, (N + 2,)."""
        Z = np.zeros((self.balance.n_ports, self.balance.L))
        Z[:, self._cosine] = self._shape
        t = self.target
        return np.concatenate([Z.reshape(-1), [np.sqrt(t.square), t.viscous + t.loss * np.sqrt(t.square)]])

    def inputs(self, amplitude: float, xi: float) -> Inputs:
        """With the motion of the mode."""
        P = self._base.P.copy()
        P[-1, self._cosine] = amplitude
        return replace(self._base, P=P, structure={XI: xi})

    def evaluate(self, y: Array, parameter: float, context: Array | None = None) -> Evaluation:
        """Residual, Jacobian and derivative by the parameter; ``detail`` is a ``ModeDetail``."""
        if not (isfinite(y.dot(y)) and isfinite(parameter) and y[-2] > 0.0):
            return Evaluation(np.full(y.size, np.nan), UndefinedJacobian(y.size), np.full(y.size, np.nan))
        a, omega, xi = exp(parameter), float(y[-2]), float(y[-1])
        here = Neighbourhood(self.outputs, a * y[:-2], omega, self.inputs(a, xi), context)
        if here.lost or not np.all(np.isfinite(here.at.residual)) or here.jacobian.singular:
            return Evaluation(np.full(y.size, np.nan), UndefinedJacobian(y.size), np.full(y.size, np.nan))
        still = np.zeros_like(here.x)
        by_omega, by_xi = here.change(still, FREQUENCY)[0], here.structural_change({XI: 1.0})[0]
        P = np.zeros_like(self._base.P)
        P[-1, self._cosine] = a
        by_a = here.change(here.x, Move(inputs=replace(self._zero, P=P)))[0]
        own, rows = self._of_mode(here, a, omega, xi)
        heat = here.found.heat
        detail = ModeDetail(
            responses=here.found.responses, inputs=here.found.inputs, omega=omega, heat=heat, amplitude=a, xi=xi,
        )  # fmt: skip
        by_log = self._force(here, here.pushed_by(here.x)) / (a * self._stiffness) - own[2:]
        return Evaluation(
            np.concatenate([here.at.residual / a, own[:2]]),
            Eliminated(here.jacobian, np.column_stack([by_omega, by_xi]) / a, rows),
            np.concatenate([(by_a - here.at.residual) / a, by_log]),
            detail,
            lambda: np.concatenate([terms(self.balance, here.x, here.at) / a, [2.0, 2.0]]),
            None if heat is None else heat.temperature,
        )

    @property
    def _stiffness(self) -> float:
        """Of the mode in the scale of the amplitude: ``w_r^2`` over the square of the scale."""
        return self.target.square / self.target.scale**2

    def _force(self, here: Neighbourhood, G: ComplexArray) -> Array:
        """Real and imaginary part of the force on the mode, of forces (n_ports, n + 1)."""
        z = self._shape @ G[: self.balance.n_ports, self._order]
        return np.array([z.real, -z.imag])

    def _of_mode(self, here: Neighbourhood, a: float, omega: float, xi: float) -> tuple[Array, Array]:
        """The two equations of the mode with their parts by force (4,), and their gradients (2, N + 2)."""
        t, size = self.target, a * self._stiffness
        g = self._force(here, self.balance.excitation(here.found.forces)) / size
        linear = np.array([1.0 - omega**2 / t.square, t.loss + omega * (t.viscous - xi) / t.square])
        psi = np.zeros((2, self.balance.n_ports, len(self.balance.orders) + 1), dtype=complex)
        psi[0, :, self._order], psi[1, :, self._order] = self._shape, -1j * self._shape
        pulled = np.array([here.forces_pulled(p) for p in psi]) * (a / size)
        by_omega = self._force(here, here.pushed(FREQUENCY)) / size
        by_omega += np.array([-2.0 * omega, t.viscous - xi]) / t.square
        by_xi = np.array([0.0, -omega / t.square])
        return np.concatenate([linear + g, g]), np.column_stack([pulled, by_omega, by_xi])
