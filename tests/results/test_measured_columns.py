"""CSV files as test rigs export them: read as the plain file with the same numbers, and what is wrong with others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.io import savemat

import slipstick as ss
from slipstick.analysis.identification.measured import dataset_of
from slipstick.errors import InputError
from slipstick.results.measured_columns import in_units, read_columns
from slipstick.results.measured_receptances import Function, read_receptances, receptances
from slipstick.units import Units

RIG = """Test rig 7;run 12;operator AB
Date;26.11.2026

Channel f;Disp ch3;Force ch1
[Hz];[µm];[N]
1,5;20,25;100
2;1.234,5e-3;
"""


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def oscillator(**given: object) -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    pair = ss.ContactPair(name="damper", contact=contact, tangential="x", rubbing=ss.RubbingMotion(velocity=10.0))
    load = ss.Load(dof="x", sin=100.0)
    return ss.Problem(structure, contacts=[pair], loads=[load], harmonics=range(4), **given)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "text",
    [
        "frequency,x\n1.5,0.02025\n2,0.5\n",
        "\ufefffrequency [Hz];x [mm]\n1,5;0,02025\n2,0;5e-1\n",
        "Rig 7\nchannels: 2, filter: 100\n\nfrequency\tx (µm)\n1,5\t20,25\n2\t500\n",
        "# a remark\nSerial;7\nfrequency;x\nHz;m\n1,5;2,025e-5\n2;5e-4\n",
        "frequency [rpm],x [mm]\n90,0.02025\n120,0.5\n",
    ],
)
def test_the_same_numbers_however_they_are_exported(tmp_path: Path, text: str) -> None:
    problem = oscillator(units={"length": "mm", "force": "N", "time": "s"})
    data = dataset_of(problem, written(tmp_path / "rig.csv", text))
    np.testing.assert_allclose(data.omega, 2.0 * np.pi * np.array([1.5, 2.0]), rtol=1e-14)
    np.testing.assert_allclose(data.amplitude.sel(dof="x"), [0.02025, 0.5], rtol=1e-14)


def test_columns_are_chosen_by_what_they_are(tmp_path: Path) -> None:
    """Others are not read; an empty cell is nan."""
    file = written(tmp_path / "rig.csv", RIG.replace("1.234,5e-3", "1234,5e-3"))
    found = read_columns(file, {"frequency": "Channel f", "x": "Disp ch3", "force": "Force ch1"})
    values = in_units(file, found, Units(length="m", force="kN", time="s"))
    np.testing.assert_allclose(values["x"], [20.25e-6, 1.2345e-6], rtol=1e-14)
    np.testing.assert_array_equal(values["force"], [0.1, np.nan])
    assert list(read_columns(file, {"x": "Disp ch3"}).values) == ["x"]


@pytest.mark.parametrize(
    ("columns", "change", "said"),
    [
        ({"x": "Disp ch4"}, ("", ""), "there is no column 'Disp ch4' in rig"),
        ({"x": 3}, ("", ""), "columns"),
        ({"x": "Disp ch3"}, ("µm", "V"), "the unit|no column"),
        ({"x": "Disp ch3"}, ("1,5;20,25", "1,5;20,25;7"), "line"),
        ({"x": "Disp ch3"}, ("Force ch1", "Disp ch3"), "two columns have this name"),
    ],
)
def test_faults(tmp_path: Path, columns: dict[str, str], change: tuple[str, str], said: str) -> None:
    file = written(tmp_path / "rig.csv", RIG.replace("1.234,5e-3", "1,2").replace(*change))
    with pytest.raises(InputError, match=said):
        in_units(file, read_columns(file, columns), Units(length="m"))


def test_a_unit_of_a_problem_without_units_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path / "rig.csv", "frequency [Hz],x [mm]\n1,2\n")
    with pytest.raises(InputError, match="names no unit of length"):
        dataset_of(oscillator(), file)
    with pytest.raises(InputError, match="a length, a force or a time"):
        dataset_of(oscillator(), written(tmp_path / "v.csv", "frequency [Hz],x [V]\n1,2\n"))
    with pytest.raises(InputError, match="are those of a"):
        ss.identify(oscillator(), object(), {"damper.mu": 0.3}, columns={"x": "y"})


def test_receptances_of_a_test_rig(tmp_path: Path) -> None:
    """As the plain file."""
    f = np.linspace(0.2, 3.0, 60)
    H = 1.0 / (40.0 + 0.4j * 2 * np.pi * f - (2 * np.pi * f) ** 2)
    plain = [f"{a!r},{z.real!r},{z.imag!r}" for a, z in zip(f.tolist(), H.tolist(), strict=True)]
    rig = [row.replace(",", ";").replace(".", ",") for row in plain]
    one = written(tmp_path / "plain.csv", "\n".join(["frequency,x/x.re,x/x.im", *plain]))
    other = written(tmp_path / "rig.csv", "\n".join(["Analyser;3.2", "f [Hz];Re H11 [m/N];Im H11 [m/N]", *rig]))
    columns = {"frequency": "f", "x/x.re": "Re H11", "x/x.im": "Im H11"}
    first = ss.models.modal_analysis(one).structure
    again = ss.models.modal_analysis(other, columns=columns).structure
    np.testing.assert_array_equal(again.natural_frequencies, first.natural_frequencies)
    mixed = other.read_text(encoding="utf-8").replace("Im H11 [m/N]", "Im H11 [mm/N]")
    bad = written(tmp_path / "mixed.csv", mixed)
    with pytest.raises(InputError, match="several units"):
        ss.models.modal_analysis(bad, columns=columns)


def test_functions_in_units_that_no_structure_has(tmp_path: Path) -> None:
    """Velocities and accelerations may stand beside displacements of the same length; g is no length."""
    f = np.array([1.0, 2.0])
    one = Function("x", "x", f, np.array([1.0 + 0j, 2.0]), "displacement", "m/N")
    other = one._replace(output="y", values=-(f**2) * one.values, what="acceleration", unit="m/s^2/N")
    table = receptances([one, other], "rig")
    np.testing.assert_allclose(table.values[:, 0], table.values[:, 1], rtol=1e-14)
    with pytest.raises(InputError, match="in several units"):
        receptances([one, other._replace(unit="mm/s^2/N")], "rig")
    with pytest.raises(InputError, match=r"export them in lengths, such as m/s\^2"):
        receptances([other._replace(unit="g/N")], "rig")


def test_infinite_numbers_are_named_by_their_place(tmp_path: Path) -> None:
    """In columns that are read, by the names that the file has; an empty cell and nan are missing numbers."""
    file = written(tmp_path / "rig.csv", RIG.replace("1.234,5e-3", "-inf"))
    with pytest.raises(InputError, match=r"rig\.csv, line 7: Disp ch3: found -inf; expected a number, none above 1e"):
        read_columns(file, {"x": "Disp ch3"})
    assert read_columns(file, {"x": "Force ch1"}).lines == (6, 7)
    arrays = written(tmp_path / "pressures.rpt", "  Node  CPRESS\n  1  2.0\n  2  1e300\n  3  inf\n")
    with pytest.raises(InputError, match=r"line 3 and 1 more: CPRESS: found 1e\+300; expected"):
        read_columns(arrays)
    mat = tmp_path / "rig.mat"
    savemat(mat, {"f": [1.0, 2.0], "x": [1.0, np.inf]})
    with pytest.raises(InputError, match=r"rig\.mat, x, row 2: found inf; expected"):
        read_columns(mat)


def test_infinite_response_functions_are_refused(tmp_path: Path) -> None:
    """A nan leaves its frequency out, an infinite number does not pass for one."""
    values = np.array([[[1.0 + 0j]], [[np.nan]], [[2.0]], [[1.0]]])
    data = xr.Dataset(
        {"receptance": (("omega", "output", "input"), values)},
        coords={"omega": [1.0, 2.0, 3.0, 4.0], "output": ["x"], "input": ["x"]},
    )
    assert read_receptances(data).omega.tolist() == [1.0, 3.0, 4.0]
    data.receptance.values[2] = np.inf
    with pytest.raises(InputError, match=r"measured, x/x: found inf\+0j at omega = 3; expected"):
        read_receptances(data)
