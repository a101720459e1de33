"""The noise that the residuals of a fit show, and what in them is no noise.

Variances are those of the largest restricted likelihood (H. D. Patterson, R. Thompson, Biometrika 58, 1971, 545-554)
of the residuals ``e`` of the fit, linear in its parameters at the end: ``e + J d``, with variances ``s^2 u``. It allows
for points that the fit passes through because they alone determine a parameter: their residuals are small however
large their noise is. Errors from the residuals themselves are ``(J^T J)^-1 J^T diag(e^2 / (1 - h)) J (J^T J)^-1`` with
the leverages ``h`` (J. G. MacKinnon, H. White, J. Econometrics 29, 1985, 305-325).
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
"""Decimal logarithms between which the noise that is left at no vibration, over that of a typical one, is sought."""
_RATIOS = (-3.0, 2.0)
"""Likewise of the noise of frequencies over that of the other quantity of a backbone."""
_LIKELIER = 5.0
"""Difference of log likelihoods from which unequal noise is taken; equal noise shows it in some test of a hundred."""
_FREEDOM = 10
"""Degrees of freedom below which unequal noise cannot be told from equal one."""
_SMALLEST = 1e-6
"""Noise that is a share of a number does not vanish with it: of the largest number this share is left."""
_SURE = 0.9999
"""Probability with which noise alone would not look so."""
_WEIGHTY = 1000
"""Numbers with the largest part in a parameter, of which that is counted."""
_NEIGHBOURS = 15
"""Neighbours in frequency, at least, from which a correlation is told."""
_CORRELATED = 3.5
"""Standard deviations of that correlation without one, beyond which it is one."""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations of what was measured, and how they came about."""

    deviations: Array
    """Of the shape of what was measured."""
    relative: float
    """Share of the size that ``text`` names; nan where noise does not grow with what is measured."""
    text: str
    """In words."""


def given_noise(measured: Measured, predicted: Array, absolute: Array | None, relative: float) -> Noise:
    """Noise that is a share of each number of the prediction, beside an absolute one."""
    (words, size), *_ = measured.shares(predicted).items()
    share = relative * np.maximum(size, _SMALLEST * float(np.nanmax(size)))
    deviations = share if absolute is None else np.hypot(absolute, share)
    return Noise(deviations=deviations, relative=relative, text=f"noise {100 * relative:.3g} % {words}, as given")


def found_noise(measured: Measured, predicted: Array, left: Array, J: Array, used: NDArray[np.bool_]) -> Noise | None:
    """Unequal noise where the residuals show it, else None.

    Parameters
    ----------
    predicted
        By the parameters that fit, of the shape of what was measured.
    left, J
        Residuals (m,) and their derivatives (m, n_p), not weighted.
    used
        Which numbers they are of, of that shape.
    """
    m = left.size
    basis = _basis(J)
    if m - basis.shape[1] < _FREEDOM or measured.in_time:
        return None
    best, chosen = _likelihood(left, basis, measured.sizes[used] ** 2)[0] + _LIKELIER, None
    for variances, ends, words in _candidates(measured, predicted):
        value, x = _largest(lambda x, v=variances: _likelihood(left, basis, v(x)[used])[0], ends)  # type: ignore[misc]
        if value > best:
            best, chosen = value, (variances(x), words)
    if chosen is None:
        return None
    relative_variances, words = chosen
    scale = _likelihood(left, basis, relative_variances[used])[1]
    deviations = np.sqrt(scale * relative_variances)
    return _told(measured, predicted, deviations, words)


def _candidates(
    measured: Measured, predicted: Array
) -> Iterator[tuple[Callable[[float], Array], tuple[float, float], str]]:
    """Variances over a common one, as functions of one number; the ends of that; what grows, in words."""
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


def _told(measured: Measured, predicted: Array, deviations: Array, words: str) -> Noise:
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
    beside = f" and {floor:.2g} beside it" if floor > 0.01 * float(np.sqrt(np.mean(deviations[there] ** 2))) else ""
    return Noise(
        deviations=deviations, relative=float(share),
        text=f"noise {100 * share:.2g} % {words}{beside}, found from what is left",
    )  # fmt: skip


def _basis(J: Array) -> Array:
    """Orthonormal columns (m, rank) of the directions in which parameters move what is predicted."""
    lengths = np.linalg.norm(J, axis=0)
    U, values, _ = np.linalg.svd(J[:, lengths > 0.0] / lengths[lengths > 0.0], full_matrices=False)
    return np.asarray(U[:, values > 1e-7 * values.max(initial=0.0)])


def _likelihood(left: Array, basis: Array, variances: Array) -> tuple[float, float]:
    """Logarithm of the restricted likelihood, up to a constant, and the common variance ``s^2`` of the largest."""
    weight = 1.0 / np.sqrt(variances)
    Q, R = np.linalg.qr(basis * weight[:, None])
    e = left * weight
    e = e - Q @ (Q.T @ e)
    freedom = left.size - basis.shape[1]
    common = float(e @ e) / freedom
    determinant = 2.0 * float(np.sum(np.log(np.abs(np.diag(R)))))
    return -0.5 * (freedom * float(np.log(common)) + float(np.sum(np.log(variances))) + determinant), common


