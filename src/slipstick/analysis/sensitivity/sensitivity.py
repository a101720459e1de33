"""Derivatives of a branch by named parameters, of whatever kind its vibration is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.road.run import one_thread
from slipstick.analysis.sensitivity.derivatives import Sensitivities
from slipstick.analysis.sensitivity.free_vibration import CycleSensitivities, ModeSensitivities
from slipstick.balance.parameters import product_warnings
from slipstick.faults import point_numbers, warn, wrong
from slipstick.results.sensitivities import (
    corner_warnings,
    known_problem,
    motion_dataset,
    parameter_names,
    sensitivity_dataset,
)
from slipstick.results.view import analysis_of

if TYPE_CHECKING:
    import xarray

    from slipstick.results.solutions import Solutions


OF = ("amplitude", "displacement")
"""What can be differentiated: the amplitude with all else that is one number, or every coefficient of the motion."""


_OF_FREE_VIBRATION = {"cycles": CycleSensitivities, "modes": ModeSensitivities}
"""By the analysis that a branch is of; all others are of vibration at a given frequency."""


def sensitivity_of(
    branch: Solutions, parameters: Any = None, dof: str | None = None, *, points: Any = None, of: Any = OF[0],
    together: bool = True,
) -> xarray.Dataset:  # fmt: skip
    """As ``Branch.sensitivity``; ``together``: the parameters are compared, and must not be the same thing twice."""
    problem = known_problem(branch)
    branch.point(0)
    if not isinstance(of, str) or of not in OF:
        raise wrong("of", of, " or ".join(f'"{name}"' for name in OF))
    chosen = parameter_names(problem, parameters)
    at = point_numbers("points", points, branch.table.sizes["point"])
    d = branch.dof_index(dof)
    if parameters is not None and together:
        warn(product_warnings(problem, chosen))
    name = str(branch.table["dof"].to_numpy()[d])
    sensitivities = _OF_FREE_VIBRATION.get(analysis_of(branch.table), Sensitivities)(branch, chosen, name)
    with one_thread():
        if of == "displacement":
            rates = [sensitivities.motion_at(k) for k in at]
            warn(list(sensitivities.warnings()))
            return motion_dataset(branch, name, chosen, at, np.array(rates).swapaxes(0, 1))
        found = sensitivity_dataset(branch, name, chosen, at, [sensitivities.at(k) for k in at])
    warn([*sensitivities.warnings(), *corner_warnings(found)])
    return found
