"""Percentiles of the peaks and curves of a study of samples; the Weibull distribution of maxima."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import gamma, log
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import number_or_numbers, shown, whole
from slipstick.results.table import is_dataset
from slipstick.results.view import followed_of
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray


PERCENTILES = (5.0, 50.0, 95.0)
_GRID = 400
"""Default number of frequencies of a band."""


def is_sampled(study: xarray.Dataset) -> bool:
    """Whether the parameters of a study are samples: of a grid or a list there are no percentiles."""
    return bool(study.attrs.get("study_distributions"))


def checked_percentiles(percentiles: object) -> list[float]:
    """Percentiles in percent; raises InputError where one is not between 0 and 100."""
    asked = np.atleast_1d(number_or_numbers("percentiles", percentiles, "numbers > 0 and < 100")).tolist()
    if wrong := [p for p in asked if not 0.0 < p < 100.0]:
        raise InputError(Fault("percentiles", found=f"{wrong[0]:g}", expected="numbers > 0 and < 100"))
    return asked


def peak_percentiles(study: xarray.Dataset, percentiles: Sequence[float] = PERCENTILES) -> xarray.Dataset:
    """How large peaks are, and where, in so many percent of the samples.

    Parameters
    ----------
    study
        The dataset of a study with random, Latin hypercube or Sobol samples.
    percentiles
        In percent, between 0 and 100.

    Returns
    -------
    xarray.Dataset
        ``peak_amplitude`` and ``peak_omega`` (or ``peak_parameter``) over (percentile, dof), and ``samples``, (dof),
        the number of completed ones.

    Raises
    ------
    InputError
        For what is no study of samples, and percentiles out of range.
    """
    import xarray

    asked, complete = checked_percentiles(percentiles), _complete(study)
    where = "peak_parameter" if "peak_parameter" in study else "peak_omega"
    data: dict[str, Any] = {}
    for name in ("peak_amplitude", where):
        values = study[name].to_numpy()[complete]
        data[name] = (("percentile", "dof"), _percentiles(values, asked), dict(study[name].attrs))
    data["samples"] = "dof", np.isfinite(study["peak_amplitude"].to_numpy()[complete]).sum(axis=0)
    return xarray.Dataset(data, coords={"percentile": asked, "dof": study["dof"]})


def curve_percentiles(
    curves: xarray.Dataset,
    study: xarray.Dataset,
    percentiles: Sequence[float] = PERCENTILES,
    *,
    points: int = _GRID,
) -> xarray.Dataset:
    """How large amplitudes are at each frequency in so many percent of the samples.

    Where a curve has several amplitudes at one frequency the largest counts. Between its points it is straight.

    Parameters
    ----------
    curves, study
        The datasets in ``curves.nc`` and ``study.nc``.
    percentiles
        In percent, between 0 and 100.
    points
        Number of frequencies, evenly over what the curves cover.

    Returns
    -------
    xarray.Dataset
        ``amplitude`` over (percentile, omega, dof), with the followed parameter in the place of omega where there is
        one, and ``samples`` (omega), how many curves reach there; those that did not complete are left out.

    Raises
    ------
    InputError
        For what is no study of samples with its curves, and percentiles out of range.
    """
    import xarray

    if not is_dataset(curves, "case", "amplitude", "branch_part"):
        raise InputError(f"percentiles: found {shown(curves)}; expected the dataset in curves.nc")
    asked, points = checked_percentiles(percentiles), whole("points", points, 2, 100_000)
    numbers = study["case"].to_numpy()[_complete(study)]
    followed = followed_of(curves)
    case, x, part = (curves[name].to_numpy() for name in ("case", followed, "branch_part"))
    amplitude = curves["amplitude"].transpose("point", "dof").to_numpy()
    known = np.isin(case, numbers)
    if not known.any():
        raise InputError("percentiles: no curve of the study is complete")
    grid = np.linspace(x[known].min(), x[known].max(), points)
    values = []
    for number in numbers[np.isin(numbers, case)].tolist():
        at = slice(*np.searchsorted(case, [number, number + 1]))
        values.append(_highest(grid, x[at], amplitude[at], part[at]))
    stacked = np.array(values)
    sizes = np.stack([_percentiles(stacked[:, :, d], asked) for d in range(amplitude.shape[1])], axis=2)
    attributes = dict(curves["amplitude"].attrs)
    return xarray.Dataset(
        {
            "amplitude": (("percentile", followed, "dof"), sizes, attributes),
            "samples": (followed, np.isfinite(stacked[:, :, 0]).sum(axis=0)),
        },
        coords={"percentile": asked, followed: (followed, grid, dict(curves[followed].attrs)), "dof": curves["dof"]},
    )


def _highest(grid: Array, x: Array, y: Array, part: Array) -> Array:
    """The largest of the amplitudes (k, n_dofs) that a curve has at each place of the grid; nan where it has none."""
    out = np.full((grid.size, y.shape[1]), np.nan)
    for i in np.flatnonzero(part[1:] == part[:-1]).tolist():
        low, high = sorted((x[i], x[i + 1]))
        at = slice(np.searchsorted(grid, low, "left"), np.searchsorted(grid, high, "right"))
        share = ((grid[at] - x[i]) / (x[i + 1] - x[i]))[:, None] if high > low else np.ones((grid[at].size, 1))
        out[at] = np.fmax(out[at], y[i] + share * (y[i + 1] - y[i]))
    return out


def _percentiles(values: Array, percentiles: Sequence[float]) -> Array:
    """Percentiles (n_percentiles, n) of columns, their nan left out; nan where nothing is left."""
    out = np.full((len(percentiles), values.shape[1]), np.nan)
    for k, column in enumerate(values.T):
        known = column[np.isfinite(column)]
        if known.size:
            out[:, k] = np.percentile(known, percentiles)
    return out


def _complete(study: xarray.Dataset) -> Any:
    """Which cases of a study of samples completed, (n_cases,) of bool."""
    if not is_dataset(study, "peak_amplitude"):
        raise InputError(f"percentiles: found {shown(study)}; expected the dataset that ss.study returns")
    if not is_sampled(study):
        method = str(study.attrs.get("study_method", ""))
        expected = 'samples: method = "random", "latin-hypercube" or "sobol"'
        raise InputError(Fault("percentiles", found=f'a study with method = "{method}"', expected=expected))
    return study["outcome"].to_numpy() == "COMPLETED"


FEWEST = 8
"""Samples from which a distribution is fitted."""
_SMALLEST_SHAPE = 1e-9
"""The Gumbel distribution, shape 0, is taken with this shape: the formulas divide by it."""


@dataclass(frozen=True, kw_only=True)
class WeibullMaxima:
    """``F(a) = exp(-(1 - shape (a - place) / scale)^(1 / shape))``: extreme values, bounded above where shape > 0.

    That is the Weibull distribution of maxima: none is above ``place + scale / shape``.
    """

    shape: float
    place: float
    scale: float

    @property
    def upper(self) -> float:
        """Upper bound of the values; inf where there is none."""
        return self.place + self.scale / self.shape if self.shape > 0.0 else float("inf")

    def percentile(self, percent: float) -> float:
        """The value that ``percent`` percent of the values do not exceed."""
        return self.place + self.scale * (1.0 - (-log(percent / 100.0)) ** self.shape) / self.shape

    @classmethod
    def fitted(cls, values: Sequence[float] | Array) -> WeibullMaxima:
        """By probability-weighted moments (Hosking, Wallis, Wood, Technometrics 27 (1985) 251).

        Raises
        ------
        InputError
            For fewer than 8 values, or values that are all equal.
        """
        a = np.sort(np.asarray(values, dtype=float))
        n, i = a.size, np.arange(a.size)
        if n < FEWEST or not np.ptp(a) > 0.0:
            raise InputError(Fault("values", found=f"{n} values", expected=f"at least {FEWEST} that differ"))
        b0, b1, b2 = a.mean(), (i * a).mean() / (n - 1), (i * (i - 1) * a).mean() / ((n - 1) * (n - 2))
        c = (2.0 * b1 - b0) / (3.0 * b2 - b0) - log(2.0) / log(3.0)
        shape = 7.8590 * c + 2.9554 * c * c
        shape = shape if abs(shape) > _SMALLEST_SHAPE else _SMALLEST_SHAPE
        scale = (2.0 * b1 - b0) * shape / (gamma(1.0 + shape) * (1.0 - 2.0**-shape))
        return cls(shape=float(shape), scale=float(scale), place=float(b0 + scale * (gamma(1.0 + shape) - 1.0) / shape))
