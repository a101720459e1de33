"""Parameters found again from what a problem with known ones does, without noise and with."""

from __future__ import annotations

import warnings
from functools import cache

import numpy as np
import pytest
import xarray as xr
from helpers.counting import calls_of
from helpers.faults import raises_fault
from helpers.oscillator import damper, one_mass

import slipstick as ss
from slipstick.analysis.identification import predicted
from slipstick.analysis.identification.measured import read_measured
from slipstick.analysis.identification.predicted import predictor_of
from slipstick.balance.balance import Balance
from slipstick.errors import TimeIsUp

TRUE = {"damper.kt": 100.0, "damper.mu": 0.3, "damper.normal_load": 300.0}
START = {"damper.kt": 60.0, "damper.mu": 0.5, "damper.normal_load": 200.0}
FREQUENCIES = np.linspace(5.0, 12.0, 16)


def oscillator(*, varying: bool = True, **rubbing) -> ss.Problem:
    """The paper's, with a normal load that varies over the period: else friction and load are one parameter."""
    moved = {"normal_cos": {2: 100.0}, "normal_sin": {1: 60.0}} if varying else {}
    return one_mass(damper(kn=1.0, normal_load=300.0, **moved, **rubbing), harmonics=range(11))


@cache
def measured(name="displacement"):
    return ss.steady_response(oscillator(), omega=FREQUENCIES).dataset[[name, "omega"]]


def noisy(seed):
    data = measured().copy(deep=True)
    size = 0.01 * np.sqrt(np.mean(data.displacement.values[..., 1:3] ** 2))
    data["displacement"] += size * np.random.default_rng(seed).standard_normal(data.displacement.shape)
    return data, float(size)


@pytest.mark.parametrize("quantity", ["displacement", "amplitude"])
def test_the_parameters_of_the_oscillator(quantity):
    """From kt 60, mu 0.5, load 200; of amplitudes alone mu and the load are correlated to five digits."""
    found = ss.identify(oscillator(), measured(quantity), START)
    for name, value in TRUE.items():
        assert found.values[name] == pytest.approx(value, rel=1e-10)
        assert found.problem.parameter(name) == found.values[name]
    assert found.misfit < 1e-10
    assert not found.indistinct
    assert found.dataset.fitted.dims == found.dataset.measured.dims


def test_friction_under_a_constant_load_is_one_parameter():
    data = ss.steady_response(oscillator(varying=False), omega=FREQUENCIES[:12]).dataset
    start = {"damper.mu": 0.2, "damper.normal_load": 280.0, "damper.kt": 80.0}
    with pytest.warns(ss.SlipstickWarning, match=r"determines their product alone|act through the friction limit"):
        found = ss.identify(oscillator(varying=False), data, start)
    assert found.values["damper.mu"] * found.values["damper.normal_load"] == pytest.approx(90.0, rel=1e-10)
    assert found.values["damper.kt"] == pytest.approx(100.0, rel=1e-10)
    assert "damper.mu and damper.normal_load cannot be separated" in found.summary()
    assert np.isinf(found.standard_errors["damper.mu"])
    assert np.isfinite(found.standard_errors["damper.kt"])
    assert found.singular_values[-1] < 1e-7 * found.singular_values[0]


@pytest.mark.parametrize(("unit", "size"), [("Hz", 2.0 * np.pi), ("kHz", 2e3 * np.pi)])
def test_levels_of_excitation_in_hertz(unit, size):
    """Amplitudes at three levels, some not measured; damping of the structure beside the contact's parameters."""
    problem, levels = oscillator(varying=False), [40.0, 100.0, 200.0]
    omega = FREQUENCIES[::2]
    table = np.array([
        ss.steady_response(problem.with_parameter("load.x.amplitude", level), omega=omega).dataset.amplitude
        for level in levels
    ])  # fmt: skip
    table[0, 3] = np.nan
    data = xr.Dataset(
        {"amplitude": (("load.x.amplitude", "frequency", "dof"), table)},
        coords={
            "load.x.amplitude": levels, "dof": ["x"],
            "omega": ("frequency", omega / size, {"units": unit}),
        },
    )  # fmt: skip
    found = ss.identify(problem, data, {"damper.mu": 0.2, "damper.kt": 80.0, "damping": 1.3})
    assert [*found.values.values()] == pytest.approx([0.3, 100.0, 1.0], rel=1e-9)


