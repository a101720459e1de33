"""The result of a fit: parameters with their uncertainty, and how it is made from the end of the descent."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.analysis.identification.descent import End, explained
from slipstick.analysis.identification.fit_request import FitRequest
from slipstick.analysis.identification.noise import (
    Noise,
    Without,
    error_text,
    listed,
    neighbours,
    robust,
    too_large,
    whiteness,
    without_levels,
)
from slipstick.analysis.identification.search import ROUNDING
from slipstick.balance.parameters import parameter_units
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import number, shown, suggestion, wrong
from slipstick.results.saved_table import write_table
from slipstick.results.schema import ANALYSIS, versions
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Parameters that fit what was measured.

    Attributes
    ----------
    values
        By the names of the parameters.
    standard_errors
        Alike; inf of what the measurement does not determine, nan at a bound, and nan where they are ``refused``.
    correlations
        Of the errors, (parameter, other); nan where one of them is not determined.
    singular_values
        Of the Jacobian of the weighted numbers by relative changes of the parameters, the largest first.
    indistinct
        What cannot be separated, one sentence each.
    warnings
        All that the fit warned of, one sentence each, with those of ``indistinct``.
    refused
        Why there are no standard errors; empty where there are.
    misfit
        Root mean square of what is left, over that of what was measured.
    noise
        Standard deviation of one measured number: the one that was given (their root mean square), else estimated from
        what is left.
    relative_noise
        Share of what was measured that the noise is, given or found; nan where it does not grow with that.
    weights
        What noise the numbers were weighted by, in words; empty where it is equal or the one given for each.
    without_level
        How the parameters move where one of the conditions that were set is left out, to first order: by the condition
        in words, then by the name of the parameter; nan of what the others do not determine.
    reduced_chi_square
        Sum of the squares left over the noise, for each degree of freedom: near 1 where model and noise are right; nan
        where no noise was given.
    at_bound
        Names of parameters that ended at a bound.
    several
        Points at which more than one motion is possible; the nearest to what was measured was taken.
    converged
        Whether the fit ended well: at a minimum, and near what was measured.
    message
        How it ended, in words.
    problem
        With the parameters that fit.
    dataset
        Measured and fitted numbers, values, errors, correlations and all else that is here.
    evaluations
        Residuals that were asked for.
    solutions
        Motions that were solved for.
    starts
        Sum of squares that each start led to, the one of the result first, before numbers were weighted by noise found.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=300.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=100.0), harmonics=range(6))
    >>> measured = ss.steady_response(problem, omega=[6.0, 8.0, 9.0, 10.0]).dataset
    >>> fit = ss.identify(problem, measured, {"foot.mu": 0.4})
    >>> round(fit.values["foot.mu"], 6), fit.converged, fit.indistinct, fit.misfit < 1e-6
    (0.3, True, (), True)
    """

    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    correlations: Array
    singular_values: Array
    indistinct: tuple[str, ...]
    warnings: tuple[str, ...]
    refused: str
    at_bound: tuple[str, ...]
    misfit: float
    noise: float
    relative_noise: float
    weights: str
    without_level: Mapping[str, Mapping[str, float]]
    reduced_chi_square: float
    degrees_of_freedom: int
    several: int
    converged: bool
    message: str
    problem: Problem
    dataset: xarray.Dataset
    evaluations: int
    solutions: int
    starts: tuple[float, ...]

    def interval(self, name: str, level: float = 0.9) -> tuple[float, float]:
        """Confidence interval of a parameter, of Student's t where the noise was estimated."""
        from scipy.stats import norm, t

        if name not in self.values:
            raise InputError(
                Fault("name", f"there is no parameter {shown(name)}", remedy=suggestion(name, self.values))
            )
        level = number("level", level, "a number between 0 and 1", above=0.0)
        if not 0.0 < level < 1.0:
            raise wrong("level", level, "a number between 0 and 1")
        known = np.isfinite(self.reduced_chi_square)
        quantile = norm.ppf(0.5 + level / 2) if known else t.ppf(0.5 + level / 2, max(self.degrees_of_freedom, 1))
        half = float(quantile) * self.standard_errors[name]
        return self.values[name] - half, self.values[name] + half

    def save_table(self, path: str | Path, table: str | None = None) -> Path:
        """Write the dataset for other programs and return the path: .csv, one table, or .xlsx and .mat, all of it.

        ``table`` chooses: "parameter" (of a .csv file by default: values, standard errors, correlations), "point"
        (measured and fitted numbers) or "rank" (singular values).

        Raises
        ------
        InputError
            For another ending or table, and where the file cannot be written.
        """
        return write_table(self.dataset, path, table)

    def summary(self) -> str:
        """All of it as a text."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.message}; misfit {self.misfit:.3g} of what was measured, noise {self.noise:.3g}"
        if np.isfinite(self.reduced_chi_square):
            yield f"reduced chi square {self.reduced_chi_square:.3g}, {self.degrees_of_freedom} degrees of freedom"
        wide = max(map(len, self.values))
        for name, value in self.values.items():
            error, unit = self.standard_errors[name], parameter_units(self.problem, name)
            label = "" if unit == "1" else f"  {self.problem.units.label(unit)}"
            said = error_text(error, at_bound=name in self.at_bound)
            yield f"  {name:<{wide}}  {value:<12.8g} {said}{label}"
        names = list(self.values)
        for i, j in zip(*np.triu_indices(len(names), 1), strict=True):
            if abs(self.correlations[i, j]) > 0.9:
                yield f"  errors of {names[i]} and {names[j]} are correlated: {self.correlations[i, j]:.3f}"
        if self.weights:
            yield self.weights
        yield from self.warnings
        if self.several:
            yield f"{self.several} points have more than one motion: the one nearest to what was measured was taken"

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={value:.6g}" for name, value in self.values.items())
        return f"Identification({said}; misfit {self.misfit:.3g})"


_EMPTY: Any = None


def result_of(
    request: FitRequest, end: End, costs: Sequence[float], weights: Noise | None, told: Sequence[str], *,
    stopped: str = "",
) -> Identification:  # fmt: skip
    """The result of a fit with this end; ``costs`` are those of all starts, ``told`` the sentences so far.

    ``stopped`` is the message of a fit that was interrupted.
    """
    freedom = end.left.size - len(request.names)
    known = request.known
    spread = float(np.sqrt(end.cost / freedom)) if freedom > 0 else np.nan
    far, told = end.far and not explained(request, end), list(told)
    deviation, refused = 1.0 if known else spread, ""
    if far:
        deviation, refused = np.nan, (
            f"there are no standard errors: the misfit, {100.0 * end.misfit:.2g} % of what was measured, is too large "
            "for noise; if the measurement is that noisy, give noise or relative_noise"
        )  # fmt: skip
        told.append(refused)
    elif known and freedom > 0 and too_large(spread**2, freedom):
        deviation = spread
        told.append(
            f"the residual is {spread:.2g} times the noise that was given: standard errors are multiplied by it"
        )
    statistics = statistics_of(request.names, end, deviation)
    left_out: list[Without] = []
    if not far and end.misfit > ROUNDING and freedom > 2 and deviation > 0.0:
        statistics, left_out, sentences = checked_against_residuals(request, end, statistics, deviation)
        told += sentences
    errors, correlations, singular, sentences, _ = statistics
    values = dict(zip(request.names, end.p.tolist(), strict=True))
    problem = request.problem.at_parameters(values)
    bound = tuple(name for name, at in zip(request.names, end.at_bound, strict=True) if at)
    message = "the fit converged" if end.converged else f"the fit did not converge in {request.most} evaluations"
    if far:
        message = f"the fit ends far from what was measured: misfit {end.misfit:.2g}"
    message = stopped or message
    if bound:
        message += f", with {' and '.join(bound)} at a bound"
    found = Identification(
        values=values,
        standard_errors=dict(zip(request.names, errors.tolist(), strict=True)),
        correlations=correlations,
        singular_values=singular,
        indistinct=tuple(sentences),
        warnings=tuple(dict.fromkeys([*told, *sentences])),
        refused=refused,
        at_bound=bound,
        misfit=end.misfit,
        noise=float(np.sqrt(np.mean(request.scale**2))) * (spread if far and not known else deviation),
        relative_noise=np.nan if weights is None else weights.relative,
        weights="" if weights is None else weights.text,
        without_level={
            each.level: dict(zip(request.names, (end.p + each.shift).tolist(), strict=True)) for each in left_out
        },
        reduced_chi_square=spread**2 if known else np.nan,
        degrees_of_freedom=freedom,
        several=end.predictor.several,
        converged=end.converged and not far,
        message=message,
        problem=problem,
        dataset=_EMPTY,
        evaluations=end.evaluations,
        solutions=end.predictor.solved,
        starts=tuple(costs),
    )
    return replace(found, dataset=_dataset(request, end, found, deviation))


def _dataset(request: FitRequest, end: End, found: Identification, deviation: float) -> xarray.Dataset:
    """The result as labelled arrays."""
    import xarray

    measured, problem = request.measured, request.problem
    label = problem.units.label
    names = np.array(request.names, dtype=np.str_)
    units = np.array([label(parameter_units(problem, name)) for name in request.names], dtype=np.str_)
    data: dict[str, Any] = {
        "value": ("parameter", end.p, {"long_name": "parameters that fit"}),
        "standard_error": ("parameter", np.array([*found.standard_errors.values()])),
        "at_bound": ("parameter", end.at_bound.astype(np.int8)),
        "correlation": (("parameter", "other"), found.correlations),
        "singular_value": ("rank", found.singular_values),
    }
    coords: dict[str, Any] = {"parameter": names, "other": names, "units": ("parameter", units)}
    dims, own, unit, what = measured.described(problem)
    coords |= own
    about = {"units": unit}
    data["measured"] = (dims, measured.values, {**about, "long_name": f"measured {what}"})
    data["fitted"] = (dims, end.predicted, {**about, "long_name": f"fitted {what}"})
    deviations = np.full(measured.values.shape, np.nan)
    deviations[request.used] = request.scale * deviation
    data["standard_deviation"] = (dims, deviations, {**about, "long_name": f"noise of the measured {what}"})
    if found.without_level:
        coords["level"] = list(found.without_level)
        moved = np.array([[*values.values()] for values in found.without_level.values()])
        data["without_level"] = (("level", "parameter"), moved, {"long_name": "parameters without a level"})
    attributes = {
        ANALYSIS: "identify", "warnings": "\n".join(found.warnings), "refused": found.refused, "weights": found.weights,
        "misfit": found.misfit, "noise": found.noise, "converged": int(found.converged), "message": found.message,
        "indistinct": "\n".join(found.indistinct), "several": found.several,
        "degrees_of_freedom": found.degrees_of_freedom, "title": problem.title, **problem.units.attributes,
        **versions(),
    }  # fmt: skip
    if np.isfinite(found.reduced_chi_square):
        attributes["reduced_chi_square"] = found.reduced_chi_square
    if np.isfinite(found.relative_noise):
        attributes["relative_noise"] = found.relative_noise
    return xarray.Dataset(data, coords=coords, attrs=attributes)


_INDISTINCT = 1e-7
"""Singular value over the largest, up to which a combination of parameters has no effect."""
IN_NOISE = 0.5
"""Relative standard deviation of a combination, above which the noise hides it."""
_TAKES_PART = 0.05
"""Component over the largest one, above which a parameter belongs to a combination."""


def checked_against_residuals(
    request: FitRequest, end: End, statistics: Statistics, deviation: float
) -> tuple[Statistics, list[Without], list[str]]:
    """Statistics with standard errors enlarged for residuals that are not noise, fits without levels, and sentences."""
    told: list[str] = []
    size, free = np.where(end.p != 0.0, np.abs(end.p), 1.0), ~end.at_bound
    J, errors = (end.J * size)[:, free], statistics.errors.copy()
    names = [name for name, there in zip(request.names, free, strict=True) if there]
    if not J.size or not len(statistics.gain):
        return statistics, [], told
    white = whiteness(neighbours(request.measured, request.used), end.left, J, deviation)
    growth = np.ones(len(names))
    if white.significant:
        growth *= white.factor
        told.append(
            f"the residual is not white: neighbouring points are correlated ({white.correlation:.2f}), so the model "
            f"lacks something or the noise is not random; standard errors are multiplied by {white.factor:.2g}"
        )
    unequal = robust(statistics.gain, end.left, J, deviation)
    larger = unequal.significant & (unequal.factor > growth)
    if larger.any():
        growth[larger] = unequal.factor[larger]
        which = [f"{name} ({factor:.2g} times)" for name, factor in zip(names, growth, strict=True)]
        told.append(
            "the residual is larger where parameters are determined: standard errors are taken from it (sandwich "
            f"estimate) for {listed([word for word, there in zip(which, larger, strict=True) if there])}"
        )
    errors[free] *= growth
    freedom = end.left.size - len(request.names)
    left_out = []
    for each in without_levels(request.measured, request.used, end.left, J, deviation, freedom):
        shift = np.zeros(len(end.p))
        shift[free] = each.shift * size[free]
        left_out.append(each._replace(shift=shift))
        moved = np.flatnonzero((np.abs(shift) > errors) & each.significant)
        if len(moved):
            values = [f"{request.names[k]} would be about {end.p[k] + shift[k]:.4g}" for k in moved]
            told.append(
                f"without {each.level} {listed(values)}: the levels do not agree within the noise, and standard errors "
                "are at least these changes"
            )
            errors[moved] = np.abs(shift[moved])
    return statistics._replace(errors=errors), left_out, told


class Statistics(NamedTuple):
    """Statistics of the parameters of a fit."""

    errors: Array
    """Standard errors (n_p,)."""
    correlations: Array
    """Correlations of the errors (n_p, n_p)."""
    singular: Array
    sentences: list[str]
    """Sentences about parameters that are not separated."""
    gain: Array
    """Derivatives (n_free, m) of relative values of the free parameters by weighted numbers."""


def statistics_of(
    names: Sequence[str], end: End, deviation: float
) -> Statistics:  # fmt: skip
    """Statistics of the parameters, with a standard deviation of the weighted numbers."""
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
    """Sentence about a combination of relative changes without effect."""
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
