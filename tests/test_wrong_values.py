"""Every argument of every public name and a zoo of wrong values: the obvious meaning, or an InputError that says it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from datetime import date
from decimal import Decimal
from functools import cache
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from helpers.cases import oscillator

import slipstick as ss
from slipstick.cli.examples import example
from slipstick.cli.options import RunOptions
from slipstick.cli.verbs.run import run_case
from slipstick.fem.box import box
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.models.blade_mesh import BladeShape
from slipstick.models.parametric_sector import SectorShape
from slipstick.results.table import ResultTable
from slipstick.structure.skin import Skin
from slipstick.structure.strains import StrainPlaces, Strains

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

H = ss.Harmonics(range(4))
CONTACT = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
RUB = ss.RubbingMotion(velocity=10.0, cos={1: 2.0})
STRUCTURE = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"], load_shapes={"pressure": [1.0]})
PAIR = ss.ContactPair(name="damper", contact=CONTACT, tangential="x", rubbing=RUB)
LOAD = ss.Load(dof="x", sin=100.0)
PROBLEM = ss.Problem(STRUCTURE, contacts=[PAIR], loads=[LOAD], harmonics=H)
STEADY = ss.Problem(
    STRUCTURE, contacts=[ss.ContactPair(name="damper", contact=CONTACT, tangential="x")], loads=[LOAD], harmonics=H
)
PLANAR = ss.Problem(
    ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=10.0 * np.eye(2), dofs=["x", "y"]),
    contacts=ss.ContactPair(
        name="foot", tangential=("x", "y"), contact=ss.PlanarFrictionContact(kt=2.0, mu=0.5, normal_load=1.0)
    ),
    loads=LOAD, harmonics=H,
)  # fmt: skip
BRAKE = ss.Problem(
    ss.MatrixStructure(M=np.eye(2), C=0.5 * np.eye(2), K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"]),
    contacts=ss.ContactPair(
        name="brake", tangential="x", normal="y", contact=ss.FrictionContact(kt=200.0, mu=0.5, kn=40.0, gap=0.0),
        rubbing=ss.RubbingMotion(velocity=1.0),
    ),
    loads=ss.Load(dof="y", harmonic=0, cos=50.0), harmonics=H,
)  # fmt: skip
WORN = ss.Problem(
    STRUCTURE, loads=[LOAD], harmonics=range(4),
    contacts=ss.ContactPair(
        name="damper", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0), tangential="x"
    ),
)  # fmt: skip
CURVE = ss.FrictionCurve(temperature=[25.0, 400.0], mu=[0.5, 0.38])
THERMAL = ss.ThermalModel(curve=CURVE, background=25.0, resistance=1e-3)
SHORT = {"max_points": 2}
GRID = np.linspace(2.0, 10.0, 60)
TESTED = xr.Dataset(
    {"receptance": (("omega", "output", "input"), 1.0 / (40.0 + 0.4j * GRID - GRID**2)[:, None, None])},
    coords={"omega": GRID, "output": ["x"], "input": ["x"]},
)
MEASURED = ss.steady_response(STEADY, omega=[8.0, 9.5]).dataset[["amplitude", "omega"]]
SHORT_CASE = oscillator(
    head='harmonics = "0..5"\n', rubbing="velocity = 100.0", response="from = 5.0\nto = 6.0\nmax_step = 0.5\n"
)  # fmt: skip


def heated(**changes: Any) -> ss.Problem:
    given: dict[str, Any] = {"curve": CURVE, "background": 25.0, "resistance": 1e-3, "contacts": None}
    return ss.Problem(STRUCTURE, contacts=PAIR, loads=LOAD, harmonics=H, thermal=ss.ThermalModel(**(given | changes)))


def branch() -> ss.Branch:
    return ss.forced_response(PROBLEM, omega=(2.0, 3.0), options=SHORT)


def sampled(**changes: Any) -> ss.Branch:
    law = ss.SampledLaw(force=lambda x, v, k=1.0: k * x**3, **({"parameters": {"k": 1.0}} | changes))
    pair = ss.ContactPair(name="cubic", contact=law, ports={"x": "x"})
    return ss.forced_response(
        ss.Problem(STRUCTURE, contacts=pair, loads=LOAD, harmonics=H), omega=(2.0, 3.0), options=SHORT
    )


SECTOR = ss.CyclicStructure(M=[[1.0]], K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=6, loss_factor=0.1)
WAVE = SECTOR.travelling_wave(2)
STEEL = ss.Material(
    young=2e11, poisson=0.3, density=7800.0, conductivity=15.0, expansion=[(0.0, 1e-5), (500.0, 2e-5)], reference=20.0
)
BEAM = MeshModel(mesh=box((0.02, 0.02, 0.01), (2, 1, 1), "hex20"))
MODEL = assemble_mesh(BEAM, source="beam", material=STEEL, fixed=["x0"])
HEATED = assemble_mesh(BEAM, source="beam", material=STEEL.but(young=[(0.0, 2e11), (500.0, 1e11)]), fixed=["x0"])
_LEAVES = {name: box((0.02, 0.02, 0.01), (2, 1, 1), "hex8", at=(0.0, y, 0.0)) for name, y in (("a", 0.0), ("b", 0.02))}
LEAVES = elastic_model(together(_LEAVES), STEEL, ["a.x0", "b.x0"])
PLANAR_LAW = ss.PlanarFrictionContact(kt=1e11, kn=1e12, mu=0.3, gap=0.0)
SKIN = Skin(nodes=np.eye(3), triangles=[[0, 1, 2]], modes=np.ones((9, 1)), static=np.ones((9, 1)))
BODY = ss.reduced_body(MODEL, surface="y1", contacts=1, modes=3)
PLACES = StrainPlaces(
    at="elements", labels=[1], positions=[[0.0, 0.0, 0.0]], young=[1.0], poisson=[0.3], nodes=np.zeros((8, 3)),
    cells={"hex8": np.arange(8)[None]},
)  # fmt: skip
STRAINS = Strains(places=PLACES, modes=np.ones((6, 1)), static=np.ones((6, 1)))


@cache
def moving() -> ss.Branch:
    modal = ss.ModalStructure(
        omega=[6.3], mode_shapes=[[1.0]], static_compliance=[[0.03]], dofs=["x"], loss_factor=0.1, skin=SKIN,
        strains=STRAINS,
    )  # fmt: skip
    problem = ss.Problem(modal, contacts=PAIR, loads=ss.Load(dof="x", sin=1.0), harmonics=H)
    return ss.forced_response(problem, omega=(2.0, 3.0), options=SHORT)


def wearing() -> ss.Branch:
    problem = ss.Problem(
        moving().problem.structure, contacts=WORN.contacts, loads=ss.Load(dof="x", sin=1.0), harmonics=range(4)
    )
    return ss.wear(problem, {"damper": 1e-9}, cycles=(0, 10), omega=2.5)


COARSE = BladeShape(element_size=0.05, stretch=4.0)
SECTOR_SHAPE = SectorShape(
    sectors=6, element_size=0.03, bore=0.04, rim=0.08, tip=0.14, thickness=0.2, stagger=3.0, twist=5.0
)
SECTOR_MODEL = ss.models.bladed_sector(SECTOR_SHAPE)
CASE = example("oscillator").path.read_text(encoding="utf-8")


def stored() -> Callable[..., ss.Branch]:
    branch().save("results.nc")
    return ss.load


def case_file() -> Callable[..., ss.Case]:
    Path("case.toml").write_text(CASE)
    return ss.Case.from_file


def pressed() -> Callable[..., Any]:
    """A pair of surfaces with the pressures of a file beside it."""
    Path("p.csv").write_text("x,y,z,CPRESS\n0.01,0.02,0.005,1e6\n0.02,0.02,0.005,2e6\n")
    return ss.surface_pair


def ended() -> Callable[..., Any]:
    """Goes on with what is complete."""
    if not Path("run").exists():
        Path("case.toml").write_text(SHORT_CASE)
        run_case(Path("case.toml"), Path("run"), options=RunOptions(figures=False, report=False, quiet=True))
    return ss.resume


def imported() -> Callable[..., Any]:
    for name, entries in {"K": "1 1 2.0\n2 2 3.0\n", "M": "1 1 1.0\n2 2 1.0\n"}.items():
        Path(f"{name}.mtx").write_text(f"%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n{entries}")
    Path("dofs.txt").write_text("1 UX\n2 UX\n")
    return ss.import_model


ENTRIES: dict[str, tuple[Callable[[], Callable[..., Any]], dict[str, Any]]] = {
    "Harmonics": (lambda: ss.Harmonics, {"orders": range(4)}),
    "Harmonics.index": (lambda: H.index, {"order": 1, "part": "c"}),
    "Harmonics.H_minus": (lambda: H.H_minus, {"tau": 0.0}),
    "Harmonics.H_plus": (lambda: H.H_plus, {"tau": 0.0}),
    "Harmonics.derivative": (lambda: H.derivative, {"X": np.ones(7)}),
    "FrictionContact": (
        lambda: ss.FrictionContact,
        {"kt": 1.0, "mu": 0.3, "kn": 1.0, "gap": -1.0, "normal_load": None, "rest": 0.1},
    ),
    "FrictionContact by load": (lambda: ss.FrictionContact, {"kt": 1.0, "mu": 0.3, "kn": 1.0, "normal_load": 1.0}),
    "RubbingMotion": (lambda: ss.RubbingMotion, {
        "velocity": 1.0, "velocity_per_omega": 1.0, "cos": {1: 1.0}, "sin": {1: 1.0}, "normal_cos": {1: 1.0},
        "normal_sin": {1: 1.0}, "second_velocity": 1.0, "second_velocity_per_omega": 1.0, "second_cos": {1: 1.0},
        "second_sin": {1: 1.0},
    }),
    "IwanContact": (
        lambda: ss.models.IwanContact, {"kt": 1.0, "limit": 2.0, "chi": -0.3, "beta": 0.1, "sliders": 5},
    ),
    "DahlContact": (lambda: ss.models.DahlContact, {"kt": 1.0, "limit": 2.0}),
    "BoucWenContact": (
        lambda: ss.models.BoucWenContact, {"kt": 1.0, "beta": 2.0, "gamma": 0.5, "n": 1.5, "alpha": 0.1},
    ),
    "StribeckContact": (
        lambda: ss.models.StribeckContact,
        {"kt": 1.0, "mu": [(0.0, 0.4), (2.0, 0.3)], "kn": 1.0, "gap": -1.0, "relaxation": 100.0},
    ),
    "StribeckContact by curve": (
        lambda: ss.models.StribeckContact,
        {
            "kt": 1.0, "mu_s": 0.4, "mu_d": 0.3, "v_s": 0.5, "viscous": 0.01, "form": "gaussian", "normal_load": 1.0,
        },
    ),
    "PlanarFrictionContact": (
        lambda: ss.PlanarFrictionContact,
        {
            "kt": 1.0, "mu": 0.3, "kn": 1.0, "gap": -1.0, "normal_load": None, "tolerance": 1e-8, "rest": 0.1,
            "second_rest": 0.1,
        },
    ),
    "SampledLaw": (
        lambda: ss.SampledLaw,
        {"force": lambda x, v, k: k * x**3, "parameters": {"k": 1.0}, "ports": ("x",), "samples": 32},
    ),
    "SampledLaw in a problem": (lambda: sampled, {"parameters": {"k": 1.0}, "ports": ("x",), "samples": 32}),
    "casing_motion": (
        lambda: ss.casing_motion,
        {
            "profile": [[0.0, 0.0], [2.0, 1e-4], [4.0, 0.0]], "angles": [0.0, 1.0], "radius": 0.4, "speed": 700.0,
            "orders": 10, "lobes": 1, "backward": False,
        },
    ),
    "casing_motion that sweeps": (
        lambda: ss.casing_motion,
        {"profile": {"cos": {2: 1e-4}, "sin": {}}, "angles": 0.0, "radius": 0.4, "speed": None, "backward": True},
    ),
    "common_period": (lambda: ss.common_period, {"j1": 2, "j2": 3}),
    "contact_forces": (
        lambda: ss.contact_forces,
        {"contact": CONTACT, "harmonics": H, "X": np.ones(7), "Y": np.zeros(7), "omega": 2.0, "rubbing": RUB},
    ),
    "casing_motion in a wave": (
        lambda: ss.casing_motion, {"profile": {"cos": {2: 1e-4}}, "angles": 0.0, "radius": 0.4, "wave": WAVE}
    ),
    "CyclicStructure": (
        lambda: ss.CyclicStructure,
        {"M": ([[1.0]], [[0.0]]), "K": ([[3.0]], [[-1.0]]), "dofs": ["x"], "sectors": 6, "C": ([[0.1]], [[0.0]]),
         "loss_factor": 0.1, "load_shapes": {"p": [1.0]}, "damping": 1.0, "aerodynamic": {0: [[0.1j]]}},
    ),
    "CyclicStructure in a wave": (lambda: SECTOR.travelling_wave, {"engine_order": 2}),
    "CyclicStructure with gas": (
        lambda: SECTOR.with_aerodynamics, {"coefficients": [1j, 1j, 1j, 1j, 1j, 1j], "shape": [[1.0]]}
    ),
    "CyclicStructure mistuned": (
        lambda: SECTOR.mistuned,
        {"stiffness": [0.0, 0.1, 0.0, 0.0, 0.0, 0.0], "blade": [[1.0]], "families": 1},
    ),
    "CyclicStructure mistuned at random": (
        lambda: SECTOR.mistuned, {"blade": [[1.0]], "spread": 0.01, "seed": 3}
    ),
    "MatrixStructure": (
        lambda: ss.MatrixStructure,
        {"M": [[1.0]], "K": [[40.0]], "dofs": ["x"], "C": [[0.4]], "loss_factor": 0.1, "load_shapes": {"p": [1.0]},
         "damping": 1.0, "gyroscopic": None, "circulatory": None, "speed": None, "engine_order": None},
    ),
    "MatrixStructure that turns": (
        lambda: ss.MatrixStructure,
        {"M": np.eye(2), "K": 40.0 * np.eye(2), "dofs": ["x", "y"], "gyroscopic": [[0.0, 0.1], [-0.1, 0.0]],
         "circulatory": [[0.0, 0.1], [-0.1, 0.0]], "speed": 2.0},
    ),
    "MatrixStructure that turns with the frequency": (
        lambda: ss.MatrixStructure,
        {"M": np.eye(2), "K": 40.0 * np.eye(2), "dofs": ["x", "y"], "gyroscopic": [[0.0, 0.1], [-0.1, 0.0]],
         "engine_order": 1},
    ),
    "ModalStructure": (
        lambda: ss.ModalStructure,
        {
            "omega": [10.0], "mode_shapes": [[1.0]], "dofs": ["x"], "static_compliance": [[0.02]], "loss_factor": 0.1,
            "damping_ratio": 0.0, "second_residual": [[1e-6]], "load_shapes": {}, "damping": 1.0, "skin": SKIN,
            "strains": STRAINS,
        },
    ),
    "reduce": (
        lambda: ss.reduce,
        {
            "K": np.diag([2.0, 3.0]), "M": np.eye(2), "keep": ["a"], "dofs": ["a", "b"], "names": None,
            "load_shapes": {"p": [1.0, 1.0]}, "modes": 1, "accuracy": 1e-3, "frequency_range": None, "loss_factor": 0.1,
            "damping_ratio": 0.0, "rayleigh": (0.0, 0.0), "force": True, "solver": None, "cache": None,
            "listener": None, "residuals": "written",
        },
    ),
    "Load": (
        lambda: ss.Load,
        {"dof": "x", "shape": None, "harmonic": 1, "cos": 1.0, "sin": 1.0, "amplitude": None, "phase": None},
    ),
    "Load of a support": (lambda: ss.Load, {"base": {"x": 1.0}, "motion": "displacement", "cos": 1.0}),
    "LoadStep": (
        lambda: ss.LoadStep,
        {"name": "a", "loads": [ss.Load(dof="x", harmonic=0, cos=1.0)], "bolts": {"b": 1.0}, "shortening": {"c": 1.0},
         "temperature": {"hot": 0.5}, "displacement": {"jaw": 1e-4}, "speed": 3.0, "increments": 2},
    ),
    "bolt": (lambda: ss.bolt, {"name": "b", "elongation": {"x": 1.0}, "stiffness": 2.0, "preload": 1.0}),
    "preload": (
        lambda: ss.preload,
        {"problem": STEADY, "steps": [ss.LoadStep(loads=ss.Load(dof="x", harmonic=0, cos=1.0))], "pairs": []},
    ),
    "Load by amplitude": (lambda: ss.Load, {"dof": "x", "amplitude": 1.0, "phase": 0.5}),
    "ContactPair": (
        lambda: ss.ContactPair,
        {
            "name": "a", "contact": CONTACT, "tangential": {"x": 1.0}, "normal": {"x": 1.0}, "ports": None,
            "rubbing": RUB, "area": 2.0,
        },
    ),
    "Problem": (
        lambda: ss.Problem,
        {
            "structure": STRUCTURE, "contacts": [PAIR], "loads": [LOAD], "harmonics": H, "outputs": ["x"],
            "period_ratio": (1, 1), "title": "t", "units": {"length": "mm"}, "load": 1.0, "friction": 1.0,
            "thermal": None, "states": (), "told": None, "preload": None,
        },
    ),
    "Problem.parameter": (lambda: PROBLEM.parameter, {"name": "damper.mu"}),
    "Problem.with_parameter": (lambda: PROBLEM.with_parameter, {"name": "damper.mu", "value": 0.5}),
    "FrictionCurve": (
        lambda: ss.FrictionCurve,
        {"temperature": [1.0, 2.0], "mu": [0.5, 0.4], "kt": [1.0, 2.0], "kn": [1.0, 2.0], "interpolation": "pchip"},
    ),
    "FrictionCurve.mu": (lambda: CURVE.mu, {"temperature": 100.0}),
    "ThermalModel": (lambda: heated, {"curve": CURVE, "background": 25.0, "resistance": 1e-3, "contacts": None}),
    "forced_response": (
        lambda: ss.forced_response,
        {
            "problem": PROBLEM, "omega": (2.0, 3.0), "at": (), "peaks_of": "x", "options": SHORT,
            "listeners": (), "guess": np.zeros(7), "stability": True,
            "follow": "subharmonic",
        },
    ),
    "forced_response options": (
        lambda: lambda **given: ss.forced_response(PROBLEM, omega=(2.0, 3.0), options=SHORT | given),
        {"max_points": 2, "max_step": 0.1, "first_step": 0.1, "newton": None, "locate_turning_points": True},
    ),
    "parameter_response": (
        lambda: ss.parameter_response,
        {
            "problem": PROBLEM, "parameter": "damper.mu", "span": (0.1, 0.3), "omega": 2.0, "at": (),
            "peaks_of": None, "options": SHORT, "listeners": (), "guess": None, "stability": "full", "follow": None,
        },
    ),
    "steady_response": (
        lambda: ss.steady_response,
        {
            "problem": PROBLEM, "omega": [2.0, 3.0], "guess": np.zeros(7), "options": SHORT, "listeners": (),
            "stability": True,
        },
    ),
    "steady_response of a parameter": (
        lambda: ss.steady_response,
        {"problem": PROBLEM, "parameter": "damper.mu", "values": [0.1, 0.3], "omega": 2.0, "guess": None},
    ),
    "track_peak": (
        lambda: ss.track_peak,
        {
            "problem": PROBLEM, "parameter": "damper.normal_load", "span": (700.0, 800.0), "omega": (9.0, 12.0),
            "dof": "x", "at": (), "options": SHORT, "listeners": (),
        },
    ),
    "limit_cycles": (
        lambda: ss.limit_cycles,
        {"problem": BRAKE, "parameter": "brake.mu", "span": (0.5, 0.6), "at": (), "options": SHORT,
         "listeners": ()},
    ),
    "wear": (
        lambda: ss.wear,
        {
            "problem": WORN, "kappa": {"damper": 1e-4}, "cycles": (0, 10), "omega": 10.0, "depth": 500.0,
            "at": (), "tolerance": 1e-4, "max_change": 1.0, "method": "auto", "listeners": (),
        },
    ),
    "wear at the peak": (
        lambda: ss.wear,
        {
            "problem": WORN, "kappa": 1e-4, "cycles": (0, 10), "omega": "peak", "range": (9.0, 12.0), "dof": "x",
            "method": "euler", "steps": 1,
        },
    ),
    "nonlinear_modes": (
        lambda: ss.nonlinear_modes,
        {
            "problem": STEADY, "amplitude": (20.0, 30.0), "mode": 1, "dof": "x", "load_factors": (0.5,),
            "options": SHORT, "listeners": (),
        },
    ),
    "modal_analysis": (
        lambda: ss.models.modal_analysis,
        {
            "measured": TESTED, "modes": 1, "range": (3.0, 9.0), "quantity": "displacement", "time_limit": 60.0,
        },
    ),
    "tabulated_structure": (
        lambda: ss.models.tabulated_structure,
        {
            "measured": TESTED, "static": [[0.025]], "beyond": "line", "smooth": False, "range": (3.0, 9.0),
            "quantity": "displacement", "columns": None,
        },
    ),
    "identify": (
        lambda: ss.identify,
        {
            "problem": STEADY, "measured": MEASURED, "parameters": {"damper.kt": 90.0},
            "bounds": {"damper.kt": (50.0, 200.0)}, "noise": 0.1, "relative_noise": 0.01, "starts": 1,
            "seed": 0, "columns": None, "quantity": "displacement", "listeners": (),
        },
    ),
    "optimal": (
        lambda: ss.optimal,
        {
            "problem": PROBLEM, "parameter": "damper.normal_load", "omega": (9.0, 12.0), "dof": "x", "start": 700.0,
            "options": SHORT, "listeners": (),
        },
    ),
    "study": (
        lambda: ss.study,
        {
            "problem": PROBLEM, "parameters": {"damper.mu": [0.3]}, "omega": (2.0, 3.0), "method": "grid",
            "samples": None, "seed": 0, "spread": None, "peaks_of": "x", "options": SHORT, "stability": False,
            "workers": 1, "client": None, "folder": "study", "missing": False, "listeners": (),
        },
    ),
    "resume": (ended, {"folder": "run"}),
    "study samples": (
        lambda: lambda **given: ss.study(PROBLEM, omega=(2.0, 3.0), options=SHORT, workers=1, **given),
        {"parameters": {"damper.mu": {"from": 0.1, "to": 0.3}}, "method": "sobol", "samples": 2, "seed": 0},
    ),
    "linear_response": (lambda: ss.linear_response, {"problem": PROBLEM, "omega": [2.0, 3.0], "state": "free"}),
    "transient": (
        lambda: ss.transient,
        {
            "problem": PROBLEM, "omega": 2.0, "periods": 2, "tolerance": 1e-6, "method": "march", "initial": None,
            "record_periods": 1, "steps": 64, "held": {"mu": [0.3]},
        },
    ),
    "run_up": (
        lambda: ss.runs.run_up,
        {
            "problem": PROBLEM, "omega": (2.0, 2.5), "rate": 0.05, "periods": 2, "samples": 8, "steps": 64,
            "folder": "passed", "listener": None,
        },
    ),
    "Material": (
        lambda: ss.Material,
        {
            "young": [(20.0, 2e11), (500.0, 1e11)], "poisson": 0.3, "density": 7800.0, "conductivity": 15.0,
            "expansion": 1e-5, "reference": 20.0, "tables": {"poisson": [(20.0, 0.3), (500.0, 0.31)]},
        },
    ),
    "models.at_temperature": (
        lambda: ss.models.at_temperature,
        {"model": HEATED, "temperature": {"all": 20.0, "x1": 300.0}},
    ),
    "import_model": (
        imported,
        {
            "files": ["K.mtx", "M.mtx", "dofs.txt"], "output": "model.h5", "mass": None, "damping": None,
            "dof_map": None, "nodes": None, "names": None, "constraints": None, "material": None,
            "conductivity": None, "expansion": None, "reference": None, "fixed": (), "quadratic": False,
            "units": "N, mm, t", "scale": None, "to": "SI",
        },
    ),
    "at_speed": (
        lambda: ss.at_speed,
        {
            "model": MODEL, "speed": 10.0, "axis": {"direction": (0.0, 0.0, 1.0)}, "coriolis": True,
        },
    ),
    "at_speed between": (lambda: ss.at_speed, {"model": MODEL, "speed": 10.0, "others": {20.0: MODEL}}),
    "reduced_body": (
        lambda: ss.reduced_body,
        {
            "model": MODEL, "surface": "y1", "contacts": 1, "radius": 0.01, "keep": (), "base": ["x"], "modes": 3,
            "accuracy": None, "up_to": None, "loss_factor": 0.01, "damping_ratio": 0.0, "force": True,
            "residuals": "written", "cache": None, "listener": None, "stress": "all", "stress_at": "nodes",
        },
    ),
    "reduced_body with heat": (
        lambda: lambda **heat: ss.reduced_body(MODEL, surface="y1", contacts=1, modes=3, **heat),
        {
            "pressure": {"push": "y1"}, "films": {"boundary": 10.0}, "cold": "x0",
            "temperature": {"hot": {"all": 20.0, "x1": 300.0}}, "initial_temperature": 30.0, "displacement": None,
            "centrifugal": {"direction": [0, 0, 1]},
        },
    ),
    "reduced_body with a support": (
        lambda: lambda **moved: ss.reduced_body(MODEL, keep=["n5x"], modes=3, **moved),
        {"displacement": {"jaw": {"x0": [1.0, 0.0, 0.0]}}},
    ),
    "reduced_body towards": (
        lambda: lambda **surface: ss.reduced_body(MODEL, surface=surface, contacts=1, modes=3),
        {"direction": [0.0, 1.0, 0.0], "angle": 30.0, "depth": 0.1},
    ),
    "reduced_blade": (
        lambda: ss.reduced_blade,
        {
            "shape": COARSE, "material": STEEL, "contacts": 1, "radius": 0.01, "film": 200.0, "modes": 3, "up_to": None,
            "loss_factor": 0.01, "cache": None, "listener": None, "solver": None, "stress": [1, "root"],
            "stress_at": "elements",
        },
    ),
    "greenwood_williamson": (
        lambda: ss.models.greenwood_williamson,
        {"pressure": 1e7, "height": 1e-6, "radius": 1e-4, "density": 1e10, "first": STEEL, "second": STEEL},
    ),
    "hertz_mindlin": (
        lambda: ss.models.hertz_mindlin, {"force": 10.0, "radius": 0.01, "first": STEEL, "second": STEEL}
    ),
    "bladed_sector": (lambda: ss.models.bladed_sector, {"shape": SECTOR_SHAPE, "material": STEEL}),
    "SectorShape": (
        lambda: SectorShape,
        {
            "sectors": 6, "element_size": 0.03, "bore": 0.04, "rim": 0.08, "tip": 0.14, "shroud_height": 0.01,
            "width": 0.08, "bore_width": 0.1, "chord": 0.04, "thickness": 0.2, "camber": 0.1, "edge_thickness": 0.4,
            "stagger": 3.0, "twist": 5.0, "shroud_gap": 0.0, "stretch": 1.5,
        },
    ),
    "reduced_sector": (
        lambda: ss.reduced_sector,
        {
            "model": SECTOR_MODEL, "sectors": 6, "low": "low", "high": "high", "axis": {"direction": (0, 0, 1)},
            "tolerance": 1e-6, "surface": "tip", "contacts": 1, "radius": 0.01,
            "between": ("shroud_low", "shroud_high"), "between_contacts": 1, "pressure": {"push": "concave"},
            "keep": (), "pairs": (), "speed": 0.0, "modes": 3, "accuracy": None, "up_to": None, "loss_factor": 0.01,
            "damping_ratio": 0.0, "force": False, "cache": None, "listener": None, "temperature": None,
            "initial_temperature": None,
        },
    ),
    "ReducedSector.mistuned": (
        lambda: ss.reduced_sector(SECTOR_MODEL, surface="tip", contacts=1, modes=2).mistuned,
        {"stiffness": [0.0, 0.01, 0.0, 0.0, 0.0, 0.0], "blade": "blade", "families": 2, "spread": None, "seed": 1},
    ),
    "straight_contacts": (
        lambda: ss.models.straight_contacts,
        {"problem": PLANAR, "omega": (1.0, 2.0), "contacts": ["foot"], "threshold": 0.2},
    ),
    "surface_contacts between": (
        lambda: lambda **given: ss.surface_contacts(
            ss.reduced_sector(SECTOR_MODEL, between=("shroud_low", "shroud_high"), between_contacts=1),
            contact=CONTACT, direction="axial", **given,
        ),
        {"between": True},
    ),
    "surface_contacts": (
        lambda: ss.surface_contacts,
        {
            "body": BODY, "name": "pad", "contact": CONTACT, "direction": [1.0, 0.0, 0.0], "points": [1],
            "normal": True, "shared": True, "rubbing": RUB, "axis": {"direction": (0, 0, 1), "point": (0, -1, 0)},
            "between": False,
        },
    ),
    "surface_pair": (
        lambda: ss.surface_pair,
        {
            "model": LEAVES, "first": "a.y1", "second": "b.y0", "contact": PLANAR_LAW, "name": "joint", "points": 2,
            "gap": "geometry", "method": "faces", "direction": [1.0, 0.0, 0.0], "within": 0.01,
        },
    ),
    "surface_pair with pressures": (
        pressed,
        {
            "model": LEAVES, "first": "a.y1", "second": "b.y0", "contact": PLANAR_LAW, "points": 2,
            "pressure": "p.csv", "columns": {"x": "x", "y": "y", "z": "z", "pressure": "CPRESS"},
        },
    ),
    "reduced_body with a pair": (
        lambda: lambda **pairs: ss.reduced_body(LEAVES, modes=3, **pairs),
        {"pairs": [ss.surface_pair(LEAVES, "a.y1", "b.y0", contact=PLANAR_LAW)]},
    ),
    "Case.from_text": (lambda: ss.Case.from_text, {"text": CASE, "path": "case.toml", "tell": print}),
    "Case.from_file": (case_file, {"path": "case.toml", "tell": print}),
    "load": (stored, {"path": "results.nc", "problem": None}),
    "load_case": (lambda: case_file() and ss.load_case, {"path": "case.toml"}),
    "Branch": (
        lambda: ss.Branch,
        {"dataset": ResultTable({}), "outcome": ss.Outcome.COMPLETED, "problem": None, "message": "", "without": ""},
    ),
    "Branch.peaks": (lambda: branch().peaks, {"dof": "x"}),
    "Branch.at": (lambda: branch().at, {"value": 2.0}),
    "Branch.contact_forces": (lambda: branch().contact_forces, {"point": 0}),
    "Branch.states": (lambda: branch().states, {"point": 0}),
    "Branch.loop": (lambda: branch().loop, {"point": 0, "contact": "damper", "samples": 5}),
    "Branch.report": (lambda: branch().report, {
        "path": "r.html", "title": "t", "contacts": 1, "dofs": 1, "tolerances": {"damper.mu": 0.1},
    }),
    "Branch.save_shape": (lambda: moving().save_shape, {"path": "shape.xdmf", "point": 0, "frames": 2}),
    "Branch.stress": (lambda: moving().stress, {"points": [0], "at": 1}),
    "Branch.stress_history": (lambda: moving().stress_history, {"point": 0, "at": [1], "samples": 4}),
    "Branch.save_stress": (lambda: moving().save_stress, {"path": "stress.xdmf", "points": 0, "at": None}),
    "Branch.save_table": (lambda: branch().save_table, {"path": "results.csv", "table": "peaks"}),
    "runs.save_table": (lambda: ss.runs.save_table, {
        "results": branch().dataset, "path": "results.csv", "table": "point",
    }),
    "Branch.save_wear": (lambda: wearing().save_wear, {"path": "wear.xdmf"}),
    "Branch.sensitivity": (lambda: branch().sensitivity, {
        "parameters": "damper.mu", "dof": "x", "points": [0], "of": "displacement",
    }),
    "Branch.plot.tolerance_band": (
        lambda: branch().plot.tolerance_band, {"tolerances": {"damper.mu": 0.1}, "dof": "x", "label": "a"}
    ),
    "Branch.plot.tornado": (
        lambda: branch().plot.tornado, {"tolerances": {"damper.mu": 0.1}, "dof": "x", "point": 0, "most": 3}
    ),
    "Branch.check_in_time": (lambda: branch().check_in_time, {"point": 0}),
}  # fmt: skip

NOT_CALLED = {"InputError", "SlipstickWarning", "Outcome", "Case"}
"""A case is made by its class methods, which are fed."""
CALLED = {"profile", "listener", "listeners", "force", "dataset", "tell"}
"""Arguments that are functions: what a function does when it is called is not ours."""


def alike(good: Any) -> Iterator[Any]:
    """The value itself with each of its numbers wrong."""
    yield from (_with(good, bad) for bad in (float("nan"), float("inf"), 1e308, 1e-320, -1e308, 10**400, 1j, "a", None))


def _with(good: Any, bad: Any) -> Any:
    if isinstance(good, dict):
        return {key: _with(value, bad) for key, value in good.items()}
    if isinstance(good, list | tuple | np.ndarray):
        return [_with(value, bad) for value in good]
    return bad


def zoo() -> Iterator[Any]:
    yield from (
        None,
        float("nan"),
        float("inf"),
        -float("inf"),
        1 + 2j,
        True,
        False,
        "a",
        "",
        "x",
        b"x",
        "1.0",
        "\0",
        "x" * 5000,
    )
    yield from (0, -1, 7, 2.5, 1e308, -1e308, 1e-320, 10**400, -(10**5000), Decimal("1.5"), date(2020, 1, 1))
    yield from ([], [1.0], [1.0, 2.0, 3.0], [1.0, float("nan")], [[1.0]], [[1.0], [1.0, 2.0]], [None], ["a"], [True])
    yield from ((), (1, 2, 3), ("x", "x"), {}, {"a": 1}, {"x": "a"}, {"x": None}, {1: "x"}, {None: 1.0}, {"damper": 1j})
    yield from ({1.0}, object(), object, len, lambda event: None, Ellipsis, NotImplemented, Path("nowhere/at/all"))
    yield from (
        np.array(3.0),
        np.array([]),
        np.linspace(1.0, 2.0, 50),
        np.array([1j]),
        np.array(["a"]),
        np.array([None]),
    )
    yield from (np.zeros((2, 2)), np.zeros((2, 2, 2)), np.array(True), np.float32(2.0), np.int64(2), np.array("a"))
    yield from (
        iter([1.0, 2.0]),
        (x for x in "ab"),
        range(3),
        slice(3),
        CONTACT,
        PAIR,
        LOAD,
        RUB,
        H,
        PROBLEM,
        STRUCTURE,
    )


CASES = [(entry, argument) for entry, (_, good) in ENTRIES.items() for argument in good]
SHARE = 4
"""Each argument gets every fourth wrong value, its neighbour the next ones; all of them are for `make verify`."""


@pytest.mark.parametrize("every", [SHARE, pytest.param(1, marks=pytest.mark.verify(sample=130))], ids=["some", "all"])
@pytest.mark.parametrize("entry, argument", CASES, ids=[f"{entry}: {argument}" for entry, argument in CASES])
def test_a_wrong_value_is_refused_with_a_sentence_or_means_the_obvious(
    entry: str, argument: str, every: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    make, good = ENTRIES[entry]
    call, wrong = make(), []
    _fault(lambda: call(**good))  # compiles what is needed
    first = CASES.index((entry, argument)) % every
    for value in islice(chain(zoo(), alike(good[argument])), first, None, every):
        if argument in CALLED and callable(value):
            continue
        fault = _fault(lambda value=value: call(**(good | {argument: value})))
        if fault:
            wrong.append(f"{_shown(value)}: {fault}")
    assert not wrong, "\n".join(wrong)


def _fault(call: Callable[[], Any]) -> str:
    """What is wrong with how a call ends."""
    try:
        call()
    except ss.InputError as error:
        poor = [text for text in error.sentences if not text or len(text) > 400 or "\n" in text]
        return f"a poor sentence: {poor[0][:500]}" if poor or not error.sentences else ""
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return ""


def _shown(value: Any) -> str:
    return type(value).__name__ if isinstance(value, int) and abs(value) > 10**100 else repr(value)[:80]


def test_every_public_name_and_argument_is_fed() -> None:
    covered: dict[str, set[str]] = {}
    for entry, (_, good) in ENTRIES.items():
        covered.setdefault(entry.split(" ")[0], set()).update(good)
    for name in set(ss.__all__) - NOT_CALLED:
        wanted = {p for p in inspect.signature(getattr(ss, name)).parameters if p != "_"}
        assert covered.get(name, set()) >= wanted, name


def test_the_good_values_are_good(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for make, good in ENTRIES.values():
        make()(**{key: value for key, value in good.items() if key != "newton"})
