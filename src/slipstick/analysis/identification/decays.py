"""Free decays fitted in time: the motion from an initial state, which is found with the parameters.

Measured motion less simulated one is the residual. The initial state ``s`` (motion, velocity and memory of the contacts
at the first sample) is found along: at any parameters it is that which fits best, by Gauss and Newton, and derivatives
by the parameters are those at the best initial state, ``J_p - J_s J_s^+ J_p`` (variable projection: L. Kaufman, BIT 15,
1975, 49-57); the covariance from them is the one of the parameters alone. Derivatives are differences of motions that
are integrated side by side with the same steps (``LSODA`` of scipy), so that those have no part in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from slipstick.analysis.identification.kinds import Decay
from slipstick.analysis.time_domain.law_in_time import LawInTime
from slipstick.analysis.time_domain.piecewise import FrictionSystem, PiecewiseLinear
from slipstick.analysis.time_domain.piecewise_model import friction_system, sticks_and_slips
from slipstick.balance.problem import Problem
from slipstick.errors import InputError
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

_MOST_UNKNOWNS = 24
"""Largest size of an initial state."""
_RELATIVE = 1e-11
"""Relative tolerance of the integration."""
_STEP = 1e-6
"""Relative step of differences."""
_NEAR = 1e-3
"""Relative change of the motion up to which it is linear in a change of the initial state; at the end it is 0."""
_MOST_RATES = 5_000
"""Evaluations of the rate in a period, above which the motion is too fast to be the measured one."""
_MOST = 6
"""Largest number of corrections of the initial state."""
_KNOWN = 1e-6
"""Singular value over the largest one, up to which a component of the initial state is not corrected."""


def decay_of(problem: Problem, data: xarray.Dataset, dof: str, omega: float) -> Decay | None:
    """The decay in a dataset over ``time``; None where the motion of the problem cannot be simulated here.

    Contacts of laws that tell a rate, that neither switch nor stick and slip, and no more than 24 numbers in the state.
    """
    if not _simulated(problem):
        return None
    time = np.asarray(data["time"].values, dtype=float)
    noise = None
    if "noise" in data:
        noise = np.broadcast_to(np.asarray(data["noise"].values, dtype=float).reshape(-1), time.shape)
    x = np.asarray(data["displacement"].values, dtype=float).reshape(-1)
    return Decay(time=time - time[0], dof=dof, values=x, noise=noise, omega=omega)


def _simulated(problem: Problem) -> bool:
    laws = [pair.contact for pair in problem.contacts]
    if any(sticks_and_slips(law) or law.regimes is not None or not law.in_time for law in laws):
        return False
    if problem.contact_states or problem.structure.tied:
        return False
    try:
        model = _model(problem, (problem.outputs or problem.structure.dofs)[0])
    except InputError:
        return False
    return model.system.n_dynamic <= _MOST_UNKNOWNS and not np.any(model.system.law_motion[:, 1:])


def _model(problem: Problem, dof: str) -> PiecewiseLinear:
    """The equations in time, with output ``dof``; the decay has no vibrating loads."""
    still = [load for load in problem.loads if load.harmonic == 0]
    return PiecewiseLinear(friction_system(replace(problem, loads=still, outputs=[dof], told=None), 1.0))


class _TooFastError(Exception):
    """The motion needs more steps than a measured one can."""


class _SideBySide:
    """Copies of a problem with different values of parameters, integrated together."""

    def __init__(self, problems: Sequence[Problem], dof: str) -> None:
        models = [_model(problem, dof) for problem in problems]
        self.system: FrictionSystem = models[0].system
        one = self.system.n_dynamic
        linear = [model(()) for model in models]
        self._A = np.array([piece.A[:one, :one] for piece in linear])
        self._constant = np.array([piece.A[:one, one] for piece in linear])
        self._row = linear[0].motion[-1]
        self._laws: list[tuple[LawInTime, dict[str, Array], slice, slice]] = []
        if self.system.laws:
            self._rows = np.array([[piece.law_rows, piece.law_speed] for piece in linear])
            self._columns = np.array([piece.law_columns[:one] for piece in linear])
            for k, (law, ports, kept, _) in enumerate(self.system.laws.each):
                own = [model.system.laws.each[k][0].values for model in models]
                values = {name: np.concatenate([each[name] for each in own], axis=1) for name in law.values}
                self._laws.append((law, values, ports, kept))

    def rate(self, z: Array) -> Array:
        """``dz/dt`` of states (copies, N)."""
        one, memory = self.system.n_dynamic, self.system.memory
        out = np.einsum("cij,cj->ci", self._A, z) + self._constant
        if self._laws:
            moved = np.einsum("cmpj,cj->mpc", self._rows[..., :one], z) + self._rows[..., one].transpose(1, 2, 0)
            forces = np.empty(moved.shape[1:])
            for law, values, ports, kept in self._laws:
                p, m, n = law.shape
                q, velocity = (moved[k, ports].reshape(p, n, -1) for k in (0, 1))
                remembered = z[:, memory][:, kept].T.reshape(m, n, -1)
                told = law.law.rate(q, velocity, remembered, values)
                assert told is not None
                forces[ports] = np.reshape(told[0], (p * n, -1))
                out[:, memory.start + kept.start : memory.start + kept.stop] += np.reshape(told[1], (m * n, -1)).T
            out += np.einsum("cip,pc->ci", self._columns, forces)
        return out

    def sizes(self, length: float, omega: float) -> Array:
        """What the numbers of a state are beside (N,), of a motion of a length at a frequency."""
        s = self.system
        out = np.full(s.n_dynamic, length)
        out[s.n : 2 * s.n] *= omega
        z = np.zeros((len(self._A), s.n_dynamic))
        z[:, s.n : 2 * s.n] = length * omega
        memory = np.abs(self.rate(z) - self.rate(0.0 * z))[0, s.memory] / omega
        out[s.memory] = np.where(memory > 0.0, memory, 1.0)
        return out

    def motion(self, starts: Array, time: Array, sizes: Array, omega: float) -> Array | None:
        """The output (copies, n) from states (copies, N) on; None where it cannot be integrated."""
        from scipy.integrate import solve_ivp

        shape, asked = starts.shape, count()
        most = _MOST_RATES * (1.0 + omega * float(time[-1]) / (2.0 * np.pi))

        def rate(_: float, z: Array) -> Array:
            if next(asked) > most:
                raise _TooFastError
            return self.rate(z.reshape(shape)).ravel()

        with np.errstate(all="ignore"), suppress(_TooFastError):
            found = solve_ivp(
                rate, (0.0, float(time[-1])), starts.ravel(), "LSODA",
                time, rtol=_RELATIVE, atol=np.tile(0.1 * _RELATIVE * sizes, shape[0]),
            )  # fmt: skip
            if found.success and np.all(np.isfinite(found.y)):
                one, z = self.system.n_dynamic, found.y.reshape(*shape, -1)
                return np.asarray(np.einsum("j,cjt->ct", self._row[:one], z) + self._row[one])
        return None


class DecayPredictor:
    """Predicts a measured decay, from the initial state that fits it best."""

    several = 0

    def __init__(self, problem: Problem, names: Sequence[str], measured: Decay) -> None:
        self.problem, self.names, self.measured = replace(problem, told=None), tuple(names), measured
        self.solved = 0
        self._used = np.isfinite(measured.values)
        self._weight = np.ones(measured.time.shape) if measured.noise is None else 1.0 / measured.noise
        self._kept: tuple[Array, Array, Array] | None = None
        """Last parameters, their initial state, and its derivatives (N, n_p)."""
        self._slopes: Array = np.empty(0)

    def begin(self, p: Array) -> bool:
        """False: there is only one motion."""
        return False

    def values(self, p: Array) -> Array:
        """Displacements (n,); nan where there is no motion."""
        nothing, size = np.full(self.measured.time.shape, np.nan), float(np.nanmax(np.abs(self.measured.values)))
        steps = _STEP * np.where(p != 0.0, np.abs(p), 1.0)
        problems = [self._at(p), *(self._at(p + step * one) for step, one in zip(steps, np.eye(len(p)), strict=True))]
        unknowns = _model(problems[0], self.measured.dof).system.n_dynamic
        copies = _SideBySide([problems[0]] * (1 + unknowns) + problems[1:], self.measured.dof)
        sizes = copies.sizes(size, self.measured.omega)
        s = self._first(copies) if self._kept is None else self._kept[1] + self._kept[2] @ (p - self._kept[0])
        weight, best, damping = self._weight[self._used], np.inf, 1.0
        step = np.zeros(unknowns)
        for _ in range(_MOST):
            starts = np.vstack([s, s + np.diag(_STEP * sizes), np.tile(s, (len(p), 1))])
            self.solved += 1
            found = copies.motion(starts, self.measured.time, sizes, self.measured.omega)
            if found is None:
                return nothing
            x, by_state = found[0], ((found[1 : 1 + unknowns] - found[0]) / _STEP).T
            by_p = ((found[1 + unknowns :] - found[0]) / steps[:, None]).T
            left = (self.measured.values - x)[self._used] * weight
            cost = float(left @ left)
            if cost > 4.0 * best and damping > 1e-3:  # too large: halve the step
                damping *= 0.5
                s = s - damping * step * sizes
                continue
            J = by_state[self._used] * weight[:, None]
            best, damping = min(best, cost), 1.0
            step = np.linalg.lstsq(J, left, rcond=_KNOWN)[0]
            s = s + step * sizes
            if np.linalg.norm(J @ step) <= _NEAR * np.linalg.norm(self.measured.values[self._used] * weight):
                break
        follows = -np.linalg.lstsq(J, by_p[self._used] * weight[:, None], rcond=_KNOWN)[0]
        self._slopes = (by_p + by_state @ follows).T
        self._kept = p.copy(), s, sizes[:, None] * follows
        return np.asarray(x + by_state @ step)

    def slopes(self, p: Array) -> Array:
        """Derivatives (n_p, n) of the displacements."""
        return self._slopes

    def _at(self, p: Array) -> Problem:
        return self.problem.at_parameters(dict(zip(self.names, p, strict=True)))

    def _first(self, copies: _SideBySide) -> Array:
        """First initial state: the linear mode nearest in frequency, with measured displacement and velocity."""
        s, omega = copies.system, self.measured.omega
        A = copies._A[0]
        rates, shapes = np.linalg.eig(A[: 2 * s.n, : 2 * s.n])
        shape = shapes[: s.n, int(np.argmin(np.abs(np.abs(rates) - omega)))].real
        seen = float(copies._row[: s.n] @ shape)
        early = self._used & (self.measured.time <= 1.0 / omega)
        if early.sum() < 4:
            early = self._used & (np.cumsum(self._used) <= 4)
        fit = np.polynomial.Polynomial.fit(self.measured.time[early], self.measured.values[early], 3).convert()
        out = np.zeros(s.n_dynamic)
        if abs(seen) > 1e-6 * np.abs(shape).max():
            out[: s.n], out[s.n : 2 * s.n] = fit.coef[0] * shape / seen, fit.coef[1] * shape / seen
        return out
