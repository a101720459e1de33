"""Residual ``R = X + A (F - P)`` of the multiharmonic balance and its derivatives (THEORY.md section 9).

Unknowns are the coefficients of the relative motion at the contact ports: one tangential port for each contact, then
one normal port for each contact that has a normal direction. A pair (cosine, sine) is handled as the complex number
``c + i s``, which makes ``x = conj(A) f``; harmonic 0 is one more such number with a real, static compliance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.heat import heat_columns, power_along, power_rows, warm_direction
from slipstick.balance.problem import Problem
from slipstick.contact.forces import ContactForces, element_forces
from slipstick.solve.newton import Evaluation, norm
from slipstick.thermal.model import HeatedForces

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """What is given to the balance besides motion and frequency; also a direction in the space of all that."""

    velocity: Array
    """(n_contacts,), length/time, as are kt, mu, kn, gap."""
    kt: Array
    mu: Array
    kn: Array
    gap: Array
    U: Array
    """Periodic rubbing motion (n_contacts, L)."""
    P: Array
    """Load coefficients (n_loads, L)."""

    def moved(self, direction: Inputs, step: float) -> Inputs:
        """``self + step * direction``."""
        return Inputs(**{name: value + step * getattr(direction, name) for name, value in vars(self).items()})

    def scaled(self, factor: float = 0.0) -> Inputs:
        """All multiplied by a factor."""
        return Inputs(**{name: factor * value for name, value in vars(self).items()})

    def only(self, *names: str) -> Inputs:
        """Zero but for some."""
        return replace(self.scaled(0.0), **{name: getattr(self, name) for name in names})


def inputs_of(problem: Problem) -> Inputs:
    """The numbers of a problem."""
    names = ("velocity", "kt", "mu", "kn", "gap")
    return Inputs(
        **{name: problem.contact_values(name) for name in names},
        U=problem.rubbing_coefficients(),
        P=problem.load_coefficients(),
    )


def parameter_direction(problem: Problem, name: str) -> tuple[Inputs, Inputs]:
    """Inputs where the named parameter is zero, and their derivative by it; every named parameter acts linearly."""
    at, quantity = problem.parameter_targets(name)
    base = inputs_of(problem)
    zero = base.scaled(0.0)
    if quantity == "load":
        unit = replace(problem, load=1.0, told=None).load_coefficients()
        return replace(base, P=np.zeros_like(unit)), replace(zero, P=unit)
    if quantity == "friction":
        unit = replace(problem, friction=1.0, told=None).contact_values("mu")
        return replace(base, mu=np.zeros_like(unit)), replace(zero, mu=unit)
    field = "gap" if quantity == "normal_load" else quantity
    start, slope = getattr(base, field).copy(), np.zeros(len(problem.contacts))
    rows = list(at)
    start[rows] = 0.0
    slope[rows] = -1.0 / base.kn[rows] if quantity == "normal_load" else 1.0
    return replace(base, **{field: start}), replace(zero, **{field: slope})


_UNDAMPED = 1e-5
"""Imaginary part of a receptance over itself, below which there is as good as no damping."""


class Compliance:
    """Receptances of one frequency for all harmonics: ``conj(A)`` and its derivative, (n_columns, n_rows, n + 1)."""

    __slots__ = ("slope", "value")

    def __init__(self, receptance: Any, orders: Array, omega: float) -> None:
        static = receptance.static
        shape = (static.shape[1], static.shape[0], orders.size + 1)
        self.value, self.slope = np.empty(shape, dtype=complex), np.empty(shape, dtype=complex)
        self.value[:, :, 0] = static.T
        self.slope[:, :, 0] = 0.0
        if orders.size:
            value, slope = receptance.at(orders * omega)
            np.conjugate(value.transpose(2, 1, 0), out=self.value[:, :, 1:])
            np.conjugate(slope.transpose(2, 1, 0), out=self.slope[:, :, 1:])
            self.slope[:, :, 1:] *= orders

    def anchor(self, springs: Array) -> None:
        """From ``A`` to ``B = A (1 + i k A)^-1`` for ``k`` (n_rows,), the receptance with springs ``i k`` at the rows.

        Undamped structures have infinite ``A`` at their resonances; ``B`` is bounded and smooth there.
        """
        rows = springs.size
        V, dV = (both.transpose(2, 1, 0)[1:] for both in (self.value, self.slope))
        turned = np.linalg.inv(np.eye(rows) - 1j * V[:, :, :rows] * springs)
        B = turned @ V
        dB = turned @ (dV + 1j * (dV[:, :, :rows] * springs) @ B)
        self.value[:, :, 1:], self.slope[:, :, 1:] = B.transpose(2, 1, 0), dB.transpose(2, 1, 0)


class Detail:
    """What a solution keeps of its evaluation: contact forces, inputs, frequency, and the heat where there is any."""

    __slots__ = ("compliance", "forces", "heat", "inputs", "omega")

    def __init__(self, forces: ContactForces, inputs: Inputs, omega: float, heat: HeatedForces | None = None) -> None:
        self.forces, self.inputs, self.omega, self.heat = forces, inputs, omega, heat
        self.compliance: Compliance | None = None
        """Receptances at ``omega``, once the balance was set up."""


class Balance:
    """A problem made ready for the balance.

    Parameters
    ----------
    problem
        The problem; its structure is projected on the contact ports and the loads once.

    Attributes
    ----------
    n_contacts, n_ports, size
        Numbers of contacts, ports, unknowns ``N = n_ports L``.
    with_normal
        Indices of the contacts with a normal port, in the order of these ports.
    springs
        ``k`` of ``anchor_if_undamped`` (n_ports,), or None.
    heated, temperature
        The thermal model of the contacts, or None; temperatures (n_contacts,) near which those of the next evaluations
        are sought, None for from cold: whoever follows a branch sets them at every point found.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem, self.harmonics = problem, problem.harmonics
        pairs = [pair.directions for pair in problem.contacts]
        self.n_contacts = len(pairs)
        self.with_normal = np.array([i for i, (_, normal) in enumerate(pairs) if normal is not None], dtype=int)
        directions = [t for t, _ in pairs] + [n for _, n in pairs if n is not None]
        self.directions = problem.direction_matrix(directions)
        dofs, shapes = problem.load_targets
        self.columns = np.hstack([self.directions, problem.direction_matrix({dof: 1.0} for dof in dofs)])
        self.shapes = shapes
        self.n_ports = len(directions)
        self.orders = self.harmonics.m.astype(float)
        self.L = self.harmonics.size
        self.size = self.n_ports * self.L
        self.receptance = self.rows_to(self.directions)
        self.heated = problem.heated
        self.temperature: Array | None = None
        self.springs: Array | None = None

    def anchor_if_undamped(self, omega: float) -> None:
        """Write the balance with springs ``i k`` on both sides where the structure has next to no damping.

        ``R = X + B (F - i k X - P)`` with ``B = A (1 + i k A)^-1`` has the same solutions as ``X + A (F - P)`` and goes
        smoothly through the resonances at which an undamped ``A`` is infinite.
        """
        own = np.arange(self.n_ports)
        value = self.receptance.at(self.orders * omega)[0][:, own, own]
        lost = np.abs(value.imag) <= _UNDAMPED * np.abs(value)
        if np.any(np.all(lost, axis=0)):
            static = np.abs(self.receptance.static[own, own])
            self.springs = np.divide(1.0, static, out=np.zeros_like(static), where=static > 0)

    def rows_to(self, rows: Array) -> Any:
        """Receptance from the contact forces and loads to other directions ``rows`` (n_dofs, n_rows)."""
        return self.problem.structure.project(rows, self.columns, self.shapes)

    def compliance(self, omega: float, *, anchored: bool = True) -> Compliance:
        """Receptances at the harmonics of ``omega``, between ports and from loads to ports: ``B``, or plainly ``A``."""
        compliance = Compliance(self.receptance, self.orders, omega)
        if anchored and self.springs is not None:
            compliance.anchor(self.springs)
        return compliance

    def split(self, x: Array) -> tuple[Array, Array]:
        """Tangential and normal relative motion (..., n_contacts, L) of unknowns (..., N); zero without a normal."""
        X = x.reshape(*x.shape[:-1], self.n_ports, self.L)
        Y = np.zeros((*x.shape[:-1], self.n_contacts, self.L))
        if self.with_normal.size:
            Y[..., self.with_normal, :] = X[..., self.n_contacts :, :]
        return X[..., : self.n_contacts, :], Y

    def forces(self, x: Array, omega: float, inputs: Inputs) -> ContactForces:
        """Contact forces at unknowns (N,)."""
        return self.detail(x, omega, inputs).forces

    def detail(self, x: Array, omega: float, inputs: Inputs) -> Detail:
        """Forces, and heat if any, at unknowns (N,): the one place where element parameters meet the motion."""
        X, Y = self.split(x)
        given = {name: getattr(inputs, name) for name in ("kt", "mu", "kn", "gap")}
        W, v = X + inputs.U, inputs.velocity / omega
        if self.heated is None:
            return Detail(element_forces(self.harmonics, W, Y, v=v, **given), inputs, omega)
        heat = self.heated.forces(self.harmonics, W, Y, v=v, omega=omega, start=self.temperature, **given)
        return Detail(heat.forces, inputs, omega, heat)

    def residual(self, x: Array, forces: ContactForces, P: Array, compliance: Compliance) -> tuple[Array, ComplexArray]:
        """Residual (N,), and the forces on all columns as complex numbers (n_columns, n + 1)."""
        G = self.excitation(forces.Fx, forces.Fy, P)
        if self.springs is not None:
            G[: self.n_ports, 1:] += 1j * self.springs[:, None] * self.paired(x.reshape(self.n_ports, -1))[:, 1:]
        moved = np.add.reduce(compliance.value * G[:, None, :], axis=0)
        return x + self.real(moved), G

    def terms(self, x: Array, detail: Detail) -> Array:
        """Sizes (N,) of the terms whose sum each residual is: the motion, and ``|A| k`` times the motion and ``U``.

        ``k`` are the contact springs as far as they act: with the fractions of the period in stick and in contact.
        The stiffer they are, the more the forces cancel, and the more is seen of the rounding of the motion.
        """
        forces, source, at = detail.forces, detail.inputs if detail.heat is None else detail.heat, self.with_normal
        assert detail.compliance is not None
        stiffness = source.kt * forces.stick_fraction
        if at.size:
            stiffness[at] += source.mu[at] * source.kn[at] * forces.slip_fraction[at]
            stiffness = np.append(stiffness, source.kn[at] * (1.0 - forces.separation_fraction[at]))
        reach = np.abs(detail.compliance.value[: self.n_ports])
        motion = norm(x)
        sprung = (stiffness @ reach.reshape(self.n_ports, -1)) * (motion + norm(detail.inputs.U.reshape(-1)))
        by_order = motion + sprung.reshape(self.n_ports, -1)
        return np.concatenate([by_order[:, :1], np.repeat(by_order[:, 1:], 2, axis=1)], axis=1).reshape(-1)

    def excitation(self, Fx: Array, Fy: Array, P: Array) -> ComplexArray:
        """``F - P`` on all columns as complex numbers (n_columns, n + 1)."""
        c, p = self.n_contacts, self.n_ports
        G = np.zeros((p + len(P), 2 * self.orders.size + 2))
        G[:c, 2:], G[:c, 0] = Fx[:, 1:], Fx[:, 0]
        if p > c:
            chosen = Fy[self.with_normal]
            G[c:p, 2:], G[c:p, 0] = chosen[:, 1:], chosen[:, 0]
        if len(P):
            G[p:, 2:], G[p:, 0] = P[:, 1:], P[:, 0]
            np.negative(G[p:], out=G[p:])
        return G.view(complex)

    def paired(self, force: Array) -> ComplexArray:
        """Coefficients (rows, L) as complex numbers (rows, n + 1)."""
        out = np.zeros((len(force), 2 * self.orders.size + 2))
        out[:, 0], out[:, 2:] = force[:, 0], force[:, 1:]
        return out.view(complex)

    def real(self, z: ComplexArray) -> Array:
        """Complex numbers (rows, n + 1) as coefficients (rows * L,)."""
        pairs = z.view(float)
        out = np.empty((len(z), self.L))
        out[:, 0], out[:, 1:] = pairs[:, 0], pairs[:, 2:]
        return out.reshape(-1)

    def jacobian(self, xx: Array, xy: Array, yy: Array, compliance: Compliance) -> Array:
        """``I + A dF/dX`` (N, N) for tangents ``dFx/dX``, ``dFx/dY``, ``dFy/dY`` (n_contacts, L, L)."""
        c, p, B = self.n_contacts, self.n_ports, compliance.value
        if self.springs is not None:
            turned = np.zeros((p, self.L, self.L))
            turned[:, np.arange(2, self.L, 2), np.arange(1, self.L, 2)] = self.springs[:, None]
            turned[:, np.arange(1, self.L, 2), np.arange(2, self.L, 2)] = -self.springs[:, None]
            xx, yy = xx + turned[:c], yy.copy()
            yy[self.with_normal] += turned[c:]
        transposed = np.empty((p, self.L, p, self.L))
        self._fill(transposed[:c], self._complex_rows(xx), B[:c])
        if p > c:
            at = self.with_normal
            self._fill(transposed[c:], self._complex_rows(xy[at]), B[at], self._complex_rows(yy[at]), B[c:p])
        matrix = transposed.reshape(self.size, self.size)
        matrix.reshape(-1)[:: self.size + 1] += 1.0
        return matrix.T

    def _complex_rows(self, matrices: Array) -> ComplexArray:
        """Derivatives (c, L, L) with their rows paired: (c, column, n + 1)."""
        out = np.zeros((len(matrices), self.L, 2 * self.orders.size + 2))
        turned = matrices.transpose(0, 2, 1)
        out[:, :, 0], out[:, :, 2:] = turned[:, :, 0], turned[:, :, 1:]
        return out.view(complex)

    @staticmethod
    def _fill(target: Array, z: ComplexArray, B: ComplexArray, z2: Any = None, B2: Any = None) -> None:
        moved = z[:, :, None, :] * B[:, None, : target.shape[2], :]
        if z2 is not None:
            moved += z2[:, :, None, :] * B2[:, None, : target.shape[2], :]
        pairs = moved.view(float)
        target[..., 0], target[..., 1:] = pairs[..., 0], pairs[..., 2:]

    def moved_by(self, dFx: Array, dFy: Array, dP: Array, compliance: Compliance) -> Array:
        """``A (dF - dP)`` (N,)."""
        return self.real(np.add.reduce(compliance.value * self.excitation(dFx, dFy, dP)[:, None, :], axis=0))

    def force_rates(self, forces: ContactForces, dx: Array) -> tuple[Array, Array]:
        """Change of Fx, Fy (n_contacts, L) for a change ``dx`` (N,) of the motion at fixed temperatures."""
        dX, dY = self.split(dx)
        dFx = np.einsum("cij,cj->ci", forces.dFx_dX, dX) + np.einsum("cij,cj->ci", forces.dFx_dY, dY)
        return dFx, np.einsum("cij,cj->ci", forces.dFy_dY, dY)

    def add_heat(self, dFx: Array, dFy: Array, heat: HeatedForces, dx: Array, dpower: Array) -> None:
        """Add what the temperatures do, for a change ``dx`` of the motion and ``dpower`` (n_contacts,) besides."""
        dT = heat.tangent.gain @ (power_rows(self, heat) @ dx + dpower)
        dFx += dT[:, None] * heat.tangent.dFx_dT
        dFy += dT[:, None] * heat.tangent.dFy_dT

    def omega_derivative(
        self, forces: ContactForces, G: ComplexArray, inputs: Inputs, at: Compliance, w: float
    ) -> Array:
        """``dR/domega`` (N,): ``(dA/domega) (F - P) + A dF/domega`` at constant rubbing velocity."""
        z = np.add.reduce(at.slope * G[:, None, :], axis=0)
        if inputs.velocity.any():
            slope = (-inputs.velocity / (w * w))[:, None] * forces.dFx_dv
            z += np.add.reduce(at.value[: self.n_contacts] * self.paired(slope)[:, None, :], axis=0)
        return self.real(z)


