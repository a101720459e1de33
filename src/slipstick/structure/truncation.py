"""Error of a receptance by the modes left out of a modal structure: estimated from its residuals, or measured.

A mode left out adds ``a_r a_r^T / (w_r^2 - w^2)``, of which the residuals hold the first terms in ``w^2``. With all
modes up to ``w_n`` kept, ``R0 = sum a_r a_r^T / w_r^2`` and ``R1 = sum a_r a_r^T / w_r^4`` over those left out, the
rest is, as a symmetric form and below ``w_n``, at most (THEORY.md (10.3))::

    R1 w^4 / (w_n^2 - w^2)   with both residuals,      R0 w^2 / (w_n^2 - w^2)   with the static one alone

Near and above ``w_n`` a mode left out may be in resonance; there ``RESONANT`` replaces ``w^2 / (w_n^2 - w^2)``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.typing import AnyArray, Array, IntArray

REFUSED = 1e-2
"""Relative error of the receptance above which a reduction is refused."""

WARNED_REDUCTION = 1e-4
"""Relative error of the receptance above which a reduction gives a warning."""

RESONANT = 5.0
"""Largest factor on the static compliance of a mode left out."""

_MODES_BEYOND = 5.0
"""Frequency of the last mode over the highest that matters, with which the error is 1e-4 (by experience)."""

CANCELLED = 0.1
"""Smallest size of a receptance for relative errors, over the sum of its modes without cancellation."""

UNREACHED = 1e-4
"""Smallest size of the response to a load, over its bound: some loads excite nothing."""

_BETWEEN = 24
"""Frequencies between two resonances of a band."""
_SPREAD = 96
"""Evenly spread frequencies of a band."""


class ReceptanceSize:
    """Size of a receptance given by modes and a static residual, to which its error is relative.

    Undamped, Frobenius norm between all dofs (first column) and from each load to all dofs (the others). Between two
    resonances a receptance can pass through zero, where no error would be small. There its size is a fraction of the
    sum of its modes without cancellation.

    Parameters
    ----------
    omega, shapes
        The modes kept, (n_modes,) and (n_dofs, n_modes).
    residual
        Static compliance of the modes left out, (n_dofs, n_dofs), or columns of it, (n_dofs, n_sample).
    sample
        Which columns, (n_sample,); None: all.
    participation, load_residual
        Of loads: modal forces (n_loads, n_modes), static response of the modes left out (n_dofs, n_loads).
    """

    def __init__(
        self, omega: Array, shapes: AnyArray, residual: AnyArray, participation: AnyArray, load_residual: AnyArray,
        sample: IntArray | None = None,
    ) -> None:  # fmt: skip
        self._squared, self._shapes = omega**2, shapes
        self._gram = np.abs(shapes.conj().T @ shapes)
        share = 1.0 if sample is None else len(shapes) / len(sample)
        columns = shapes if sample is None else shapes[sample]
        self._crossed = share * np.sum(shapes.conj() * (residual @ columns), axis=0).real
        self._residual = float(np.sqrt(share) * np.linalg.norm(residual))
        self._loads = list(zip(participation, load_residual.T, strict=True))

    def at(self, frequency: ArrayLike) -> Array:
        """Sizes (..., 1 + n_loads) at frequencies (rad/s)."""
        gap = self._squared - np.asarray(frequency, dtype=float)[..., None] ** 2
        c = 1.0 / np.where(gap == 0.0, 1e-12 * self._squared, gap)
        size, most = self._between_dofs(c), self._between_dofs(np.abs(c))
        columns = [np.maximum(size, CANCELLED * most)]
        for participation, residual in self._loads:
            weights = c * participation
            alone = np.linalg.norm(weights @ self._shapes.T + residual, axis=-1)
            apart = _norm(np.abs(weights), self._gram) + float(np.linalg.norm(residual))
            possible = np.sqrt(most * np.sum(np.abs(weights * participation), axis=-1))
            columns.append(np.maximum.reduce([alone, CANCELLED * apart, UNREACHED * possible]))
        return np.stack(columns, axis=-1)

    def _between_dofs(self, c: Array) -> Array:
        """``|sum c_r a_r a_r^T + R0|`` by the Gram matrix of the modes."""
        whole = np.sum((c @ self._gram**2) * c, axis=-1) + 2.0 * c @ self._crossed + self._residual**2
        return np.asarray(np.sqrt(np.maximum(whole, 0.0)))


def _norm(weights: Array, gram: Array) -> Array:
    return np.asarray(np.sqrt(np.maximum(np.sum((weights @ gram) * weights, axis=-1), 0.0)))


def band(omega: Array, lowest: float, highest: float) -> Array:
    """Frequencies that resolve a receptance over a band: evenly spread, and more between its resonances."""
    even = np.linspace(lowest, highest, _SPREAD)
    inner = np.sort(omega[(omega > lowest) & (omega < highest)])
    ends = np.concatenate([[lowest], inner, [highest]])
    parts = (np.arange(_BETWEEN) + 0.5) / _BETWEEN
    between = ends[:-1, None] + np.diff(ends)[:, None] * parts
    return np.unique(np.concatenate([even, between.ravel()]))


_TOGETHER = 120
"""Frequencies at which errors are computed together."""


class Truncation:
    """Estimate of the undamped error by modes left out; dofs are scaled by their static compliance.

    Symmetric forms, or the Hermitian ones of a phase from sector to sector.

    Parameters
    ----------
    omega, mode_shapes
        The modes kept, (n_modes,) and (n_dofs, n_modes).
    static_compliance
        Exact, (n_dofs, n_dofs); of a ``sample`` of dofs (n_sample,), their columns, (n_dofs, n_sample).
    second_residual
        Likewise, or None.
    own
        Static compliance that dofs are scaled by, (n_dofs,), where it is not the diagonal above.
    participation, load_response, second_load_response
        Of loads: modal forces (n_loads, n_modes), exact static response and second residual (n_dofs, n_loads), the last
        one None where it is not known of all.
    kind
        Kind of the error: an "estimate", with the static compliance alone a "bound", "unknown" without residuals; by
        default as the residuals are.

    Attributes
    ----------
    last, count
        Highest natural frequency of the modes kept, rad/s, and their number.
    """

    def __init__(
        self,
        *,
        omega: Array,
        mode_shapes: AnyArray,
        static_compliance: AnyArray,
        second_residual: AnyArray | None,
        participation: AnyArray | None = None,
        load_response: AnyArray | None = None,
        second_load_response: AnyArray | None = None,
        sample: IntArray | None = None,
        own: Array | None = None,
        kind: str = "",
    ) -> None:
        self.last, self.count = float(omega.max()), int(omega.size)
        self.kind = kind or ("bound" if second_residual is None else "estimate")
        diagonal = np.diag(static_compliance).real if own is None else own
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))[:, None]
        shapes, n, modes = mode_shapes * scale, *mode_shapes.shape
        participation = np.zeros((0, modes)) if participation is None else participation
        responses = np.zeros((n, 0)) if load_response is None else load_response
        here = slice(None) if sample is None else sample
        residual = scale * static_compliance * scale[here].T - (shapes / omega**2) @ shapes[here].conj().T
        load_residual = scale * responses - (shapes / omega**2) @ participation.T
        self._size = ReceptanceSize(omega, shapes, residual, participation, load_residual, sample)
        share = 1.0 if sample is None else float(np.sqrt(n / len(sample)))
        self._residual = np.array([share * np.linalg.norm(residual), *np.linalg.norm(load_residual, axis=0)])
        self._second = np.full(self._residual.shape, np.nan)
        if second_residual is not None:
            self._second[0] = share * np.linalg.norm(scale * second_residual * scale[here].T)
        if second_load_response is not None:
            self._second[1:] = np.linalg.norm(scale * second_load_response, axis=0)

    def error(
        self, frequency: ArrayLike, relative_to: ArrayLike | None = None, beside: Truncation | None = None
    ) -> Array:
        """Error of the receptance (Frobenius norm) at frequencies (rad/s), same shape: the worst of all dofs and loads.

        It is relative to the receptance there, or at the frequencies ``relative_to`` (of a shape that fits), with
        ``beside`` to that of another phase. Loads count only where both frequencies are equal: they act at no other.
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
        size = (beside or self)._size.at(reference)
        unknown = np.where(left_out > 0.0, np.inf, 0.0)
        return np.asarray(np.divide(left_out, size, out=unknown, where=size > 0.0).max(axis=-1))

    @cached_property
    def valid_to(self) -> float:
        """Lowest frequency (rad/s) at which the estimate reaches ``REFUSED``; infinite where it never does."""
        grid = self.last * np.geomspace(1e-3, 1e3, 1201)
        for first in range(0, grid.size, _TOGETHER):
            above = np.flatnonzero(self.error(grid[first : first + _TOGETHER]) > REFUSED)
            if len(above):
                return float(grid[max(first + above[0] - 1, 0)])
        return float("inf")


