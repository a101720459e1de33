"""The example of a lap joint: its mesh is that of its script, it has nothing to warn of, and it runs."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.cli.verbs.init import write_example

EXAMPLE = Path(__file__).parents[2] / "examples/joint"
SENSOR = "n106z"
RANGE = (2 * np.pi * 184.0, 2 * np.pi * 195.0)


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> ss.Case:
    folder = tmp_path_factory.mktemp("joint")
    write_example("joint", folder)
    return ss.Case.from_file(folder / "joint.toml")


def test_the_mesh_is_that_of_the_script() -> None:
    named = {"__name__": "mesh"}
    exec((EXAMPLE / "lap_joint_mesh.py").read_text(), named)
    assert (EXAMPLE / "lap_joint.inp").read_text().splitlines() == named["deck"](named["beams"]())  # type: ignore[operator]


def test_bolts_have_their_force_and_a_point_is_found(case: ss.Case) -> None:
    problem = case.problem()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        point = ss.steady_response(problem, omega=2.0 * np.pi * 185.0).dataset.isel(point=0)
    force = {name: float(point.normal_force.sel(contact=name, coefficient="0")) for name in problem.elements}
    bolts = [force.pop(f"bolt {number}") for number in (1, 2, 3)]
    # nothing else presses on the lap
    assert sum(bolts) == pytest.approx(36e3, rel=2e-3)
    assert sum(force.values()) == pytest.approx(sum(bolts), rel=1e-3)


@pytest.mark.verify
def test_the_peak_of_the_lap_joint_falls_where_it_slips(case: ss.Case) -> None:
    """Ten times the load, less than ten times the amplitude, at a lower frequency; no warning of its own."""
    peaks, problem = [], case.problem()
    for force in (1.0, 10.0):
        loads = [ss.Load(dof=SENSOR, cos=force)]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            branch = ss.forced_response(replace(problem, loads=loads), omega=RANGE)
        assert branch.outcome.ok
        peaks.append(max(branch.peaks(SENSOR), key=lambda peak: peak[1]))
    assert peaks[1][1] < 8.0 * peaks[0][1]
    assert peaks[1][0] < peaks[0][0]


def test_what_is_left_out_of_a_stiff_joint_is_near_what_more_harmonics_change(case: ss.Case) -> None:
    """Contacts hardly let further orders move them; their forces alone would say hundreds of percent."""
    found = []
    for highest in (3, 6):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ss.SlipstickWarning)
            problem = replace(case.problem(), harmonics=range(highest + 1))
            found.append(ss.steady_response(problem, omega=2 * np.pi * 189.8).dataset.isel(point=0))
    fewer, more = (np.concatenate([one.displacement.to_numpy(), one.contact_tangential.to_numpy()]) for one in found)
    changed = np.abs(more[:, : fewer.shape[1]] - fewer)[:, 1:].max() / np.abs(more[:, 1:]).max()
    estimate = float(found[0].truncation)
    assert changed / 5.0 < estimate < 5.0 * changed
