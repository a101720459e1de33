"""The problem of free vibration in a mode: the structure by its modes, one of which moves as prescribed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.analysis.modes.start import LinearMode, linear_mode
from slipstick.analysis.modes.system import ModeSystem, TargetMode
from slipstick.balance.balance import Balance
from slipstick.balance.jacobian_backends import JacobianBackend
from slipstick.balance.loads import Load
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.results.record import Outputs
from slipstick.structure.cyclic import TravellingWave
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.modal import ModalStructure
from slipstick.structure.prescribed_mode import MODE, PrescribedMode
from slipstick.typing import Array, ComplexArray

_STILL = 1e-6
_ALONE = "free vibration has no such motion: leave it out"


class FreeProblem:
    """A problem whose mode moves as prescribed, and what of the problem with loads its results are held against."""

    def __init__(
        self, problem: Problem, structure: ModalStructure, number: int, dof: str, backend: JacobianBackend | str,
        viscous: Array | None = None,
    ) -> None:  # fmt: skip
        self.forced, self.modal = problem, structure
        directions = problem.direction_matrix(problem.port_directions)
        self.ports: Array = directions.T @ structure.mode_shapes
        at_dof = structure.mode_shapes[structure.dofs.index(dof)]
        self.target = TargetMode(structure, number, self.ports, at_dof, viscous)
        still = _resting(problem, structure)
        prescribed = PrescribedMode(structure, number, self.target.scale, viscous)
        self.problem = replace(still, structure=prescribed, loads=[*still.loads, Load(shape=MODE, cos=1.0)], told=None)
        self.balance = Balance(self.problem, backend=backend)
        self.balance.anchor_if_undamped(float(structure.omega[number]))
        self.outputs = Outputs(self.balance, (dof,))

    def system(self, reference: Array, *, at_dof: bool = False) -> ModeSystem:
        """The system of equations, its phase fixed near a motion (N + 2,)."""
        return ModeSystem(self.outputs, self.modal, self.ports, self.target, reference, at_dof=at_dof)

    def mode_force(self) -> ComplexArray:
        """Phasors of the forces of the problem's loads on the mass-normalised modes, (n_modes,)."""
        columns = self.forced.load_columns
        names = tuple(shape for shape in columns.shapes)
        _, right, _, _ = self.modal.modal_parts(np.zeros((len(self.modal.dofs), 0)), columns.vectors, names)
        P, order = self.forced.load_coefficients(), self.forced.load_order
        if order not in self.forced.harmonics.orders:
            return np.zeros(self.modal.omega.size, dtype=complex)
        c, s = (self.forced.harmonics.index(order, part) for part in "cs")
        return np.asarray(right.T @ (P[:, c] - 1j * P[:, s]))


def free_problem(
    problem: Problem, number: int, dof: str, backend: JacobianBackend | str = "auto"
) -> tuple[FreeProblem, LinearMode]:
    """The problem of free vibration in a mode, and the mode with contacts as they are at rest.

    The mode that is split off is the one with the largest share in that. InputError where there is no such mode.
    """
    structure, viscous = _modal(problem, number, dof)
    linear = linear_mode(_resting(problem, structure), structure, number, dof, viscous)
    if abs(linear.at_dof) <= _STILL * linear.size:
        raise InputError(Fault("dof", f"{dof} does not move in mode {number + 1} with the contacts as they are at rest",
                               remedy="name one that does"))  # fmt: skip
    return FreeProblem(problem, structure, linear.most, dof, backend, viscous), linear


def _resting(problem: Problem, structure: ModalStructure) -> Problem:
    """With nothing but its static loads."""
    still = [replace(load, cos=problem.load * load.cos) for load in problem.loads if load.harmonic == 0]
    return replace(problem, structure=structure, loads=still, load=1.0, period_ratio=(1, 1), told=None)


def _modal(problem: Problem, number: int, dof: str) -> tuple[ModalStructure, Array | None]:
    """The structure by its modes, and the viscous damping between them where it couples them."""
    structure: Any = problem.structure
    viscous: Array | None = None
    if isinstance(structure, MatrixStructure):
        by_modes = structure.by_modes(alone=True)
        structure, viscous = by_modes, structure.modal_viscous
    if isinstance(structure, TravellingWave):
        remedy = 'take limit cycles of its sector with C = -M over "damping", or the whole disc, sector.mistuned()'
        raise InputError(Fault("problem", "a travelling wave has no real mode", remedy=remedy))
    if not isinstance(structure, ModalStructure):
        name = type(structure).__name__
        raise InputError(f"nonlinear modes need a structure given by matrices or modes; found a {name}")
    if structure.couples:
        raise InputError("damping or the gas couple the modes of the disc: there is no nonlinear mode of one of them")
    faults = motion_faults(problem)
    count = structure.omega.size
    shape = np.abs(structure.mode_shapes[:, number]) if number < count else np.zeros(0)
    if number >= count:
        faults.append(Fault("mode", found=str(number + 1), expected=f"a number from 1 to {count}"))
    elif shape[structure.dofs.index(dof)] <= _STILL * shape.max():
        faults.append(Fault("dof", f"{dof} does not move in mode {number + 1}", remedy="name one that does"))
    if faults:
        raise InputError(faults)
    return structure, viscous


def motion_faults(problem: Problem) -> list[Fault]:
    """What moves the structure so that there is no free vibration in a mode."""
    faults = [
        Fault(("contact", pair.name), "its opposing surface moves periodically", remedy=_ALONE)
        for pair in problem.contacts
        if any(np.any(array) for array in _periodic(pair.rubbing))
    ]
    if 1 not in problem.harmonics.orders:
        faults.append(Fault("harmonics", "a mode vibrates in harmonic 1, which is not kept", remedy="keep it"))
    if any(load.motion is not None and (load.cos or load.sin) for load in problem.loads):
        faults.append(Fault("loads", "a support moves or an unbalance turns", remedy=_ALONE))
    return faults


def _periodic(rubbing: Any) -> list[Any]:
    return [value for part in rubbing.parts.values() for order, value in part.items() if order]
