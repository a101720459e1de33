"""Results for other programs, read again by other libraries."""

from __future__ import annotations

import csv
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
import xarray
from helpers import reports
from helpers.command import slipstick as called
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass
from scipy.io import loadmat

import slipstick as ss
from slipstick.results import saved_table
from slipstick.results.percentiles import curve_percentiles, peak_percentiles
from slipstick.results.run_up import RunUp
from slipstick.results.saved_table import matlab_names, tables_of, write_table


@cache
def problem() -> ss.Problem:
    return one_mass(damper(normal_load=300.0))


@cache
def passed() -> RunUp:
    return ss.runs.run_up(problem(), (8.0, 10.0), rate=0.1, samples=8)


def read(path: Path) -> pandas.DataFrame:
    """A table as pandas reads it, texts as they are, columns without units."""
    found = pandas.read_csv(path, keep_default_na=False, na_values=["nan"])
    return found.rename(columns=lambda name: name.partition(" [")[0])


def same(found: pandas.Series[Any], expected: Any) -> None:
    np.testing.assert_array_equal(found.to_numpy(), np.asarray(expected))


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
    about = found["about"][0, 0]
    assert str(about["units"]["omega"][0, 0][0]) == data.omega.attrs["units"]
    assert str(about["meaning"]["omega"][0, 0][0]) == data.omega.attrs["long_name"]
    assert str(about["attributes"]["outcome"][0, 0][0]) == "COMPLETED"


def test_peaks_of_a_branch(tmp_path: Path) -> None:
    made = reports.branch()
    found = read(made.save_table(tmp_path / "a.csv", "peaks"))
    for dof in made.dataset.dof.values.tolist():
        own = found[found["dof"] == dof]
        assert list(zip(own["omega"], own["amplitude"], strict=True)) == made.peaks(dof)
    assert len(found)


def test_faults_of_tables(tmp_path: Path) -> None:
    with raises_fault("table", says=r"\.csv, \.mat"):
        reports.branch().save_table(tmp_path / "a.txt")
    with pytest.raises(ss.InputError, match="cannot be written"):
        reports.branch().save_table(tmp_path / "no" / "a.csv")
    with raises_fault("table", says='"point" or "peaks"'):
        reports.branch().save_table(tmp_path / "a.csv", "peak")
    with raises_fault("table", says="no rows"):
        write_table(xarray.Dataset({"one": 1.0}), tmp_path / "a.csv")
    with raises_fault("results", says="xarray.Dataset"):
        ss.runs.save_table([1.0], tmp_path / "a.csv")
    assert list(tmp_path.iterdir()) == []


def test_a_grid_and_its_curves_are_long_tables(tmp_path: Path) -> None:
    """A line for each combination; curves of different lengths one after another, each line with its case."""
    values = {"damper.mu": [0.2, 0.3, 0.4], "load.x.amplitude": [80.0, 100.0]}
    study = ss.study(problem(), values, omega=(8.0, 12.0), workers=1, folder=tmp_path / "study")
    found = read(ss.runs.save_table(study, tmp_path / "a.csv"))
    assert list(found.columns[:2]) == ["damper.mu", "load.x.amplitude"]
    for row in found.itertuples(index=False):
        own = study.sel({"damper.mu": row[0], "load.x.amplitude": row[1]})
        assert own["case"] == row[found.columns.get_loc("case")]
        assert float(own["peak_amplitude"].sel(dof="x")) == row[found.columns.get_loc("peak_amplitude.x")]
        assert row[found.columns.get_loc("outcome")] == "COMPLETED"
    curves = xarray.open_dataset(tmp_path / "study" / "curves.nc", engine="h5netcdf").load()
    assert len({int((curves["case"] == k).sum()) for k in range(6)}) > 1  # of different lengths
    long = read(ss.runs.save_table(tmp_path / "study", tmp_path / "b.csv", "curves"))
    same(long["amplitude.x"], curves["amplitude"].sel(dof="x"))
    for case, own in long.groupby("case"):
        mu, load = np.unravel_index(int(case), (3, 2))
        assert own["damper.mu"].unique() == [values["damper.mu"][mu]]
        assert own["load.x.amplitude"].unique() == [values["load.x.amplitude"][load]]
    mat = loadmat(ss.runs.save_table(tmp_path / "study", tmp_path / "b.mat"))
    np.testing.assert_array_equal(mat["damper_mu"][:, 0], values["damper.mu"])
    np.testing.assert_array_equal(mat["peak_amplitude"], study["peak_amplitude"])
    assert str(mat["dimensions"]["peak_amplitude"][0, 0][0]) == "damper_mu load_x_amplitude dof"
    assert str(mat["about"]["names"][0, 0]["damper_mu"][0, 0][0]) == "damper.mu"
    alone = read(ss.runs.save_table(tmp_path / "study" / "curves.nc", tmp_path / "c.csv"))
    same(alone["omega"], long["omega"])


