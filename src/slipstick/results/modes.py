"""What results of a nonlinear mode hold besides: its amplitude, its damping, the load whose forced peak is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.results.schema import Declared, Layout
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

MODE_VARIABLES: Mapping[str, Declared] = {
    "modal_amplitude": Declared((), "length", "amplitude of the mode"),
    "modal_damping": Declared((), "1", "damping ratio of the mode (all damping together)"),
    "load_factor": Declared((), "1", "factor on the loads of the problem whose forced response peaks here"),
}


def mode_layout(layout: Layout, problem: Problem) -> Layout:
    """That of a branch with these variables."""
    own = {name: d._replace(units=problem.units.label(d.units)) for name, d in MODE_VARIABLES.items()}
    return replace(layout, variables={**layout.variables, **own})


def mode_values(details: Sequence[Any], scale: float, force: float) -> dict[str, Array]:
    """Their values (n_points,), from details with ``amplitude``, ``omega`` and ``xi``; ``force`` that of the loads."""
    a, omega, xi = (np.array([getattr(d, n) for d in details], dtype=float) for n in ("amplitude", "omega", "xi"))
    given = xi * omega * a / scale**2
    return {
        "modal_amplitude": a,
        "modal_damping": xi / (2.0 * omega),
        "load_factor": given / force if force > 0.0 else np.full_like(a, np.nan),
    }
