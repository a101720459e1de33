"""From points of a branch to named numbers: which variables there are, what they mean, and their values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipstick.balance.residual import Balance, Compliance, Detail, FrequencySystem, Inputs, ParameterSystem
from slipstick.contact.forces import ContactForces
from slipstick.results.measures import amplitude
from slipstick.results.truncation import moved, truncation

Array = NDArray[np.float64]

KINDS = ("start", "regular", "peak", "turning point", "requested", "end")

VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "omega": ((), "rad/s", "principal frequency"),
    "excitation_frequency": ((), "rad/s", "excitation frequency"),
    "parameter": ((), "1", "followed parameter"),
    "displacement": (("dof", "coefficient"), "length", "displacement coefficients"),
    "amplitude": (("dof",), "length", "amplitude (0-to-peak, without the zero harmonic)"),
    "mean": (("dof",), "length", "zero harmonic"),
    "dissipated_power": (("contact",), "force length/time", "dissipated power"),
    "friction_coefficient": (("contact",), "1", "friction coefficient"),
    "temperature": (("contact",), "temperature", "contact temperature"),
    "stick_fraction": (("contact",), "1", "fraction of the period in stick"),
    "slip_fraction": (("contact",), "1", "fraction of the period in slip"),
    "separation_fraction": (("contact",), "1", "fraction of the period in separation"),
    "residual_traction": (("contact", "bound"), "force", "interval of admissible mean friction forces"),
    "contact_tangential": (("contact", "coefficient"), "length", "tangential relative motion coefficients"),
    "contact_normal": (("contact", "coefficient"), "length", "normal relative motion coefficients"),
    "friction_force": (("contact", "coefficient"), "force", "friction force coefficients"),
    "normal_force": (("contact", "coefficient"), "force", "normal force coefficients"),
    "rubbing_velocity": (("contact",), "length/time", "constant rubbing velocity"),
    "rubbing_motion": (("contact", "coefficient"), "length", "periodic rubbing motion coefficients"),
    "tangential_stiffness": (("contact",), "force/length", "tangential contact stiffness"),
    "normal_stiffness": (("contact",), "force/length", "normal contact stiffness"),
    "gap": (("contact",), "length", "gap, negative for interference"),
    "truncation": ((), "1", "estimate of what the harmonics left out would add, relative to the largest amplitude"),
    "residual": (
        (),
        "1",
        "residual of the balance over the sizes of its terms: of the motion and of the contact springs' part in it",
    ),
    "newton_iterations": ((), "1", "Newton corrections"),
    "kind_code": ((), "1", "kind of point: " + ", ".join(f"{i} {name}" for i, name in enumerate(KINDS))),
    "part": ((), "1", "part of the branch: 1, or 2 where it was also followed from the other end of the range"),
    "peak_dof": ((), "1", "index of the dof whose amplitude peaks here, -1 for none"),
}
"""Dimensions after ``point``, units and long name of every variable. Units are the user's own consistent system."""

DIMENSIONS = {
    "point": "number along the branch",
    "dof": "degree of freedom",
    "coefficient": "harmonic coefficient",
    "contact": "contact",
    "bound": "lower and upper bound",
}


@dataclass(frozen=True, kw_only=True)
class Point:
    """A point of a branch: the solution and what was measured on its contacts."""

    omega: float
    parameter: float
    """Value of the followed quantity: the frequency itself or the named parameter."""
    kind: str
    """One of ``KINDS``."""
    peak_of: str
    """Name of the dof whose amplitude peaks here, else empty."""
    x: Array
    """Unknowns of the balance (N,)."""
    forces: ContactForces
    inputs: Inputs
    parameters: Mapping[str, Array]
    """mu, kt, kn (n_contacts,) as they act here, and "temperature" where contacts are heated."""
    iterations: int
    residual: float
    """Relative to the sizes of its terms."""
    part: int = 1
    """Number of the part of the branch: 2 where it was also followed from the other end."""

    @classmethod
    def at(cls, detail: Detail, *, x: Array, residual: float, iterations: int, kind: str, **names: object) -> Point:
        """From the evaluation at a solution."""
        heat = detail.heat
        source = heat if heat is not None else detail.inputs
        parameters = {name: getattr(source, name) for name in ("mu", "kt", "kn")}
        if heat is not None:
            parameters["temperature"] = heat.temperature
        return cls(
            parameters=parameters,
            omega=detail.omega,
            x=x,
            kind=kind,
            forces=detail.forces,
            inputs=detail.inputs,
            iterations=iterations,
            residual=residual,
            **names,  # type: ignore[arg-type]
        )


