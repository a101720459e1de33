"""Every argument of every figure and wrong values: the obvious meaning, or an InputError."""

from __future__ import annotations

import inspect
import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from helpers.blocks import stressed
from helpers.figures import branch, problem
from helpers.joint import shaken_joint
from helpers.rings import disc_and_wave
from helpers.rotors import whirling

import slipstick as ss
from slipstick import plots
from slipstick.plots.shown import for_files
from slipstick.studies.plan import make_plan
from slipstick.studies.solving import Job, solve
from slipstick.studies.table import curves_dataset, study_attributes, study_dataset
from slipstick.verify.cases import oscillator

WRONG = (
    float("nan"), 1j, "", "q", "\0", b"x", 2.5, 10**400, [], [1.0], [None], (), {}, {"a": 1}, {1: "x"}, object(), len,
    Ellipsis, np.array(3.0), np.array([]), np.zeros((2, 2)), np.float32(2.0), np.int64(2), slice(3), iter([1.0]), True,
)  # fmt: skip
GOOD: dict[str, Any] = {
    "branch": None, "branches": None, "dof": "x0", "contact": "c0", "point": 3, "harmonic": 1, "frequency": "Hz",
    "label": "a", "labels": ["a"], "references": None, "peaks": True, "log": None, "over": "sliding", "limit": True,
    "mode": None, "forced": None, "ax": None, "tolerances": {"c0.mu": 0.2}, "most": 5,
}  # fmt: skip


@cache
def stable() -> ss.Branch:
    """A short branch that knows its stability, and whose sensitivities are soon there."""
    options = {"max_step": 0.5, "first_step": 0.5, "output_step": 1.0}
    return ss.forced_response(problem(10.0), omega=(5.0, 5.2), options=options, stability=True)


@cache
def vibrating() -> ss.Branch:
    """A nonlinear mode of the oscillator, of large damping."""
    with warnings.catch_warnings(action="ignore", category=ss.SlipstickWarning):
        return ss.nonlinear_modes(oscillator(), amplitude=(2.5, 4.0))


@cache
def preloaded() -> xr.Dataset:
    """A flange whose bolt is tightened."""
    structure = ss.MatrixStructure(M=[[2.0]], K=[[0.0]], C=[[5.0]], dofs=["u"])
    plates = ss.ContactPair(name="plates", contact=ss.FrictionContact(kn=7e8, gap=0.0), normal={"u": -1.0})
    screw = ss.bolt(name="bolt 1", elongation={"u": 1.0}, stiffness=2e8)
    problem = ss.Problem(structure, contacts=[plates, screw], harmonics=3)
    return ss.preload(problem, ss.LoadStep(bolts={"bolt 1": 12e3})).dataset


@cache
def worn() -> ss.Branch:
    """A contact that has worn for some cycles."""
    problem = ss.Problem(
        oscillator().structure, loads=oscillator().loads, harmonics=range(4),
        contacts=ss.ContactPair(
            name="c0", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=800.0)
        ),
    )  # fmt: skip
    return ss.wear(problem, 8e-4, (0, 100), omega=10.0, max_change=0.5, tolerance=1e-3)


@cache
def studied() -> dict[str, Any]:
    """A study of two cases, and its curves."""
    job = Job(problem=oscillator(velocity=10.0), span=(5.0, 5.5), options={"max_step": 0.2, "first_step": 0.2})
    plan = make_plan(job.problem, {"damper.mu": [0.2, 0.3]}, method="random", samples=2)
    found = {i: solve(job, plan, i) for i in range(len(plan))}
    attributes = study_attributes(job, plan, found, {})
    return {"study": study_dataset(job, plan, found, attributes), "curves": curves_dataset(job, found, attributes)}


@cache
def passed() -> Any:
    """The oscillator passed through."""
    return ss.runs.run_up(oscillator(velocity=10.0), (4.0, 8.0), rate=1.0)


@cache
def fitting() -> xr.Dataset:
    """A parameter fitted to two amplitudes."""
    problem = oscillator()
    measured = ss.steady_response(problem, omega=[8.0, 9.5]).dataset[["amplitude", "omega"]]
    return ss.identify(problem, measured, {"damping": 1.1}).dataset


def turning() -> xr.Dataset:
    """Campbell diagram of a rotor of one mass."""
    gyroscopic = [[0.0, 0.3], [-0.3, 0.0]]
    rotor = ss.MatrixStructure(M=np.eye(2), K=40.0 * np.eye(2), dofs=["x", "y"], gyroscopic=gyroscopic, speed=1.0)
    return ss.models.campbell(rotor, [0.0, 5.0, 10.0], engine_orders=[1])


