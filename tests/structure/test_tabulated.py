"""A structure known by a table of receptances, held against the one that the table was computed of."""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np
import pytest
import xarray as xr
from helpers.cases import measured as measured_case
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.case.case import Case
from slipstick.case.script import python_script
from slipstick.errors import InputError, SlipstickWarning
from slipstick.structure.tabulated import TabulatedStructure, noise_of

DOFS = ["tip", "mid", "low", "root"]


@cache
def known() -> ss.MatrixStructure:
    M = np.diag([1.0, 1.2, 0.8, 1.0])
    K = np.array([[60.0, -25, 0, 0], [-25, 70, -30, 0], [0, -30, 80, -35], [0, 0, -35, 90]])
    return ss.MatrixStructure(M=M, C=0.004 * K + 0.02 * M, K=K, dofs=DOFS)


def measured(top=60.0, noise=0.0, inputs=DOFS) -> xr.Dataset:
    omega, at = np.linspace(1.0, top, round(68 * (top - 1.0))), [DOFS.index(name) for name in inputs]
    rng = np.random.default_rng(3)
    H = known().project(np.eye(4), np.eye(4)[:, at]).at([1.0], omega)[0][:, 0]
    H = H * (1.0 + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)))
    names = {"omega": omega, "output": DOFS, "input": list(inputs)}
    return xr.Dataset({"receptance": (("omega", "output", "input"), H)}, coords=names)


@cache
def tabulated(top=60.0, noise=0.0, beyond="refuse") -> TabulatedStructure:
    return ss.models.tabulated_structure(measured(top, noise), beyond=beyond)


def damped(structure) -> ss.Problem:
    """A friction contact between two points that were measured, loaded at a third."""
    pair = ss.ContactPair(
        name="joint", contact=ss.FrictionContact(kt=20.0, mu=0.3, normal_load=20.0),
        tangential={"tip": 1.0, "root": -1.0},
    )  # fmt: skip
    load = ss.Load(dof="low", sin=8.0)
    return ss.Problem(structure, contacts=pair, loads=load, harmonics=[0, 1, 3, 5], outputs=["tip", "mid"])


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize(
    ("top", "noise", "beyond", "within"),
    [
        pytest.param(60.0, 0.0, "refuse", 2e-4, marks=pytest.mark.verify),
        (60.0, 1e-3, "refuse", 0.01),
        (20.0, 1e-3, "line", 0.02),
    ],
)
def test_friction_curves_of_the_table(top, noise, beyond, within):
    """0.1 % noise: curves with friction come back to 1 %; to 2 % where harmonics 3 and 5 lie beyond the table."""
    omega = np.linspace(3.0, 10.0, 40)
    exact, found = (
        ss.forced_response(damped(s), omega=(2.5, 10.5), at=omega) for s in (known(), tabulated(top, noise, beyond))
    )
    a, b = (branch.dataset.isel(point=branch.dataset.kind.values == "requested").amplitude for branch in (exact, found))
    assert 0.0 < float(exact.dataset.stick_fraction.min()) < 1.0
    assert np.abs(b.values / a.values - 1.0).max() < within
    (w, height), (v, other) = exact.peaks("tip")[0], found.peaks("tip")[0]
    assert v == pytest.approx(w, rel=1e-3)
    assert other == pytest.approx(height, rel=5e-3)
    assert np.isnan(found.dataset.truncation.values[-1]) == (beyond == "refuse")  # asks for 7 x 10.5 rad/s


