"""A table answers as the dataset does that it makes."""

import numpy as np
import xarray
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.results.table import ResultColumn, ResultTable


def table() -> ResultTable:
    columns = {
        "point": ResultColumn(("point",), np.arange(3)),
        "dof": ResultColumn(("dof",), np.array(["x", "y"])),
        "omega": ResultColumn(("point",), np.array([1.0, 2.0, 3.0]), {"units": "rad/s"}),
        "amplitude": ResultColumn(("point", "dof"), np.arange(6.0).reshape(3, 2), {"long_name": "amplitude"}),
        "gap": ResultColumn(("dof",), np.array([0.0, -1.0])),
    }
    return ResultTable(columns, {"outcome": "COMPLETED"})


def same(found: ResultTable, dataset: xarray.Dataset) -> None:
    assert found.sizes == dict(dataset.sizes)
    assert found.dims == set(dataset.dims)
    assert set(found) == set(dataset)
    assert set(found.data_vars) == set(dataset.data_vars)
    assert found.attrs == dataset.attrs
    for name in dataset.variables:
        assert name in found
        assert found[name].dims == dataset[name].dims
        assert dict(found[name].attrs) == dataset[name].attrs
        np.testing.assert_array_equal(found[name].to_numpy(), dataset[name].to_numpy())


def test_a_table_and_its_dataset_say_the_same() -> None:
    same(table(), table().to_dataset())
    same(ResultTable.of(table().to_dataset()), table().to_dataset())
    assert "velocity" not in table()


def test_some_points() -> None:
    same(table().at([2, 0]), table().to_dataset().isel(point=[2, 0]))


def test_a_branch_has_both_and_what_is_changed_in_one_is_seen_in_the_other() -> None:
    branch = ss.Branch(table(), ss.Outcome.COMPLETED)
    branch.table.attrs["title"] = "before"
    assert branch.dataset.attrs["title"] == "before"
    branch.dataset.attrs["title"] = "after"
    assert branch.table.attrs["title"] == "after"
    assert len(branch) == 3
    with raises_fault("branch, dataset", expected="an xarray.Dataset"):
        ss.Branch(lambda: table(), ss.Outcome.COMPLETED)
