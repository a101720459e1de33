"""How sure fitted parameters are, and what the measurement cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slipstick.analysis.identification.descent import End
from slipstick.analysis.identification.fit_request import FitRequest
from slipstick.analysis.identification.noise import Without, listed, neighbours, robust, whiteness, without_levels
from slipstick.typing import Array

if TYPE_CHECKING:
    pass


_INDISTINCT = 1e-7
"""Singular value over the largest below which a combination of parameters changes nothing."""
IN_NOISE = 0.5
"""Relative standard deviation of a combination above which it is lost in the noise."""
_TAKES_PART = 0.05
"""Share of the largest from which a parameter belongs to a combination."""


def checked_against_residuals(
    request: FitRequest, end: End, statistics: Statistics, deviation: float
) -> tuple[Statistics, list[Without], list[str]]:
    """Standard errors that grow with what in the residuals is no noise, the levels left out, and sentences."""
    told: list[str] = []
    size, free = np.where(end.p != 0.0, np.abs(end.p), 1.0), ~end.at_bound
    J, errors = (end.J * size)[:, free], statistics.errors.copy()
    names = [name for name, there in zip(request.names, free, strict=True) if there]
    if not J.size or not len(statistics.gain):
        return statistics, [], told
    white = whiteness(neighbours(request.measured, request.used), end.left, J, deviation)
    growth = np.ones(len(names))
    if white.told:
        growth *= white.factor
        told.append(
            f"what is left is not white: neighbouring points are alike (correlation {white.correlation:.2f}), the "
            f"model lacks something or the noise is not random; standard errors are multiplied by {white.factor:.2g}"
        )
    unequal = robust(statistics.gain, end.left, J, deviation)
    larger = unequal.told & (unequal.factor > growth)
    if larger.any():
        growth[larger] = unequal.factor[larger]
        which = [f"{name} ({factor:.2g} times)" for name, factor in zip(names, growth, strict=True)]
        told.append(
            "what is left is larger where parameters are determined: standard errors are taken from it (sandwich "
            f"estimate) for {listed([word for word, there in zip(which, larger, strict=True) if there])}"
        )
    errors[free] *= growth
    freedom = end.left.size - len(request.names)
    left_out = []
    for each in without_levels(request.measured, request.used, end.left, J, deviation, freedom):
        shift = np.zeros(len(end.p))
        shift[free] = each.shift * size[free]
        left_out.append(each._replace(shift=shift))
        moved = np.flatnonzero((np.abs(shift) > errors) & each.told)
        if len(moved):
            values = [f"{request.names[k]} would be about {end.p[k] + shift[k]:.4g}" for k in moved]
            told.append(
                f"without {each.level} {listed(values)}: the levels do not agree within the noise, and standard errors "
                "are at least these changes"
            )
            errors[moved] = np.abs(shift[moved])
    return statistics._replace(errors=errors), left_out, told


class Statistics(NamedTuple):
    """Of the parameters of a fit."""

    errors: Array
    """(n_p,)"""
    correlations: Array
    """(n_p, n_p)"""
    singular: Array
    sentences: list[str]
    """Of what is not separated."""
    gain: Array
    """How relative values of the free parameters follow weighted numbers (n_free, m)."""


def statistics_of(
    names: Sequence[str], end: End, deviation: float
) -> Statistics:  # fmt: skip
    """How sure the parameters are, of noise with one standard deviation of the weighted numbers."""
    size = np.where(end.p != 0.0, np.abs(end.p), 1.0)
    free = ~end.at_bound
    scaled = (end.J * size)[:, free]
    columns, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    errors, correlations = np.full(len(names), np.nan), np.full((len(names),) * 2, np.nan)
    if not singular.size:
        return Statistics(errors, correlations, singular, [], np.empty((0, end.left.size)))
    known = singular > _INDISTINCT * singular[0]
    inverse = rows[known].T / singular[known]
    covariance = inverse @ inverse.T
    undetermined = np.any(np.abs(rows[~known]) > 1e-3, axis=0)
    own = np.sqrt(np.diag(covariance))
    errors[free] = np.where(undetermined, np.inf, deviation * own * size[free])
    with np.errstate(invalid="ignore", divide="ignore"):
        between = covariance / np.outer(own, own)
    between[undetermined], between[:, undetermined] = np.nan, np.nan
    correlations[np.ix_(free, free)] = between
    chosen = [name for name, there in zip(names, free, strict=True) if there]
    sentences = [_indistinct(chosen, row, end.p[free]) for row in rows[~known]]
    for value, row in zip(singular[known], rows[known], strict=True):
        if deviation / value > IN_NOISE:
            sentences.append(_in_noise(chosen, row, deviation / value))
    return Statistics(errors, correlations, singular, sentences, inverse @ columns[:, known].T)


def _indistinct(names: Sequence[str], row: Array, p: Array) -> str:
    """What a combination of relative changes that changes nothing means."""
    share = row / np.max(np.abs(row))
    part = [(name, float(r)) for name, r, v in zip(names, share, p, strict=True) if abs(r) > _TAKES_PART]
    if len(part) == 1:
        return f"{part[0][0]} has no effect on what was measured: any value fits as well"
    if len(part) == 2 and abs(abs(part[0][1]) - abs(part[1][1])) < 1e-3:
        together = "product" if part[0][1] * part[1][1] < 0.0 else "ratio"
        return (
            f"{part[0][0]} and {part[1][0]} cannot be separated: the measurement determines their {together} alone; "
            "keep one of them fixed"
        )
    changes = ", ".join(f"{r:+.2g} % of {name}" for name, r in part)
    return f"{' and '.join(name for name, _ in part)} cannot be separated: changing {changes} changes nothing measured"


def _in_noise(names: Sequence[str], row: Array, spread: float) -> str:
    part = [name for name, r in zip(names, row / np.max(np.abs(row)), strict=True) if abs(r) > 2 * _TAKES_PART]
    return f"the noise hides {' against '.join(part)}: that combination is known to {100.0 * spread:.0f} % only"
