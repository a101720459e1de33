"""The noise in the residuals of a fit, and tests for residuals that are not noise.

Variances ``s^2 u`` maximise the restricted likelihood (H. D. Patterson, R. Thompson, Biometrika 58, 1971, 545-554) of
the residuals ``e + J d`` of the fit, linear in its parameters at the end. It accounts for points that alone determine a
parameter: the fit passes through them, and their residuals are small for any noise. Errors from the residuals
themselves are ``(J^T J)^-1 J^T diag(e^2 / (1 - h)) J (J^T J)^-1`` with the leverages ``h`` (J. G. MacKinnon, H. White,
J. Econometrics 29, 1985, 305-325).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.identification.kinds import Measured
from slipstick.typing import Array, IntArray

_FLOORS = (-3.0, 1.0)
"""Decimal logarithms of noise without vibration over noise of a typical vibration: range of the search."""
_RATIOS = (-3.0, 2.0)
"""Decimal logarithms of the noise of frequencies over that of the other quantity of a backbone: range of the search."""
_LIKELIHOOD_GAIN = 5.0
"""Difference of log likelihoods above which noise is unequal; about one in a hundred tests of equal noise shows it."""
_FREEDOM = 10
"""Degrees of freedom below which noise counts as equal."""
_LEAST_SIZE = 1e-6
"""Least size of a number for relative noise, over the largest number."""
_CONFIDENCE = 0.9999
"""Probability with which noise alone stays below the limit of a test."""
_MOST_RESIDUALS = 1000
"""Largest number of residuals, those that affect a parameter most, for its degrees of freedom."""
_NEIGHBOURS = 15
"""Least number of pairs of neighbours for a test of their correlation."""
_CORRELATED = 3.5
"""Standard deviations above which that correlation is significant."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations of the measured numbers, with their description."""

    deviations: Array
    """Standard deviations, of the shape of the measured numbers."""
    relative: float
    """Noise over the size that ``text`` names; nan where noise is not proportional to the measured numbers."""
    text: str
    """In words."""


def given_noise(measured: Measured, predicted: Array, absolute: Array | None, relative: float) -> Noise:
    """Noise proportional to each predicted number, in addition to absolute noise."""
    (words, size), *_ = measured.shares(predicted).items()
    share = relative * np.maximum(size, _LEAST_SIZE * float(np.nanmax(size)))
    deviations = share if absolute is None else np.hypot(absolute, share)
    return Noise(deviations=deviations, relative=relative, text=f"noise {100 * relative:.3g} % {words}, as given")


def found_noise(measured: Measured, predicted: Array, left: Array, J: Array, used: NDArray[np.bool_]) -> Noise | None:
    """Unequal noise where the residuals show it, else None.

    Parameters
    ----------
    predicted
        Predicted numbers at the fitted parameters, of the shape of the measured ones.
    left, J
        Unweighted residuals (m,) and their derivatives (m, n_p).
    used
        Which measured numbers they belong to, of the same shape.
    """
    m = left.size
    basis = _basis(J)
    if m - basis.shape[1] < _FREEDOM or measured.in_time:
        return None
    best, chosen = _likelihood(left, basis, measured.sizes[used] ** 2)[0] + _LIKELIHOOD_GAIN, None
    for variances, ends, words in _candidates(measured, predicted):
        value, x = _largest(lambda x, v=variances: _likelihood(left, basis, v(x)[used])[0], ends)  # type: ignore[misc]
        if value > best:
            best, chosen = value, (variances(x), words)
    if chosen is None:
        return None
    relative_variances, words = chosen
    scale = _likelihood(left, basis, relative_variances[used])[1]
    deviations = np.sqrt(scale * relative_variances)
    return _described(measured, predicted, deviations, words)


def _candidates(
    measured: Measured, predicted: Array
) -> Iterator[tuple[Callable[[float], Array], tuple[float, float], str]]:
    """Relative variances as functions of one number, its range, and the size that noise grows with, in words."""
    if measured.quantities:
        if np.isfinite(measured.values).any(axis=0).all():
            first = np.array([1.0, 0.0])
            for own, words in ((measured.sizes, ""), (np.abs(predicted), "of each number")):
                square = own**2 / measured.sizes**2
                yield lambda x, s=square: measured.sizes**2 * s * 10.0 ** (2.0 * x * first), _RATIOS, words  # type: ignore[misc]
        return
    for words, size in measured.shares(predicted).items():
        square = size**2 / np.mean(size**2)
        yield lambda x, s=square: 10.0 ** (2.0 * x) + s, _FLOORS, words  # type: ignore[misc]