class Outputs:
    """Motion of the output dofs from the motion of the contacts and the forces.

    A dof that is a contact port itself needs no receptance. All others are computed by the receptance from forces.
    """

    def __init__(self, balance: Balance, names: Sequence[str]) -> None:
        self.balance, self.names = balance, tuple(names)
        wanted = balance.problem.direction_matrix({name: 1.0} for name in names)
        self._ports = [_same_direction(balance.directions, column) for column in wanted.T]
        self._far = [i for i, port in enumerate(self._ports) if port is None]
        self.receptance = balance.rows_to(wanted[:, self._far]) if self._far else None

    def __len__(self) -> int:
        return len(self.names)

    def motion(self, x: Array, Fx: Array, Fy: Array, P: Array, omega: Array) -> Array:
        """Coefficients (n, n_outputs, L) of n points: x (n, N), forces (n, n_contacts, L), loads (n, n_loads, L)."""
        b = self.balance
        X = x.reshape(len(x), b.n_ports, b.L)
        out = np.empty((len(x), len(self), b.L))
        for i, port in enumerate(self._ports):
            if port is not None:
                out[:, i] = X[:, port[0]] / port[1]
        if self._far:
            near = np.concatenate([Fx, Fy[:, b.with_normal], -P], axis=1)
            out[:, self._far] = self._answer(near, omega)
        return out

    def motion_along(self, step: Any, system: FrequencySystem | ParameterSystem) -> tuple[Array, Array]:
        """Motion of the outputs at a step and its derivative along the branch, both (n_outputs, L)."""
        b, tangent, detail = self.balance, step.tangent, step.evaluation.detail
        X, dX = step.x.reshape(b.n_ports, b.L), tangent[:-1].reshape(b.n_ports, b.L)
        motion, change = np.empty((len(self), b.L)), np.empty((len(self), b.L))
        for i, port in enumerate(self._ports):
            if port is not None:
                motion[i], change[i] = X[port[0]] / port[1], dX[port[0]] / port[1]
        if self._far:
            rate = float(tangent[-1])
            G = b.excitation(detail.forces.Fx, detail.forces.Fy, detail.inputs.P)
            dG = b.excitation(*system.rates(detail, tangent[:-1], rate))
            at = Compliance(self.receptance, b.orders, detail.omega)
            rates = np.add.reduce(at.value * dG[:, None, :], axis=0)
            if isinstance(system, FrequencySystem):
                rates += rate * np.add.reduce(at.slope * G[:, None, :], axis=0)
            motion[self._far] = -b.real(np.add.reduce(at.value * G[:, None, :], axis=0)).reshape(-1, b.L)
            change[self._far] = -b.real(rates).reshape(-1, b.L)
        return motion, change

    def _answer(self, G: Array, omega: Array) -> Array:
        """``-A G`` (n, n_far, L) for forces less loads ``G`` (n, n_columns, L)."""
        assert self.receptance is not None
        out = moved(self.receptance, self.balance.orders, G[:, :, 1:], omega)
        out[:, :, 0] = -(G[:, :, 0] @ self.receptance.static.T)
        return out


def _same_direction(directions: Array, wanted: Array) -> tuple[int, float] | None:
    """Port along which a dof moves, and its cosine."""
    at = int(np.argmax(wanted))
    for port, column in enumerate(directions.T):
        if column[at] != 0 and np.count_nonzero(column) == 1:
            return port, float(column[at])
    return None