def _undefined(size: int) -> Evaluation:
    """What a system answers to an iterate that is no motion: the iteration takes a shorter step."""
    return Evaluation(np.full(size, np.nan), np.eye(size), np.full(size, np.nan))


class FrequencySystem:
    """The balance as a system in omega: what the continuation follows."""

    def __init__(self, balance: Balance, inputs: Inputs) -> None:
        self.balance, self.inputs = balance, inputs

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.inputs, parameter

    def evaluate(self, x: Array, parameter: float) -> Evaluation:
        """Residual, Jacobian and derivative by omega at ``parameter`` = omega; nan where the motion is not finite and
        where the thermal equilibrium near ``balance.temperature`` has vanished."""
        if not (isfinite(x.dot(x)) and 0.0 < parameter < inf):
            return _undefined(x.size)
        balance, inputs = self.balance, self.inputs
        compliance = balance.compliance(parameter)
        detail = balance.detail(x, parameter, inputs)
        forces, heat = detail.forces, detail.heat
        if heat is not None and heat.lost:
            return _undefined(x.size)
        detail.compliance = compliance
        residual, G = balance.residual(x, forces, inputs.P, compliance)
        jacobian = balance.jacobian(forces.dFx_dX, forces.dFx_dY, forces.dFy_dY, compliance)
        slope = balance.omega_derivative(forces, G, inputs, compliance, parameter)
        if heat is not None:
            columns = heat_columns(balance, heat, compliance)
            jacobian += columns @ power_rows(balance, heat)
            slope += columns @ heat.power.omega
        return Evaluation(residual, jacobian, slope, detail, lambda: balance.terms(x, detail))

    def rates(self, detail: Detail, dx: Array, rate: float) -> tuple[Array, Array, Array]:
        """Change of Fx, Fy (n_contacts, L) and of the loads for changes ``dx`` (N,) and ``rate`` of omega."""
        forces, velocity = detail.forces, detail.inputs.velocity
        dFx, dFy = self.balance.force_rates(forces, dx)
        dFx += (-rate * velocity / detail.omega**2)[:, None] * forces.dFx_dv
        if detail.heat is not None:
            self.balance.add_heat(dFx, dFy, detail.heat, dx, rate * detail.heat.power.omega)
        return dFx, dFy, np.zeros_like(detail.inputs.P)


