"""What results of a nonlinear mode hold besides: its amplitude, its damping, the load whose forced peak is there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.results.schema import Declared, Layout
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

MODE_VARIABLES: Mapping[str, Declared] = {
    "modal_amplitude": Declared((), "length", "amplitude of the mode: of harmonic 1 at its output"),
    "modal_damping": Declared((), "1", "damping ratio of the mode (all damping together)"),
    "load_factor": Declared((), "1", "factor on the loads of the problem whose forced response peaks here"),
}


def mode_layout(layout: Layout, problem: Problem) -> Layout:
    """That of a branch with these variables."""
    of_modes = {name: d._replace(units=problem.units.label(d.units)) for name, d in MODE_VARIABLES.items()}
    return replace(layout, variables={**layout.variables, **of_modes})


def mode_values(details: Sequence[Any], force: ComplexArray) -> dict[str, Array]:
    """Their values (n_points,), from details of a nonlinear mode; ``force`` as in ``peak_forces``."""
    omega, xi = (np.array([getattr(d, n) for d in details], dtype=float) for n in ("omega", "xi"))
    return {
        "modal_amplitude": np.array([d.amplitude for d in details], dtype=float),
        "modal_damping": xi / (2.0 * omega),
        "load_factor": peak_forces(details, force),
    }


def peak_forces(details: Sequence[Any], force: ComplexArray) -> Array:
    """Factors (n_points,) on loads whose forced response peaks there; nan where they do not act on the mode.

    In phase resonance the loads feed what ``xi`` takes: ``factor |p^H q| = xi w |q|^2``, with the phasors of the
    mass-normalised modes in harmonic 1, and of the loads on them ``force`` (n_modes,).
    """
    dissipated = np.array([d.xi * d.omega * np.sum(np.abs(d.modal) ** 2) for d in details], dtype=float)
    power = np.array([abs(np.vdot(force, d.modal)) for d in details], dtype=float)
    return np.divide(dissipated, power, out=np.full_like(dissipated, np.nan), where=power > 0.0)
