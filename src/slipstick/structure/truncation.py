"""What the modes left out of a modal structure do to its receptance: an estimate from the structure's own residuals.

A mode left out adds ``a_r a_r^T / (w_r^2 - w^2)``, of which the residuals hold the first terms in ``w^2``. With all
modes up to ``w_n`` kept, ``R0 = sum a_r a_r^T / w_r^2`` and ``R1 = sum a_r a_r^T / w_r^4`` over those left out, the
rest is, as a symmetric form and below ``w_n``, at most (THEORY.md (10.3))::

    R1 w^4 / (w_n^2 - w^2)   with both residuals,      R0 w^2 / (w_n^2 - w^2)   with the static one alone

Near and above ``w_n`` modes may be left out that w passes; there ``RESONANT`` stands for ``w^2 / (w_n^2 - w^2)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipstick.typing import Array, Matrix

REFUSED = 1e-2
"""Relative error of the receptance above which a reduction is refused."""

WARNED_REDUCTION = 1e-4
"""Relative error of the receptance above which a reduction is warned of."""

RESONANT = 5.0
"""Largest factor on what a mode left out adds at rest."""


_MODES_BEYOND = 5.0


class Truncation:
    """Estimate of what is left out, undamped; dofs are scaled by their static compliance, so that units do not matter.

    Parameters
    ----------
    omega, mode_shapes
        The modes kept, (n_modes,) and (n_dofs, n_modes).
    static_compliance
        Exact, (n_dofs, n_dofs).
    second_residual
        (n_dofs, n_dofs), or None.
    """

    def __init__(
        self, *, omega: Array, mode_shapes: Array, static_compliance: Array, second_residual: Array | None
    ) -> None:
        self._squared = omega**2
        self.last = float(omega.max())
        diagonal = np.diag(static_compliance)
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        scales, shapes = np.outer(scale, scale), mode_shapes * scale[:, None]
        residual = scales * static_compliance - (shapes / self._squared) @ shapes.T
        self._products = (shapes.T @ shapes) ** 2
        self._crossed = np.einsum("ir,ij,jr->r", shapes, residual, shapes, optimize=True)
        self._residual = float(np.linalg.norm(residual))
        self._second = None if second_residual is None else float(np.linalg.norm(scales * second_residual))

    def error(self, frequency: ArrayLike, relative_to: ArrayLike | None = None) -> Array:
        """Error of the receptance (Frobenius norm over all dofs) at frequencies (rad/s), same shape.

        It is relative to the receptance there, or at the frequencies ``relative_to`` (of a shape that fits).
        """
        w = np.asarray(frequency, dtype=float)
        square = w * w
        with np.errstate(divide="ignore"):
            factor = np.where(w < self.last, np.minimum(square / (self.last**2 - square), RESONANT), RESONANT)
        left_out = factor * (self._residual if self._second is None else square * self._second)
        size = self._size(square if relative_to is None else np.asarray(relative_to, dtype=float) ** 2)
        left_out, size = np.broadcast_arrays(left_out, size)
        return np.divide(left_out, size, out=np.full(size.shape, np.inf), where=size > 0.0)

    def _size(self, square: Matrix) -> Array:
        """Norm of the modal part and the static residual: ``|sum c_r a_r a_r^T + R0|`` with Gram matrices."""
        gap = self._squared - square[..., None]
        c = 1.0 / np.where(gap == 0.0, 1e-12 * self._squared, gap)
        modal = np.einsum("...r,rs,...s->...", c, self._products, c, optimize=True)
        return np.asarray(np.sqrt(np.maximum(modal + 2.0 * c @ self._crossed + self._residual**2, 0.0)))

    def valid_to(self, error: float = REFUSED) -> float:
        """Lowest frequency (rad/s) at which the estimate reaches ``error``; infinite where it never does."""
        grid = self.last * np.geomspace(1e-3, 1e3, 1201)
        above = np.flatnonzero(self.error(grid) > error)
        return float(grid[max(above[0] - 1, 0)]) if len(above) else float("inf")


@dataclass(frozen=True, kw_only=True)
class WorstError:
    """Where the receptance of a reduced structure is worst.

    ``relative`` is the error of the receptance at ``order`` times ``omega`` (rad/s), ``value`` what it does to the
    motion, relative to that at the harmonics that are excited; ``last_mode`` in rad/s; ``reach`` (rad/s) the highest
    frequency that matters, lower for harmonics that count less; ``kind`` as
    :attr:`slipstick.structure.modal.ModalStructure.error_kind`.
    """

    value: float
    relative: float
    omega: float
    last_mode: float
    reach: float
    order: int = 1
    kind: str = "estimate"

    @property
    def refused(self) -> bool:
        """Whether it is of no use: a bound alone, which can be far above the error, does not say so."""
        return self.kind == "estimate" and not self.value <= REFUSED

    @property
    def needed(self) -> float:
        """Frequency (rad/s) up to which modes bring the error below ``WARNED``, by experience (within a half).

        The error falls with the third to fifth power of the last mode's frequency, to 1e-4 at five times ``reach``.
        """
        closer = self.last_mode * max(self.value / WARNED_REDUCTION, 1.0) ** (1 / 3) if self.value < REFUSED else np.inf
        return float(max(min(_MODES_BEYOND * self.reach, closer), 1.05 * self.last_mode))

    def sentence(self, count: int | None = None, unit: str = "rad/s") -> str:
        """What is wrong and what to do; ``count`` modes lie below :attr:`needed`; ``unit`` is that of frequencies."""
        at = f"{self.order * self.omega:.5g} {unit}"
        if self.order > 1:
            at += f" (harmonic {self.order} of {self.omega:.5g} {unit}"
            at += ")" if self.value == self.relative else f", which counts {self.value:.1e} there)"
        may = "is wrong by about" if self.kind == "estimate" else "may be wrong by up to"
        more = f"all {count} below" if count else "about all below"
        known = "" if self.kind == "estimate" else "give second_residual, which tells more, or "
        force = "; force = true takes it as it is" if self.refused else ""
        return (
            f"the receptance of the reduced structure {may} {self.relative:.1e} of itself at {at}: its modes "
            f"end at {self.last_mode:.5g} {unit}, and what counts should stay below {WARNED_REDUCTION:g}, "
            f"above {REFUSED:g} it is of no use; {known}keep more modes, {more} {self.needed:.3g} {unit}, "
            f"or lower the range or the harmonics{force}"
        )