class ParameterSystem:
    """The balance at a fixed frequency as a system in a parameter: inputs are ``base + parameter * direction``."""

    def __init__(self, balance: Balance, base: Inputs, direction: Inputs, omega: float) -> None:
        self.balance, self.base, self.direction, self.omega = balance, base, direction, omega
        self._compliance = balance.compliance(omega)
        self._moving = {name for name, value in vars(direction).items() if np.any(value)}

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs and frequency at ``parameter``."""
        return self.base.moved(self.direction, parameter), self.omega

    def evaluate(self, x: Array, parameter: float) -> Evaluation:
        """Residual, Jacobian and derivative by the parameter; nan as in a ``FrequencySystem``."""
        if not (isfinite(x.dot(x)) and isfinite(parameter)):
            return _undefined(x.size)
        balance, compliance = self.balance, self._compliance
        inputs = self.base.moved(self.direction, parameter)
        detail = balance.detail(x, self.omega, inputs)
        forces, heat, direction = detail.forces, detail.heat, self.direction
        if heat is not None and heat.lost:
            return _undefined(x.size)
        if balance.heated is not None and heat is not None:
            direction = warm_direction(balance.heated, heat, direction)
        detail.compliance = compliance
        residual, _ = balance.residual(x, forces, inputs.P, compliance)
        jacobian = balance.jacobian(forces.dFx_dX, forces.dFx_dY, forces.dFy_dY, compliance)
        slope = balance.moved_by(*self.force_derivatives(forces, direction), direction.P, compliance)
        if heat is not None:
            columns = heat_columns(balance, heat, compliance)
            jacobian += columns @ power_rows(balance, heat)
            slope += columns @ power_along(heat, direction)
        return Evaluation(residual, jacobian, slope, detail, lambda: balance.terms(x, detail))

    def rates(self, detail: Detail, dx: Array, rate: float) -> tuple[Array, Array, Array]:
        """Change of Fx, Fy (n_contacts, L) and of the loads for changes ``dx`` (N,) and ``rate`` of the parameter."""
        forces, heat, direction = detail.forces, detail.heat, self.direction
        if self.balance.heated is not None and heat is not None:
            direction = warm_direction(self.balance.heated, heat, direction)
        dFx, dFy = self.balance.force_rates(forces, dx)
        by_parameter = self.force_derivatives(forces, direction)
        dFx, dFy = dFx + rate * by_parameter[0], dFy + rate * by_parameter[1]
        if heat is not None:
            self.balance.add_heat(dFx, dFy, heat, dx, rate * power_along(heat, direction))
        return dFx, dFy, rate * direction.P

    def force_derivatives(self, forces: ContactForces, d: Inputs) -> tuple[Array, Array]:
        """Derivatives of the contact forces (n_contacts, L) along a direction in the inputs at fixed motion."""
        dFx, dFy = np.zeros_like(forces.Fx), np.zeros_like(forces.Fy)
        if "velocity" in self._moving:
            dFx += (d.velocity / self.omega)[:, None] * forces.dFx_dv
        for name in self._moving & {"kt", "mu", "kn", "gap"}:
            dFx += getattr(d, name)[:, None] * getattr(forces, f"dFx_d{name}")
        for name in self._moving & {"kn", "gap"}:
            dFy += getattr(d, name)[:, None] * getattr(forces, f"dFy_d{name}")
        if "U" in self._moving:
            dFx += np.einsum("cij,cj->ci", forces.dFx_dX, d.U)
        return dFx, dFy
