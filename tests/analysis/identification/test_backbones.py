"""Parameters found again from peaks, nonlinear modes and time series of a problem with known ones."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import xarray as xr
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass
from scipy.integrate import solve_ivp

import slipstick as ss
from slipstick.analysis.identification.measured import read_measured
from slipstick.analysis.identification.predicted import predictor_of
from slipstick.analysis.identification.series import windows
from slipstick.plots.fits import fit

START = {"damper.kt": 80.0, "damper.mu": 0.36}
LOADS = [80.0, 120.0, 180.0, 260.0]


def oscillator(kt=100.0, mu=0.3) -> ss.Problem:
    return one_mass(damper(kt=kt, mu=mu, normal_load=300.0), harmonics=[0, 1, 3])


@cache
def peaks() -> xr.Dataset:
    """Peaks of four curves."""
    rows = []
    for load in LOADS:
        branch = ss.forced_response(oscillator().with_parameter("load", load / 100.0), omega=(5.0, 13.0))
        rows.append(max(branch.peaks("x"), key=lambda peak: peak[1]))
    omega, amplitude = np.array(rows).T
    return xr.Dataset(
        {"peak_omega": ("load", omega), "peak_amplitude": ("load", amplitude)},
        coords={"load": np.array(LOADS) / 100.0}, attrs={"dof": "x"},
    )  # fmt: skip


@cache
def mode() -> xr.Dataset:
    data = ss.nonlinear_modes(oscillator(), amplitude=(0.5, 8.0)).dataset
    chosen = np.linspace(0, data.sizes["point"] - 1, 8).astype(int)
    return data[["modal_amplitude", "modal_damping", "omega"]].isel(point=chosen)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("data", [peaks, mode])
def test_the_parameters_of_backbones(data):
    found = ss.identify(oscillator(), data(), START)
    assert found.values["damper.kt"] == pytest.approx(100.0, rel=1e-6)
    assert found.values["damper.mu"] == pytest.approx(0.3, rel=1e-6)
    assert found.converged
    assert found.dataset.fitted.dims == ("point", "quantity")
    assert len(fit(found.dataset).lines) == 4


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
@pytest.mark.parametrize("data", [peaks, mode])
def test_slopes_are_differences(data):
    names, p = [*START, "damping"], np.array([85.0, 0.33, 1.1])
    predictor = predictor_of(oscillator(), names, read_measured(oscillator(), data()))
    predictor.begin(p)
    predictor.values(p)
    slopes = predictor.slopes(p).copy()
    for k, slope in enumerate(slopes):
        step = np.zeros(3)
        step[k] = 1e-4 * p[k]
        difference = (predictor.values(p + step) - predictor.values(p - step)) / (2.0 * step[k])
        np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-6 * np.abs(slope).max())


@pytest.mark.verify
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_one_quantity_will_do():
    """Frequencies alone tell both, amplitudes alone too; noise is relative to each quantity."""
    only = ss.identify(oscillator(), peaks().drop_vars("peak_amplitude"), START, noise=1e-3)
    assert only.values == pytest.approx({"damper.kt": 100.0, "damper.mu": 0.3}, rel=1e-5)
    both = ss.identify(oscillator(), peaks(), START, noise=1e-3)
    assert both.standard_errors["damper.kt"] < only.standard_errors["damper.kt"]
    damping = ss.identify(oscillator(), mode().drop_vars("omega"), START)
    assert damping.values == pytest.approx({"damper.kt": 100.0, "damper.mu": 0.3}, rel=1e-5)


def test_noise_of_each_number_weighs_it():
    data = peaks().assign(peak_omega_noise=("load", np.full(4, 0.02)), peak_amplitude_noise=("load", np.full(4, 5.0)))
    found = ss.identify(oscillator(), data, START)
    assert found.values == pytest.approx({"damper.kt": 100.0, "damper.mu": 0.3}, rel=1e-5)
    assert found.reduced_chi_square < 1e-6
    with raises_fault("measured", "peak_amplitude_noise"):
        ss.identify(oscillator(), data.drop_vars("peak_amplitude_noise"), START)


def test_wrong_backbones_are_refused():
    with raises_fault("measured", "dof"):
        ss.identify(oscillator(), peaks().assign_attrs(dof="y"), START)
    with raises_fault("measured", "peak_omega"):
        ss.identify(oscillator(), peaks().drop_vars("peak_omega"), START)
    with raises_fault("measured", "peak_omega"):
        ss.identify(oscillator(), peaks().assign(peak_omega=-peaks().peak_omega), START)
    with raises_fault("measured", "omega"):
        ss.identify(oscillator(), mode()[["modal_amplitude"]].drop_vars("omega", errors="ignore"), START)


def bolted(kt=20.0, limit=0.3, load=0.0) -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.02]], K=[[40.0]], dofs=["x"])
    contact = ss.models.DahlContact(kt=kt, limit=limit)
    pair = ss.ContactPair(name="joint", contact=contact, tangential="x")
    loads = ss.Load(dof="x", sin=load) if load else ()
    return ss.Problem(structure, contacts=pair, loads=loads, harmonics=range(6), outputs=["x"])


def test_windows_of_a_viscous_decay_are_exact():
    """Amplitude, damped frequency and d / w in closed form."""
    t, w, zeta = np.linspace(0.0, 30.0, 3001), 6.0, 0.02
    damped = w * np.sqrt(1.0 - zeta**2)
    x = 2.0 * np.exp(-zeta * w * t) * np.cos(damped * t + 0.3) + 0.1
    found = np.array(list(windows(t, x)))
    assert len(found) >= 6
    np.testing.assert_allclose(found[:, 1], damped, rtol=1e-7)
    np.testing.assert_allclose(found[:, 2], zeta * w / damped, rtol=1e-6)
    np.testing.assert_allclose(found[1:, 0] / found[:-1, 0], np.exp(-zeta * w / damped * 6.0 * np.pi), rtol=1e-3)


@pytest.mark.verify
@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_a_free_decay_is_a_nonlinear_mode():
    """Dahl's element integrated in time: frequency and damping over amplitude are those of the mode, parameters too."""

    def rates(_, y):
        return [y[1], -40.0 * y[0] - 0.02 * y[1] - y[2], 20.0 * (y[1] - abs(y[1]) * y[2] / 0.3)]

    t = np.linspace(0.0, 50.0, 4001)
    x = solve_ivp(rates, (0.0, 50.0), [2.0, 0.0, 0.0], t_eval=t, rtol=1e-8, atol=1e-10).y[0]
    found = np.array(list(windows(t, x)))
    branch = ss.nonlinear_modes(bolted(), amplitude=(found[-1, 0], found[0, 0])).dataset
    omega, damping = (np.interp(found[:, 0], branch.modal_amplitude, branch[n]) for n in ("omega", "modal_damping"))
    np.testing.assert_allclose(found[:, 1], omega, rtol=2e-3)
    np.testing.assert_allclose(found[:, 2], damping, rtol=0.01)
    data = xr.Dataset({"displacement": ("time", x)}, coords={"time": t}, attrs={"dof": "x"})
    fitted = ss.identify(bolted(15.0, 0.4), data, ["joint.kt", "joint.limit"])
    assert fitted.values["joint.limit"] == pytest.approx(0.3, rel=5e-3)
    assert fitted.values["joint.kt"] == pytest.approx(20.0, rel=0.1)


