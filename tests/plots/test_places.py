"""Points by their number, and what the title says of them."""

from __future__ import annotations

import pytest
from helpers.faults import raises_fault
from helpers.figures import branch, title

from slipstick.errors import InputError
from slipstick.plots.points import branch_of, point_number, point_titled
from slipstick.plots.style import styled


def test_points_count_from_both_ends() -> None:
    data = branch().dataset
    count = data.sizes["point"]
    assert (point_number(data, 0), point_number(data, -1), point_number(data, 2.0)) == (0, -1, 2)
    for point in (count, -count - 1, 0.5, "0", None):
        with raises_fault("point", says=f"point: found .* from -{count} to {count - 1}"):
            point_number(data, point)
    with pytest.raises(InputError, match="the branch has no points to draw"):
        point_number(data.isel(point=slice(0, 0)), 0)


def test_a_branch_is_taken_as_it_is() -> None:
    assert branch_of(branch()) is branch()
    assert branch_of(branch().dataset).dataset is branch().dataset


def test_the_title_names_what_is_alone_and_where_it_is() -> None:
    data = branch().dataset.assign_attrs(frequency_unit="Hz")
    where = f"at {float(data['omega'][4]) / 6.283185307179586:.5g} Hz"
    for names, about in ((["c0"], f"c0, {where}"), (["c0", "c1"], where), ([], where)):
        ax = styled(None, "x", "y")
        point_titled(ax, data, 4, names)
        assert title(ax) == f"Chain ({about})"
