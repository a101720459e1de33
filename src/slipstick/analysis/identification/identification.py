"""Parameters that fit what was measured, and how sure they are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipstick.analysis.identification.noise import error_text
from slipstick.balance.parameters import parameter_units
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import number, shown, suggestion, wrong
from slipstick.results.saved_table import write_table
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
        """Write the dataset for other programs and return the path: a .csv file, one table, or a .mat file, all of it.

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
