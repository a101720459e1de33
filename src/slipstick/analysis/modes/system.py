"""Free vibration as periodic motion: the balance with one mode separated, frequency and damping unknown.

``M x'' + (C - xi M) x' + K x + f = 0``. In harmonic 1 the target mode r of the structure without contacts, of which
the receptance is infinite at its resonance, has a motion ``q`` of its own: ``X + A'(w, xi) F - phi_r q = 0`` and
``(w_r^2 (1 + i eta_r) - w^2 + i w (2 zeta_r w_r - xi)) q + g = 0`` with ``g`` the force on it. Two more equations fix
size and phase. Unknowns are ``(X / A, q / A, w, xi)``, the parameter is ``log A``. The static part of ``X`` is divided
by ``sqrt(A^2 + b^2)``, ``b`` its size at rest.

``A`` is the size of the motion over all harmonics (M. Krack and J. Gross, Harmonic Balance for Nonlinear Vibration
Problems, 2019, section 2.5). In an internal resonance another mode vibrates in a higher harmonic: harmonic 1 may vanish
there, ``A`` does not. With ``at_dof`` it is the amplitude of harmonic 1 at the output instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import exp, isfinite

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered, extended
from slipstick.analysis.sensitivity.linearization import FREQUENCY, Linearization, Move
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs
from slipstick.errors import InputError
from slipstick.results.record import Outputs
from slipstick.solve.norm import norm
from slipstick.structure.modal import ModalStructure
from slipstick.structure.prescribed_mode import XI, CoupledModes
from slipstick.typing import AnyArray, Array, ComplexArray

_TRANSVERSAL = 0.5
"""Cosine between a shift in time and the direction of the phase condition, below which that direction is renewed."""

_STEP = 1e-6
"""Relative step of a parameter for differences of the equations."""
_CURVATURE, _ROUNDING = 1e-2, 1e-10
"""Second difference over the first, above which the equations have a corner; and its rounding."""

_EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, kw_only=True, slots=True)
class ModeDetail(Detail):
    """Further quantities of an evaluation at a point of a nonlinear mode.

    Attributes
    ----------
    size
        ``A``, the size of the motion over all harmonics.
    xi
        Damping that is subtracted, 1/time.
    at_dof
        Phasor of harmonic 1 at the output (cosine minus i times sine), length.
    modal
        Phasors of the mass-normalised modal coordinates, (n_modes,).
    """

    size: float
    xi: float
    at_dof: complex
    modal: ComplexArray

    @property
    def amplitude(self) -> float:
        """Amplitude of harmonic 1 at the output."""
        return abs(self.at_dof)


class TargetMode:
    """The separated mode: one of the structure without contacts.

    Attributes
    ----------
    number
        Its number, from 0.
    square, loss, viscous
        ``w_r^2``, ``eta_r`` and ``2 zeta_r w_r``.
    scale
        Norm of its shape at contact ports and output.
    shape
        Its shape at the ports of the balance over ``scale``, (n_ports,).
    """

    def __init__(
        self, structure: ModalStructure, number: int, ports: Array, at_dof: Array, viscous: Array | None = None
    ) -> None:
        w = float(structure.omega[number])
        self.number, self.square = number, w * w
        self.loss = float(np.broadcast_to(structure.loss_factor, structure.omega.shape)[number])
        self.viscous = 2.0 * w * float(np.broadcast_to(structure.damping_ratio, structure.omega.shape)[number])
        self.scale = float(np.hypot(norm(ports[:, number]), at_dof[number]))
        self.shape: Array = ports[:, number] / self.scale
        self._coupled = None if viscous is None else CoupledModes(structure, viscous, number)
        self._ports = ports

    def answer(self, omega: float, xi: float) -> tuple[ComplexArray, AnyArray]:
        """Its dynamic stiffness over ``square``, and its shape at the ports over ``scale``.

        With their derivatives by frequency and by ``xi``: (3,) and (3, n_ports). Modes that damping couples to it move
        with it.
        """
        if self._coupled is not None:
            modes, stiffness = self._coupled.carried(omega, xi)
            return stiffness / self.square, modes @ self._ports.T / self.scale
        drag = (self.viscous - xi) / self.square
        stiffness = np.array([
            complex(1.0 - omega**2 / self.square, self.loss + omega * drag),
            complex(-2.0 * omega / self.square, drag), complex(0.0, -omega / self.square),
        ])  # fmt: skip
        return stiffness, np.stack([self.shape, 0.0 * self.shape, 0.0 * self.shape])

    def coordinates(self, forces: ComplexArray, q: complex, omega: float, xi: float) -> ComplexArray | None:
        """Modal coordinates (n_modes,) under modal ``forces``, the target at ``q``; None where nothing couples them."""
        if self._coupled is None:
            return None
        o = self._coupled.others
        out = q * self._coupled.carried(omega, xi)[0][0]
        out[o] -= np.linalg.solve(self._coupled.dynamic(omega, xi)[0][np.ix_(o, o)], forces[o])
        return out


class ModeSystem(Augmented):
    """The system of equations for ``(X / A, q / A, w, xi)`` over ``log A``.

    The ``context`` is the direction of the phase condition, a shift in time of an earlier point, with the contact
    states there.

    Parameters
    ----------
    outputs
        Outputs of the balance of a problem with a ``PrescribedMode``, whose last load is the motion of the mode. The
        amplitude is that of the first output.
    structure, ports
        The modes, and their shapes at the ports of the balance (n_ports, n_modes).
    target
        The separated mode.
    reference
        A motion (N + 2,) of ports and mode, length: the first phase condition is the phase of this motion.
    at_dof
        Whether ``A`` is the amplitude of harmonic 1 at the output.
    """

    def __init__(
        self, outputs: Outputs, structure: ModalStructure, ports: Array, target: TargetMode, reference: Array, *,
        at_dof: bool = False,
    ) -> None:  # fmt: skip
        self.outputs, self.balance, self.target, self._at_dof = outputs, outputs.balance, target, at_dof
        self._ports, b = ports, self.balance
        self._stiffness = structure.omega**2 * (1.0 + 1j * structure.loss_factor)
        self._damping = 2.0 * structure.damping_ratio * structure.omega
        harmonics = b.harmonics
        self._pair = [harmonics.index(1, part) for part in "cs"]
        self._order = harmonics.orders.index(1)
        self._base = b.problem.inputs
        self._zero = self._base.scaled(0.0)
        self.vibration = np.append(np.tile(np.arange(b.L) > 0, b.n_ports), [True, True])
        self._reference = self.shifted(reference) / norm(self.shifted(reference))
        self._rest = float(np.abs(reference[~self.vibration]).max(initial=0.0))

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.balance.size + 4

    def sizes(self, A: float) -> Array:
        """Divisors of the motion of ports and mode (N + 2,)."""
        return np.where(self.vibration, A, np.hypot(A, self._rest))

    def shifted(self, motion: Array) -> Array:
        """Derivative by the phase of a motion (N + 2,) of ports and mode."""
        X = motion[:-2].reshape(self.balance.n_ports, -1)
        out, m = np.zeros_like(X), self.balance.orders
        out[:, 1::2], out[:, 2::2] = m * X[:, 2::2], -m * X[:, 1::2]
        return np.append(out.reshape(-1), [motion[-1], -motion[-2]])

    def turned(self, motion: Array, angle: float) -> Array:
        """A motion of ports and mode (N + 2,), or of ports (N,), advanced by ``angle`` in harmonic 1."""
        n = self.balance.size
        X = motion[:n].reshape(self.balance.n_ports, -1).copy()
        turn = np.exp(1j * angle * self.balance.orders)
        z = (X[:, 1::2] - 1j * X[:, 2::2]) * turn
        X[:, 1::2], X[:, 2::2] = z.real, -z.imag
        q = motion[n:]
        coordinate = complex(q[0], -q[1]) * np.exp(1j * angle) if q.size else 0.0j
        return np.append(X.reshape(-1), [coordinate.real, -coordinate.imag][: q.size])

    def inputs(self, q: Sequence[float] | Array, xi: float) -> Inputs:
        """Inputs with the motion ``q`` (2,) of the mode, cosine and sine."""
        P = self._base.P.copy()
        P[-1, self._pair] = q
        return replace(self._base, P=P, structure={XI: xi})

    def context(self, near: Array | None) -> Array | None:
        """Context of points near contact states (n_states,); None without states."""
        return None if near is None else np.append(self._reference, near)

    def state(self, y: Array, parameter: float, context: Array | None = None) -> Bordered | None:
        """The balance with the equations of the mode, its size and its phase; ``detail`` is a ``ModeDetail``."""
        if not (isfinite(y.dot(y)) and isfinite(parameter) and abs(parameter) < 600.0 and y[-2] > 0.0):
            return None
        reference, near, n = self._reference, None, self._reference.size
        if context is not None:
            reference, near = context[:n], context[n:] if context.size > n else None
        A, omega, xi, motion = exp(parameter), float(y[-2]), float(y[-1]), y[:-2]
        sizes = self.sizes(A)[:-2]
        q = A * y[-4:-2]
        here = Linearization(self.outputs, sizes * y[:-4], omega, self.inputs(q, xi), near)
        if here.lost or not np.all(np.isfinite(here.at.residual)):
            return None
        pushed, grown = here.pushed(FREQUENCY), A * A / sizes * y[:-4]  # dx / dlog A
        of_mode = np.column_stack(self._columns_of_mode(here))
        columns = np.column_stack([A * of_mode, *self._other_columns(here, pushed)]) / sizes[:, None]
        by_log = here.jacobian.multiply(grown) + of_mode @ q - here.at.residual * (A / sizes) ** 2
        equation, rows, equation_by_log = self._of_mode(here, A, y, pushed, grown)
        U = here.motion()[0]
        size, row, rate = self._of_dof(here, A, U, y, grown) if self._at_dof else self._of_size(motion)
        rows[:, :-4] *= sizes
        shift = self.shifted(motion)
        turned, carried = reference, here.detail.carried
        if reference @ shift < _TRANSVERSAL * norm(shift):
            turned = shift / norm(shift)
        return Bordered(
            here, extended(here.jacobian, sizes, columns, np.vstack([rows, row, [*reference, 0.0, 0.0]])),
            np.concatenate([equation, [size, reference @ motion]]), np.array([2.0, 2.0, 2.0, 1.0]),
            lambda way: self._along(here, A, way), np.concatenate([by_log / sizes, equation_by_log, [rate, 0.0]]),
            ModeDetail(
                responses=here.detail.responses, inputs=here.detail.inputs, omega=omega, states=here.detail.states,
                size=A,
                xi=xi, at_dof=complex(U[self._pair[0]], -U[self._pair[1]]), modal=self._modal(here, q, omega, xi),
            ),
            turned if carried is None else np.append(turned, carried), sizes,
        )  # fmt: skip

    def with_mode(self, x: Array, omega: float, xi: float, motion: Array, near: Array | None = None) -> Array:
        """Motion (N + 2,) of ports and mode, from the motion of ports (N,) and first output (L,) at a solution."""
        here, still = Linearization(self.outputs, x, omega, self.inputs((0.0, 0.0), xi), near), np.zeros_like(x)
        units = [self.inputs(q, 0.0) for q in ((1.0, 0.0), (0.0, 1.0))]
        P = [np.where(np.arange(len(i.P))[:, None] == len(i.P) - 1, i.P, 0.0) for i in units]
        moves = [here.change(still, Move(inputs=replace(self._zero, P=load))) for load in P]
        known = np.concatenate([here.at.residual, here.motion()[0] - motion])
        return np.append(x, -np.linalg.lstsq(np.column_stack([np.append(R, U[0]) for R, U in moves]), known)[0])

    def _columns_of_mode(self, here: Linearization) -> list[Array]:
        """Derivatives of the balance by the motion of the mode, cosine and sine."""
        columns = []
        for unit in (1.0, 1.0j):
            G = np.zeros((self.balance.n_ports + len(self._base.P), len(self.balance.orders) + 1), dtype=complex)
            G[-1, self._order] = -unit
            columns.append(here.at.compliance.answer(G))
        return columns

    def _other_columns(self, here: Linearization, pushed: ComplexArray) -> Array:
        """Derivatives of the balance by frequency and damping; ``pushed`` are those of the forces by the frequency."""
        at = here.at
        by_omega = at.compliance.answer(pushed) + at.compliance.rate(at.G)
        return np.array([by_omega, here.structural_change({XI: 1.0})[0]])

    def _force(self, shape: AnyArray, G: ComplexArray) -> Array:
        """Real and imaginary part of the force on a shape (n_ports,), of forces (n_ports, n + 1)."""
        z = np.conj(shape) @ G[: self.balance.n_ports, self._order]
        return np.array([z.real, -z.imag])

    def _of_mode(
        self, here: Linearization, A: float, y: Array, pushed: ComplexArray, grown: Array
    ) -> tuple[Array, Array, Array]:
        """The two equations of the mode over its stiffness, their gradients (2, N + 4), derivatives by ``log A``.

        Gradients are by the motion of the ports in lengths; ``grown`` (N,) is its derivative by ``log A``.
        """
        t, (c, s, omega, xi) = self.target, y[-4:]
        stiffness = t.square / t.scale**2
        dynamic, (shape, *turned) = t.answer(omega, xi)
        by_q, by_w, by_drag = (np.array([[z.real, z.imag], [z.imag, -z.real]]) for z in dynamic)
        forces = self.balance.layout.excitation(here.detail.forces)
        g = self._force(shape, forces) / (A * stiffness)
        psi = np.zeros((2, self.balance.n_ports, len(self.balance.orders) + 1), dtype=complex)
        psi[0, :, self._order], psi[1, :, self._order] = shape, -1j * shape
        pulled = np.array([here.forces_pulled(p) for p in psi]) / (A * stiffness)
        by_omega = (self._force(shape, pushed) + self._force(turned[0], forces)) / (A * stiffness)
        by_omega += by_w @ np.array([c, s])
        by_xi = self._force(turned[1], forces) / (A * stiffness) + by_drag @ np.array([c, s])
        rows = np.column_stack([pulled, by_q, by_omega, by_xi])
        return by_q @ y[-4:-2] + g, rows, pulled @ grown - g

    def _of_size(self, motion: Array) -> tuple[float, Array, float]:
        """The equation of the size over all harmonics, its gradient (N + 4,), its derivative by ``log A``."""
        vibration = np.where(self.vibration, motion, 0.0)
        return float(vibration @ vibration) - 1.0, np.append(2.0 * vibration, [0.0, 0.0]), 0.0

    def _of_dof(self, here: Linearization, A: float, U: Array, y: Array, grown: Array) -> tuple[float, Array, float]:
        """The equation of the size as harmonic 1 at the output, whose motion is ``U`` (L,); as ``_of_size``."""
        still, h = np.zeros_like(here.x), self._level(A, U)
        P = np.zeros((2, *self._base.P.shape))
        P[[0, 1], -1, self._pair] = 1.0
        moves = [here.change(still, Move(inputs=replace(self._zero, P=load)))[1] for load in P]
        others = [here.change(still, FREQUENCY)[1], here.structural_change({XI: 1.0})[1]]
        rates = np.array([A * np.sum(h * dU) for dU in moves] + [np.sum(h * dU) for dU in others])
        pulled, level = here.pull(h=h), float(U[self._pair] @ U[self._pair]) / A**2
        row = np.append(self.sizes(A)[:-2] * pulled, rates)
        return level - 1.0, row, float(pulled @ grown + rates[:2] @ y[-4:-2]) - 2.0 * level

    def _level(self, A: float, U: Array) -> Array:
        """Gradient (n_outputs, L) of the square of harmonic 1 at the first output, whose motion ``U`` is (L,)."""
        h = np.zeros((len(self.outputs), self.balance.L))
        h[0, self._pair] = 2.0 * U[self._pair] / A**2
        return h

    def _along(self, here: Linearization, A: float, way: Move) -> Array:
        """Derivatives (4,) of the further equations along a direction of contacts."""
        t, size = self.target, 0.0
        shape = t.answer(here.omega, here.inputs.structure[XI])[1][0]
        if self._at_dof:
            size = float(np.sum(self._level(A, here.motion()[0]) * here.change(np.zeros_like(here.x), way)[1]))
        return np.append(self._force(shape, here.pushed(way)) / (A * t.square / t.scale**2), [size, 0.0])

    def moved(self, at: Bordered, dy: Array, direction: Move) -> tuple[Array, Move]:
        """The change of motion (N,), and of frequency, motion of the mode and subtracted damping."""
        *q, omega, xi = dy[-4:].tolist()
        inputs = direction.inputs or self._zero
        P = inputs.P.copy()
        P[-1, self._pair] += at.detail.size * np.array(q)
        return at.units * dy[:-4], Move(omega, replace(inputs, P=P, structure={XI: xi}))

    def compared(
        self, y: Array, parameter: float, here: ModeSystem, context: Array | None = None
    ) -> tuple[Array, Array]:
        """Residual (N + 4,) and motion of the outputs at the motion that ``y`` describes in ``here``, another system.

        Sizes are those of ``here``; the equation of the phase is left out.
        """
        n, own, other = self.balance.size, self.sizes(exp(parameter)), here.sizes(exp(parameter))
        at = self.state(np.append(y[:-2] * other / own, y[-2:]), parameter, context)
        if at is None:
            return np.full(y.size, np.nan), np.full((len(self.outputs), self.balance.L), np.nan)
        return np.concatenate([at.here.at.residual / other[:n], at.values[:-1], [0.0]]), at.here.motion()

    def _modal(self, here: Linearization, q: Array, omega: float, xi: float) -> ComplexArray:
        """Mass-normalised modal coordinates of harmonic 1, (n_modes,)."""
        G = self.balance.layout.excitation(here.detail.forces)[:, self._order]
        known = self.target.coordinates(
            self._ports.T @ G.conj(), complex(q[0], -q[1]) / self.target.scale, omega, xi
        )  # fmt: skip
        if known is not None:
            return known
        dynamic = self._stiffness + omega * (1j * (self._damping - xi) - omega)
        least = _EPS * np.abs(self._stiffness)
        coordinates = -(self._ports.T @ G.conj()) / np.where(np.abs(dynamic) < least, least, dynamic)
        coordinates[self.target.number] = complex(q[0], -q[1]) / self.target.scale
        return np.asarray(coordinates)


def damping_rate(y: Array, dy: Array) -> float:
    """Change of the damping ratio ``xi / (2 w)`` for a change of the unknowns, both (N + 4,)."""
    return float((dy[-1] - y[-1] / y[-2] * dy[-2]) / (2.0 * y[-2]))


class BothSides:
    """The equations of a mode on both sides of the value of a parameter, for differences.

    Parameters
    ----------
    system
        Makes the equations at a value. Where it raises InputError, differences are one-sided.
    """

    def __init__(self, system: Callable[[float], ModeSystem], value: float) -> None:
        self._step = _STEP * (abs(value) or 1.0)
        try:
            other = {-1: system(value - self._step)}
        except InputError:
            other = {2: system(value + 2.0 * self._step)}
        self._sides = {1: system(value + self._step), **other}

    def rates(
        self, here: ModeSystem, y: Array, parameter: float, context: Array | None = None
    ) -> tuple[Array, Array, bool]:
        """Derivatives of the residual (N + 4,) and of the motion of the outputs at a solution ``y`` of ``here``.

        The third value is whether the residual has neither jump nor corner there.
        """
        up, other = (self._sides[k].compared(y, parameter, here, context) for k in self._sides)
        if -1 in self._sides:
            R, U = ((a - b) / (2.0 * self._step) for a, b in zip(up, other, strict=True))
            second = 0.5 * (up[0] + other[0])  # the residual is 0 at a solution
        else:
            at = here.compared(y, parameter, here, context)
            R, U = ((4.0 * b - c - 3.0 * a) / (2.0 * self._step) for a, b, c in zip(at, up, other, strict=True))
            second = up[0] - 0.5 * other[0]
        return R, U, norm(second) <= _CURVATURE * norm(up[0]) + _ROUNDING
