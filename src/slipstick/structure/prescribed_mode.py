"""A structure with one mode whose motion is prescribed, for nonlinear modes by extended periodic motion.

``M x'' + (C - xi M) x' + K x + f = 0``: in the modes every ``D_r(m w)`` has ``2 zeta_r w_r - xi`` for its damping. The
motion of the target mode is prescribed in harmonic 1; it is one more load shape, ``MODE``.

Viscous damping may couple the modes: ``D = modes^T C modes``. The motion of the others by the target is then
eliminated. With ``Z = diag(w_r^2 (1 + i eta_r) - w^2) + i w (D - xi)``, the target r and the others o, these move by
``-v`` times the target, ``v = Z_oo^-1 Z_or``. So the target has the shape ``phi_r - phi_o v``, along which forces act
on it too, and the dynamic stiffness ``Z_rr - Z_ro v``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError
from slipstick.structure.modal import ModalStructure
from slipstick.structure.protocol import Structure, TimeEquations
from slipstick.structure.receptance import Factors, Receptance, SummedReceptance
from slipstick.structure.residuals import WrittenResiduals
from slipstick.structure.truncation import Truncation
from slipstick.typing import Array, ComplexArray

MODE = "mode"
"""The load shape that is the motion of the target mode, in the length that its own shape is scaled to."""

XI = "xi"
"""The parameter: damping over mass that is subtracted from all modes, 1/time."""

_EPS = float(np.finfo(float).eps)
_SAME_LOSS = 1e-14
"""Relative difference of loss factors that is rounding."""


class PrescribedMode(Structure):
    """A ``ModalStructure`` whose mode number ``target`` (from 0) has a prescribed motion in harmonic 1.

    ``scale`` divides the mode shape: its motion of amplitude 1 is 1 where the shape is ``scale``.
    ``viscous`` is the damping between the modes (n_modes, n_modes) where it couples them.
    """

    sparse_directions = True

    def __init__(self, structure: ModalStructure, target: int, scale: float, viscous: Array | None = None) -> None:
        self._viscous = viscous
        self._structure, self.target, self.scale, self.xi = structure, target, scale, 0.0

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self._structure.dofs

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Those of the structure, and the mode."""
        return (*self._structure.load_shapes, MODE)

    @property
    def natural_frequencies(self) -> Array:
        """Of the structure without contacts, rad/s."""
        return self._structure.natural_frequencies

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Errors by the modes that the structure leaves out."""
        return self._structure.truncations(order)

    @property
    def values(self) -> dict[str, float]:
        """The damping that is subtracted."""
        return {XI: self.xi}

    def changed(self, **values: float) -> PrescribedMode:
        """A copy with another damping subtracted."""
        new = copy(self)
        new.xi = values.get(XI, self.xi)
        return new

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance; the load shape ``MODE`` adds the motion of the mode as the last column."""
        others = [shape for shape in shapes if shape != MODE]
        if MODE in shapes and list(shapes) != [*others, MODE]:
            raise InputError("the mode is the last of the load shapes")
        left, right, static, second = self._structure.modal_parts(rows, columns, others)
        mode = self.scale if MODE in shapes else None
        left_out = LeftOut(self._structure, left, right, static, second, width=0 if mode is None else 1)
        if self._viscous is not None:
            modes = CoupledModes(self._structure, self._viscous, self.target)
            return CoupledPrescribedReceptance(modes, left, right, left_out, mode=mode, xi=self.xi)
        return PrescribedReceptance(self._structure, self.target, left, right, left_out, mode=mode, xi=self.xi)

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """There are none."""
        raise InputError("a mode whose motion is prescribed has no equations in time")


class LeftOut:
    """Static compliance and residuals of a receptance, with ``width`` columns of zeros for the prescribed mode.

    The residuals are ``(R_p, p)``, whose weights at a frequency are ``w^(2 p) / e^(p + 1)``: ``e = 1 + i eta`` where
    one loss factor holds for all modes, else 1.
    """

    def __init__(
        self, structure: ModalStructure, left: Array, right: Array, static: Array, second: Array | None, *, width: int
    ) -> None:
        loss = structure.loss_factor
        same = np.all(np.abs(loss - loss[0]) <= _SAME_LOSS * abs(loss[0]))
        self.e: complex = 1.0 + 1j * float(loss[0]) if same else 1.0
        self.static = np.pad(static, ((0, 0), (0, width)))
        matrices = [static - (left / structure.omega**2) @ right.T, *([] if second is None else [second])]
        self.parts = [(np.pad(matrix, ((0, 0), (0, width))), power) for power, matrix in enumerate(matrices)]