def test_complex_frequency_responses():
    """Of the first harmonic alone, x = Re(z e^(i tau)), as an analyser gives them."""
    c, s = measured().displacement.values[:, 0, 1:3].T
    data = xr.Dataset(
        {"displacement": (("omega", "dof"), (c - 1j * s)[:, None])}, coords={"omega": FREQUENCIES, "dof": ["x"]}
    )
    found = ss.identify(oscillator(), data, START)
    assert [*found.values.values()] == pytest.approx([*TRUE.values()], rel=1e-9)


@pytest.mark.parametrize("hole", [np.nan, complex(np.nan, 0.3), complex(0.3, np.nan)])
def test_a_complex_number_that_lacks_a_part_is_missing(hole):
    """nan written into a complex array is nan + 0j: its imaginary part is no measurement."""
    c, s = measured().displacement.values[:, 0, 1:3].T
    z = (c - 1j * s)[:, None]
    z[[2, 7, 8, 11]] = hole
    data = xr.Dataset({"displacement": (("omega", "dof"), z)}, coords={"omega": FREQUENCIES, "dof": ["x"]})
    read = read_measured(oscillator(), data)
    assert np.isnan(read.values[[2, 7, 8, 11]]).all()
    assert np.isfinite(read.values[:, 0, 1:3]).sum() == 24
    if hole is np.nan:
        found = ss.identify(oscillator(), data, START)
        assert [*found.values.values()] == pytest.approx([*TRUE.values()], rel=1e-9)


def test_a_cosine_without_its_sine_is_missing(tmp_path):
    """In a dataset and in a file; of a dof whose sines were measured nowhere the cosines stand by themselves."""
    data = measured().sel(coefficient=["c1", "s1"]).copy(deep=True)
    data.displacement[3, 0, 0] = np.nan
    table = np.column_stack([FREQUENCIES, data.displacement.values[:, 0]])
    lines = [",".join("" if np.isnan(cell) else repr(float(cell)) for cell in row) for row in table]
    (tmp_path / "a.csv").write_text("\n".join(["omega,x.c1,x.s1", *lines]) + "\n")
    for given in (data, tmp_path / "a.csv"):
        read = read_measured(oscillator(), given)
        assert np.isnan(read.values[3]).all()
        assert np.isfinite(read.values[:, 0, 1:3]).sum() == 30
        assert "1 measured coefficients are left out" in read.notes[0]
    with pytest.warns(ss.SlipstickWarning, match="left out"):
        found = ss.identify(oscillator(), data, START)
    assert found.warnings == read.notes
    data.displacement[:, 0, 1] = np.nan
    alone = read_measured(oscillator(), data)
    assert np.isfinite(alone.values).sum() == 15
    assert not alone.notes
    data.displacement[:, 0, 0] = 0.0  # what the real and imaginary part of nan + 0j leave
    with raises_fault("measured", "displacement", says="holds no numbers"):
        read_measured(oscillator(), data)
    with raises_fault("measured", "amplitude", says="complex numbers"):
        read_measured(oscillator(), measured("amplitude") * (1.0 + 0.0j))


@pytest.mark.parametrize("velocity", [0.0, 3.0])
def test_hysteresis_loops(velocity):
    """Two loops of a known contact: its stiffness, friction and load, without solving for any motion. Sampled corners
    of the force fold into the harmonics kept: 800 samples tell them to 1e-4."""
    problem = oscillator(velocity=velocity)
    branch = ss.steady_response(problem, omega=[6.0, 9.0])
    loops = [branch.loop(k, samples=801) for k in range(2)]
    data = xr.Dataset(
        {
            "force": (("loop", "tau"), [loop["force"][:-1] for loop in loops]),
            "displacement": (("loop", "tau"), [loop["motion"][:-1] for loop in loops]),
            "omega": ("loop", [6.0, 9.0]),
        },
        coords={"tau": loops[0]["tau"][:-1]}, attrs={"contact": "damper"},
    )  # fmt: skip
    found = ss.identify(problem, data, START)
    assert [*found.values.values()] == pytest.approx([*TRUE.values()], rel=1e-4)
    assert found.solutions == 0


