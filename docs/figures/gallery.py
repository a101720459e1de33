"""Make gallery/*.png: every figure that ``ss.plots`` draws, small, each from a problem that is computed in seconds."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray
from scipy import stats

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.model import elastic_model

HERE = Path(__file__).parent
EXAMPLES = HERE.parent.parent / "examples"
DPI = 70
Drawing = tuple[str, Callable[[], Any]]


def oscillator(velocity: float = 0.0, load: float = 800.0, damping: float = 0.4) -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[damping]], K=[[40.0]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=load)
    damper = ss.ContactPair(name="damper", contact=contact, tangential="x", rubbing=ss.RubbingMotion(velocity=velocity))
    return ss.Problem(
        structure,
        contacts=damper,
        loads=ss.Load(dof="x", sin=100.0),
        harmonics=range(8),
        units={"length": "mm", "force": "N", "time": "s"},
        title="Oscillator with friction damper",
    )


def heated() -> ss.Problem:
    damper = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=100.0, mu=0.5, normal_load=20.0),
        tangential="x",
        rubbing=ss.RubbingMotion(velocity=1.0),
    )
    curve = ss.FrictionCurve(temperature=[25, 200, 400], mu=[0.50, 0.45, 0.38])
    return ss.Problem(
        oscillator().structure,
        contacts=damper,
        loads=ss.Load(dof="x", sin=15.0),
        harmonics=range(8),
        thermal=ss.ThermalModel(curve=curve, background=25.0, resistance=3.0),
        units={"length": "m", "force": "N", "time": "s", "temperature": "degC"},
        title="Damper heated by its friction",
    )


def of_curves() -> Iterator[Drawing]:
    plots, names = ss.plots, (0.0, 10.0, 100.0)
    branches = {f"v = {v:g} mm/s": ss.forced_response(oscillator(v), (2.0, 15.0), stability=True) for v in names}
    stuck, rubbed, _ = branches.values()
    peak = rubbed.at(max(rubbed.peaks("x"), key=lambda found: found[1])[0])
    tolerances = {"damper.mu": 0.05, "damper.kt": 0.1, "damper.normal_load": 0.1}
    yield "response", lambda: plots.response(branches, "x")
    yield "phase", lambda: plots.phase(branches, "x")
    yield "mean", lambda: plots.mean(branches, "x")
    yield "power", lambda: plots.power(branches, "damper")
    yield "fractions", lambda: plots.fractions(stuck, "damper")
    yield "stability", lambda: plots.stability(rubbed)
    yield "compare", lambda: plots.compare(list(branches.values())[:2], labels=["at rest", "rubbing"])[0]
    yield "loop", lambda: plots.loop(rubbed, peak, "damper")
    yield "loops", lambda: plots.loops(rubbed, peak, "damper")[0]
    yield "states", lambda: plots.states(rubbed, peak)
    yield "history", lambda: plots.history(rubbed, peak, contact="damper")
    yield "spectrum", lambda: plots.spectrum(rubbed, peak, "x")
    yield "tolerance_band", lambda: plots.tolerance_band(rubbed, tolerances, "x")
    yield "tornado", lambda: plots.tornado(stuck, tolerances, "x")
    hot = ss.forced_response(heated(), (3.0, 9.0))
    yield "friction", lambda: plots.friction(hot, "damper")
    yield "temperature", lambda: plots.temperature(hot, "damper")


def of_modes_and_wear() -> Iterator[Drawing]:
    problem = oscillator()
    mode = ss.nonlinear_modes(problem, amplitude=(2.0, 10.0), load_factors=[1.0, 2.0])
    large = ss.nonlinear_modes(problem, amplitude=(2.0, 80.0))
    forced = {
        f"load {load:g}": ss.forced_response(problem.with_parameter("load", load), (4.0, 15.0)) for load in (1, 2)
    }
    yield "backbone", lambda: ss.plots.backbone(mode, forced)
    yield "damping", lambda: ss.plots.damping(large)
    pair = ss.ContactPair(
        name="damper", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1000.0, normal_load=800.0), tangential="x"
    )
    worn = ss.Problem(
        problem.structure,
        contacts=pair,
        loads=problem.loads,
        harmonics=range(8),
        units=problem.units,
        title="Damper that wears",
    )
    result = ss.wear(worn, {"damper": 8e-7}, cycles=(0, 400), omega=10.79)
    yield "wear", lambda: ss.plots.wear(result)[0]
    yield "worn_surface", lambda: ss.plots.worn_surface(result)[0]


def of_studies(folder: Path) -> Iterator[Drawing]:
    plots = ss.plots
    grid = {"damper.velocity": [3.0, 10.0, 30.0, 100.0], "damper.mu": [0.1, 0.2, 0.3]}
    study = ss.study(oscillator(), grid, omega=(2, 15), folder=folder / "grid", workers=1)
    curves = xarray.open_dataset(folder / "grid" / "curves.nc")
    yield "study_map", lambda: plots.study_map(study)
    yield "study_curves", lambda: plots.study_curves(curves, study)
    spread = {"damper.mu": stats.norm(0.3, 0.03), "damper.kt": stats.uniform(80.0, 40.0)}
    sampled = ss.study(
        oscillator(10.0), spread, omega=(2, 15), method="sobol", samples=64, folder=folder / "sampled", workers=1
    )
    samples = xarray.open_dataset(folder / "sampled" / "curves.nc")
    yield "percentile_band", lambda: plots.percentile_band(samples, sampled, "x")


def of_runs() -> Iterator[Drawing]:
    problem = oscillator(2.0, load=300.0)
    passed = ss.runs.run_up(problem, (4.0, 14.0), rate=0.2)
    steady = ss.forced_response(problem, (4.0, 14.0))
    settling = ss.runs.run_up(oscillator(load=2000.0, damping=0.15), 9.0, periods=100)
    yield "run_up", lambda: ss.plots.run_up(passed, "x", branch=steady)
    yield "spectrogram", lambda: ss.plots.spectrogram(passed, "x")
    yield "section", lambda: ss.plots.section(settling, "x", last=100)


def of_measurements() -> Iterator[Drawing]:
    problem, levels, omega = oscillator(), [50.0, 100.0, 200.0], np.linspace(6.0, 13.0, 15)
    rng, rows = np.random.default_rng(0), []
    for level in levels:
        steady = ss.steady_response(problem.with_parameter("load.x.amplitude", level), omega=omega)
        c, s = steady.dataset["displacement"].values[:, 0, 1:3].T
        noise = rng.standard_normal(c.size) + 1j * rng.standard_normal(c.size)
        rows.append(c - 1j * s + 0.02 * np.abs(c - 1j * s).max() * noise)
    measured = xarray.Dataset(
        {"displacement": (("load.x.amplitude", "omega", "dof"), np.array(rows)[..., None])},
        coords={"load.x.amplitude": levels, "omega": omega, "dof": ["x"]},
    )
    found = ss.identify(problem, measured, {"damper.mu": 0.5, "damper.kt": 80.0})
    yield "fit", lambda: ss.plots.fit(found.dataset)


def of_machines() -> Iterator[Drawing]:
    blade, disc, between = 4.0e4, 4.0e5, 1.5e5
    K0 = np.array([[blade, -blade], [-blade, blade + disc + 2.0 * between]])
    K1 = np.array([[0.0, 0.0], [0.0, -between]])
    sector = ss.CyclicStructure(M=np.diag([0.3, 1.2]), K=(K0, K1), dofs=["tip", "disc"], sectors=24, loss_factor=2e-3)
    pair = ss.ContactPair(
        name="damper", contact=ss.FrictionContact(kt=4.0e3, mu=0.3, normal_load=10.0), tangential="tip"
    )
    wave = ss.Problem(
        sector.travelling_wave(engine_order=4),
        contacts=pair,
        loads=ss.Load(dof="tip", cos=3.0),
        harmonics=[0, 1, 3],
        units={"length": "m", "force": "N", "time": "s"},
        title="Bladed disc whose blades differ",
    )
    share = blade * np.array([[1.0, -1.0], [-1.0, 1.0]])
    mistuned = sector.mistuned(blade=share, spread=0.02, seed=7).problem(wave)
    whole = ss.forced_response(mistuned, (345.0, 385.0), peaks_of="largest")
    peak = whole.at(max(whole.peaks("largest"), key=lambda found: found[1])[0])
    yield "blades", lambda: ss.plots.blades(whole, "tip")
    yield "disc", lambda: ss.plots.disc(whole, peak, "tip")
    scatter = ss.study(mistuned, method="mistuning", omega=(345.0, 385.0), spread=0.02, samples=24, seed=1, workers=1)
    yield "percentile_convergence", lambda: ss.plots.percentile_convergence(scatter)
    yield "amplification_histogram", lambda: ss.plots.amplification_histogram(scatter)
    yield "worst_disc", lambda: ss.plots.worst_disc(scatter)
    yield (
        "interference",
        lambda: ss.plots.interference(ss.models.interference(sector, (40.0, 120.0), engine_orders=(4, 8))),
    )

    steel = ss.Material(young=211e9, poisson=0.3, density=7810.0)
    discs = [ss.models.Disc.of(node=2, material=steel, width=0.07, outer=0.28, inner=0.05)]
    bearings = [ss.models.Bearing(node=node, kxx=1e6, kyy=0.8e6) for node in (0, 6)]
    shaft = ss.models.Shaft(length=1.5, outer=0.05, elements=6)
    rotor = ss.models.beam_rotor([shaft], material=steel, discs=discs, bearings=bearings, speed=0.0)
    stator = ss.models.StatorContact(kn=400.0, gap=0.1, mu=0.2, slip_velocity=1e-4)
    touching = ss.ContactPair(
        name="stator", contact=stator, ports={"x": "x", "y": "y"}, rubbing=ss.RubbingMotion(velocity_per_omega=0.5)
    )
    loads = [ss.Load(dof="x", motion="unbalance", cos=0.4), ss.Load(dof="y", motion="unbalance", sin=0.2)]
    jeffcott = ss.models.jeffcott_rotor(mass=2.0, stiffness=50.0, damping=1.0)
    rotor_in_stator = ss.Problem(
        jeffcott,
        contacts=touching,
        loads=loads,
        harmonics=range(8),
        units={"length": "mm", "force": "N", "time": "s"},
        title="Rotor that rubs in its stator",
    )
    rubbing = ss.steady_response(rotor_in_stator, omega=6.0)
    yield "orbit", lambda: ss.plots.orbit(rubbing, 0)
    yield "campbell", lambda: ss.plots.campbell(ss.models.campbell(rotor, speeds=np.linspace(0.0, 400.0, 41)))


def of_joints() -> Iterator[Drawing]:
    """Two plates that one load presses together off their middle, at rest and shaken."""
    from slipstick.fem.mesh import together

    lower = box((0.06, 0.04, 0.006), (12, 8, 2), "hex8")
    upper = box((0.06, 0.04, 0.006), (9, 6, 2), "hex8", at=(0.0, 0.0, 0.006))
    mesh = together({"lower": lower, "upper": upper})
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    plates = elastic_model(mesh, steel, ["lower.z0", "upper.x0"])
    law = ss.PlanarFrictionContact(kt=1e13, kn=2e13, mu=0.3, gap=0.0)
    joint = ss.surface_pair(plates, "lower.z1", "upper.z0", contact=law, points=100)
    pushed = f"n{mesh.labels[np.argmin(np.linalg.norm(mesh.nodes - [0.04, 0.02, 0.012], axis=1))]}"
    body = ss.reduced_body(plates, pairs=joint, keep=[f"{pushed}x", f"{pushed}z"], modes=20, loss_factor=0.01)
    problem = ss.Problem(body.structure, contacts=joint, units={"length": "m", "force": "N"})
    push = [ss.Load(dof=f"{pushed}{axis}", harmonic=0, cos=force) for axis, force in (("x", 2e3), ("z", -8e3))]
    state = ss.preload(problem, ss.LoadStep(name="push", loads=push), pairs=joint)
    yield "preload", lambda: ss.plots.preload(state.dataset)
    shaken = ss.Problem(
        body.structure,
        contacts=joint,
        loads=ss.Load(dof=f"{pushed}x", cos=500.0),
        preload=state,
        harmonics=range(12),
        units={"length": "m", "force": "N", "time": "s"},
    )
    branch = ss.steady_response(shaken, omega=6000.0)
    yield "interface", lambda: ss.plots.interface(branch, 0)[0]


def of_stress() -> Iterator[Drawing]:
    steel = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
    beam = elastic_model(box((0.12, 0.02, 0.005), (12, 2, 1), "hex20"), steel, ["x0"])
    body = ss.reduced_body(
        beam, surface="x1", contacts=1, pressure="z0", modes=6, loss_factor=0.005, stress="all", stress_at="nodes"
    )
    rub = ss.surface_contacts(
        body,
        "tip",
        contact=ss.FrictionContact(kt=1e4, mu=0.3, normal_load=4.0),
        direction=(0, 0, 1),
        rubbing=ss.RubbingMotion(velocity=0.5),
    )
    loads = [ss.Load(shape="pressure", cos=500.0), ss.Load(shape="pressure", harmonic=0, cos=2000.0)]
    problem = ss.Problem(
        body.structure,
        contacts=rub,
        loads=loads,
        harmonics=range(4),
        units={"length": "m", "force": "N", "time": "s"},
        title="A beam whose tip rubs",
    )
    at = float(body.structure.natural_frequencies[0])
    branch = ss.steady_response(problem, omega=at)
    yield "haigh", lambda: ss.plots.haigh(branch, 0)


def main() -> None:
    mpl.use("agg")
    target = HERE / "gallery"
    target.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        for group in (
            of_curves(),
            of_modes_and_wear(),
            of_studies(Path(folder)),
            of_runs(),
            of_measurements(),
            of_machines(),
            of_joints(),
            of_stress(),
        ):
            for name, draw in group:
                figure = draw().figure
                figure.savefig(target / f"{name}.png", dpi=DPI, pil_kwargs={"optimize": True})
                print(name)


if __name__ == "__main__":
    main()
