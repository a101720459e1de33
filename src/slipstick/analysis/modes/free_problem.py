"""The problem of free vibration in one mode: the structure by its modes, one of which moves as prescribed.

The nonlinear mode begins as a linear one. At small amplitude a law answers by its tangent at the static equilibrium:
sticking contacts are springs, sliding and open ones are not. The number of the mode is that of the structure without
contacts: the mode is followed while the contact forces grow from zero to their full size.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slipstick.analysis.modes.system import ModeSystem, TargetMode
from slipstick.balance.balance import Balance
from slipstick.balance.base_motion import static_forces
from slipstick.balance.evaluation import detail
from slipstick.balance.jacobian_backends import JacobianBackend
from slipstick.balance.loads import Load
from slipstick.balance.problem import Problem
from slipstick.balance.start import FirstPoint
from slipstick.contact.law import Response
from slipstick.errors import Fault, InputError
from slipstick.html import some
from slipstick.results.record import Outputs
from slipstick.structure.cyclic import TravellingWave
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.modal import ModalStructure
from slipstick.structure.prescribed_mode import MODE, PrescribedMode
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray

_MODES = 80
"""Number of modes of the first guess, unless twice the number of the mode is more; further modes are static."""

_ALIKE = 0.8
"""Modal assurance above which two modes are the same as contact forces grow."""

_LEAST_STEP = 1e-3
"""Smallest step of the share of contact forces."""

_ROUNDS = 4
"""Number of iterations for the frequency at which the tangents are evaluated."""


@dataclass(frozen=True, kw_only=True)
class LinearMode:
    """Free vibration at small amplitude.

    Attributes
    ----------
    omega, xi
        Frequency (rad/s) and subtracted damping (1/time).
    modal
        Phasors (cosine minus i times sine) of the mass-normalised modal coordinates, (n,) of the first n modes.
    ports
        Phasors of the relative motion at the ports, (n_ports,).
    at_dof
        Phasor of the motion at the output.
    size
        Largest motion of a dof.
    static
        Motion of the ports at rest, (n_ports,).
    least
        Smallest damping ``2 D omega`` (1/time), with the same contacts, of the other modes that the harmonics reach;
        inf without others. Those above are made of residuals, which have no damping.
    """

    omega: float
    xi: float
    modal: ComplexArray
    ports: ComplexArray
    at_dof: complex
    size: float
    static: Array
    least: float

    @property
    def most(self) -> int:
        """Number, from 0, of the mode without contacts that has the largest share."""
        return int(np.argmax(np.abs(self.modal)))


def linear_mode(
    problem: Problem, structure: ModalStructure, number: int, dof: str, viscous: Array | None = None
) -> LinearMode:
    """The mode ``number`` (from 0) of a structure with contacts linearised at rest.

    ``problem`` has the structure with static loads only; ``viscous`` is its damping between the modes
    (n_modes, n_modes) where that couples them.
    """
    balance = Balance(problem)
    static = _at_rest(balance, float(structure.omega[number]))
    count = min(structure.omega.size, max(_MODES, 2 * number + 2))
    left, _, compliance, _ = structure.modal_parts(balance.directions, balance.directions, ())
    left = left[:, :count]
    square, kept = structure.omega[:count] ** 2, np.arange(count)
    rest = compliance - (left / square) @ left.T
    damping = (2.0 * structure.damping_ratio * structure.omega)[:count]
    between = np.diag(damping) if viscous is None else viscous[:count, :count]
    loss = np.broadcast_to(structure.loss_factor, structure.omega.shape)[:count]

    def modes(share: float, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """Eigenvalues ``w^2 + i w xi`` and modes with a share of the contact forces, tangent at a frequency."""
        K = share * _tangent(balance, static, omega)
        S = left.T @ K @ np.linalg.solve(np.eye(len(left)) + rest @ K, left)
        S[kept, kept] += square * (1.0 + 1j * loss)
        S += 1j * omega * between
        values, shapes = np.linalg.eig(S)
        return values, shapes

    shape, value = np.eye(count)[number] + 0j, complex(square[number])
    share, growth = 0.0, 1.0
    while share < 1.0:
        ahead = min(share + growth, 1.0)
        omega, reached_shape, alike = np.sqrt(value.real), shape, 0.0
        for _ in range(_ROUNDS):
            values, shapes = modes(ahead, omega)
            likeness = np.where(values.real > 0.0, np.abs(shape.conj() @ shapes) ** 2, -1.0)
            best = int(np.argmax(likeness))
            reached_shape, alike, reached = shapes[:, best], float(likeness[best]), complex(values[best])
            omega = np.sqrt(max(reached.real, 1e-12 * square[0]))
        if alike >= _ALIKE or growth <= _LEAST_STEP:
            share, shape, value, growth = ahead, reached_shape, reached, 2.0 * growth
        else:
            growth *= 0.5
    K = _tangent(balance, static, float(omega))
    ports = np.linalg.solve(np.eye(len(left)) + rest @ K, left @ shape)
    row = np.zeros(len(structure.dofs))
    row[structure.dofs.index(dof)] = 1.0
    near, _, compliance, _ = structure.modal_parts(row[:, None], balance.directions, ())
    near = near[:, :count]
    at_dof = complex((near @ shape - (compliance - (near / square) @ left.T) @ K @ ports)[0])
    decays = _decays(values, shapes, float(omega), between)
    others = (values.real <= (balance.orders.max(initial=1) * omega) ** 2) & (np.arange(len(values)) != best)
    return LinearMode(
        omega=float(omega), xi=value.imag / float(omega), modal=shape, ports=ports, at_dof=at_dof, static=static,
        size=float(np.abs(structure.mode_shapes[:, :count] @ shape).max()),
        least=float(decays[others].min(initial=np.inf)),
    )  # fmt: skip


def _decays(values: ComplexArray, shapes: ComplexArray, omega: float, viscous: Array) -> Array:
    """Damping ``2 D omega`` (n,) of modes by eigenvalues ``w^2 + i omega d + i s`` with viscous and hysteretic parts.

    ``viscous`` (n, n) was taken at ``omega``; inf of a mode that is no vibration.
    """
    d = np.einsum("ik,ij,jk->k", shapes.conj(), viscous, shapes).real / np.sum(np.abs(shapes) ** 2, axis=0)
    own = np.sqrt(np.maximum(values.real, 0.0))
    return np.divide(values.imag - omega * d, own, out=np.full(len(values), np.inf), where=own > 0.0) + d


def _at_rest(balance: Balance, omega: float) -> Array:
    """Static equilibrium of the contacts, (n_ports,); zero where no equilibrium is found."""
    static = balance.narrowed(Harmonics([0]))
    x = FirstPoint(static, static.problem.inputs, omega).find()
    return np.zeros(balance.n_ports) if x is None else x


def _tangent(balance: Balance, static: Array, omega: float) -> ComplexArray:
    """Force phasors over motion phasors of harmonic 1 at rest, (n_ports, n_ports)."""
    X = np.zeros((balance.n_ports, balance.L))
    X[:, 0] = static
    evaluated = detail(balance, X.reshape(-1), omega, balance.problem.inputs)
    c, s = (balance.harmonics.index(1, part) for part in "cs")
    K = np.zeros((balance.n_ports, balance.n_ports), dtype=complex)
    for k, response in enumerate(evaluated.responses):
        _gather(balance, k, response, (c, s), K)
    return K


def _gather(balance: Balance, k: int, response: Response, pair: tuple[int, int], K: ComplexArray) -> None:
    """Add the tangents of one batch to ``K``."""
    c, s = pair
    for ports, tangent in response.by_motion.items():
        members, felt, moving = balance.batches[k].couplings[ports]
        t = tangent[members]
        receptance = 0.5 * (t[:, c, c] + t[:, s, s]) + 0.5j * (t[:, c, s] - t[:, s, c])
        np.add.at(K, (felt, moving), receptance)


_AT_REST = 1e-6
_ALONE = "free vibration has no such motion: leave it out"


class FreeProblem:
    """A problem in which one mode moves as prescribed, and the loads of the problem on the modes."""

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
        """The system of equations, with the phase of a motion ``reference`` (N + 2,)."""
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
    """The problem of free vibration in a mode, and the mode with contacts linearised at rest.

    The separated mode is the one with the largest share. Raises InputError where there is no such mode.
    """
    structure, viscous = _modal(problem, number, dof)
    linear = linear_mode(_resting(problem, structure), structure, number, dof, viscous)
    if abs(linear.at_dof) <= _AT_REST * linear.size:
        raise InputError(Fault("dof", f"{dof} does not move in mode {number + 1} with the contacts as they are at rest",
                               remedy="name one that does"))  # fmt: skip
    return FreeProblem(problem, structure, linear.most, dof, backend, viscous), linear


def _resting(problem: Problem, structure: ModalStructure) -> Problem:
    """The problem with its static loads only, all of them forces."""
    static = [force for load in problem.loads if load.harmonic == 0 for force in static_forces(load, problem)]
    still = [replace(load, cos=problem.load * load.cos) for load in static]
    return replace(problem, structure=structure, loads=still, load=1.0, period_ratio=(1, 1), told=None)


def _modal(problem: Problem, number: int, dof: str) -> tuple[ModalStructure, Array | None]:
    """The structure by its modes, and the viscous damping matrix where that couples them."""
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
    elif shape[structure.dofs.index(dof)] <= _AT_REST * shape.max():
        row = np.abs(structure.mode_shapes[structure.dofs.index(dof)])
        sizes = np.abs(structure.mode_shapes).max(axis=0)
        moves = some([str(k + 1) for k in np.flatnonzero(row > _AT_REST * sizes)], 5)
        remedy = f"name another dof, or a mode in which it moves: {moves or 'there is none'}"
        faults.append(Fault("dof", f"{dof} does not move in mode {number + 1}", remedy=remedy))
    if faults:
        raise InputError(faults)
    return structure, viscous


def motion_faults(problem: Problem) -> list[Fault]:
    """Faults: prescribed motion and other reasons why there is no free vibration in a mode."""
    faults = [
        Fault(("contact", pair.name), "its opposing surface moves periodically", remedy=_ALONE)
        for pair in problem.contacts
        if any(np.any(array) for array in _periodic(pair.rubbing))
    ]
    if 1 not in problem.harmonics.orders:
        faults.append(Fault("harmonics", "a mode vibrates in harmonic 1, which is not kept", remedy="keep it"))
    if any(load.motion is not None and load.harmonic and (load.cos or load.sin) for load in problem.loads):
        faults.append(Fault("loads", "a support moves or an unbalance turns", remedy=_ALONE))
    return faults


def _periodic(rubbing: Any) -> list[Any]:
    return [value for part in rubbing.parts.values() for order, value in part.items() if order]
