"""What overlaid curves have in common: one axis, names that tell them apart, limits that do not magnify rounding."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import OMEGA, dataset, drawn, named

from slipstick.errors import InputError
from slipstick.plots.overlay import Curves


def test_curves_are_named_by_what_tells_them_apart() -> None:
    def labels(branches: object, given: object = None, label: str | None = None) -> list[str]:
        return [str(line.get_label()) for line in Curves(branches, label=label).draw("amplitude", "dof", given).lines]

    assert labels(dataset()) == ["x"]
    assert labels(dataset(), label="dry") == ["dry"]
    assert labels(dataset(), ["x", "z"]) == ["x", "z"]
    assert labels({"dry": dataset(), "wet": dataset()}) == ["dry", "wet"]
    assert labels({"dry": dataset()}, ["x", "z"]) == ["dry, x", "dry, z"]


def test_a_single_curve_of_a_new_figure_needs_no_legend() -> None:
    for branches, label, names in ((dataset(), None, []), (dataset(), "dry", ["dry"]), ({"a": dataset()}, None, ["a"])):
        curves = Curves(branches, label=label)
        ax = curves.draw("mean", "dof", None)
        curves.legend()
        assert named(ax) == names


def test_parts_of_a_branch_are_not_joined() -> None:
    data = dataset()
    data["branch_part"] = ("point", np.repeat([1, 2], [15, 25]))
    x, y = drawn(Curves(data).draw("amplitude", "dof", None).lines[0])
    assert np.flatnonzero(np.isnan(y)).tolist() == [15]
    np.testing.assert_array_equal(x[~np.isnan(x)], OMEGA)


def test_frequencies_are_all_in_the_unit_of_the_first() -> None:
    first, other = dataset().assign_attrs(frequency_unit="Hz"), dataset().assign_attrs(frequency_unit="rpm")
    ax = Curves([first, other]).draw("amplitude", "dof", None)
    assert ax.get_xlabel() == "Omega [Hz]"
    for line in ax.lines:
        np.testing.assert_allclose(drawn(line)[0] * 2 * np.pi, OMEGA, rtol=1e-15)


def test_branches_of_different_units_of_time_do_not_fit() -> None:
    other = dataset().assign_attrs(time_unit="ms", frequency_unit="rad/ms")
    other["omega"].attrs["units"] = "rad/ms"
    with pytest.raises(InputError, match=r"branches over Omega \[rad/s\] and over Omega \[rad/ms\]"):
        Curves([dataset(), other])