@pytest.mark.parametrize(("top", "beyond"), [(60.0, "refuse"), (20.0, "line")])
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_the_derivative_is_that_of_the_interpolant(top, beyond):
    rows, columns = np.eye(4)[:, [0, 3]] - np.eye(4)[:, [2, 1]], np.eye(4)[:, :3]
    receptance = tabulated(top, 0.0, beyond).project(rows, columns)
    orders, omega, step = np.array([1.0, 3.0, 5.0]), np.array([1.4, 7.3, 11.3]), 1e-6
    if beyond == "line":
        omega = np.append(omega, 0.3)  # below, within and above the table
    value, slope = receptance.at(orders, omega)
    ahead, behind = (receptance.at(orders, omega + s)[0] for s in (step, -step))
    np.testing.assert_allclose(slope, (ahead - behind) / (2 * step), rtol=1e-6, atol=1e-7 * np.abs(slope).max())
    assert value.shape == slope.shape == (omega.size, 3, 2, 3)
    for k, w in enumerate(omega):
        one = receptance.at(orders, float(w))
        np.testing.assert_allclose(one, (value[k], slope[k]), rtol=1e-14)
    truth = known().project(rows, columns).at(orders, omega)[0]
    np.testing.assert_allclose(value, truth, atol=(1e-3 if beyond == "refuse" else 6e-3) * np.abs(truth).max())


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_stated_errors_are_those_made():
    """Through every second line the error is that stated; with all lines less; at rest it is that of the fit."""
    coarse, fine = (ss.models.tabulated_structure(measured().isel(omega=slice(None, None, k))) for k in (2, 1))
    between = fine.omega[1::2][:-1]
    exact = known().project(np.eye(4), np.eye(4)).at([1.0], between)[0][:, 0]
    found = coarse.project(np.eye(4), np.eye(4)).at([1.0], between)[0][:, 0]
    size = np.abs(exact) + 0.02 * np.sqrt(np.mean(np.abs(exact) ** 2, axis=0))
    made = np.abs(found - exact) / size
    assert fine.error == pytest.approx(np.sqrt(np.mean(made**2)), rel=0.02)
    assert fine.worst == pytest.approx(made.max(), rel=0.02)
    assert fine.error < 0.1 * coarse.error
    static = np.linalg.inv(known().K)
    off = np.linalg.norm(fine.static - static) / np.linalg.norm(static)
    assert off < 3.0 * fine.static_error < 3e-3
    assert fine.natural_frequencies == pytest.approx(known().natural_frequencies, abs=1.0 / 68)


def test_noise_is_seen_and_taken_off():
    noisy = measured(noise=1e-3)
    H, exact = (data.receptance.values.reshape(-1, 16) for data in (noisy, measured()))
    assert noise_of(H) == pytest.approx(np.full(16, 1e-3), rel=0.1)
    left = ss.models.tabulated_structure(noisy, smooth=False)
    smooth = tabulated(noise=1e-3)
    off = [np.sqrt(np.mean(np.abs(s.table.reshape(-1, 16) / exact - 1.0) ** 2)) for s in (left, smooth)]
    assert off[1] < 0.5 * off[0] < 6e-4
    assert (left.noise, tabulated().noise) == (0.0, 0.0)
    assert smooth.noise == pytest.approx(7e-4, rel=0.1)  # of the mean of both ways
    assert "noise of 0.07" in smooth.summary()


@pytest.mark.parametrize("lines", [400, 3000])
def test_a_noise_floor_is_taken_off_and_resonances_stay(lines):
    """A floor of 0.1 % of the largest: less of it is left where receptances are small, and hardly more at peaks."""
    omega = np.linspace(1.0, 35.0, lines)
    exact = known().project(np.eye(4), np.eye(4)).at([1.0], omega)[0][:, 0]
    largest, rng = np.abs(exact).max(), np.random.default_rng(0)
    parts = np.sqrt(0.5) * 1e-3 * largest * rng.standard_normal((2, *exact.shape))
    noise = parts[0] + 1j * parts[1]
    data = xr.Dataset(
        {"receptance": (("omega", "output", "input"), exact + noise)},
        coords={"omega": omega, "output": DOFS, "input": DOFS},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SlipstickWarning)
        smooth = ss.models.tabulated_structure(data)
    off, peaks = np.abs(smooth.table - exact) / (1e-3 * largest), np.abs(exact) > 0.3 * largest
    assert np.sqrt(np.mean(off[~peaks] ** 2)) < 0.6
    assert np.sqrt(np.mean(off[peaks] ** 2)) < 2.0  # 400 lines: one or two in the width of a resonance
    assert smooth.natural_frequencies.size < 10


def test_tables_that_are_no_receptances_are_named():
    exact = measured()
    with raises_fault("receptances", says="they are conjugated"):
        ss.models.tabulated_structure(exact.assign(receptance=exact.receptance.conj()))
    with raises_fault("receptances", says='look like accelerances .*quantity="acceleration"'):
        ss.models.tabulated_structure(exact.assign(receptance=-(exact.omega**2) * exact.receptance))


def test_reciprocity_fills_in_and_what_is_missing_is_refused():
    fit = ss.models.tabulated_structure(measured(inputs=["tip", "root"]))
    i, j = fit.dofs.index("tip"), fit.dofs.index("low")
    np.testing.assert_array_equal(fit.table[:, i, j], fit.table[:, j, i])
    eye = np.eye(4)
    assert np.isfinite(fit.project(eye[:, [i]], eye).at([1.0], 3.0)[0]).all()
    with raises_fault("structure", says="'mid' by a force on 'low' was not measured|'low' by a force on"):
        ss.steady_response(damped(fit), omega=3.0)