class Recorder:
    """Values of all variables at points of a problem's branch."""

    def __init__(self, balance: Balance, *, parameter: str = "") -> None:
        self.balance, self.parameter = balance, parameter
        self.outputs = Outputs(balance, balance.problem.outputs or ())

    @property
    def labels(self) -> dict[str, tuple[str, ...]]:
        """Names along the dimensions other than ``point``."""
        problem = self.balance.problem
        return {
            "dof": tuple(problem.outputs or ()),
            "coefficient": problem.harmonics.labels,
            "contact": tuple(pair.name for pair in problem.contacts),
            "bound": ("lower", "upper"),
        }

    @property
    def variables(self) -> dict[str, tuple[str, ...]]:
        """Dimensions of each variable after ``point``."""
        return {name: dims for name, (dims, _, _) in VARIABLES.items() if self.parameter or name != "parameter"}

    @property
    def meanings(self) -> dict[str, tuple[str, str]]:
        """Units and long name of each variable and dimension."""
        found = {name: VARIABLES[name][1:] for name in self.variables} | {d: ("1", t) for d, t in DIMENSIONS.items()}
        if self.parameter:
            found["parameter"] = (_units(self.parameter), self.parameter)
        return found

    def values(self, points: Sequence[Point]) -> dict[str, Array]:
        """Every variable, (n_points, ...)."""
        b, forces = self.balance, [p.forces for p in points]
        x = _stack([p.x for p in points], (b.size,))
        omega = np.array([p.omega for p in points], dtype=float)
        of = {
            name: _stack([getattr(f, name) for f in forces], (b.n_contacts, *extra))
            for name, extra in _FORCES.items() | {("Fx", (b.L,)), ("Fy", (b.L,))}
        }
        given = {
            name: _stack([getattr(p.inputs, name) for p in points], (b.n_contacts,)) for name in ("velocity", "gap")
        }
        names = ("mu", "kt", "kn", *(("temperature",) if b.heated is not None else ()))
        given |= {name: _stack([p.parameters[name] for p in points], (b.n_contacts,)) for name in names}
        U = _stack([p.inputs.U for p in points], (b.n_contacts, b.L))
        P = _stack([p.inputs.P for p in points], (b.columns.shape[1] - b.n_ports + len(b.shapes), b.L))
        motion = self.outputs.motion(x, of["Fx"], of["Fy"], P, omega)
        X, Y = b.split(x)
        outputs = self.outputs.names
        found = {
            "omega": omega,
            "excitation_frequency": omega * b.problem.load_order,
            "parameter": np.array([p.parameter for p in points], dtype=float),
            "displacement": motion,
            "amplitude": amplitude(b.harmonics, motion).value,
            "mean": motion[:, :, 0],
            "dissipated_power": omega[:, None] * of["work"],
            "friction_coefficient": given["mu"],
            "temperature": given.get("temperature", np.full_like(given["mu"], np.nan)),
            "stick_fraction": of["stick_fraction"],
            "slip_fraction": of["slip_fraction"],
            "separation_fraction": of["separation_fraction"],
            "residual_traction": of["residual_traction"],
            "contact_tangential": X,
            "contact_normal": Y,
            "friction_force": of["Fx"],
            "normal_force": of["Fy"],
            "rubbing_velocity": given["velocity"],
            "rubbing_motion": U,
            "tangential_stiffness": given["kt"],
            "normal_stiffness": given["kn"],
            "gap": given["gap"],
            "truncation": truncation(self.outputs, x, motion, omega, U, given),
            "residual": np.array([p.residual for p in points], dtype=float),
            "newton_iterations": np.array([p.iterations for p in points], dtype=float),
            "kind_code": np.array([KINDS.index(p.kind) for p in points], dtype=float),
            "part": np.array([p.part for p in points], dtype=float),
            "peak_dof": np.array(
                [outputs.index(p.peak_of) if p.peak_of in outputs else -1 for p in points], dtype=float
            ),
        }
        return {name: found[name] for name in self.variables}

    def record(self, point: Point) -> Mapping[str, Array]:
        """Every variable of one point."""
        return {name: value[0] for name, value in self.values([point]).items()}


_FORCES: dict[str, tuple[int, ...]] = {
    "work": (),
    "stick_fraction": (),
    "slip_fraction": (),
    "separation_fraction": (),
    "residual_traction": (2,),
}


def _stack(arrays: Sequence[Array], shape: tuple[int, ...]) -> Array:
    return np.array(arrays, dtype=float).reshape(len(arrays), *shape)


def _units(parameter: str) -> str:
    kind = parameter.rpartition(".")[2]
    return {
        "velocity": "length/time",
        "kt": "force/length",
        "kn": "force/length",
        "gap": "length",
        "normal_load": "force",
    }.get(kind, "1")
