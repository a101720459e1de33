"""Linear references of a response curve: without the contacts, and with all of them stuck."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from slipstick.balance.problem import Problem
from slipstick.balance.residual import Balance, Inputs, inputs_of
from slipstick.balance.scaling import linear_motions
from slipstick.errors import InputError, Outcome
from slipstick.results.branch import Branch, attributes_of
from slipstick.results.measures import amplitude
from slipstick.results.record import VARIABLES, Outputs

Array = NDArray[np.float64]


def linear_response(problem: Problem, *, omega: ArrayLike, state: str = "free") -> Branch:
    """Linear response at given frequencies, as a reference for the nonlinear one.

    Parameters
    ----------
    omega
        Principal frequencies (n,), rad/s.
    state
        "free": without the contacts. "stuck": every contact that is closed at rest holds by kt and kn and follows the
        periodic rubbing motion; a constant rubbing velocity has no meaning there and is left out.

    Returns
    -------
    Branch
        A dataset of omega, displacement, amplitude and mean.

    Raises
    ------
    InputError
        For another state, or frequencies that are not positive.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> problem = ss.Problem(structure, loads=[ss.Load(dof="x", sin=100.0)], harmonics=[0, 1])
    >>> linear_response(problem, omega=[6.3182]).dataset["amplitude"].values.round(3).tolist()
    [[39.548]]
    """
    w = np.atleast_1d(np.asarray(omega, dtype=float))
    faults = [] if np.all(np.isfinite(w) & (w > 0)) else ["omega: found a value not > 0; expected frequencies in rad/s"]
    if state not in ("free", "stuck"):
        faults.append(f'state: found "{state}"; expected "free" or "stuck"')
    if faults:
        raise InputError(faults)
    balance, inputs = Balance(problem), inputs_of(problem)
    return _branch(problem, w, _motion(balance, inputs, w, state), state)


def _motion(balance: Balance, inputs: Inputs, w: Array, state: str) -> Array:
    """Coefficients of the outputs (n, n_outputs, L)."""
    outputs = Outputs(balance, balance.problem.outputs or ())
    x = np.zeros((w.size, balance.size))
    Fx, Fy = np.zeros((2, w.size, balance.n_contacts, balance.L))
    for i, each in enumerate(w if balance.size else ()):
        x[i] = linear_motions(balance, inputs, balance.compliance(float(each)))[state]
    if state == "stuck" and balance.size:
        X, Y = balance.split(x)
        closed = inputs.gap < 0
        Fx = (inputs.kt * closed)[:, None] * (X + inputs.U)
        Y[..., 0] -= inputs.gap
        Fy = (inputs.kn * closed)[:, None] * Y
    return outputs.motion(x, Fx, Fy, np.broadcast_to(inputs.P, (w.size, *inputs.P.shape)), w)


def _branch(problem: Problem, w: Array, motion: Array, state: str) -> Branch:
    import xarray

    names = ("omega", "displacement", "amplitude", "mean")
    values = (w, motion, amplitude(problem.harmonics, motion).value, motion[:, :, 0])
    data = {}
    for name, value in zip(names, values, strict=True):
        dims, units, text = VARIABLES[name]
        data[name] = (("point", *dims), value, {"units": units, "long_name": text})
    coords = {
        "point": np.arange(w.size),
        "dof": list(problem.outputs or ()),
        "coefficient": list(problem.harmonics.labels),
    }
    attributes = attributes_of(problem, Outcome.COMPLETED, f"linear response, contacts {state}")
    return Branch(xarray.Dataset(data, coords=coords, attrs=attributes), Outcome.COMPLETED, problem)
