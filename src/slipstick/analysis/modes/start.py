"""The linear mode that a nonlinear one begins as: of the structure with its contacts as they are at rest.

At small amplitude a law answers by its tangent at the static equilibrium: contacts that stick are springs, those that
slide or are open are not. The modes of the structure with these, of the number that is meant among those without
contacts: the mode is followed while the contact forces grow from nothing to what they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import detail
from slipstick.balance.problem import Problem
from slipstick.balance.start import FirstPoint
from slipstick.contact.law import Response
from slipstick.structure.modal import ModalStructure
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, ComplexArray

_MODES = 80
"""Modes that the first guess is made of, besides those up to the number asked for; the others count as static."""

_ALIKE = 0.8
"""Modal assurance above which a mode is the same one as before the contact forces grew."""

_LEAST = 1e-3
"""Smallest growth of the contact forces, in parts of the whole."""

_ROUNDS = 4


@dataclass(frozen=True, kw_only=True)
class LinearMode:
    """Free vibration at small amplitude.

    Attributes
    ----------
    omega, xi
        Frequency (rad/s) and what is taken of damping (1/time).
    modal
        Cosine minus i times sine of the mass-normalised modal coordinates, (n,) of the first n modes.
    ports
        Those of the relative motion at the ports, (n_ports,).
    at_dof
        That of the motion at the output.
    size
        Largest motion of a dof.
    static
        Motion of the ports at rest, (n_ports,).
    """

    omega: float
    xi: float
    modal: ComplexArray
    ports: ComplexArray
    at_dof: complex
    size: float
    static: Array

    @property
    def most(self) -> int:
        """Number of the mode of the structure without contacts that has the largest share, from 0."""
        return int(np.argmax(np.abs(self.modal)))


def linear_mode(
    problem: Problem, structure: ModalStructure, number: int, dof: str, viscous: Array | None = None
) -> LinearMode:
    """The mode ``number`` (from 0) of a structure, with its contacts as they are at rest.

    ``problem`` is that of the structure with nothing but static loads; ``viscous`` its damping between the modes
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
    loss = np.broadcast_to(structure.loss_factor, structure.omega.shape)[:count]

    def modes(share: float, omega: float) -> tuple[ComplexArray, ComplexArray]:
        """Eigenvalues ``w^2 + i w xi`` and modes with a share of the contact forces, tangent at a frequency."""
        K = share * _tangent(balance, static, omega)
        S = left.T @ K @ np.linalg.solve(np.eye(len(left)) + rest @ K, left)
        S[kept, kept] += square * (1.0 + 1j * loss) + (1j * omega * damping if viscous is None else 0.0)
        if viscous is not None:
            S += 1j * omega * viscous[:count, :count]
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
        if alike >= _ALIKE or growth <= _LEAST:
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
    return LinearMode(
        omega=float(omega), xi=value.imag / float(omega), modal=shape, ports=ports, at_dof=at_dof, static=static,
        size=float(np.abs(structure.mode_shapes[:, :count] @ shape).max()),
    )  # fmt: skip


def _at_rest(balance: Balance, omega: float) -> Array:
    """Static equilibrium of the contacts, (n_ports,); zero where none is found."""
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
    """Add the tangents of one batch."""
    c, s = pair
    for ports, tangent in response.by_motion.items():
        members, felt, moving = balance.batches[k].couplings[ports]
        t = tangent[members]
        receptance = 0.5 * (t[:, c, c] + t[:, s, s]) + 0.5j * (t[:, c, s] - t[:, s, c])
        np.add.at(K, (felt, moving), receptance)