def load_arrays(shapes: Sequence[Mapping[str, Array]]) -> dict[str, Any]:
    """Arguments of :class:`Truncation` by load shapes; second responses where all have one."""
    arrays: dict[str, Any] = {}
    if shapes:
        arrays["participation"] = np.array([shape["participation"] for shape in shapes])
        arrays["load_response"] = np.column_stack([shape["static_response"] for shape in shapes])
        if all("second_response" in shape for shape in shapes):
            arrays["second_load_response"] = np.column_stack([shape["second_response"] for shape in shapes])
    return arrays


def band_error(
    size: ReceptanceSize, omega: Array, n_keep: int, *, top: float, missing: AnyArray, second: AnyArray,
    sample: IntArray | None = None,
) -> float:  # fmt: skip
    """Largest relative error of a reduction below ``top`` (rad/s), between directions and from each load to them.

    From one direct solution at the top. With all modes up to ``w_n`` kept, the error of the receptance is
    ``sum_r t_r w^4 / (w_r^2 - w^2)``, ``t_r = a_r a_r^T / w_r^4``, over those left out (THEORY.md (10.2)). Between
    directions it is a form that grows faster than ``w^4``, so what is measured at the top ``W`` bounds it below. From a
    load ``p`` the terms ``a_r (a_r . p)`` may cancel at the top and not below; as ``g(w) = w^4 / (w_r^2 - w^2)`` is
    ``(w/W)^4 g(W) [1 - (W^2 - w^2) / (w_r^2 - w^2)]``, the error is at most (Cauchy and Schwarz; THEORY.md (10.4))::

        (w/W)^4 [ |E_p(W)| + (W^2 - w^2) / (w_n^2 - w^2) sqrt(tr E(W)  E_pp(W)) ]

    Near a resonance the measured bound grows without limit; (10.3) is then the better one.

    ``missing`` is the error of the receptance at the top, ``second`` the second-order residual, both between directions
    and loads after them (n, n), or of a ``sample`` of directions and of loads (n, n_sample + n_loads); ``omega`` the
    modes kept. Infinite where these end below the top.
    """
    last = float(omega.max())
    if last <= top:
        return float("inf")
    here = np.arange(n_keep) if sample is None else sample
    (lacks, hidden), known = _sizes(missing, n_keep, here), np.maximum(*_sizes(second, n_keep, here))
    w = band(omega, 0.0, top)
    part = (top**2 - w**2) / (last**2 - w**2)
    measured = (w / top)[:, None] ** 4 * (lacks + part[:, None] * hidden)
    bound = (w**4 / (last**2 - w**2))[:, None] * known
    below = np.minimum(measured, bound) / size.at(w)
    return float(max(below.max(), (lacks / size.at(top)).max()))


