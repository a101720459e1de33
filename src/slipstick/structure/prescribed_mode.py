"""A structure with one mode held to a given motion and damping taken from all, as extended periodic motion asks.

``M x'' + (C - xi M) x' + K x + f = 0``: in the modes every ``D_r(m w)`` has ``2 zeta_r w_r - xi`` for its damping. The
target mode is split off in harmonic 1, where its motion is prescribed; it is one more load shape, ``MODE``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError
from slipstick.structure.modal import ModalStructure
from slipstick.structure.protocol import TimeEquations
from slipstick.structure.receptance import Factors
from slipstick.typing import Array, ComplexArray

MODE = "mode"
"""The load shape that is the motion of the target mode, in the length that its own shape is scaled to."""

XI = "xi"
"""The parameter: damping over mass that is taken from all modes, 1/time."""

_EPS = float(np.finfo(float).eps)


class PrescribedMode:
    """A ``ModalStructure`` whose mode number ``target`` (from 0) moves as it is told in harmonic 1.

    ``scale`` is what the mode shape is divided by: its motion of amplitude 1 is 1 where the shape is ``scale``.
    """

    def __init__(self, structure: ModalStructure, target: int, scale: float) -> None:
        self._own, self.target, self.scale, self.xi = structure, target, scale, 0.0

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self._own.dofs

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Those of the structure, and the mode."""
        return (*self._own.load_shapes, MODE)

    @property
    def natural_frequencies(self) -> Array:
        """Of the structure without contacts, rad/s."""
        return self._own.natural_frequencies

    @property
    def values(self) -> dict[str, float]:
        """The damping that is taken away."""
        return {XI: self.xi}

    def changed(self, **values: float) -> PrescribedMode:
        """With another damping taken away."""
        new = copy(self)
        new.xi = values.get(XI, self.xi)
        return new

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> PrescribedReceptance:
        """Receptance with the motion of the mode as the last column, where it is asked for."""
        others = [shape for shape in shapes if shape != MODE]
        if MODE in shapes and list(shapes) != [*others, MODE]:
            raise InputError("the mode is the last of the load shapes")
        left, right, static, second = self._own.modal_parts(rows, columns, others)
        return PrescribedReceptance(
            self._own, self.target, left, right, (static, second), mode=self.scale if MODE in shapes else None
        ).changed(xi=self.xi)

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """There are none."""
        raise InputError("a mode whose motion is prescribed has no equations in time")


