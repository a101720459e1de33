from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from helpers.cases import oscillator
from helpers.command import slipstick

import slipstick as ss
from slipstick.case.case import Case

TABLE = '[identify]\nparameters = { "damper.mu" = 0.2, "damper.kt" = 80.0 }\nbounds = { "damper.mu" = [0.05, 1.0] }\n'


def files(folder, table=TABLE):
    """A case, and what its own parameters do as a table of the first harmonic."""
    case, data = folder / "case.toml", folder / "measured.csv"
    case.write_text(
        oscillator(head='harmonics = "0..5"\n', rubbing="velocity = 0.0", response="from = 8.0\nto = 12.0\n") + table
    )
    found = ss.steady_response(Case.from_file(case).problem(), omega=np.linspace(5.0, 12.0, 8)).dataset
    rows = np.column_stack([found.omega, found.displacement.values[:, 0, 1:3]])
    np.savetxt(data, rows, delimiter=",", header="omega,x.c1,x.s1", comments="", fmt="%.17g")
    return case, data


def test_identify_leaves_a_folder(tmp_path):
    case, data = files(tmp_path)
    truth = Case.from_file(case).problem()
    out = tmp_path / "out"
    result = slipstick("identify", case, data, "-o", out)
    assert result.exit_code == 0, result.output
    assert "the fit converged" in result.output
    assert "\\n" not in result.output
    assert result.stdout.splitlines()[-2:] == [f"results in {out}/", f"open {out / 'report.html'} in a browser"]
    assert [line.split()[0] for line in result.output.splitlines() if "+-" in line] == ["damper.mu", "damper.kt"]
    assert {path.name for path in out.iterdir()} == {
        "identify.nc",
        "summary.txt",
        "values.json",
        "fit.png",
        "report.html",
    }
    values = json.loads((out / "values.json").read_text())
    assert values == {name: pytest.approx(truth.parameter(name), rel=1e-9) for name in ("damper.mu", "damper.kt")}
    with xr.open_dataset(out / "identify.nc", engine="h5netcdf") as dataset:
        assert dataset.value.values.tolist() == [values["damper.mu"], values["damper.kt"]]
        assert float(np.nanmax(np.abs(dataset.fitted - dataset.measured))) < 1e-9
    refused = slipstick("identify", case, data, "-o", out)
    assert (refused.exit_code, "--force" in refused.output) == (2, True)
    answer = json.loads(slipstick("identify", case, data, "-o", out, "--force", "--json").stdout)
    assert answer["values"] == pytest.approx(values)


def test_a_fit_that_ends_far_away_is_no_success(tmp_path):
    """Sines with the other sign: the same words on the terminal, in the answer, the summary and the report."""
    table = '[identify]\nparameters = { "damper.mu" = 0.2 }\nrelative_noise = 0.01\n'
    case, data = files(tmp_path, table)
    head, *rows = data.read_text().splitlines()[:5]
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows]) * [1.0, 1.0, -1.0]
    np.savetxt(data, table, delimiter=",", header=head, comments="", fmt="%.17g")
    out = tmp_path / "out"
    result = slipstick("identify", case, data, "-o", out, "--json")
    assert result.exit_code == 1
    answer = json.loads(result.stdout)
    assert answer["message"].startswith("the fit ends far from what was measured: misfit")
    (mistake,) = [sentence for sentence in answer["warnings"] if "conjugated" in sentence]
    assert f"warning: {mistake}" in result.stderr
    assert mistake in (out / "summary.txt").read_text()
    assert mistake in (out / "report.html").read_text(encoding="utf-8")
    assert "no standard error" in (out / "report.html").read_text(encoding="utf-8")


def test_what_is_wrong_is_said(tmp_path):
    case, data = files(tmp_path)
    case.write_text(case.read_text().replace('"damper.mu" =', '"damper.nu" ='))
    refused = slipstick("identify", case, data, "-o", tmp_path / "out")
    assert (refused.exit_code, "did you mean 'damper.mu'" in refused.output) == (2, True)
    case.write_text(case.read_text().replace('"damper.nu" =', '"damper.mu" ='))
    refused = slipstick("identify", case, tmp_path / "none.csv", "-o", tmp_path / "out")
    assert (refused.exit_code, "there is no file" in refused.output) == (2, True)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("freq,x\n8.0,0.1\n", ("the columns are freq, x", "did you mean 'frequency'?")),
        ("omega,disp\n8.0,0.1\n", ("the columns are omega, disp", "dofs are x")),
        ("omega\n8.0\n", ("has no column of a dof; the columns are omega", "omega (rad/s) or frequency (Hz)")),
        ("# a rig\n\nomega x\n8.0 0.1\n", ("line 4", "commas or semicolons")),
    ],
)
def test_a_table_without_the_columns_names_those_it_has(tmp_path, text, says):
    case, data = files(tmp_path)
    data.write_text(text)
    refused = slipstick("identify", case, data, "-o", tmp_path / "out")
    assert refused.exit_code == 2
    assert [said for said in says if said not in refused.output] == []


def test_a_fit_whose_time_is_up_before_a_step_leaves_nothing(tmp_path):
    case, data = files(tmp_path)
    result = slipstick("identify", case, data, "-o", tmp_path / "out", "--time-limit", "1e-9 s")
    assert (result.exit_code, "stopped at the time limit" in result.output) == (1, True)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("0", "1e300"), "line 4: x.c1: found 1e+300; expected a number, none above 1e+100"),
        (("0", "inf"), "line 4: x.c1: found inf; expected a number"),
        (("0", "-1e400"), "line 4: x.c1: found -inf; expected a number"),
        ((":", "0"), "all 16 measured numbers are 0; expected a vibration"),
    ],
    ids=["1e300", "inf", "-1e400", "zeros"],
)
def test_numbers_that_nothing_measured_are_named_by_line_and_column(tmp_path, change, said):
    """One cell of the third row, or all numbers; nothing is written."""
    case, data = files(tmp_path)
    head, *rows = data.read_text().splitlines()
    cells = [row.split(",") for row in rows]
    where, value = change
    if where == ":":
        cells = [[omega, value, value] for omega, *_ in cells]
    else:
        cells[2][1] = value
    data.write_text("\n".join([head, *(",".join(row) for row in cells)]) + "\n")
    refused = slipstick("identify", case, data, "-o", tmp_path / "out")
    assert refused.exit_code == 2
    assert said in " ".join(refused.output.split())
    assert not (tmp_path / "out").exists()
