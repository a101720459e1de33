"""Numbers of a branch for other programs, read again by other libraries."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from helpers import reports
from helpers.faults import raises_fault
from scipy.io import loadmat

import slipstick as ss


def test_a_line_for_each_point(tmp_path: Path) -> None:
    made = reports.branch()
    data = made.dataset
    with made.save_table(tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert len(rows) == len(made)
    assert len(set(head)) == len(head)
    column = {name.partition(" [")[0]: [row[k] for row in rows] for k, name in enumerate(head)}
    np.testing.assert_array_equal(np.array(column["omega"], dtype=float), data.omega)
    dof, contact = str(data.dof[0].values), str(data.contact[0].values)
    np.testing.assert_array_equal(
        np.array(column[f"displacement.{dof}.c1"], dtype=float), data.displacement.sel(dof=dof, coefficient="c1")
    )
    np.testing.assert_array_equal(
        np.array(column[f"dissipated_power.{contact}"], dtype=float), data.dissipated_power.sel(contact=contact)
    )
    assert column["kind"] == data.kind.values.astype(str).tolist()


def test_every_array_in_a_matlab_file(tmp_path: Path) -> None:
    data = reports.branch().dataset
    found = loadmat(reports.branch().save_table(tmp_path / "a.mat"), squeeze_me=False)
    assert {str(name) for name in data.variables} <= set(found)
    np.testing.assert_array_equal(found["displacement"], data.displacement)
    np.testing.assert_array_equal(found["omega"][:, 0], data.omega)
    assert [str(label[0]) for label in found["dof"][:, 0]] == data.dof.values.tolist()
    assert str(found["dimensions"]["displacement"][0, 0][0]) == "point dof coefficient"


def test_faults_of_tables(tmp_path: Path) -> None:
    with raises_fault("table", says=r"\.csv or \.mat"):
        reports.branch().save_table(tmp_path / "a.txt")
    with pytest.raises(ss.InputError, match="the table cannot be written"):
        reports.branch().save_table(tmp_path / "no" / "a.csv")
