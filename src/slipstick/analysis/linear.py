"""Linear references of a response curve: without the contacts, and with all of them stuck."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.balance.ports import Balance
from slipstick.balance.preflight import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, Outcome
from slipstick.faults import Gathering, frequency, in_radians, numbers, one, shown, wrong
from slipstick.results.branch import Branch
from slipstick.results.measures import amplitude
from slipstick.results.record import Outputs
from slipstick.results.schema import attributes_of, layout_of, make_table
from slipstick.typing import Array, FrequencyList
from slipstick.units import Units


def linear_response(problem: Problem, *, omega: FrequencyList, state: str = "free") -> Branch:
    """Linear response at given frequencies, as a reference for the nonlinear one.

    Parameters
    ----------
    omega
        Fundamental frequencies (n,), rad/s.
    state
        "free": without the contacts. "stuck": every friction contact that is closed at rest holds by kt and kn and
        follows the periodic rubbing motion; a constant rubbing velocity has no meaning there and is left out. Other
        laws act with their stiffness at rest.

    Returns
    -------
    Branch
        A dataset of omega, displacement, amplitude and mean; ``peaks`` are the largest among the frequencies given.

    Raises
    ------
    InputError
        For another state, or frequencies that are not positive.

    Warns
    -----
    SlipstickWarning
        As :func:`forced_response`.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> problem = ss.Problem(structure, loads=[ss.Load(dof="x", sin=100.0)], harmonics=[0, 1])
    >>> linear_response(problem, omega=[6.3182]).dataset["amplitude"].values.round(3).tolist()
    [[39.548]]
    """
    found = Gathering()
    found.take(one, "problem", problem, Problem, "an ss.Problem")
    w = found.take(_frequencies, omega, problem.units if isinstance(problem, Problem) else None)
    if not isinstance(state, str) or state not in ("free", "stuck"):
        found.faults.append(Fault("state", found=shown(state), expected='"free" or "stuck"'))
    found.end()
    assert w is not None
    limit = LinearLimit(Balance(problem), state)
    warnings = problem_warnings(problem, (w.min(), w.max()), limit.balance.receptance.static)
    problem.warn(warnings)
    return limit.branch(w, limit.motion(w), warnings)


def _frequencies(given: Any, units: Units | None) -> Array:
    expected = "frequencies > 0 in rad/s, one or a list"
    if isinstance(given, str):
        given = frequency("omega", given, units)
    elif isinstance(given, list | tuple):
        given = [in_radians(("omega", i), value, units) for i, value in enumerate(given)]
    w = np.atleast_1d(numbers("omega", given, expected))
    if w.ndim > 1 or w.size == 0 or np.any(w <= 0):
        raise wrong("omega", given, expected)
    return w


class LinearLimit:
    """The linear system of a problem, "free" or "stuck", made ready for any frequencies."""

    def __init__(self, balance: Balance, state: str) -> None:
        self.balance, self.state, self._P = balance, state, balance.problem.inputs.P
        self._outputs = Outputs(balance, balance.problem.outputs or ())
        self._stiffness, self._constant = _held(balance, balance.problem.inputs, state)

    def motion(self, w: Array) -> Array:
        """Coefficients of the outputs (n, n_outputs, L) at frequencies (n,)."""
        balance = self.balance
        x = np.empty((w.size, balance.n_ports, balance.L))
        slices = max(1, int(2e6 / max(1, balance.orders.size * balance.receptance.static.size)))
        for first in range(0, w.size, slices):
            chosen = slice(first, first + slices)
            x[chosen] = _ports(balance, w[chosen], self._stiffness, self._constant, self._P)
        force = np.einsum("pq,nql->npl", self._stiffness, x) + self._constant
        P = np.broadcast_to(self._P, (w.size, *self._P.shape))
        return self._outputs.motion(x.reshape(w.size, -1), force, P, w, [{}] * w.size)

    def branch(self, w: Array, motion: Array, warnings: Sequence[str] = ()) -> Branch:
        """The branch of frequencies (n,) and motion (n, n_outputs, L)."""
        problem = self.balance.problem
        values = {
            "omega": w,
            "displacement": motion,
            "amplitude": amplitude(problem.harmonics, motion).value,
            "mean": motion[:, :, 0],
        }
        attributes = attributes_of(problem, Outcome.COMPLETED, f"linear response, contacts {self.state}", warnings)
        layout = layout_of(problem, only=tuple(values))
        return Branch(make_table(layout, values, attributes), Outcome.COMPLETED, problem)


def _held(balance: Balance, inputs: Inputs, state: str) -> tuple[Array, Array]:
    """Stiffness (n_ports, n_ports) and force at rest (n_ports, L) of all contacts held in one state."""
    stiffness, constant = np.zeros((balance.n_ports, balance.n_ports)), np.zeros((balance.n_ports, balance.L))
    for batch, given in zip(balance.batches, inputs.batches, strict=True):
        held = batch.law.linear(state, given.values, np.zeros_like(given.velocity))
        if held is None:
            continue
        rows = np.full((len(batch.ports), batch.count), -1)
        for i, port in enumerate(batch.ports):
            rows[i, port.members] = np.arange(balance.n_ports)[port.rows]
        for (i, j), k in held.stiffness.items():
            both = (rows[i] >= 0) & (rows[j] >= 0)
            stiffness[rows[i, both], rows[j, both]] += k[both]
            constant[rows[i, rows[i] >= 0]] += (k[:, None] * given.motion[j])[rows[i] >= 0]
        for i, c in held.constant.items():
            constant[rows[i, rows[i] >= 0], 0] += c[rows[i] >= 0]
    return stiffness, constant


def _ports(balance: Balance, w: Array, stiffness: Array, c: Array, P: Array) -> Array:
    """Motion of the ports (n, n_ports, L) with springs and constant forces c (n_ports, L): harmonics are apart."""
    p = balance.n_ports
    unit, x = np.eye(p), np.empty((w.size, p, balance.L))
    push = np.concatenate([-c, P])
    static = balance.receptance.static
    x[:, :, 0] = np.linalg.solve(unit + static[:, :p] @ stiffness, static @ push[:, 0])
    if balance.orders.size:
        A = balance.receptance.at(balance.orders, w)[0]
        hat = (push[:, 1::2] - 1j * push[:, 2::2]).T[:, :, None]
        moved = np.linalg.solve(unit + A[..., :p] @ stiffness, A @ hat)[..., 0].transpose(0, 2, 1)
        x[:, :, 1::2], x[:, :, 2::2] = moved.real, -moved.imag
    return x
