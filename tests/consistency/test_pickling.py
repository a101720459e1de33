"""Everything public goes to another process and back with the same numbers."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.oscillator import one_mass
from scipy import sparse

import slipstick as ss
from slipstick.analysis.curve.response import response_options

CONTACT = ss.ContactPair(
    name="damper",
    contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-80.0),
    tangential="x",
    rubbing=ss.RubbingMotion(velocity=10.0, cos={1: 2.0}),
)
THERMAL = ss.ThermalModel(curve=ss.FrictionCurve(mu=[[25, 0.5], [90000, 0.4]]), background=25.0, resistance=0.1)


def problem(**more: Any) -> ss.Problem:
    return one_mass(CONTACT, **more)


def modal() -> ss.ModalStructure:
    K, M = sparse.diags_array(np.arange(1.0, 31.0)).tocsr(), sparse.eye_array(30).tocsr()
    return ss.reduce(K, M, keep=["d0", "d3"], dofs=[f"d{i}" for i in range(30)], modes=4)


def cubic(x: Any, v: Any, k3: Any) -> Any:
    return k3 * x**3


COPIES: list[Callable[[Any], Any]] = [lambda thing: pickle.loads(pickle.dumps(thing)), copy.deepcopy]


@pytest.mark.parametrize("copied", COPIES, ids=["pickle", "deepcopy"])
def test_problems_and_branches(copied: Callable[[Any], Any]) -> None:
    for whole in (problem(), problem(thermal=THERMAL)):
        branch = ss.forced_response(copied(whole), omega=(4.0, 4.1))
        again = copied(branch)
        assert again.dataset.equals(ss.forced_response(whole, omega=(4.0, 4.1)).dataset)
        assert (again.outcome, again.message) == (branch.outcome, branch.message)
        assert again.states(0) == branch.states(0)
        assert again.check_in_time(0).relative_difference == branch.check_in_time(0).relative_difference


@pytest.mark.parametrize("copied", COPIES, ids=["pickle", "deepcopy"])
def test_parts(copied: Callable[[Any], Any]) -> None:
    h = copied(ss.Harmonics([0, 1, 3]))
    assert h == ss.Harmonics([0, 1, 3])
    forces = ss.contact_forces(
        CONTACT.contact, h, np.ones(5), np.zeros(5), omega=2.0, rubbing=ss.RubbingMotion(velocity=1.0)
    )
    again = copied(forces)
    np.testing.assert_array_equal(again.dFx_dX, forces.dFx_dX)
    assert (again.states, again.power) == (forces.states, forces.power)
    for structure in (modal(), ss.MatrixStructure(M=sparse.eye_array(2), K=sparse.eye_array(2) * 4.0, dofs=["x", "y"])):
        np.testing.assert_array_equal(copied(structure).natural_frequencies, structure.natural_frequencies)
    assert copied(ss.InputError(["a", "b"])).sentences == ("a", "b")
    assert copied(ss.Outcome.COMPLETED) is ss.Outcome.COMPLETED
    curve = THERMAL.curve
    assert float(copied(curve).mu(100.0)) == float(curve.mu(100.0))
    options = response_options(max_step=0.01)
    assert copied(options) == options
    load = ss.Load(dof="x", amplitude=2.0, phase=0.1)
    assert copied(load) == load
    assert copied(CONTACT) == CONTACT
    law = ss.SampledLaw(force=cubic, parameters={"k3": 2.0})
    assert copied(law) == law
    linear = ss.linear_response(problem(), omega=(4.0, 4.4))
    assert copied(linear).dataset.equals(linear.dataset)
    result = ss.transient(problem(), 4.0)
    np.testing.assert_array_equal(copied(result).amplitude, result.amplitude)


ELSEWHERE = """
import pickle, sys
import slipstick as ss
branch = pickle.load(open(sys.argv[1], "rb"))
again = ss.forced_response(branch.problem, omega=(4.0, 4.4))
assert again.dataset.equals(branch.dataset)
print("same")
"""


def test_a_process_of_its_own(tmp_path: Path) -> None:
    """A branch with its problem, read and computed again bit for bit where nothing is known of this process."""
    (tmp_path / "b").write_bytes(pickle.dumps(ss.forced_response(problem(), omega=(4.0, 4.4))))
    found = subprocess.run(
        [sys.executable, "-c", ELSEWHERE, str(tmp_path / "b")], capture_output=True, text=True, timeout=600
    )
    assert found.stdout == "same\n", found.stderr
