"""From the end of a fit to its result: values, errors, sentences, a dataset."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.identification.descent import FAR, End, explained
from slipstick.analysis.identification.fit_request import FitRequest
from slipstick.analysis.identification.identification import Identification
from slipstick.analysis.identification.noise import Noise, Without, too_large
from slipstick.analysis.identification.search import ROUNDING
from slipstick.analysis.identification.statistics import checked_against_residuals, statistics_of
from slipstick.balance.parameters import parameter_units
from slipstick.results.schema import ANALYSIS, versions

if TYPE_CHECKING:
    import xarray


_EMPTY: Any = None


def result_of(
    request: FitRequest, end: End, costs: Sequence[float], weights: Noise | None, told: Sequence[str], *,
    stopped: str = "",
) -> Identification:  # fmt: skip
    """The result of a fit that ended there; ``costs`` are those of all starts, ``told`` what was said on the way.

    ``stopped`` says why it did not come to its end.
    """
    freedom = end.left.size - len(request.names)
    known = request.known
    spread = float(np.sqrt(end.cost / freedom)) if freedom > 0 else np.nan
    far, told = end.misfit > FAR and not explained(request, end), list(told)
    deviation, refused = 1.0 if known else spread, ""
    if far:
        deviation, refused = np.nan, (
            f"there are no standard errors: what is left, {100.0 * end.misfit:.2g} % of what was measured, is not "
            "taken for noise; if the measurement is that noisy, give noise or relative_noise"
        )  # fmt: skip
        told.append(refused)
    elif known and freedom > 0 and too_large(spread**2, freedom):
        deviation = spread
        told.append(
            f"what is left is {spread:.2g} times the noise that was given: standard errors are multiplied by it"
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
    """Everything as labelled arrays."""
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