OMEGA = np.array([7.0, 8.0, 9.0, 10.0])


def series(noise=1e-4, growing=0.0) -> xr.Dataset:
    """Four runs of steady vibration over twelve seconds."""
    t, problem = np.linspace(0.0, 12.0, 1500), oscillator()
    U = ss.steady_response(problem, omega=OMEGA).dataset.displacement.values[:, 0]
    x = np.array([np.asarray(problem.harmonics.H_minus(w * t)) @ u for w, u in zip(OMEGA, U, strict=True)])
    x = x * (1.0 + growing * t) + noise * np.random.default_rng(0).standard_normal(x.shape)
    return xr.Dataset(
        {"displacement": (("run", "dof", "time"), x[:, None]), "omega": ("run", OMEGA)},
        coords={"time": t, "dof": ["x"]},
    )


def test_steady_series_are_their_last_periods():
    found = ss.identify(oscillator(80.0, 0.36), series(), list(START))
    assert found.values == pytest.approx({"damper.kt": 100.0, "damper.mu": 0.3}, rel=1e-3)
    one = read_measured(oscillator(), series().isel(run=1))
    np.testing.assert_allclose(one.values[0], read_measured(oscillator(), series()).values[1], rtol=1e-12)
    (note,) = read_measured(oscillator(), series(growing=0.05)).notes
    assert "is not steady" in note
    gaps = series().copy(deep=True)
    gaps.displacement[1, ..., -40:-20] = np.nan
    np.testing.assert_allclose(read_measured(oscillator(), gaps).values[1], one.values[0], atol=2e-5)
    with raises_fault("measured", "time", says="less than two periods"):
        read_measured(oscillator(), series().isel(time=slice(0, 120)))


def test_a_series_with_force_is_a_loop():
    problem = bolted(load=1.0)
    loop = ss.steady_response(problem, omega=6.3).loop(0, samples=401)
    n = 400
    data = xr.Dataset(
        {
            "force": ("time", np.tile(loop["force"][:n], 4)), "displacement": ("time", np.tile(loop["motion"][:n], 4)),
            "omega": 6.3,
        },
        coords={"time": np.arange(4 * n) * (2.0 * np.pi / 6.3 / n)},
    )  # fmt: skip
    found = ss.identify(bolted(15.0, 0.4, load=1.0), data, ["joint.kt", "joint.limit"])
    assert found.solutions == 0
    assert found.values == pytest.approx({"joint.kt": 20.0, "joint.limit": 0.3}, rel=5e-3)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_columns_of_files(tmp_path):
    """The same numbers as from a dataset."""
    p = peaks()
    table = np.column_stack([p["load"], p.peak_omega / (2.0 * np.pi), p.peak_amplitude])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="load,peak_frequency,peak_amplitude", comments="")
    read = read_measured(oscillator(), tmp_path / "a.csv")
    np.testing.assert_allclose(read.values, np.column_stack([p.peak_omega, p.peak_amplitude]), rtol=1e-12)
    np.testing.assert_allclose(read.conditions["load"], p["load"])
    m = mode()
    table = np.column_stack([m.modal_amplitude, m.omega, m.modal_damping])
    np.savetxt(tmp_path / "b.csv", table, delimiter=",", header="modal_amplitude,omega,modal_damping", comments="")
    read = read_measured(oscillator(), tmp_path / "b.csv")
    np.testing.assert_allclose(read.values, np.column_stack([m.omega, m.modal_damping]), rtol=1e-12)
    one = series().isel(run=1, dof=0)
    table = np.column_stack([one.time, one.displacement, np.full(one.time.size, OMEGA[1])])
    np.savetxt(tmp_path / "c.csv", table, delimiter=",", header="time,x,omega", comments="")
    read = read_measured(oscillator(), tmp_path / "c.csv")
    assert read.values.shape == (1, 1, 5)
