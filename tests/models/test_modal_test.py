"""A structure from its measured receptances, held against the one that they were computed of."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from helpers.cases import measured as measured_case
from helpers.faults import raises_fault
from scipy.io import savemat

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.models.modal_test import read_receptances
from slipstick.structure.modal_fit import Receptances, fit_modes

OMEGA = np.linspace(2.0, 11.0, 600)
DOFS = ["tip", "mid", "low", "root"]


@cache
def known() -> ss.MatrixStructure:
    """Four masses in a row: the fourth mode, at 11.9 rad/s, lies above the range measured."""
    M = np.diag([1.0, 1.2, 0.8, 1.0])
    K = np.array([[60.0, -25, 0, 0], [-25, 70, -30, 0], [0, -30, 80, -35], [0, 0, -35, 90]])
    return ss.MatrixStructure(M=M, C=0.004 * K + 0.02 * M, K=K, dofs=DOFS)


def measured(inputs=("tip", "root"), noise=1e-3) -> xr.Dataset:
    """Receptances of the four points by forces on some, with relative noise."""
    at, rng = [DOFS.index(name) for name in inputs], np.random.default_rng(3)
    H = known().project(np.eye(4), np.eye(4)[:, at]).at([1.0], OMEGA)[0][:, 0]
    H = H * (1.0 + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)))
    names = {"omega": OMEGA, "output": DOFS, "input": list(inputs)}
    return xr.Dataset({"receptance": (("omega", "output", "input"), H)}, coords=names)


def damped(structure) -> ss.Problem:
    """A friction contact between two points that were measured, loaded at a third."""
    contact = ss.FrictionContact(kt=20.0, mu=0.3, normal_load=20.0)
    pair = ss.ContactPair(name="joint", contact=contact, tangential={"tip": 1.0, "root": -1.0})
    load = ss.Load(dof="low", sin=8.0)
    return ss.Problem(structure, contacts=pair, loads=load, harmonics=[0, 1, 3, 5], outputs=["tip", "mid"])


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_friction_curves_of_the_measured_structure():
    """0.1 % noise: the modes are those of the known one, curves with friction come back to 1 % everywhere."""
    fit = ss.models.modal_analysis(measured(("tip", "root")))
    np.testing.assert_allclose(fit.structure.natural_frequencies, known().natural_frequencies, rtol=2e-4)
    assert fit.error < 0.003
    assert fit.reciprocity < 0.005
    omega = np.linspace(3.0, 10.0, 40)
    exact, found = (ss.forced_response(damped(s), omega=(2.5, 10.5), at=omega) for s in (known(), fit.structure))
    a, b = (branch.dataset.isel(point=branch.dataset.kind.values == "requested").amplitude for branch in (exact, found))
    assert 0.0 < float(exact.dataset.stick_fraction.min()) < 1.0
    assert np.abs(b.values / a.values - 1.0).max() < 0.01
    for (w, height), (v, other) in zip(exact.peaks("tip"), found.peaks("tip"), strict=True):
        assert v == pytest.approx(w, rel=1e-3)
        assert other == pytest.approx(height, rel=5e-3)


def test_exact_receptances_give_the_exact_modes():
    fit = fit_modes(read_receptances(measured(("tip", "mid", "low", "root"), noise=0.0)))
    np.testing.assert_allclose(fit.structure.natural_frequencies, known().natural_frequencies, rtol=1e-7)
    np.testing.assert_allclose(fit.structure.static_compliance, np.linalg.inv(known().K), rtol=1e-5)
    assert fit.error < 1e-6
    assert not fit.warnings
    assert "mode 4: 11.906" in fit.summary()


def test_modes_beyond_the_range_are_what_is_left_over():
    """Of the four, one is in the range: a second one and a compliance stand for the others, right in the range."""
    data = measured(("tip", "root"), noise=0.0).sel(omega=slice(2.0, 6.0))
    fit = fit_modes(read_receptances(data), 2)
    assert fit.structure.omega.size == 2
    assert fit.structure.natural_frequencies[0] == pytest.approx(known().natural_frequencies[0], rel=1e-4)
    assert fit.error < 0.07


def test_a_sensor_the_wrong_way_round_is_named():
    data = measured()
    flipped = data.assign(receptance=data.receptance * xr.where(data.output == "tip", -1.0, 1.0))
    with raises_fault(says="'tip' is negative: energy would come out"):
        ss.models.modal_analysis(flipped.sel(input=["tip"]))


def test_what_is_not_passive_or_not_reciprocal_is_said():
    table = read_receptances(measured(("tip", "root")))
    values = table.values.copy()
    values[100:140, 0] = values[100:140, 0].conj()
    other = int(np.flatnonzero((table.rows == DOFS.index("tip")) & (table.columns == 1))[0])
    values[:, other] *= 1.3
    changed = Receptances(dofs=table.dofs, omega=table.omega, values=values, rows=table.rows, columns=table.columns)
    passivity, reciprocity = sorted(changed.warnings("rad/s"))
    assert "passivity: at 'tip' power comes out of the driving point at 40 of 600 frequencies" in passivity
    assert "reciprocity" in reciprocity
    with raises_fault("receptances", says="driving point"):
        fit_modes(read_receptances(measured(("tip",)).sel(output=["mid"])))


def test_files_hold_the_same(tmp_path):
    data, table = measured(), read_receptances(measured())
    data_file = data.assign(receptance_real=data.receptance.real).drop_vars("receptance_real")
    np.savez(
        tmp_path / "a.npz", frequency=OMEGA / (2 * np.pi), outputs=DOFS, inputs=["tip", "root"],
        accelerance=-(OMEGA[:, None, None] ** 2) * data_file.receptance.values,
    )  # fmt: skip
    names = [f"{o}/{i}" for o in DOFS for i in ("tip", "root")]
    H = data.receptance.values.reshape(OMEGA.size, -1)
    columns = np.column_stack([OMEGA, *(part for h in H.T for part in (h.real, h.imag))])
    head = ",".join(["omega", *(f"{name}.{part}" for name in names for part in ("re", "im"))])
    np.savetxt(tmp_path / "a.csv", columns, delimiter=",", header=head, comments="", fmt="%.17g")
    for file in ("a.npz", "a.csv"):
        read = read_receptances(tmp_path / file)
        assert set(read.dofs) == set(DOFS)
        np.testing.assert_allclose(read.omega, OMEGA, rtol=1e-12)
        for k, (i, j) in enumerate(zip(read.rows, read.columns, strict=True)):
            truth = data.receptance.sel(output=read.dofs[i], input=read.dofs[j]).values
            np.testing.assert_allclose(read.values[:, k], truth, rtol=1e-10)
    assert table.values.shape == (600, 8)
    with raises_fault(says="pyuff|no frequency response"):
        read_receptances(_written(tmp_path / "b.unv", "    -1\n    58\n"))
    with raises_fault(str(tmp_path / "c.csv"), "x"):
        read_receptances(_written(tmp_path / "c.csv", "omega,x\n1,2\n"))


def _written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_universal_files_need_a_reader(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyuff", None)
    with raises_fault(says=r"pip install 'slipstick\[test-rig\]'"):
        read_receptances(_written(tmp_path / "a.unv", "    -1\n    58\n"))


def test_universal_files(tmp_path):
    """Accelerances in data sets 58, one of them along -X: its sign is turned."""
    pyuff = pytest.importorskip("pyuff")
    file, data = tmp_path / "a.unv", measured()
    for k, name in enumerate(DOFS):
        sign = -1 if name == "mid" else 1
        h = data.receptance.sel(output=name, input="tip").values * -(OMEGA**2) * sign
        held = pyuff.prepare_58(
            binary=0, func_type=4, rsp_node=k + 1, rsp_dir=sign, ref_node=1, ref_dir=1, data=h,
            x=OMEGA / (2 * np.pi), id1="a", rsp_ent_name="a", ref_ent_name="a", abscissa_spacing=1,
            abscissa_spec_data_type=18, ordinate_spec_data_type=12, orddenom_spec_data_type=13,
        )  # fmt: skip
        pyuff.UFF(str(file)).write_sets(held, "add")
    read = read_receptances(file)
    assert read.dofs == ("n1x", "n2x", "n3x", "n4x")
    np.testing.assert_allclose(read.values, data.receptance.sel(input="tip").values, rtol=1e-4)


def test_a_case_of_a_measured_structure(tmp_path):
    table = measured().receptance.values.copy()
    table[:, 0, 1] *= 1.3
    np.savez(tmp_path / "rig.npz", omega=OMEGA, outputs=DOFS, inputs=["tip", "root"], receptance=table)
    (tmp_path / "case.toml").write_text(measured_case(to=6.0))
    case = Case.from_file(tmp_path / "case.toml")
    assert case.problem().structure.dofs == ("tip", "root", "mid", "low")
    assert any("reciprocity" in sentence for sentence in case.noticed)
    assert 'ss.models.modal_analysis(HERE / "rig.npz"' in python_script(case.text, "case.toml", tmp_path)
    (tmp_path / "case.toml").write_text((tmp_path / "case.toml").read_text().replace("rig.npz", "none.npz"))
    with raises_fault("structure", "file"):
        Case.from_file(tmp_path / "case.toml")


def test_a_fault_in_the_file_of_a_case_is_told_at_its_key(tmp_path):
    """A case with a MATLAB file: its matrix as functions, and a unit that is no receptance's."""
    H = measured(("tip",)).receptance.values[:, :, 0]
    savemat(tmp_path / "rig.mat", {"f": OMEGA / (2.0 * np.pi), "H": H})
    columns = 'columns = { frequency = "f", "tip/tip" = "H(:,1)", "low/tip" = "H(:,3)", "root/tip" = "H(:,4) [UNIT]" }'
    text = measured_case(to=6.0).replace("rig.npz", "rig.mat").replace("[structure]", f"[structure]\n{columns}")
    case = tmp_path / "case.toml"
    case.write_text(text.replace(" [UNIT]", ""))
    found = Case.from_file(case).problem().structure
    assert found.dofs == ("tip", "low", "root")
    case.write_text(text.replace("UNIT", "(m/s^2)/N"))
    with raises_fault("structure", "file", "root/tip", says=r"is in \(m/s\^2\)/N, which is acceleration"):
        Case.from_file(case)
    case.write_text(text.replace("H(:,4) [UNIT]", "H(:,5)"))
    with raises_fault("structure", "columns", "root/tip", says=r"the columns are f, H \(600 x 4\)"):
        Case.from_file(case)