def test_what_the_table_does_not_reach_is_refused():
    problem = damped(tabulated())
    with raises_fault("frequency range", says="harmonics 1 to 5 .* to 75 rad/s.*1 to 60"):
        ss.forced_response(problem, omega=(2.5, 15.0))
    with raises_fault("frequency range"):
        ss.track_peak(problem, "load", (0.5, 1.0), dof="tip", omega=(0.5, 6.0))
    with raises_fault("structure", says="at 100 rad/s"):
        ss.steady_response(problem, omega=20.0)
    with raises_fault("stability", says="table of receptances"):
        ss.forced_response(problem, omega=(2.5, 3.0), stability=True)
    with raises_fault("structure", says="no equations in time"):
        ss.transient(problem, omega=3.0)
    with pytest.raises(InputError, match="nonlinear modes need"):
        ss.nonlinear_modes(problem, amplitude=(0.1, 1.0), mode=1, dof="tip")


def test_a_free_body_needs_its_static_compliance():
    """A(w) = -1 / w^2 rises without end; given, nothing else is in its way."""
    omega = np.linspace(2.0, 40.0, 400)
    data = xr.Dataset(
        {"receptance": (("omega", "output", "input"), (-1.0 / omega**2 + 0j)[:, None, None])},
        coords={"omega": omega, "output": ["x"], "input": ["x"]},
    )
    with raises_fault("static", says="zeros do"):
        ss.models.tabulated_structure(data)
    assert ss.models.tabulated_structure(data, static=[[0.0]]).static_error == 0.0


def test_stability_of_lines_is_counted():
    """With lines the table answers everywhere, and the argument principle needs no states."""
    with pytest.warns(SlipstickWarning, match="nothing was measured"):
        structure = ss.models.tabulated_structure(measured(), beyond="line")
    branches = [ss.steady_response(damped(s), omega=[4.9, 5.1], stability=True) for s in (known(), structure)]
    assert [b.dataset.stable.values.tolist() for b in branches] == [[1, 1], [1, 1]]
    assert set(branches[1].dataset.stability_method.values) == {"count"}


def test_suspicious_tables_are_warned_of():
    coarse = measured().isel(omega=slice(None, None, 12))
    with pytest.warns(SlipstickWarning, match="coarse or noisy: .* at [0-9.]+ rad/s"):
        ss.models.tabulated_structure(coarse)
    late = measured().sel(omega=slice(3.0, 60.0))
    with pytest.warns(SlipstickWarning, match="static compliance|nothing") as told:
        found = ss.models.tabulated_structure(late, beyond="line")
    assert len(told) == len(found.warnings) > 0
    turned = measured()
    turned["receptance"] = turned.receptance.where(abs(turned.omega - 5.0) > 0.2, turned.receptance.conj())
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", SlipstickWarning)
        ss.models.tabulated_structure(turned)
    assert any("passivity" in str(one.message) for one in told)


def test_files_hold_it(tmp_path):
    problem = damped(tabulated(noise=1e-3))
    branch = ss.steady_response(problem, omega=[4.0, 5.0])
    branch.save(tmp_path / "a.nc")
    read = ss.load(tmp_path / "a.nc").problem.structure
    assert isinstance(read, TabulatedStructure)
    np.testing.assert_array_equal(read.table, problem.structure.table)
    assert read.summary() == problem.structure.summary()
    again = ss.steady_response(ss.load(tmp_path / "a.nc").problem, omega=[4.0, 5.0])
    np.testing.assert_allclose(again.dataset.displacement, branch.dataset.displacement, rtol=1e-10)


CASE = measured_case('fit = "tabulated"\nbeyond = "line"\n')


def test_in_a_case(tmp_path):
    data = measured(20.0)
    np.savez(
        tmp_path / "rig.npz", omega=data.omega, outputs=DOFS, inputs=DOFS, receptance=data.receptance.values
    )  # fmt: skip
    (tmp_path / "case.toml").write_text(CASE)
    case = Case.from_file(tmp_path / "case.toml")
    assert isinstance(case.problem().structure, TabulatedStructure)
    assert any("nothing was measured" in sentence for sentence in case.noticed)
    script = python_script(case.text, "case.toml", tmp_path)
    assert 'structure = ss.models.tabulated_structure(HERE / "rig.npz", beyond="line")' in script
    (tmp_path / "case.toml").write_text(CASE.replace('beyond = "line"', ""))
    with raises_fault("response", says="to 27 rad/s.*1 to 20"):
        Case.from_file(tmp_path / "case.toml")
    (tmp_path / "case.toml").write_text(CASE.replace('fit = "tabulated"', 'fit = "modes"'))
    with raises_fault("structure", "beyond"):
        Case.from_file(tmp_path / "case.toml")
    (tmp_path / "case.toml").write_text(CASE.replace('beyond = "line"', "static = [[1.0]]"))
    with raises_fault("structure", "static", says="shape"):
        Case.from_file(tmp_path / "case.toml")