def _described(measured: Measured, predicted: Array, deviations: Array, words: str) -> Noise:
    there = np.isfinite(measured.values)
    if measured.quantities:
        shares = [float(np.sqrt(np.mean((deviations / measured.sizes)[there[:, k], k] ** 2))) for k in (0, 1)]
        said = ", ".join(
            f"{100 * share:.2g} % of the {name}" for share, name in zip(shares, measured.quantities, strict=True)
        )
        return Noise(deviations=deviations, relative=np.nan, text=f"noise {said}, found from what is left")
    size = measured.shares(predicted)[words]
    coefficients = np.linalg.lstsq(
        np.column_stack([np.ones(there.sum()), size[there] ** 2]), deviations[there] ** 2, rcond=None
    )[0]
    floor, share = np.sqrt(np.maximum(coefficients, 0.0))
    absolute = f" and {floor:.2g} beside it" if floor > 0.01 * float(np.sqrt(np.mean(deviations[there] ** 2))) else ""
    return Noise(
        deviations=deviations, relative=float(share),
        text=f"noise {100 * share:.2g} % {words}{absolute}, found from what is left",
    )  # fmt: skip


def _basis(J: Array) -> Array:
    """Orthonormal basis (m, rank) of the columns of the Jacobian."""
    lengths = np.linalg.norm(J, axis=0)
    U, values, _ = np.linalg.svd(J[:, lengths > 0.0] / lengths[lengths > 0.0], full_matrices=False)
    return np.asarray(U[:, values > 1e-7 * values.max(initial=0.0)])


def _likelihood(left: Array, basis: Array, variances: Array) -> tuple[float, float]:
    """Largest logarithm of the restricted likelihood, up to a constant, and its common variance ``s^2``."""
    weight = 1.0 / np.sqrt(variances)
    Q, R = np.linalg.qr(basis * weight[:, None])
    e = left * weight
    e = e - Q @ (Q.T @ e)
    freedom = left.size - basis.shape[1]
    common = float(e @ e) / freedom
    determinant = 2.0 * float(np.sum(np.log(np.abs(np.diag(R)))))
    return -0.5 * (freedom * float(np.log(common)) + float(np.sum(np.log(variances))) + determinant), common


def _largest(function: Callable[[float], float], ends: tuple[float, float]) -> tuple[float, float]:
    """Largest value of a function in an interval, and its argument: the best of a grid, refined."""
    from scipy.optimize import minimize_scalar

    grid = np.linspace(*ends, 13)
    values = [function(float(x)) for x in grid]
    k = int(np.argmax(values))
    low, high = grid[max(k - 1, 0)], grid[min(k + 1, grid.size - 1)]
    found = minimize_scalar(
        lambda x: -function(float(x)), bounds=(low, high), method="bounded", options={"xatol": 1e-3}
    )
    return max((values[k], float(grid[k])), (-float(found.fun), float(found.x)))


class Whiteness(NamedTuple):
    """Correlation of neighbouring residuals, and its distance from zero in standard deviations."""

    correlation: float
    deviations: float

    @property
    def significant(self) -> bool:
        """Whether the correlation is significant."""
        return self.deviations > _CORRELATED

    @property
    def factor(self) -> float:
        """Factor on standard errors: n numbers with correlations ``r^k`` count as ``n (1 - r) / (1 + r)``."""
        r = min(max(self.correlation, 0.0), 0.98)
        return float(np.sqrt((1.0 + r) / (1.0 - r)))


def neighbours(measured: Measured, used: NDArray[np.bool_]) -> IntArray:
    """Pairs (k, 2) of successive measured numbers, as indices among the used ones."""
    place = np.full(used.shape, -1)
    place[used] = np.arange(used.sum())
    chains = [place[run].reshape(len(run), -1) for run in measured.runs]
    out = []
    for chain in chains:
        for column in chain.T:
            there = column[column >= 0]
            out += [*zip(there[:-1].tolist(), there[1:].tolist(), strict=True)]
    return np.array(out, dtype=int).reshape(-1, 2)


def whiteness(pairs: IntArray, left: Array, J: Array, deviation: float) -> Whiteness:
    """Whiteness of weighted residuals, corrected for the effect of the fit on white noise (J. Durbin, G. S. Watson,
    Biometrika 37, 1950)."""
    if len(pairs) < _NEIGHBOURS or not deviation > 0.0:
        return Whiteness(0.0, 0.0)
    i, j = pairs.T
    Q, e = _basis(J), left / deviation
    products = np.zeros_like(Q)  # A Q, where e^T A e is the sum of products of neighbours
    np.add.at(products, i, 0.5 * Q[j])
    np.add.at(products, j, 0.5 * Q[i])
    small = Q.T @ products
    mean = -float(np.trace(small))
    # A^2 on the diagonal: a quarter of the number of neighbours; A has entries of one half
    variance = 2.0 * (0.5 * len(pairs) - 2.0 * float(np.sum(products**2)) + float(np.sum(small * small.T)))
    excess = float(e[i] @ e[j]) - mean
    return Whiteness(excess / len(pairs), excess / np.sqrt(max(variance, 1e-12)))


