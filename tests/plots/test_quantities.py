"""Labels with units, chosen names, and what is rounding."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import OMEGA, branch, dataset

from slipstick.errors import InputError
from slipstick.plots.quantities import abscissa, chosen, datasets, held_text, quantity, with_unit
from slipstick.results.view import values_of


def test_labels() -> None:
    data = branch().dataset
    assert quantity(data, "amplitude") == "Amplitude [mm]"  # what stands in brackets is left out
    assert quantity(data, "dissipated_power") == "Dissipated power [mW]"
    assert quantity(data, "friction_coefficient") == "Friction coefficient"
    assert (with_unit("a", ""), with_unit("a", "1"), with_unit("a", "m")) == ("a", "a", "a [m]")


def test_the_frequency_in_its_unit() -> None:
    hertz = abscissa(branch().dataset, "Hz")
    assert (hertz.label, hertz.unit) == ("Fundamental frequency [Hz]", "Hz")
    np.testing.assert_allclose(hertz.values(branch().dataset) * 2 * np.pi, branch().dataset["omega"], rtol=1e-15)
    assert abscissa(dataset()).text(dataset(), 0) == "2 rad/s"
    assert held_text(dataset()) == ""


def test_one_name_several_or_the_first() -> None:
    data = dataset()
    assert (chosen(data, "dof", None), chosen(data, "dof", "z"), chosen(data, "dof", ("z", "x"))) == (
        ["x"], ["z"], ["z", "x"],
    )  # fmt: skip
    for none in ([], ()):
        with pytest.raises(InputError, match="there is no dof in the results to draw"):
            chosen(data, "dof", none)


def test_what_is_drawn() -> None:
    assert [label for label, _ in datasets({"a": dataset(), "b": branch()})] == ["a", "b"]
    assert [label for label, _ in datasets(d for d in [dataset(), dataset()])] == [None, None]
    with pytest.raises(InputError, match="it has no omega"):
        datasets(dataset().drop_vars("omega"))


def test_rounding_beside_the_largest_motion_is_zero_and_what_is_larger_stays() -> None:
    data = dataset()
    data["amplitude"].values[:, 0] = np.geomspace(1e-14, 1e-8, 40)
    data["amplitude"].values[:, 1] = 1.0
    data["mean"].values[:] = 0.0
    found = values_of(data, "amplitude", "dof", "x")
    np.testing.assert_array_equal(found, np.where(data["amplitude"][:, 0] > 1e-11, data["amplitude"][:, 0], 0.0))
    assert (values_of(data, "friction_coefficient", "contact", "tip") == 0.3).all()
    assert len(found) == len(OMEGA)
    with pytest.raises(InputError, match="there is no temperature in these results"):
        values_of(data, "temperature", "contact", "tip")