class PrescribedReceptance(SummedReceptance):
    """Receptance of a ``PrescribedMode``: a sum over modes without the target in harmonic 1.

    The motion of the target mode itself, divided by ``mode``, is one more term, which is 1 in harmonic 1 and 0 in all
    others; None: it is not among the columns.
    """

    def __init__(
        self, structure: ModalStructure, target: int, left: Array, right: Array, left_out: LeftOut, *,
        mode: float | None, xi: float,
    ) -> None:  # fmt: skip
        self._stiffness = structure.omega**2 * (1.0 + 1j * structure.loss_factor)
        self._damping = 2.0 * structure.damping_ratio * structure.omega
        self._target, self._xi = target, xi
        self._left = left if mode is None else np.column_stack([left, left[:, target] / mode])
        width = self._left.shape[1] - left.shape[1]
        self._right = np.pad(right, ((0, width), (0, width)))
        if mode is not None:
            self._right[-1, -1] = 1.0
        self.static, self._e, self._parts = left_out.static, left_out.e, left_out.parts

    def changed(self, **values: float) -> PrescribedReceptance:
        """A copy with another damping subtracted."""
        new = copy(self)
        new._xi = values.get(XI, self._xi)
        return new

    def factors(self, orders: ArrayLike, omega: ArrayLike, along: Mapping[str, float] | None = None) -> Factors:
        """Factors of the sum, or of its derivative by the damping that is subtracted."""
        m = np.asarray(orders, dtype=float)
        w = np.multiply.outer(np.asarray(omega, dtype=float), m).ravel()
        m = np.resize(m, w.size)
        D = self._dynamic(m, w)
        width = self._left.shape[1] - self._stiffness.size  # 1 where the motion of the mode is among the columns
        by_mode = np.repeat((m == 1.0).astype(complex)[:, None], width, axis=1)
        if along is None:
            slope = D * D * (2.0 * w[:, None] - 1j * (self._damping - self._xi)) * m[:, None]
        else:
            slope = along.get(XI, 0.0) * 1j * w[:, None] * D * D
        static = np.append(1.0 / self._stiffness.real, np.zeros(width)) + 0j
        powers = [power for _, power in self._parts]
        part = np.array([w ** (2 * p) / self._e ** (p + 1) for p in powers])
        part_slope = np.array([2.0 * p * w * m / self._e**2 for p in powers]) if along is None else 0.0 * part
        first = np.array([[0.0 if p else 1.0] for p in powers])
        return Factors(
            left=self._left,
            right=self._right,
            weight=np.vstack([static, np.hstack([D, by_mode])]),
            slope=np.vstack([0.0 * static, np.hstack([slope, 0.0 * by_mode])]),
            parts=WrittenResiduals([matrix for matrix, _ in self._parts]),
            part_weight=np.hstack([first, part]) + 0j,
            part_slope=np.hstack([0.0 * first, part_slope]) + 0j,
        )

    def _dynamic(self, m: Array, w: Array) -> ComplexArray:
        """``D`` (k, n_modes) at orders and their frequencies (k,), zero for the target in harmonic 1."""
        held = np.zeros((m.size, self._stiffness.size), dtype=bool)
        held[m == 1.0, self._target] = True
        inverse = self._stiffness + w[:, None] * (1j * (self._damping - self._xi) - w[:, None])
        least = _EPS * np.abs(self._stiffness)  # modes of one frequency: at the target's another is in resonance
        inverse = np.where(np.abs(inverse) < least, least, inverse)
        return np.where(held, 0.0, 1.0 / np.where(held, 1.0, inverse))