def _sizes(form: AnyArray, n: int, sample: IntArray) -> tuple[Array, Array]:
    """Norms of the block between directions and of each load's column, and bounds of terms that may cancel.

    These are 0 between directions, ``sqrt(tr F  F_pp)`` for a load.
    """
    s = len(sample)
    norms = [np.sqrt(n / s) * np.linalg.norm(form[:n, :s]), *np.linalg.norm(form[:n, s:], axis=0)]
    trace = n / s * float(form[sample, np.arange(s)].sum().real)
    own = np.maximum(np.diag(form[n:, s:]).real, 0.0)
    return np.array(norms), np.concatenate([[0.0], np.sqrt(own * max(trace, 0.0))])


@dataclass(frozen=True, kw_only=True)
class WorstError:
    """Largest error of the receptance of a reduced structure.

    ``relative`` is the error of the receptance at ``order`` times ``omega`` (rad/s), ``value`` its effect on the
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
        """Whether the reduction is refused: only by an estimate, since a bound can be far above the error."""
        return self.kind == "estimate" and not self.value <= REFUSED

    @property
    def needed(self) -> float:
        """Frequency (rad/s) up to which modes bring it below ``WARNED_REDUCTION``, by experience (within a half).

        The error falls with the third to fifth power of the last mode's frequency, to 1e-4 at five times ``reach``.
        """
        closer = self.last_mode * max(self.value / WARNED_REDUCTION, 1.0) ** (1 / 3) if self.value < REFUSED else np.inf
        return float(max(min(_MODES_BEYOND * self.reach, closer), 1.05 * self.last_mode))

    def sentence(self, count: int | None = None, unit: str = "rad/s") -> str:
        """Description and remedy; ``count`` modes lie below :attr:`needed`; ``unit`` is that of frequencies."""
        at = f"{self.order * self.omega:.5g} {unit}"
        if self.order > 1:
            at += f" (harmonic {self.order} of {self.omega:.5g} {unit}"
            at += ")" if self.value == self.relative else f", which counts {self.value:.1e} there)"
        may = "is wrong by about" if self.kind == "estimate" else "may be wrong by up to"
        more = f"all {count} below" if count else "about all below"
        known = "" if self.kind == "estimate" else "give second_residual for a closer estimate, or "
        force = "; force = true takes it as it is" if self.refused else ""
        return (
            f"the receptance of the reduced structure {may} {self.relative:.1e} of itself at {at}, which should stay "
            f"below {WARNED_REDUCTION:g}; above {REFUSED:g} it is of no use; {known}keep more modes, {more} "
            f"{self.needed:.3g} {unit} "
            f"(they end at {self.last_mode:.5g} {unit}), or lower the range or the harmonics{force}"
        )