def meeting() -> xr.Dataset:
    """Interference diagram of a disc of one mass a sector."""
    sector = ss.CyclicStructure(M=[[1.0]], K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=6)
    return ss.models.interference(sector, (0.1, 1.0), engine_orders=[1, 2])


def scattered() -> xr.Dataset:
    """Two discs of two blades."""
    return xr.Dataset(
        {
            "amplification": ("case", [1.1, 1.2]),
            "worst": ("case", ["tip@0", "tip@1"]),
            "peak_amplitude": (("case", "dof"), [[1.0], [2.0]]),
            "outcome": ("case", ["COMPLETED", "COMPLETED"]),
            "stiffness@0": ("case", [0.01, -0.01]),
            "stiffness@1": ("case", [0.02, 0.01]),
        },
        coords={"case": [0, 1], "dof": ["tip@0"]},
        attrs={"study_parameters": "stiffness@0\nstiffness@1", "tuned_amplitude": 1.0},
    )


TURNING = {"campbell": turning, "interference": meeting}
DRAWN = [name for name in plots.__all__ if name not in ("save_figure", "abscissa_text", "temperature")]
SHORT = ("stability", "tolerance_band", "tornado", "run_up")


@pytest.mark.parametrize("every", [2, pytest.param(1, marks=pytest.mark.verify(sample=12))], ids=["some", "all"])
@pytest.mark.parametrize("name", DRAWN)
def test_a_wrong_value_is_refused_with_a_sentence_or_means_the_obvious(name: str, every: int) -> None:
    """One argument gets every other wrong value, the next the others."""
    draw = getattr(plots, name)
    names = list(inspect.signature(draw).parameters)
    good = {key: GOOD.get(key) for key in names if key != "label" and not (key == "contact" and "dof" in names)}
    good |= {
        key: [branch()] if name == "compare" else stable() if name in SHORT else branch()
        for key in ("branch", "branches")
        if key in names
    }
    if "mode" in names:
        good |= {key: found for key, found in {"mode": vibrating(), "dof": "x"}.items() if key in names}
    if "study" in names:
        chosen = {"dof": "x", "over": "damper.mu", "percentiles": (5.0, 95.0), **studied()}
        good |= {key: found for key, found in chosen.items() if key in names}
    if "run" in names:
        good |= {"run": passed(), "dof": "x", "last": 5, "highest": 20.0}
        good = {key: value for key, value in good.items() if key in names}
        good |= {"branch": None} if "branch" in names else {}
    if name == "orbit":
        good |= {"branch": whirling(), "point": 0, "contact": "stator"}
    if name == "disc":
        good |= {"branch": disc_and_wave()[0], "point": 0, "dof": "tip", "tau": 0.5}
    if name == "blades":
        good |= {"branch": disc_and_wave()[0], "dof": "tip"}
    if name == "haigh":
        good |= {"branch": stressed(12), "endurance": 2.0, "strength": 5.0}
    if name == "preload":
        good |= {"loaded": preloaded(), "step": -1, "joint": None}
    if name == "interface":
        good |= {"branch": shaken_joint(), "point": 0, "name": "joint"}
    if name == "wear":
        good |= {"branch": worn(), "dof": "x", "contact": "c0"}
    if name == "worn_surface":
        good |= {"branch": worn()}
    if "samples" in names:
        given = {"samples": xr.Dataset({"amplification": ("sample", np.ones(20))}), "percentiles": (50.0, 95.0)}
        good |= {key: value for key, value in given.items() if key in names}
    if name == "worst_disc":
        good = {"study": scattered(), "ax": None}
    if "fitted" in names:
        good |= {"fitted": fitting()}
    if "data" in names:
        good |= {"data": TURNING[name](), "rpm": True} if name == "campbell" else {"data": TURNING[name]()}
    draw(**good)
    poor = []
    for number, argument in enumerate(names):
        for value in WRONG[number % every :: every]:
            given = {k: v for k, v in good.items() if not (argument == "contact" and k == "dof")} | {argument: value}
            try:
                with for_files():
                    draw(**given)
            except ss.InputError:
                continue
            except Exception as error:
                poor.append(f"{argument} = {type(value).__name__}: {type(error).__name__}: {error}")
    assert not poor, "\n".join(poor)
