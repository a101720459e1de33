"""What tolerances of parameters do to amplitudes, to first order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, number, shown, wrong
from slipstick.results.sensitivities import parameter_names
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions

DEFAULT = 0.1
"""Default tolerance of a parameter, as a share of its value."""


class Band(NamedTuple):
    """Smallest and largest amplitudes (point,) with all tolerances at their worst."""

    low: Array
    high: Array


class Bar(NamedTuple):
    """Effect of the tolerance of one parameter on the amplitude at a point."""

    name: str
    share: float
    change: float
    """Change of the amplitude for ``+ share`` of the value."""


def checked_tolerances(problem: Problem, tolerances: Any) -> dict[str, float]:
    """Shares by name of parameter, such as ``{"damper.mu": 0.2}`` for 20 % up and down.

    Raises
    ------
    InputError
        For a value that is no share, an unknown name, and a parameter that is 0.
    """
    if not isinstance(tolerances, Mapping) or not tolerances:
        raise wrong("tolerances", tolerances, 'shares by name of parameter such as {"damper.mu": 0.2}')
    parameter_names(problem, list(tolerances))
    checks, shares = Gathering(), {}
    for name, share in tolerances.items():
        shares[str(name)] = checks.take(number, ("tolerances", name), share, "a share >= 0 such as 0.2", above=0.0)
        if problem.parameter(name) == 0.0:
            checks.faults.append(
                Fault(
                    ("tolerances", name),
                    f"the parameter is 0, of which {shown(share)} is nothing",
                    remedy="leave it out",
                )
            )
    checks.end()
    return {name: share for name, share in shares.items() if share is not None}


def amplitude_band(branch: Solutions, dof: str, tolerances: Any) -> Band:
    """``a -+ sum |da/ds| share |s|`` at every point, not below 0; of the steeper side at a corner."""
    shares = _shares(branch, tolerances)
    rates = _sensitivity(branch, shares, dof)
    size = np.abs(rates["value"].to_numpy()) * np.array(list(shares.values()))
    steeper = np.maximum(*(np.abs(rates[f"amplitude_{side}"].to_numpy()) for side in ("above", "below")))
    spread = np.nan_to_num(steeper).T @ size
    amplitude = branch.table["amplitude"].to_numpy()[:, branch.dof_index(dof)]
    return Band(np.maximum(amplitude - spread, 0.0), amplitude + spread)


def ranked_bars(branch: Solutions, dof: str, point: int, tolerances: Any = None) -> list[Bar]:
    """Effects of tolerances at a point, the largest first; by default of ``DEFAULT`` for all nonzero parameters."""
    problem = branch.problem_at(point)
    if tolerances is None:
        tolerances = {name: DEFAULT for name in parameter_names(problem) if problem.parameter(name) != 0.0}
    shares = _shares(branch, tolerances)
    rates = _sensitivity(branch, shares, dof)
    slopes = rates["amplitude"].to_numpy()[:, point] * rates["value"].to_numpy()
    made = [Bar(name, share, float(s) * share) for (name, share), s in zip(shares.items(), slopes, strict=True)]
    return sorted((bar for bar in made if np.isfinite(bar.change)), key=lambda bar: -abs(bar.change))


def _shares(branch: Solutions, tolerances: Any) -> dict[str, float]:
    if branch.problem is None:
        raise InputError(f"tolerances need the problem of the branch, which is not known: {branch.without}")
    return checked_tolerances(branch.problem, tolerances)


def _sensitivity(branch: Solutions, shares: Mapping[str, float], dof: str) -> xarray.Dataset:
    """Derivatives by the parameters with tolerances; imported here because most reports have no tolerances."""
    from slipstick.analysis.sensitivity.sensitivity import sensitivity_of

    return sensitivity_of(branch, list(shares), dof, together=False)