class CoupledModes:
    """Modes that viscous damping (n_modes, n_modes) couples, one of them the target."""

    def __init__(self, structure: ModalStructure, viscous: Array, target: int) -> None:
        self.target = target
        self._stiffness, self._viscous = structure.omega**2 * (1.0 + 1j * structure.loss_factor), viscous
        self._unit = np.eye(structure.omega.size)
        self.others = np.delete(np.arange(structure.omega.size), target)

    def dynamic(self, w: float, xi: float) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """``Z`` (n, n) at a frequency, and its derivatives by that and by ``xi``."""
        Z: ComplexArray = np.diag(self._stiffness - w * w) + 1j * w * (self._viscous - xi * self._unit)
        by_w = 1j * (self._viscous - xi * self._unit) - 2.0 * w * self._unit
        return Z, np.asarray(by_w, dtype=complex), np.asarray(-1j * w * self._unit, dtype=complex)

    def carried(self, w: float, xi: float) -> tuple[ComplexArray, ComplexArray]:
        """Modal coordinates with the target at 1, and its stiffness; each with derivatives by ``w`` and ``xi``.

        (3, n) and (3,).
        """
        Z, *rates = self.dynamic(w, xi)
        r, o = self.target, self.others
        inner = np.linalg.inv(Z[np.ix_(o, o)])
        shape = np.zeros((3, len(Z)), dtype=complex)
        shape[0, r], shape[0, o] = 1.0, -inner @ Z[o, r]
        stiffness = np.empty(3, dtype=complex)
        stiffness[0] = shape[0] @ Z @ shape[0]
        for k, rate in enumerate(rates, 1):
            shape[k, o] = -inner @ (rate @ shape[0])[o]
            stiffness[k] = shape[0] @ rate @ shape[0]  # stationary: Z is symmetric
        return shape, stiffness


class CoupledPrescribedReceptance(Receptance):
    """As a ``PrescribedReceptance``, of modes that damping couples: solved at each order and frequency."""

    def __init__(
        self, modes: CoupledModes, left: Array, right: Array, left_out: LeftOut, *, mode: float | None, xi: float
    ) -> None:
        self._modes, self._left, self._right, self._mode, self._xi = modes, left, right, mode, xi
        self.static, self._e, self._parts = left_out.static, left_out.e, left_out.parts

    def changed(self, **values: float) -> CoupledPrescribedReceptance:
        """A copy with another damping subtracted."""
        new = copy(self)
        new._xi = values.get(XI, self._xi)
        return new

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance and its derivative by omega, see ``Receptance.at``."""
        value, by_omega, _ = self._all(orders, omega)
        return value, by_omega

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by the damping that is subtracted, the only parameter."""
        del name
        return self._all(orders, omega)[2]

    def _all(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        m, w = np.asarray(orders, dtype=float), np.asarray(omega, dtype=float)
        out = np.zeros((3, w.size, m.size, *self.static.shape), dtype=complex)
        for i, fundamental in enumerate(w.ravel().tolist()):
            for k, order in enumerate(m.tolist()):
                out[:, i, k] = self._one(order, order * fundamental)
        value, by_omega, by_xi = out.reshape(3, *w.shape, *m.shape, *self.static.shape)
        return value, by_omega, by_xi

    def _one(self, order: float, w: float) -> ComplexArray:
        """Value and derivatives, (3, n_rows, n_columns)."""
        modes, out = self._modes, np.zeros((3, *self.static.shape), dtype=complex)
        Z, by_w, by_xi = modes.dynamic(w, self._xi)
        held = order == 1.0
        o = modes.others if held else np.arange(len(Z))
        inner, n = np.linalg.inv(Z[np.ix_(o, o)]), len(self._right)
        left, right = self._left[:, o] @ inner, inner @ self._right[:, o].T
        out[0, :, :n] = self._left[:, o] @ right
        for k, rate in ((1, order * by_w), (2, by_xi)):
            out[k, :, :n] = -left @ rate[np.ix_(o, o)] @ right
        for matrix, p in self._parts:
            out[0] += w ** (2 * p) / self._e ** (p + 1) * matrix
            if p:
                out[1] += 2.0 * p * w ** (2 * p - 1) * order / self._e ** (p + 1) * matrix
        if held and self._mode is not None:
            shape, _ = modes.carried(w, self._xi)
            out[:, :, n] = shape @ self._left.T / self._mode
        return out
