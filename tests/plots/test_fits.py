"""Figures of identifications: a curve for each level, in the unit of the case."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from slipstick import plots


def levels_over_frequency() -> xr.Dataset:
    """Three levels of a load, the same frequencies each, one below the other."""
    omega, load = np.tile(np.linspace(20.0, 40.0, 5), 3), np.repeat([1.0, 2.0, 5.0], 5)
    size = load / np.hypot(900.0 - omega**2, 30.0)
    about = {"units": "mm", "long_name": "measured amplitude"}
    return xr.Dataset(
        {"measured": (("point", "dof"), 1.02 * size[:, None], about), "fitted": (("point", "dof"), size[:, None])},
        coords={"omega": ("point", omega, {"units": "rad/s"}), "dof": ["x"], "load.x.amplitude": ("point", load)},
        attrs={"frequency_unit": "Hz", "length_unit": "mm", "time_unit": "s"},
    )


@pytest.mark.parametrize("read", [False, True])
def test_each_level_has_a_curve_in_the_unit_of_the_case(read: bool) -> None:
    """Read from a file the level is a variable, not a coordinate."""
    data = levels_over_frequency()
    ax = plots.fit(data.reset_coords("load.x.amplitude") if read else data)
    fitted = [line for line in ax.lines if line.get_linestyle() == "-"]
    assert len(fitted) == 3
    for line, load in zip(fitted, (1.0, 2.0, 5.0), strict=True):
        here = data["load.x.amplitude"].values == load
        np.testing.assert_allclose(line.get_xdata(), data["omega"].values[here] / (2.0 * np.pi))
        np.testing.assert_array_equal(line.get_ydata(), data["fitted"].values[here, 0])
    assert ax.get_xlabel() == "Frequency [Hz]"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "load.x.amplitude = 1 fitted", "load.x.amplitude = 2 fitted", "load.x.amplitude = 5 fitted", "measured",
    ]  # fmt: skip


def test_one_level_is_named_by_its_dof() -> None:
    one = levels_over_frequency().isel(point=slice(0, 5))
    ax = plots.fit(one, frequency="rad/s")
    assert ax.get_xlabel() == "Frequency [rad/s]"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["x fitted", "x measured"]
