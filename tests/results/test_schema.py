"""One schema: whoever writes results, a script or the command line, they have the same variables and attributes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray

import slipstick as ss
from slipstick.case.case import Case
from slipstick.cli.options import RunOptions
from slipstick.cli.verbs.run import run_case
from slipstick.results.schema import MISSING, POINT_KINDS, VARIABLES

CASE = """
format = 1
harmonics = [0, 1, 2, 3]
[structure]
kind = "matrices"
dofs = ["x", "y"]
mass = [[1.0, 0.0], [0.0, 1.0]]
damping = [[0.4, 0.0], [0.0, 0.4]]
stiffness = [[40.0, -5.0], [-5.0, 60.0]]
[[load]]
dof = "x"
sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
kt = 100.0
mu = 3.0
normal_load = 80.0
rubbing = { velocity = 2.0, cos = { "1" = 0.5 } }
[response]
"""
RANGES = {
    "frequency": "from = 4.0\nto = 8.0\nat = [5.0]",
    "parameter": 'parameter = "damper.velocity"\nfrom = 2\nto = 4\nomega = 5.0',
}
DIFFERENT = {"seconds"}
"""Attributes that two runs of the same case do not share."""


@pytest.fixture(scope="module", params=RANGES)
def files(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The same case computed by the command line and by Python."""
    folder = tmp_path_factory.mktemp("schema")
    path = folder / "case.toml"
    path.write_text(CASE + RANGES[request.param])
    assert run_case(path, folder / "out", options=RunOptions(figures=False, quiet=True)) == 0
    branch = Case.from_file(path).run()
    assert "dry surfaces" in branch.warnings[0]
    assert request.param != "frequency" or "harmonics left out" in branch.warnings[-1]
    return {"command line": folder / "out" / "results.nc", "Python": branch.save(folder / "branch.nc")}


@pytest.mark.parametrize("group", [None, "problem"])
def test_files_are_the_same(files: dict[str, Path], group: str | None) -> None:
    a, b = (xarray.load_dataset(path, engine="h5netcdf", group=group) for path in files.values())
    assert list(a.variables) == list(b.variables)
    for name in a.variables:
        mine, other = a[name], b[name]
        assert (mine.dims, mine.dtype, mine.attrs) == (other.dims, other.dtype, other.attrs), name
        assert {k: v for k, v in mine.encoding.items() if k != "source"} == {
            k: v for k, v in other.encoding.items() if k != "source"
        }, name
        if mine.dtype.kind == "f":
            np.testing.assert_allclose(mine, other, rtol=1e-9, atol=1e-12)
        else:
            assert mine.equals(other), name
    assert list(a.coords) == list(b.coords)
    assert list(a.attrs) == list(b.attrs)
    assert {k: v for k, v in a.attrs.items() if k not in DIFFERENT} == {
        k: v for k, v in b.attrs.items() if k not in DIFFERENT
    }


def test_what_is_computed_is_what_is_read(files: dict[str, Path]) -> None:
    """A branch in memory, and the same one from its file."""
    for path in files.values():
        branch = ss.load(path)
        assert branch.problem is not None
        assert branch.dataset.attrs["case"] == (path.parents[path.name == "results.nc"] / "case.toml").read_text()
        again = ss.load(branch.save(path.with_name("again.nc")))
        assert again.dataset.identical(branch.dataset)
        assert again.dataset["kind"].to_numpy()[0] == "start"
        assert again.dataset["peak_dof"].dtype == np.int32


def test_xarray_opens_results_by_itself(files: dict[str, Path]) -> None:
    """With what the package itself depends on, without naming an engine."""
    with xarray.open_dataset(files["Python"]) as data:
        assert set(data["kind"].to_numpy()) <= set(POINT_KINDS)


def test_every_variable_is_described(files: dict[str, Path]) -> None:
    data = ss.load(files["command line"]).dataset
    assert all({"units", "long_name"} <= data[name].attrs.keys() for name in data.variables)
    assert set(VARIABLES) - {"parameter"} <= set(data.variables)


def test_the_page_about_results_names_every_variable(files: dict[str, Path]) -> None:
    page = (Path(__file__).parents[2] / "docs" / "results.md").read_text()
    branch = ss.load(files["Python"])
    for name in (*branch.dataset.variables, *branch.dataset.attrs):
        assert f"`{name}`" in page or name == "point" or name.endswith("_version") or name == "Conventions", name


STIFF_DAHL = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
sin = 5.0
[[contact]]
law = "dahl"
name = "joint"
tangential = "x"
kt = 3575.0
limit = 2.5
[response]
from = 4.0
to = 4.02
stability = true
"""


def test_points_without_known_stability_are_kept_by_both(tmp_path: Path) -> None:
    """No motion in time was found next to these points: their method is empty, their stability not known."""
    path = tmp_path / "case.toml"
    path.write_text(STIFF_DAHL)
    assert run_case(path, tmp_path / "out", options=RunOptions(figures=False, quiet=True)) == 0
    with pytest.warns(ss.SlipstickWarning) as said:
        branch = Case.from_file(path).run()
    assert any("stability is not known" in str(each.message) for each in said)
    ours = xarray.load_dataset(tmp_path / "out" / "results.nc")
    assert "" in branch.dataset["stability_method"].to_numpy()
    for name in ("omega", "stability_method", "stable", "unstable_multipliers"):
        np.testing.assert_array_equal(ours[name], branch.dataset[name])
    assert np.all(ours["stable"].to_numpy()[ours["stability_method"].to_numpy() == ""] == MISSING)
