"""What the modes left out of a modal structure do to its receptance: an estimate from the structure's own residuals.

A mode left out adds ``a_r a_r^T / (w_r^2 - w^2)``, of which the residuals hold the first terms in ``w^2``. With all
modes up to ``w_n`` kept, ``R0 = sum a_r a_r^T / w_r^2`` and ``R1 = sum a_r a_r^T / w_r^4`` over those left out, the
rest is, as a symmetric form and below ``w_n``, at most (THEORY.md (10.3))::

    R1 w^4 / (w_n^2 - w^2)   with both residuals,      R0 w^2 / (w_n^2 - w^2)   with the static one alone

Near and above ``w_n`` modes may be left out that w passes; there ``RESONANT`` stands for ``w^2 / (w_n^2 - w^2)``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipstick.structure.receptance_size import ReceptanceSize
from slipstick.typing import Array

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
    participation, load_response, second_load_response
        Of loads: modal forces (n_loads, n_modes), exact static response and second residual (n_dofs, n_loads), the last
        one None where it is not known of all.
    """

    def __init__(
        self,
        *,
        omega: Array,
        mode_shapes: Array,
        static_compliance: Array,
        second_residual: Array | None,
        participation: Array | None = None,
        load_response: Array | None = None,
        second_load_response: Array | None = None,
    ) -> None:
        self.last = float(omega.max())
        diagonal = np.diag(static_compliance)
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))[:, None]
        shapes, n, modes = mode_shapes * scale, *mode_shapes.shape
        participation = np.zeros((0, modes)) if participation is None else participation
        responses = np.zeros((n, 0)) if load_response is None else load_response
        residual = scale * static_compliance * scale.T - (shapes / omega**2) @ shapes.T
        load_residual = scale * responses - (shapes / omega**2) @ participation.T
        self._size = ReceptanceSize(omega, shapes, residual, participation, load_residual)
        self._residual = np.array([np.linalg.norm(residual), *np.linalg.norm(load_residual, axis=0)])
        self._second = np.full(self._residual.shape, np.nan)
        if second_residual is not None:
            self._second[0] = np.linalg.norm(scale * second_residual * scale.T)
        if second_load_response is not None:
            self._second[1:] = np.linalg.norm(scale * second_load_response, axis=0)

    def error(self, frequency: ArrayLike, relative_to: ArrayLike | None = None) -> Array:
        """Error of the receptance (Frobenius norm) at frequencies (rad/s), same shape: the worst of all dofs and loads.

        It is relative to the receptance there, or at the frequencies ``relative_to`` (of a shape that fits): loads
        count where these are the same, for no load acts elsewhere.
        """
        w = np.asarray(frequency, dtype=float)
        reference = w if relative_to is None else np.asarray(relative_to, dtype=float)
        w, reference = np.broadcast_arrays(w, reference)
        square = (w * w)[..., None]
        with np.errstate(divide="ignore"):
            growing = np.minimum(square / (self.last**2 - square), RESONANT)
        factor = np.where(w[..., None] < self.last, growing, RESONANT)
        left_out = factor * np.where(np.isnan(self._second), self._residual, square * self._second)
        left_out[..., 1:] *= (w == reference)[..., None]
        size = self._size.at(reference)
        unknown = np.where(left_out > 0.0, np.inf, 0.0)
        return np.asarray(np.divide(left_out, size, out=unknown, where=size > 0.0).max(axis=-1))

    def valid_to(self, error: float = REFUSED) -> float:
        """Lowest frequency (rad/s) at which the estimate reaches ``error``; infinite where it never does."""
        grid = self.last * np.geomspace(1e-3, 1e3, 1201)
        above = np.flatnonzero(self.error(grid) > error)
        return float(grid[max(above[0] - 1, 0)]) if len(above) else float("inf")


def load_arrays(shapes: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """What :class:`Truncation` takes of load shapes; second responses where all have one."""
    found = {}
    if shapes:
        found["participation"] = np.array([shape["participation"] for shape in shapes])
        found["load_response"] = np.column_stack([shape["static_response"] for shape in shapes])
        if all("second_response" in shape for shape in shapes):
            found["second_load_response"] = np.column_stack([shape["second_response"] for shape in shapes])
    return found


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
        known = "" if self.kind == "estimate" else "give second_residual for a closer estimate, or "
        force = "; force = true takes it as it is" if self.refused else ""
        return (
            f"the receptance of the reduced structure {may} {self.relative:.1e} of itself at {at}: its modes "
            f"end at {self.last_mode:.5g} {unit}, and what counts should stay below {WARNED_REDUCTION:g}, "
            f"above {REFUSED:g} it is of no use; {known}keep more modes, {more} {self.needed:.3g} {unit}, "
            f"or lower the range or the harmonics{force}"
        )
