"""Which curves a report draws."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.reports import branch, decoded

import slipstick as ss
from slipstick import plots
from slipstick.report.curves import curves_of, meaning
from slipstick.results.view import VIEWS


@pytest.fixture(scope="module")
def made() -> ss.Branch:
    return branch()


def test_curves_say_what_varies_with_units_and_totals(made: ss.Branch) -> None:
    kept = {"dof": np.array([0, 2]), "contact": np.array([1])}
    curves = {curve["key"]: curve for curve in curves_of(made, kept, VIEWS["response"])}
    assert list(curves)[:3] == ["amplitude", "mean", "phase"]
    assert {"friction_coefficient", "stick_fraction", "truncation"} <= set(curves)
    assert "temperature" not in curves  # nothing is heated
    assert "gap" not in curves  # it is the same everywhere
    np.testing.assert_allclose(
        decoded(curves["amplitude"]["values"]), made.dataset["amplitude"].values[:, [0, 2]], rtol=0
    )
    total = made.dataset["dissipated_power"].sum("contact").values
    np.testing.assert_allclose(decoded(curves["dissipated_power"]["total"]), total, rtol=1e-15)
    assert curves["amplitude"]["units"] == "length"
    assert curves["amplitude"]["after"] == ""  # no unit was named
    assert curves["stick_fraction"]["units"] == ""


def test_units_that_have_names_stand_after_numbers(made: ss.Branch) -> None:
    data = made.dataset.copy()
    data["amplitude"].attrs["units"] = "mm"
    said, factor = meaning(data, "amplitude")
    assert factor == 1.0
    assert said == {
        "label": "Amplitude (0-to-peak, without the mean)", "units": "mm", "after": " mm",
    }  # fmt: skip


def test_a_mean_of_a_rotation_is_not_rounding_beside_lengths(made: ss.Branch) -> None:
    """Micrometres beside radians: the page and the figure draw the same, each unit by its own size."""
    data = made.dataset.copy(deep=True)
    data = data.assign_coords(dof=["n1x", "n1rx", *data["dof"].values[2:]])
    data["mean"].values[:, :2] = 1e-13
    data["amplitude"].values[:, 1] = 1e-4
    known = ss.Branch.from_dataset(data)
    kept = {"dof": np.array([0, 1]), "contact": np.array([], dtype=int)}
    page = next(curve for curve in curves_of(known, kept, VIEWS["response"]) if curve["key"] == "mean")
    assert (decoded(page["values"]) == [[0.0, 1e-13]]).all()
    for dof, value in (("n1x", 0.0), ("n1rx", 1e-13)):
        line = plots.mean(known, dof).lines[0]
        drawn = np.asarray(line.get_ydata(), dtype=float)
        assert (drawn[np.isfinite(drawn)] == value).all()


def test_nothing_of_contacts_where_there_are_none(made: ss.Branch) -> None:
    none = {"dof": np.array([0]), "contact": np.array([], dtype=int)}
    assert {curve["over"] for curve in curves_of(made, none, VIEWS["response"])} == {"dof", ""}