class PrescribedReceptance:
    """Receptance of a ``PrescribedMode``: a sum over modes, of which the target is left out in harmonic 1.

    The motion of the target mode itself is one more term, which is 1 in harmonic 1 and 0 in all others.
    """

    def __init__(
        self, structure: ModalStructure, target: int, left: Array, right: Array,
        residuals: tuple[Array, Array | None], *, mode: float | None,
    ) -> None:  # fmt: skip
        static, second = residuals
        square = structure.omega**2
        residual = static - (left / square) @ right.T
        loss = structure.loss_factor
        same = np.all(np.abs(loss - loss[0]) <= 1e-14 * abs(loss[0]))
        e = 1.0 + 1j * float(loss[0]) if same else 1.0
        self._stiffness, self._damping = square * (1.0 + 1j * loss), 2.0 * structure.damping_ratio * structure.omega
        self._target, self._e, self._xi = target, e, 0.0
        width = 0 if mode is None else 1
        self._left = left if mode is None else np.column_stack([left, left[:, target] / mode])
        self._right = np.pad(right, ((0, width), (0, width)))
        if mode is not None:
            self._right[-1, -1] = 1.0
        self.static: Array = np.pad(static, ((0, 0), (0, width)))
        left_out = [(residual, 0), *([] if second is None else [(second, 1)])]
        self._parts = [(np.pad(matrix, ((0, 0), (0, width))), power) for matrix, power in left_out]

    def changed(self, **values: float) -> PrescribedReceptance:
        """With another damping taken away."""
        new = copy(self)
        new._xi = values.get(XI, self._xi)
        return new

    def at(self, orders: ArrayLike, omega: float | Array) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at the harmonics of ``omega`` and its derivative by it, as of every receptance."""
        m, w, D = self._dynamic(orders, omega)
        slope = D * D * (2.0 * w - 1j * (self._damping - self._xi)) * m[:, None]
        value, rate = self._sum(m, D), self._sum(m, slope, by_mode=0.0)
        for matrix, power in self._parts:
            factor = w[..., None] ** (2 * power) / self._e ** (power + 1)
            value += factor * matrix
            if power:
                rate += 2.0 * m[:, None, None] * w[..., None] / self._e**2 * matrix
        return value, rate

    def by_parameter(self, name: str, orders: Array, omega: float) -> ComplexArray:
        """Derivative by the damping that is taken away, of the shape of ``at``: ``i m w D^2``."""
        m, w, D = self._dynamic(orders, omega)
        return self._sum(m, 1j * w * D * D, by_mode=0.0)

    def factors(self, orders: Array, omega: float, along: Mapping[str, float] | None = None) -> Factors:
        """What :meth:`at` sums, apart."""
        m, w, D = self._dynamic(orders, omega)
        own = (m == 1.0).astype(complex)[:, None] if self._moved else np.zeros((m.size, 0))
        none = np.zeros_like(own)
        rate = D * D * (2.0 * w - 1j * (self._damping - self._xi)) * m[:, None]
        if along is not None:
            rate = along.get(XI, 0.0) * 1j * w * D * D
        static = np.append(1.0 / self._stiffness.real, np.zeros(own.shape[1])) + 0j
        powers = [power for _, power in self._parts]
        part = np.array([w[:, 0] ** (2 * p) / self._e ** (p + 1) for p in powers]).reshape(-1, m.size)
        part_rate = np.array([2.0 * p * w[:, 0] * m / self._e**2 for p in powers]).reshape(-1, m.size)
        first = np.array([[0.0 if p else 1.0] for p in powers])
        return Factors(
            left=self._left, right=self._right, weight=np.vstack([static, np.hstack([D, own])]),
            slope=np.vstack([0.0 * static, np.hstack([rate, none])]), parts=tuple(matrix for matrix, _ in self._parts),
            part_weight=np.hstack([first, part]) + 0j,
            part_slope=np.hstack([0.0 * first, part_rate if along is None else 0.0 * part]) + 0j,
        )  # fmt: skip

    @property
    def _moved(self) -> bool:
        """Whether the motion of the mode is among the columns."""
        return self._left.shape[1] > self._stiffness.size

    def _dynamic(self, orders: ArrayLike, omega: ArrayLike) -> tuple[Array, Array, ComplexArray]:
        """Orders (k,), frequencies (..., k, 1) and ``D`` (..., k, n_modes), zero for the target in harmonic 1."""
        m = np.asarray(orders, dtype=float)
        w = np.multiply.outer(np.asarray(omega, dtype=float), m)[..., None]
        held = np.zeros((m.size, self._stiffness.size), dtype=bool)
        held[m == 1.0, self._target] = True
        inverse = self._stiffness + w * (1j * (self._damping - self._xi) - w)
        least = _EPS * np.abs(self._stiffness)  # modes of one frequency: at the target's another is in resonance
        inverse = np.where(np.abs(inverse) < least, least, inverse)
        D = np.where(held, 0.0, 1.0 / np.where(held, 1.0, inverse))
        return m, w, D

    def _sum(self, m: Array, D: ComplexArray, by_mode: float = 1.0) -> ComplexArray:
        """``left D right^T`` (..., k, n_rows, n_columns), with the motion of the mode."""
        if self._moved:
            own = np.broadcast_to(by_mode * (m == 1.0), D.shape[:-1])
            D = np.concatenate([D, own[..., None]], axis=-1)
        return np.asarray((self._left * D[..., None, :]) @ self._right.T, dtype=complex)