def test_percentiles_and_samples(tmp_path: Path) -> None:
    """Samples lie along their case; bands have a column for each percentile."""
    study = ss.study(
        problem(), {"damper.mu": [0.2, 0.4]}, omega=(8.0, 12.0), method="random", samples=3, workers=1,
        folder=tmp_path / "study",
    )  # fmt: skip
    curves = xarray.open_dataset(tmp_path / "study" / "curves.nc", engine="h5netcdf").load()
    if "case" not in study.dims:
        raise AssertionError("samples lie along their case")
    long = read(ss.runs.save_table(tmp_path / "study", tmp_path / "c.csv", "curves"))
    same(long["damper.mu"], study["damper.mu"].to_numpy()[curves["case"].to_numpy()])
    band, peaks = curve_percentiles(curves, study, (5, 95), points=9), peak_percentiles(study, (5, 95))
    found = read(ss.runs.save_table(band, tmp_path / "a.csv"))
    same(found["amplitude.95.0.x"], band["amplitude"].sel(percentile=95, dof="x"))
    same(found["omega"], band["omega"])
    found = read(ss.runs.save_table(peaks, tmp_path / "b.csv"))
    same(found["percentile"], [5.0, 95.0])
    same(found["peak_omega.x"], peaks["peak_omega"].sel(dof="x"))


def test_a_run_up(tmp_path: Path) -> None:
    run, data = passed(), passed().dataset
    periods = read(run.save_table(tmp_path / "a.csv"))
    same(periods["period"], data["period"])
    same(periods["section_velocity.x"], data["section_velocity"].sel(dof="x"))
    same(periods["slip_fraction.damper"], data["slip_fraction"].sel(contact="damper"))
    samples = read(run.save_table(tmp_path / "b.csv", "sample"))
    same(samples["sample_time"], data["sample_time"])
    same(samples["displacement.x"], data["displacement"].sel(dof="x"))
    changes = read(run.save_table(tmp_path / "c.csv", "change"))
    same(changes["change_after"], data["change_after"])
    envelope = read(run.save_table(tmp_path / "d.csv", "envelope"))
    same(envelope["omega"], run.envelope()[0])
    same(envelope["amplitude"], run.envelope()[1])
    spectrum = read(run.save_table(tmp_path / "e.csv", "spectrum"))
    same(spectrum["frequency"], run.spectrum()[0])
    same(spectrum["amplitude.x"], run.spectrum()[1])
    sizes = run.spectrogram()
    found = loadmat(run.save_table(tmp_path / "f.mat", "spectrogram"))
    np.testing.assert_array_equal(found["amplitude"][:, :, 0], sizes)
    np.testing.assert_array_equal(found["time"][:, 0], sizes["time"])
    long = read(ss.runs.save_table(sizes, tmp_path / "f.csv"))
    same(long.iloc[:, -1], sizes.to_numpy().ravel())
    whole = loadmat(run.save_table(tmp_path / "g.mat"))
    np.testing.assert_array_equal(whole["displacement"], data["displacement"])
    np.testing.assert_array_equal(whole["highest"], data["highest"])


def test_a_fit(tmp_path: Path) -> None:
    measured = ss.steady_response(problem(), omega=[8.0, 9.0, 10.0]).dataset
    fit = ss.identify(problem(), measured, {"damper.kt": 70.0, "damper.mu": 0.4}, noise=1e-6)
    values = read(fit.save_table(tmp_path / "a.csv"))
    same(values["parameter"], list(fit.values))
    same(values["value"], list(fit.values.values()))
    same(values["standard_error"], list(fit.standard_errors.values()))
    same(values["correlation.damper.mu"], fit.correlations[:, 1])
    points = read(fit.save_table(tmp_path / "b.csv", "point"))
    same(points["fitted.x.s1"], fit.dataset["fitted"].sel(dof="x", coefficient="s1"))
    same(points["omega"], [8.0, 9.0, 10.0])
    mat = loadmat(fit.save_table(tmp_path / "c.mat"))
    np.testing.assert_array_equal(mat["correlation"], fit.correlations)
    assert float(mat["about"][0, 0]["attributes"]["misfit"][0, 0][0, 0]) == fit.misfit
    assert str(mat["units"][0, 0][0]) == "force/length"  # a variable of that name stays


def test_an_integration_in_time(tmp_path: Path) -> None:
    found = ss.transient(problem(), 9.0)
    series = read(found.save_table(tmp_path / "a.csv"))
    same(series["time"], found.time)
    same(series["displacement.x"], found.displacement[:, 0])
    same(series["friction_force.damper"], found.friction_force[:, 0])
    with (tmp_path / "a.csv").open(encoding="utf-8") as file:
        assert file.readline().startswith("time [time],displacement.x [length],")
    same(read(found.save_table(tmp_path / "b.csv", "contact"))["power"], found.power)
    changes = read(found.save_table(tmp_path / "c.csv", "change"))
    assert changes["change_after"].tolist() == [change.after for change in found.changes]
    mat = loadmat(found.save_table(tmp_path / "d.mat"))
    np.testing.assert_array_equal(mat["friction_coefficients"], found.friction_coefficients)