def _largest(function: Callable[[float], float], ends: tuple[float, float]) -> tuple[float, float]:
    """Largest value of a function of one number between two, and where: the best of a grid, refined."""
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
    """Correlation of neighbours, and how many standard deviations it is from none."""

    correlation: float
    deviations: float

    @property
    def told(self) -> bool:
        """Whether it is no accident."""
        return self.deviations > _CORRELATED

    @property
    def factor(self) -> float:
        """By which standard errors grow: of n numbers with correlations ``r^k`` only ``n (1 - r) / (1 + r)`` count."""
        r = min(max(self.correlation, 0.0), 0.98)
        return float(np.sqrt((1.0 + r) / (1.0 - r)))


def neighbours(measured: Measured, used: NDArray[np.bool_]) -> IntArray:
    """Pairs (k, 2) of fitted numbers, counted among those used, that were measured next to each other."""
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
    """Of weighted residuals; what the fit itself makes of white noise is allowed for (as J. Durbin, G. S. Watson,
    Biometrika 37, 1950, do)."""
    if len(pairs) < _NEIGHBOURS or not deviation > 0.0:
        return Whiteness(0.0, 0.0)
    i, j = pairs.T
    Q, e = _basis(J), left / deviation
    beside = np.zeros_like(Q)  # A Q, where e^T A e is the sum of products of neighbours
    np.add.at(beside, i, 0.5 * Q[j])
    np.add.at(beside, j, 0.5 * Q[i])
    small = Q.T @ beside
    mean = -float(np.trace(small))
    # A^2 on the diagonal: a quarter of the number of neighbours; A has entries of one half
    variance = 2.0 * (0.5 * len(pairs) - 2.0 * float(np.sum(beside**2)) + float(np.sum(small * small.T)))
    excess = float(e[i] @ e[j]) - mean
    return Whiteness(excess / len(pairs), excess / np.sqrt(max(variance, 1e-12)))


class Robust(NamedTuple):
    """Standard errors from the residuals themselves, over those from the noise, and for which that is no accident."""

    factor: Array
    told: NDArray[np.bool_]


def robust(gain: Array, left: Array, J: Array, deviation: float) -> Robust:
    """Of parameters that weighted residuals move by ``gain`` (n_p, m)."""
    from scipy.stats import chi2

    basis = _basis(J)
    free = 1.0 - np.sum(basis**2, axis=1)
    square = np.where(free > 1e-6, left**2 / np.maximum(free, 1e-6), deviation**2)
    model = deviation**2 * np.sum(gain**2, axis=1)
    ratio = np.sum(gain**2 * square, axis=1) / model
    freedom = np.array([_freedom(row, basis, free) for row in gain])
    return Robust(np.sqrt(ratio), ratio > chi2.ppf(_SURE, freedom) / freedom)


def _freedom(gain: Array, basis: Array, free: Array) -> float:
    """Degrees of freedom of such an error (R. M. Bell, D. F. McCaffrey, Survey Methodology 28, 2002, 169-181)."""
    most = np.argsort(-np.abs(gain))[:_WEIGHTY]
    most = most[free[most] > 1e-6]
    between = -basis[most] @ basis[most].T
    between[np.diag_indices(len(most))] += 1.0
    share = gain[most] ** 2 / free[most]
    return max(float(np.sum(share * np.diag(between)) ** 2 / (share @ between**2 @ share)), 1.0) if len(most) else 1.0


class Without(NamedTuple):
    """A level left out."""

    level: str
    shift: Array
    """Of the parameters (n_p,), to first order; nan of what the others do not determine."""
    told: bool
    """Whether it is more than noise."""


def without_levels(
    measured: Measured, used: NDArray[np.bool_], left: Array, J: Array, deviation: float, freedom: int
) -> list[Without]:
    """How parameters move where one level is left out, from weighted residuals and derivatives."""
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
        seen = rest[0] > 1e-9 * rest[0].max()
        shift = rest[1][:, seen] @ ((rest[1][:, seen].T @ pull) / rest[0][seen])
        shift[np.any(np.abs(rest[1][:, ~seen]) > 1e-3, axis=1)] = np.nan
        limit = rank * float(f.ppf(1.0 - (1.0 - _SURE) / len(chosen), rank, max(freedom, 1))) if rank else np.inf
        out.append(Without(name, shift, statistic > limit))
    return out


def too_large(chi_square: float, freedom: int) -> bool:
    """Whether a reduced chi square is no accident of the noise that was given."""
    from scipy.stats import chi2

    return bool(freedom > 0 and chi_square > chi2.ppf(_SURE, freedom) / freedom)


def listed(names: Sequence[str]) -> str:
    """Names as a list in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def error_text(error: float, *, at_bound: bool) -> str:
    """A standard error in words."""
    if np.isinf(error):
        return "not determined"
    return f"+- {error:.2g}" if np.isfinite(error) else "at a bound" if at_bound else "no standard error"