@pytest.mark.filterwarnings("ignore:the fit from the start given ends far")  # with SciPy 1.15
def test_the_upper_of_three_motions():
    """A stop bends the curve over. At the start only the lower motion exists at the highest frequencies measured:
    the others lead to parameters at which the upper one does."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[40.0]], dofs=["x"])
    stop = ss.ContactPair(name="stop", contact=ss.FrictionContact(kn=30.0, gap=2.0), normal="x")
    problem = ss.Problem(structure, contacts=stop, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    omega = np.linspace(6.2, 7.4, 13)
    curve = ss.forced_response(problem, omega=(5.5, 9.0), at=omega).dataset
    at = [np.flatnonzero((curve.kind == "requested") & (np.abs(curve.omega - w) < 1e-9)) for w in omega]
    assert max(map(len, at)) == 3
    highest = [k[int(np.argmax(curve.amplitude.values[k, 0]))] for k in at]
    data = curve.isel(point=highest)[["displacement", "omega"]]
    found = ss.identify(problem, data, {"stop.kn": 24.0, "stop.gap": 2.1, "damping": 1.2})
    assert [*found.values.values()] == pytest.approx([30.0, 2.0, 1.0], rel=1e-9)
    assert found.several == 4
    assert "4 points have more than one motion" in found.summary()


def spread(seeds):
    """Errors over their standard errors, and whether the 90 % intervals hold the truth, (n_seeds, 3) each."""
    errors, inside = [], []
    for seed in seeds:
        found = ss.identify(oscillator(), noisy(seed)[0], TRUE)
        errors.append([(found.values[k] - v) / found.standard_errors[k] for k, v in TRUE.items()])
        inside.append([low <= v <= high for k, v in TRUE.items() for low, high in [found.interval(k)]])
    return np.array(errors), np.array(inside)


def test_noise_is_what_the_errors_say():
    """Errors of the size that is said; the noise is found from what is left, or judged where it is given."""
    errors, inside = spread(range(3))
    assert 0.3 < np.sqrt(np.mean(errors**2)) < 2.0
    assert np.mean(inside) > 0.6
    data, size = noisy(0)
    found, told = ss.identify(oscillator(), data, TRUE), ss.identify(oscillator(), data, TRUE, noise=size)
    assert found.noise == pytest.approx(size, rel=0.1)
    assert told.reduced_chi_square == pytest.approx((found.noise / size) ** 2, rel=1e-6)
    for name in TRUE:
        assert told.values[name] == pytest.approx(found.values[name], rel=1e-6)
        assert told.standard_errors[name] == pytest.approx(found.standard_errors[name] * size / found.noise, rel=1e-4)
    assert "correlated" in found.summary()


@pytest.mark.verify
def test_bias_and_coverage():
    """1 % noise, 100 seeds: the mean is off by less than a standard error, 90 % intervals hold the truth."""
    errors, inside = spread(range(100))
    assert np.all(np.abs(errors.mean(axis=0)) < 1.0)
    assert 0.85 <= np.mean(inside) <= 0.95
    assert np.all(np.abs(errors.std(axis=0) - 1.0) < 0.2)


def test_derivatives_are_exact_and_take_no_evaluation(monkeypatch):
    """Against central differences of the same predictions, each solved from the motion before."""
    problem, data = oscillator(), measured()
    predictor = predictor_of(problem, tuple(START), read_measured(problem, data))
    p = np.array([90.0, 0.35, 310.0])
    predictor.begin(p)
    predictor.values(p)
    made = calls_of(monkeypatch, Balance, "jacobian")
    exact = predictor.slopes(p)
    assert not made
    differences = []
    for i, h in enumerate(1e-5 * p):
        ends = [predictor.values(p + way * h * np.eye(3)[i]) for way in (1, -1)]
        differences.append((ends[0] - ends[1]) / (2 * h))
    np.testing.assert_allclose(exact, differences, atol=1e-7 * np.abs(exact).max(axis=(1, 2, 3)).min())


def test_several_starts_find_what_one_does_not_lose():
    bounds = {"damper.kt": (20.0, 500.0), "damper.mu": (0.05, 1.0)}
    start = {"damper.kt": 400.0, "damper.mu": 0.9}
    found = ss.identify(oscillator(), measured().isel(point=slice(0, None, 3)), start, bounds=bounds, starts=2)
    assert len(found.starts) == 2
    assert found.starts[0] == min(found.starts)
    assert [*found.values.values()] == pytest.approx([100.0, 0.3], rel=1e-9)
    at = ss.identify(oscillator(), measured(), {"damper.mu": 0.35}, bounds={"damper.mu": (0.303, 1)})
    assert at.values["damper.mu"] == pytest.approx(0.303, rel=1e-6)
    assert at.at_bound == ("damper.mu",)
    assert "at a bound" in at.summary()


def test_files(tmp_path):
    data = measured()
    table = np.column_stack([data.omega / (2 * np.pi), data.displacement.values[:, 0, 1:3]])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",", header="frequency,x.c1,x.s1", comments="", fmt="%.17g")
    data.to_netcdf(tmp_path / "a.nc", engine="h5netcdf")
    for file in ("a.csv", "a.nc"):
        read = read_measured(oscillator(), tmp_path / file)
        np.testing.assert_allclose(read.omega, FREQUENCIES)
        np.testing.assert_array_equal(read.values[:, 0, 1:3], table[:, 1:])
    (tmp_path / "loops.csv").write_text(
        "loop,tau,displacement,force\n" + "".join(
            f"{k},{t},{np.sin(t)},{k * np.cos(t)}\n" for k in (1, 2) for t in np.arange(24) * np.pi / 12
        )
    )  # fmt: skip
    loops = read_measured(oscillator(), tmp_path / "loops.csv")
    np.testing.assert_allclose(loops.values[:, 1], [1.0, 2.0])
    assert np.isnan(loops.values[:, 0]).all()
    (tmp_path / "b.csv").write_text("omega,y\n1,2\n")
    with raises_fault(str(tmp_path / "b.csv"), "y"):
        read_measured(oscillator(), tmp_path / "b.csv")


def test_what_does_not_fit():
    problem, data = oscillator(), measured()
    with raises_fault("measured", says="omega"):
        ss.identify(problem, xr.Dataset({"y": ("x", [1.0])}), START)
    with raises_fault("measured", "coefficient"):
        ss.identify(problem, data.assign_coords(coefficient=[f"c{m}" for m in range(21)]), START)
    with raises_fault("parameters", "damper.kn", says="moves damper.normal_load"):
        ss.identify(problem, data, {"damper.kn": 1.0, "damper.normal_load": 300.0})
    with raises_fault("bounds"):
        ss.identify(problem, data, START, starts=2)
    with raises_fault("parameters", "damper.mu", says="within its bounds"):
        ss.identify(problem, data, START, bounds={"damper.mu": (0.6, 1.0)})
    with raises_fault("parameters", "load", says="set at every point"):
        ss.identify(problem, data.assign(load=("point", np.ones(16))), {"load": 1.1})
    with raises_fault("measured", "displacement", says="holds no numbers"):
        ss.identify(problem, data.assign(displacement=data.displacement * np.nan), START)


@pytest.mark.parametrize(
    ("error", "said"), [(KeyboardInterrupt, "interrupted"), (TimeIsUp, "stopped at its time limit")]
)
def test_a_fit_that_is_stopped_has_the_best_values_so_far(error, said):
    steps = []

    def late(event):
        steps.append(event)
        if len(steps) == 5:
            raise error

    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        found = ss.identify(oscillator(), measured(), START, listeners=late)
    assert any(said in str(warning.message) for warning in told)
    assert not found.converged
    assert said in found.message
    left = {name: residual(values) for name, values in (("start", START), ("found", found.values))}
    assert left["found"] < 0.9 * left["start"]
    assert found.misfit == pytest.approx(left["found"], rel=1e-6)
    assert set(found.dataset.data_vars) >= {"measured", "fitted", "value"}


def residual(values):
    """Root mean square of what is left over that of what was measured, by a computation of its own."""
    steady = ss.steady_response(oscillator().at_parameters(values), omega=FREQUENCIES).dataset.displacement
    true = measured().displacement.values
    return np.sqrt(np.mean((steady.values - true) ** 2) / np.mean(true**2))


def test_before_a_step_there_is_nothing_to_keep():
    def at_once(event):
        raise TimeIsUp

    with pytest.raises(TimeIsUp):
        ss.identify(oscillator(), measured(), START, listeners=at_once)


def test_what_stops_a_curve_stops_the_fit_that_it_is_part_of(monkeypatch):
    """Of amplitudes the motions meant are chosen by curves, which end by themselves where they are interrupted."""
    whole = predicted.frequency_request

    def interrupted(*arguments, **named):
        def stop(event):
            raise KeyboardInterrupt

        return whole(*arguments, **named, listeners=(stop,))

    monkeypatch.setattr(predicted, "frequency_request", interrupted)
    with pytest.raises(KeyboardInterrupt):
        ss.identify(oscillator(), measured(), START)
