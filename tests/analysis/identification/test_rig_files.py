"""Measurements as rigs leave them: MATLAB files, response functions, velocities and accelerations, in any units."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass
from scipy.io import savemat

import slipstick as ss
from slipstick.analysis.identification.measured import dataset_of, read_measured

OMEGA = np.linspace(6.0, 12.0, 8)
UNITS = {"length": "mm", "force": "N", "time": "s"}
START = {"damper.kt": 85.0, "damper.mu": 0.26}


@cache
def problem(**given: object) -> ss.Problem:
    return one_mass(damper(normal_load=300.0), harmonics=range(4), units=UNITS, **given)


@cache
def steady() -> xr.Dataset:
    return ss.steady_response(problem(), omega=OMEGA).dataset


def motion() -> np.ndarray:
    """Complex motion of harmonic 1, mm."""
    c, s = steady().displacement.sel(dof="x", coefficient=["c1", "s1"]).values.T
    return c - 1j * s


def force() -> complex:
    (load,) = problem().loads
    return complex(load.cos, -load.sin)


def rig(folder: Path) -> Path:
    """A file of a rig in SI units and Hz, functions in the columns of a matrix."""
    z, w = motion() * 1e-3, OMEGA
    H = np.column_stack([z, 1j * w * z, -(w**2) * z]) / force()
    held = {"f": w / (2.0 * np.pi), "H": H, "z": z, "a": -(w**2) * z / 9.80665, "peak": np.arange(5.0)}
    savemat(folder / "rig.mat", {"test": held})
    return folder / "rig.mat"


@pytest.mark.parametrize(
    ("column", "quantity"),
    [
        ({"x": "test.z [m]"}, None),
        ({"x/x": "test.H(:,1) [m/N]"}, None),
        ({"x/x": "test.H(:,2) [(m/s)/N]"}, "velocity"),
        ({"x/x": "test.H(:,3) [m/s^2/N]"}, "acceleration"),
        ({"x": "test.a [g]"}, "acceleration"),
    ],
)
def test_the_same_motion_however_it_was_measured(tmp_path: Path, column: dict[str, str], quantity: str | None) -> None:
    data = dataset_of(problem(), rig(tmp_path), {"frequency": "test.f"} | column, quantity)
    found = read_measured(problem(), data)
    np.testing.assert_allclose(found.omega, OMEGA, rtol=1e-14)
    c, s = motion().real, -motion().imag
    np.testing.assert_allclose(found.values[:, 0, 1:3], np.column_stack([c, s]), rtol=1e-12)
    assert not np.isfinite(found.values[:, 0, 3:]).any()


def test_a_fit_to_accelerances_of_a_matlab_file(tmp_path: Path) -> None:
    columns = {"frequency": "test.f", "x/x": "test.H(:,3) [m/s^2/N]"}
    fit = ss.identify(problem(), rig(tmp_path), START, columns=columns, quantity="acceleration")
    for name, value in fit.values.items():
        assert value == pytest.approx(problem().parameter(name), rel=1e-7)


def test_noise_is_divided_with_the_numbers() -> None:
    """Of every harmonic by its own frequency."""
    data = steady()[["displacement"]].isel(coefficient=slice(1, None))
    orders = np.repeat([1.0, 2.0, 3.0], 2)
    noise = 0.01 * (orders * OMEGA[:, None]) ** 2
    given = data.assign(noise=(("point", "coefficient"), noise), omega=("point", OMEGA)).assign_attrs(
        quantity="acceleration"
    )
    found = read_measured(problem(), given)
    np.testing.assert_allclose(found.noise[:, 0, 1:], 0.01, rtol=1e-13)


def test_units_of_another_quantity_are_refused(tmp_path: Path) -> None:
    for column in ({"x": "test.a [g]"}, {"x/x": "test.H(:,3) [m/s^2/N]"}):
        with raises_fault(says='which is acceleration; expected displacement; say quantity = "acceleration"'):
            ss.identify(problem(), rig(tmp_path), START, columns={"frequency": "test.f"} | column)
    with raises_fault("quantity", says="'velocity', 'acceleration'"):
        ss.identify(problem(), rig(tmp_path), START, columns={"frequency": "test.f", "x": "test.z"}, quantity="jerk")
    loop = xr.Dataset({"force": ("tau", np.ones(9)), "displacement": ("tau", np.ones(9))})
    with raises_fault("quantity", says="unless it is a vibration"):
        ss.identify(problem(), loop, START, quantity="velocity")


def test_amplitudes_of_velocities_are_taken_with_a_warning() -> None:
    data = xr.Dataset({"amplitude": (("omega", "dof"), OMEGA[:, None])}, coords={"omega": OMEGA, "dof": ["x"]})
    found = read_measured(problem(), data.assign_attrs(quantity="velocity"))
    np.testing.assert_allclose(found.values, 1.0, rtol=1e-14)
    assert any("right for harmonic 1 alone" in note for note in found.notes)


def functions(outputs: list[str], inputs: list[str]) -> xr.Dataset:
    H = (motion() / force())[:, None, None] * np.ones((1, len(outputs), len(inputs)))
    names = {"omega": OMEGA, "output": outputs, "input": inputs}
    return xr.Dataset({"receptance": (("omega", "output", "input"), H)}, coords=names)


def test_functions_by_other_forces_are_left_out_with_a_warning() -> None:
    structure = ss.MatrixStructure(M=np.eye(2), C=np.eye(2), K=[[40.0, -5], [-5, 50]], dofs=["x", "y"])
    two = replace(problem(), structure=structure, outputs=None, told=None)
    found = read_measured(two, functions(["x"], ["x", "y"]))
    assert found.notes == ("response functions by forces on y are left out: the load is on x",)
    np.testing.assert_allclose(found.values[:, 0, 1], motion().real, rtol=1e-13)
    with raises_fault(says="there is no dof 'y'; the functions are x/x, x/y"):
        read_measured(problem(), functions(["x"], ["x", "y"]))
    with raises_fault("loads", says="one force on one dof"):
        read_measured(problem(loads=()), functions(["x"], ["x"]))


def test_columns_of_a_universal_file(tmp_path: Path) -> None:
    """Functions are called by what they are: a measured structure and a fit read the same file."""
    pytest.importorskip("pyuff")
    structure = ss.MatrixStructure(M=np.eye(2), C=0.4 * np.eye(2), K=[[40.0, -5], [-5, 50]], dofs=["n4x", "n9z"])
    linear = ss.Problem(structure, loads=ss.Load(dof="n4x", cos=2.0), harmonics=[0, 1], units=UNITS)
    file = ss.linear_response(linear, omega=np.linspace(3.0, 9.0, 200)).save_table(tmp_path / "a.unv")
    text = file.read_text(encoding="ascii").replace("slipstick: ", "by another: ")
    file.write_text(text, encoding="ascii")
    named = ss.models.modal_analysis(file, columns={"tip/tip": "n4x/n4x", "root/tip": "n9z/n4x"}).structure
    assert named.dofs == ("tip", "root")
    np.testing.assert_allclose(named.natural_frequencies, structure.natural_frequencies, rtol=1e-6)
    with raises_fault("columns", "x", says="no function 'n4y/n4x' in a.unv; the functions are n4x/n4x, n9z/n4x"):
        ss.identify(problem(), file, START, columns={"x": "n4y/n4x"})
    data = dataset_of(problem(), file, {"x": "n9z/n4x"})
    exact = [np.linalg.inv(structure.K + 0.4j * w * np.eye(2) - w * w * np.eye(2))[1, 0] for w in data.omega.values]
    np.testing.assert_allclose(data.displacement.values[:, 0, 0], force() * np.array(exact), rtol=1e-9)
