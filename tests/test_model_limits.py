"""What docs/model-limits.md says is refused, tried."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from helpers.oscillator import damper, one_mass, with_law

import slipstick as ss

PAGE = (Path(__file__).parent.parent / "docs" / "model-limits.md").read_text(encoding="utf-8")
ROWS = dict(re.findall(r"^\| (.+?) \| (.+) \|$", PAGE.partition("| try | and you get |")[2], flags=re.MULTILINE))
"""What is tried, and the sentence that answers it."""

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
AMPLITUDES, RANGE = (1.0, 2.0), (8.0, 9.0)


def falling(**more: Any) -> ss.models.StribeckContact:
    return ss.models.StribeckContact(kt=30.0, mu_s=1.0, mu_d=0.5, v_s=0.5, normal_load=1.0, **more)


def heated(to: float = 400.0, **more: Any) -> dict[str, Any]:
    curve = ss.FrictionCurve(temperature=[25.0, to], mu=[0.3, 0.2])
    return {"thermal": ss.ThermalModel(curve=curve, background=25.0, resistance=3.0)} | more


def two(**more: Any) -> ss.MatrixStructure:
    given = {"M": 2.0 * np.eye(2), "C": 0.1 * np.eye(2), "K": 40.0 * np.eye(2), "dofs": ["x", "y"]}
    return ss.MatrixStructure(**given | more)


def rotor(velocity: float = 1.0, **more: Any) -> ss.Problem:
    """Tied to the frequency unless told otherwise; without loads."""
    structure = two(**more or {"gyroscopic": 3.0 * TURN, "engine_order": 1})
    return ss.Problem(structure, contacts=damper(velocity), harmonics=range(4))


def table() -> ss.Problem:
    """The mass as a table of receptances."""
    omega = np.linspace(1.0, 40.0, 2000)
    found = (1.0 / (40.0 - omega**2 + 0.4j * omega))[:, None, None]
    coords = {"omega": omega, "output": ["x"], "input": ["x"]}
    measured = xr.Dataset({"receptance": (("omega", "output", "input"), found)}, coords=coords)
    structure = ss.models.tabulated_structure(measured, static=[[1.0 / 40.0]])
    return ss.Problem(structure, contacts=damper(), loads=ss.Load(dof="x", sin=100.0), harmonics=[0, 1, 3])


def superelement(ending: str) -> object:
    Path(f"model.{ending}").write_bytes(b"something")
    return ss.import_model(f"model.{ending}")


def cubic() -> ss.Problem:
    law = ss.SampledLaw(force=lambda q, velocity, k: k * q**3, parameters={"k": 1.0})
    return with_law(law)


PLANAR = ss.PlanarFrictionContact(kt=10.0, mu=0.1, normal_load=1.0)


def planar(structure: Any, **rubbing: Any) -> ss.Problem:
    pair = ss.ContactPair(name="foot", contact=PLANAR, tangential=("x", "y"), rubbing=ss.RubbingMotion(**rubbing))
    return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="x", sin=1.0), harmonics=[0, 1])


def wave() -> Any:
    K = np.diag([40.0, 50.0]), np.diag([0.0, -5.0])
    sector = ss.CyclicStructure(M=np.eye(2), K=K, C=(0.1 * np.eye(2), np.zeros((2, 2))), dofs=["x", "y"], sectors=6)
    return sector.travelling_wave(engine_order=1)


def floating() -> ss.Problem:
    """Two masses on a spring that nothing holds, under a constant load."""
    K = [[3.0, -3.0], [-3.0, 3.0]]
    free = ss.models.free_structure(K, np.eye(2), dofs=["x", "y"], keep=["x", "y"], modes=1)
    pair = ss.ContactPair(name="damper", contact=damper().contact, tangential={"x": 1.0, "y": -1.0})
    return ss.Problem(free, contacts=pair, loads=ss.Load(dof="x", harmonic=0, cos=1.0), harmonics=[0, 1])


TRIED: dict[str, Callable[[], object]] = {
    'a smoothed sign for friction, `form="tanh"`': lambda: falling(form="tanh"),
    "`mu` over velocity and temperature at once": lambda: ss.forced_response(
        one_mass(damper(law=falling()), **heated()), omega=RANGE
    ),
    "a temperature beyond its table": lambda: (
        ss.forced_response(one_mass(damper(10.0), **heated(26.0)), omega=RANGE).message
    ),
    "to follow a `mu` that a table gives": lambda: ss.parameter_response(
        one_mass(damper(), **heated()), "damper.mu", (0.1, 0.2), omega=9.0
    ),
    "limit cycles of heated contacts": lambda: ss.limit_cycles(
        one_mass(damper(1.0), **heated(loads=())), "damper.velocity", (1.0, 2.0)
    ),
    "limit cycles at a speed tied to the frequency": lambda: ss.limit_cycles(rotor(), "damper.mu", (0.1, 0.2)),
    "circulatory forces at such a speed": lambda: two(circulatory=3.0 * TURN, engine_order=1),
    "a run-up of a rotor that turns with the excitation": lambda: ss.runs.run_up(rotor(), (1.0, 2.0), rate=0.1),
    "nonlinear modes of unsymmetric matrices": lambda: ss.nonlinear_modes(
        rotor(K=[[40.0, 1.0], [-1.0, 40.0]]), amplitude=AMPLITUDES
    ),
    "nonlinear modes under a periodic rub": lambda: ss.nonlinear_modes(
        one_mass(damper(cos={1: 1.0}), loads=()), amplitude=AMPLITUDES
    ),
    "time integration of a measured table": lambda: ss.transient(table(), omega=9.0),
    "nonlinear modes of one": lambda: ss.nonlinear_modes(table(), amplitude=AMPLITUDES),
    "stability of one": lambda: ss.forced_response(table(), omega=RANGE, stability=True),
    "`BoucWenContact(alpha=0.1)` with a rubbing velocity": lambda: ss.forced_response(
        one_mass(damper(1.0, law=ss.models.BoucWenContact(kt=10.0, beta=1.0, alpha=0.1))), omega=RANGE
    ),
    "frequencies beyond the table": lambda: ss.forced_response(table(), omega=(30.0, 45.0)),
    "limit cycles of a structure under a periodic load": lambda: ss.limit_cycles(
        one_mass(damper(1.0)), "damper.velocity", (1.0, 2.0)
    ),
    "a constant load on a body that is not held": lambda: ss.steady_response(floating(), omega=1.0),
    "stability of a planar contact in a travelling wave": lambda: ss.forced_response(
        planar(wave()), omega=(3.0, 3.5), stability=True
    ),
    "a run-up of a planar contact whose velocity grows with the speed": lambda: ss.runs.run_up(
        planar(two(), velocity_per_omega=(1.0, 0.0)), (3.0, 3.2), rate=0.1
    ),
    "`ss.contact_forces` of a planar contact": lambda: ss.contact_forces(
        PLANAR,
        [0, 1],
        np.zeros(3),
        np.zeros(3),
        omega=1.0,  # type: ignore[arg-type]
    ),
    "a complex stiffness": lambda: ss.MatrixStructure(M=[[1.0]], K=[[40.0 + 1.0j]], dofs=["x"]),
    "one triangle of a matrix": lambda: two(K=[[40.0, -3.0], [0.0, 40.0]]),
    "harmonic 1.5 of a load": lambda: ss.Load(dof="x", sin=1.0, harmonic=1.5),  # type: ignore[arg-type]
    "a curve without contacts": lambda: ss.forced_response(one_mass(), omega=RANGE),
    "a superelement of Nastran, `.op2`": lambda: superelement("op2"),
    "a substructure of Ansys, `.sub`": lambda: superelement("sub"),
    "to save a law made of a function": lambda: ss.forced_response(cubic(), omega=(3.0, 3.1)).save("own.nc"),
}


def answer(attempt: Callable[[], object]) -> str:
    """The error, else the warning, else what is returned."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", ss.SlipstickWarning)
        try:
            found = attempt()
        except ss.InputError as error:
            return str(error)
    return str(caught[0].message) if caught else str(found)


def test_every_row_is_tried() -> None:
    assert list(ROWS) == [*TRIED]


@pytest.mark.parametrize("what", TRIED)
def test_the_answer_is_the_one_shown(what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert answer(TRIED[what]) == ROWS[what].strip("`")