class Robust(NamedTuple):
    """Standard errors from the residuals over those from the noise, and where the difference is significant."""

    factor: Array
    significant: NDArray[np.bool_]


def robust(gain: Array, left: Array, J: Array, deviation: float) -> Robust:
    """Robust errors of parameters that are linear in weighted residuals, with coefficients ``gain`` (n_p, m).

    A parameter without any has no effect on what was measured, and no errors to compare: its factor is 1.
    """
    from scipy.stats import chi2

    basis = _basis(J)
    free = 1.0 - np.sum(basis**2, axis=1)
    square = np.where(free > 1e-6, left**2 / np.maximum(free, 1e-6), deviation**2)
    model = deviation**2 * np.sum(gain**2, axis=1)
    ratio = np.divide(np.sum(gain**2 * square, axis=1), model, out=np.ones_like(model), where=model > 0.0)
    freedom = np.array([_freedom(row, basis, free) if row.any() else 1.0 for row in gain])
    return Robust(np.sqrt(ratio), ratio > chi2.ppf(_CONFIDENCE, freedom) / freedom)


def _freedom(gain: Array, basis: Array, free: Array) -> float:
    """Degrees of freedom of such an error (R. M. Bell, D. F. McCaffrey, Survey Methodology 28, 2002, 169-181)."""
    most = np.argsort(-np.abs(gain))[:_MOST_RESIDUALS]
    most = most[free[most] > 1e-6]
    between = -basis[most] @ basis[most].T
    between[np.diag_indices(len(most))] += 1.0
    share = gain[most] ** 2 / free[most]
    return max(float(np.sum(share * np.diag(between)) ** 2 / (share @ between**2 @ share)), 1.0) if len(most) else 1.0


class Without(NamedTuple):
    """A fit without one level."""

    level: str
    shift: Array
    """First-order change of the parameters (n_p,); nan where the other levels do not determine one."""
    significant: bool
    """Whether the change is more than noise."""


def without_levels(
    measured: Measured, used: NDArray[np.bool_], left: Array, J: Array, deviation: float, freedom: int
) -> list[Without]:
    """Changes of the parameters without each of the levels, from weighted residuals and derivatives."""
    from scipy.stats import f

    chosen = measured.levels
    point = np.broadcast_to(np.arange(used.shape[0]).reshape(-1, *(1,) * (used.ndim - 1)), used.shape)[used]
    A = J.T @ J
    inverse = np.linalg.pinv(A, rcond=1e-14, hermitian=True)
    out = []
    for name, group in chosen:
        inside = np.isin(point, group)
        if not inside.any() or inside.all():
            continue
        of = J[inside].T @ J[inside]
        pull = J[inside].T @ left[inside]
        values, vectors = np.linalg.eigh(of - of @ inverse @ of)
        known = values > 1e-9 * max(float(np.abs(A).max()), 1e-300)
        rank = int(known.sum())
        statistic = float(np.sum((vectors[:, known].T @ pull) ** 2 / values[known])) / deviation**2 if rank else 0.0
        rest = np.linalg.eigh(A - of)
        determined = rest[0] > 1e-9 * rest[0].max()
        shift = rest[1][:, determined] @ ((rest[1][:, determined].T @ pull) / rest[0][determined])
        shift[np.any(np.abs(rest[1][:, ~determined]) > 1e-3, axis=1)] = np.nan
        limit = rank * float(f.ppf(1.0 - (1.0 - _CONFIDENCE) / len(chosen), rank, max(freedom, 1))) if rank else np.inf
        out.append(Without(name, shift, statistic > limit))
    return out


def too_large(chi_square: float, freedom: int) -> bool:
    """Whether a reduced chi square is significantly too large for the given noise."""
    from scipy.stats import chi2

    return bool(freedom > 0 and chi_square > chi2.ppf(_CONFIDENCE, freedom) / freedom)


def listed(names: Sequence[str]) -> str:
    """Names as a list in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def error_text(error: float, *, at_bound: bool) -> str:
    """A standard error in words."""
    if np.isinf(error):
        return "not determined"
    return f"+- {error:.2g}" if np.isfinite(error) else "at a bound" if at_bound else "no standard error"
