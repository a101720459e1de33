"""What every structure tells: energy fed in, what its modes leave out; and what one of a user's own need not know."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.balance.physics_checks import problem_warnings
from slipstick.structure.free import FreeStructure
from slipstick.structure.protocol import Structure

RATIO = -0.01


def matrices() -> Structure:
    return ss.MatrixStructure(M=[[1.0]], C=[[2.0 * RATIO * 6.0]], K=[[36.0]], dofs=["x"])


def modes(**given: float) -> ss.ModalStructure:
    return ss.ModalStructure(omega=[6.0], mode_shapes=[[1.0]], dofs=["x"], damping_ratio=RATIO, **given)


def free() -> Structure:
    return FreeStructure(elastic=modes(), rigid_shapes=[[0.5]])


def sector() -> ss.CyclicStructure:
    return ss.CyclicStructure(M=[[1.0]], K=([[38.0]], [[-1.0]]), C=[[2.0 * RATIO * 6.0]], dofs=["x"], sectors=5)


def table() -> Structure:
    lines = np.linspace(2.0, 20.0, 1500)
    damped = {"damping_ratio": [RATIO, 0.05]}  # negative damping of all modes looks like a conjugated table
    structure = ss.ModalStructure(omega=[6.0, 12.0], mode_shapes=[[1.0, 1.0]], dofs=["x"], **damped)
    H = structure.project(np.eye(1), np.eye(1)).at([1.0], lines)[0][:, 0]
    names = {"omega": lines, "output": ["x"], "input": ["x"]}
    measured = xr.Dataset({"receptance": (("omega", "output", "input"), H)}, coords=names)
    return ss.models.tabulated_structure(measured)


MADE = [matrices, modes, free, lambda: sector().travelling_wave(1), lambda: sector().mistuned(), table]


@pytest.mark.filterwarnings("ignore:the static compliance", "ignore:passivity")
@pytest.mark.parametrize("made", MADE, ids=["matrices", "modes", "free", "wave", "disc", "table"])
def test_negative_damping_is_told_of_every_structure(made: Callable[[], Structure]) -> None:
    structure = made()
    assert structure.energy_fed
    dof = structure.dofs[0]
    problem = ss.Problem(structure, loads=[ss.Load(dof=dof, sin=1.0)], harmonics=[0, 1])
    (said,) = (text for text in problem_warnings(problem, (5.0, 7.0)) if "damping feeds energy in" in text)
    assert structure.energy_fed in said


@pytest.mark.parametrize("made", [lambda: ss.MatrixStructure(M=[[1.0]], C=[[0.1]], K=[[36.0]], dofs=["x"]),
                                  lambda: ss.models.free_structure([[3.0, -3.0], [-3.0, 3.0]], np.eye(2),
                                                                   dofs=["a", "b"], keep=["a"], modes=1)])  # fmt: skip
def test_what_loses_energy_feeds_none(made: Callable[[], Structure]) -> None:
    structure = made()
    assert (structure.energy_fed, structure.self_excited) == ("", "")


def test_hysteretic_damping_is_known_round_the_modes() -> None:
    """Limit cycles say how they take it."""
    hysteretic = modes(loss_factor=0.02)
    assert FreeStructure(elastic=hysteretic, rigid_shapes=[[0.5]]).loss_factor == hysteretic.loss_factor
    assert Bare().loss_factor == 0.0


class Bare(ss.models.Structure):
    """As little as a structure has to tell."""

    dofs, natural_frequencies = ("x",), np.array([6.0])

    def project(self, rows, columns, shapes=()):
        return modes().project(rows, columns, shapes)


def test_a_structure_of_ones_own_need_not_know_all() -> None:
    problem = ss.Problem(Bare(), loads=[ss.Load(dof="x", sin=1.0)], harmonics=[0, 1])
    branch = ss.linear_response(problem, omega=[5.0])
    assert float(branch.dataset.amplitude[0, 0]) == pytest.approx(1.0 / 11.0, rel=0.02)
    from slipstick.cli.verbs.check import untold

    assert untold(problem.structure) == [
        "damping ratios", "whether its damping feeds energy in", "whether its stiffness makes it grow",
        "the error by modes left out",
    ]  # fmt: skip
    with pytest.raises(ss.InputError, match="a Bare does not tell its equations in time"):
        Bare().time_equations(np.eye(1), np.eye(1))


def test_what_does_not_derive_from_it_is_refused() -> None:
    class Alone:
        dofs, load_shapes, natural_frequencies = ("x",), (), np.array([6.0])

        def project(self, rows, columns, shapes=()):
            return modes().project(rows, columns)

    with raises_fault("structure", remedy="derive its class from ss.models.Structure"):
        ss.Problem(Alone(), loads=[ss.Load(dof="x", sin=1.0)], harmonics=[0, 1])