def test_sensitivities(tmp_path: Path) -> None:
    rates = reports.branch().sensitivity(["joint.mu", "joint.kt"])
    found = read(ss.runs.save_table(rates, tmp_path / "a.csv"))
    same(found["amplitude.joint.kt"], rates["amplitude"].sel(parameter="joint.kt"))
    same(found["at"], rates["at"])
    values = read(ss.runs.save_table(rates, tmp_path / "b.csv", "parameter"))
    same(values["value"], rates["value"])
    same(values["units"], rates["units"])
    assert set(tables_of(rates)) == {"point", "peak", "parameter"}


def test_names_in_matlab() -> None:
    """Valid, at most 63 characters, each its own."""
    long = ["a" * 70, "a" * 71, "a" * 62 + ".", "größe", "_x", "", "about", "for"]
    names = list(matlab_names(long).values())
    assert len(set(names)) == len(names)
    assert all(name.isidentifier() and name.isascii() and name[0] != "_" and len(name) <= 63 for name in names)
    assert "about" not in names
    assert "for" not in names


def test_a_sheet_for_each_table(tmp_path: Path) -> None:
    """The same names and numbers as in the CSV file; empty where a number is not finite; texts are no formulas."""
    openpyxl = pytest.importorskip("openpyxl")
    data = ss.transient(problem(), 9.0)
    book = openpyxl.load_workbook(data.save_table(tmp_path / "a.xlsx"))
    assert book.sheetnames == list(tables_of(data.dataset))
    for name in book.sheetnames:
        with data.save_table(tmp_path / "a.csv", name).open(encoding="utf-8", newline="") as file:
            head, *rows = csv.reader(file)
        own = list(book[name].values)
        assert list(own[0]) == head
        assert len(own) == len(rows) + 1
        for row, texts in zip(own[1:], rows, strict=True):
            for value, text in zip(row, texts, strict=True):
                if value is None:
                    assert text in ("nan", "")
                elif value != text:  # 16 digits
                    assert value == pytest.approx(float(text), rel=1e-15, abs=0.0)
    assert openpyxl.load_workbook(data.save_table(tmp_path / "b.xlsx", "contact")).sheetnames == ["contact"]
    odd = xarray.Dataset({"note": ("a[b]:" + "c" * 40, ["=1+1", "a\x01b"]), "x": ("d" * 40, [np.inf, 1.0])})
    book = openpyxl.load_workbook(write_table(odd, tmp_path / "c.xlsx"))
    assert all(len(name) <= 31 for name in book.sheetnames)
    assert [cell.data_type for cell in book.worksheets[0]["A"]] == ["s"] * 3
    assert [cell.value for cell in book.worksheets[0]["A"]][1:] == ["=1+1", "a b"]
    assert [cell.value for cell in book.worksheets[1]["A"]][1:] == [None, 1]


def test_excel_needs_a_writer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with raises_fault(says=r"pip install 'slipstick\[excel\]', or write a \.csv file"):
        reports.branch().save_table(tmp_path / "a.xlsx")
    assert list(tmp_path.iterdir()) == []


def test_more_than_a_sheet_holds_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("openpyxl")
    monkeypatch.setattr(saved_table, "_MOST_ROWS", 3)
    with raises_fault(says="more than a sheet of Excel has"):
        reports.branch().save_table(tmp_path / "a.xlsx")


def test_the_verb(tmp_path: Path) -> None:
    made = reports.branch()
    made.save(tmp_path / "results.nc")
    assert called("table", tmp_path / "results.nc", tmp_path / "a.csv").exit_code == 0
    assert (tmp_path / "a.csv").read_bytes() == made.save_table(tmp_path / "b.csv").read_bytes()
    assert called("table", tmp_path, tmp_path / "a.csv", "--table", "peaks", "--force").exit_code == 0
    same(read(tmp_path / "a.csv")["amplitude"], read(made.save_table(tmp_path / "b.csv", "peaks"))["amplitude"])
    (tmp_path / "a.csv").write_text("of the user")
    there = called("table", tmp_path, tmp_path / "a.csv")
    assert (there.exit_code, "a.csv: is there already; choose another name, or --force" in there.output) == (2, True)
    assert (tmp_path / "a.csv").read_text() == "of the user"
    refused = called("table", tmp_path, tmp_path / "a.xls")
    assert refused.exit_code == 2
    assert ".csv, .mat, .xlsx or .uff" in refused.output
