"""Percentiles over the number of samples."""

import numpy as np
import pytest
import xarray

import slipstick as ss
from slipstick.results.percentiles import WeibullMaxima


def samples(values) -> xarray.Dataset:
    return xarray.Dataset({"amplification": ("sample", np.asarray(values, dtype=float))})


def test_lines_are_percentiles_of_the_first_samples():
    values = np.random.default_rng(2).weibull(3.0, 50)
    ax = ss.plots.percentile_convergence(samples([np.nan, *values]), (50, 95))
    plain, fitted = ax.lines[2:4]
    assert plain.get_label() == "95 %"
    at = dict(zip(*plain.get_data(), strict=True))
    assert (min(at), max(at)) == (1, 50)
    assert all(value == np.percentile(values[:n], 95) for n, value in at.items())
    counts, y = fitted.get_data()
    assert min(counts) >= 8
    assert y[-1] == pytest.approx(WeibullMaxima.fitted(values).percentile(95))


@pytest.mark.parametrize(
    ("given", "percentiles", "fragment"),
    [
        (xarray.Dataset(), (50,), "expected the dataset of a mistuning study"),
        (samples([np.nan]), (50,), "all samples failed"),
        (samples([1.0]), (100.0,), "found 100"),
        (samples([1.0]), (0.0,), "percentiles"),
    ],
)
def test_faults(given, percentiles, fragment):
    with pytest.raises(ss.InputError, match=fragment):
        ss.plots.percentile_convergence(given, percentiles)
