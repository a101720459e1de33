"""What a branch offers for convenience though it belongs to rooms further on: files, figures, the check in time.

The one file of this room that may know those rooms, and only inside its functions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.reduction import worst_error
from slipstick.errors import InputError
from slipstick.results.contacts import FRICTION_VARIABLES
from slipstick.results.schema import is_self_excited
from slipstick.typing import Array, DrawnAxes, Names

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

    from slipstick.results.branch import Branch


def save(branch: Branch, path: str | Path) -> Path:
    """As ``Branch.save``."""
    from slipstick.io.store import save_branch

    return save_branch(branch, path)


def report(branch: Branch, path: str | Path, **options: Any) -> Path:
    """As ``Branch.report``."""
    from slipstick.report.writing import write_report

    return write_report(branch, path, **options)


def save_shape(branch: Branch, path: str | Path, point: int, **options: Any) -> Path:
    """As ``Branch.save_shape``."""
    from slipstick.io.xdmf import write_shape

    return write_shape(branch, path, point, **options)


def sensitivity(branch: Branch, parameters: Names, dof: str | None, *, together: bool = True) -> xarray.Dataset:
    """As ``Branch.sensitivity``; ``together``: parameters that are the same thing twice are warned of."""
    from slipstick.analysis.sensitivity.sensitivity import sensitivity_of

    return sensitivity_of(branch, parameters, dof, together=together)


def subharmonic(branch: Branch, point: int, **options: Any) -> Branch:
    """As ``Branch.subharmonic``."""
    from slipstick.analysis.stability.subharmonics import subharmonic_response

    return subharmonic_response(branch, point, **options)


_FREE_PHASE = 1e-4
"""Change of the state over a period, of self-excited vibration, that is that of a frequency that is nearly right."""


@dataclass(frozen=True, kw_only=True)
class TimeCheck:
    """A point of a branch against time integration, by output dof, both (n_outputs,)."""

    omega: float
    dofs: tuple[str, ...]
    amplitude: Array
    amplitude_in_time: Array
    mean: Array
    mean_in_time: Array
    relative_difference: float
    """Largest difference of amplitudes and means over the largest of all of them."""
    converged: bool
    """Whether the time integration became periodic."""
    reduction_error: float | None = None
    """Estimated error of the reduced structure here, which both share: the comparison cannot see it. None: unknown."""


def check_in_time(branch: Branch, point: int, **options: Any) -> TimeCheck:
    """As ``Branch.check_in_time``."""
    from slipstick.analysis.curve.steady import corrected
    from slipstick.analysis.time_domain.initial_state import HarmonicStart
    from slipstick.analysis.time_domain.piecewise_model import friction_elements, integration_faults
    from slipstick.analysis.time_domain.transient import transient
    from slipstick.contact.friction_law import FrictionLaw, is_friction

    found, problem = branch.point(point), branch.problem_at(point)
    if faults := list(integration_faults(problem)):
        raise InputError(faults)
    omega = float(found["omega"])
    between = "kind" in found and str(found["kind"].to_numpy()) == "interpolated"
    d = corrected(branch, point) if between else {str(name): own.to_numpy() for name, own in found.data_vars.items()}
    friction, none = friction_elements(problem), np.zeros((0, problem.harmonics.size))
    tangential, normal = (d[f"contact_{port}"][friction] if friction.size else none for port in FrictionLaw.ports)
    others = [b for b in problem.batches if not is_friction(b.law)]
    ports = np.concatenate([none, *(d[f"contact_{port}"][b.elements] for b in others for port in b.law.ports)])
    start = HarmonicStart(harmonics=problem.harmonics, tangential=tangential, normal=normal, ports=ports)
    held = {name: np.nan_to_num(d[variable]) for name, variable in FRICTION_VARIABLES.items()} if friction.size else {}
    if is_self_excited(branch.table):  # shooting at a given period has no solution that stands alone: the phase is free
        options = {"method": "march", "tolerance": _FREE_PHASE, **options}
    result = transient(problem, omega, initial=start, held=held, **options)
    amplitude, mean = d["amplitude"], d["mean"]
    pairs = ((amplitude, result.amplitude), (mean, result.mean))
    worst = worst_error(problem, [omega])
    size = max(float(np.abs(value).max()) for pair in pairs for value in pair) or 1.0
    return TimeCheck(
        omega=omega,
        dofs=tuple(result.outputs),
        amplitude=amplitude,
        amplitude_in_time=result.amplitude,
        mean=mean,
        mean_in_time=result.mean,
        relative_difference=max(float(np.abs(a - b).max()) for a, b in pairs) / size,
        converged=result.converged,
        reduction_error=None if worst is None or worst.kind == "unknown" else worst.value,
    )


class BranchPlots:
    """Figures of one branch, as ``branch.plot.response("x")``; each returns its Axes.

    Options are those of ``slipstick.plots``.
    """

    def __init__(self, branch: Branch) -> None:
        self._branch = branch

    def response(self, dof: Names = None, **options: Any) -> DrawnAxes:
        """Amplitude over the followed quantity."""
        return _plots().response(self._branch, dof, **options)

    def stability(self, **options: Any) -> DrawnAxes:
        """Largest magnitude of a Floquet multiplier, where stability was asked for."""
        return _plots().stability(self._branch, **options)

    def tolerance_band(self, tolerances: Mapping[str, float], dof: str | None = None, **options: Any) -> DrawnAxes:
        """Amplitude with the band that tolerances of parameters make of it, ``{"damper.mu": 0.2}``."""
        return _plots().tolerance_band(self._branch, tolerances, dof, **options)

    def tornado(
        self, tolerances: Mapping[str, float] | None = None, dof: str | None = None, **options: Any
    ) -> DrawnAxes:
        """Which parameters matter most at a point, by default at the highest peak."""
        return _plots().tornado(self._branch, tolerances, dof, **options)

    def phase(self, dof: Names = None, **options: Any) -> DrawnAxes:
        """Phase of a harmonic."""
        return _plots().phase(self._branch, dof, **options)

    def mean(self, dof: Names = None, **options: Any) -> DrawnAxes:
        """Mean of the motion (harmonic 0)."""
        return _plots().mean(self._branch, dof, **options)

    def power(self, contact: Names = None, **options: Any) -> DrawnAxes:
        """Dissipated power, of contacts or all together."""
        return _plots().power(self._branch, contact, **options)

    def friction(self, contact: Names = None, **options: Any) -> DrawnAxes:
        """Friction coefficient."""
        return _plots().friction(self._branch, contact, **options)

    def temperature(self, contact: Names = None, **options: Any) -> DrawnAxes:
        """Contact temperature, where friction heats the contacts."""
        return _plots().temperature(self._branch, contact, **options)

    def fractions(self, contact: str | None = None, **options: Any) -> DrawnAxes:
        """Fractions of the period in stick, slip and separation."""
        return _plots().fractions(self._branch, contact, **options)

    def loop(self, point: int, contact: Names = None, **options: Any) -> DrawnAxes:
        """Hysteresis loop of a contact at a point: friction force over its vibration, or over="sliding"."""
        return _plots().loop(self._branch, point, contact, **options)

    def loops(self, point: int, contact: Names = None, **options: Any) -> tuple[Axes, Axes]:
        """The loop over the vibration and that over the sliding motion, side by side."""
        return _plots().loops(self._branch, point, contact, **options)

    def states(self, point: int, contact: Names = None, **options: Any) -> DrawnAxes:
        """States of contacts over a period."""
        return _plots().states(self._branch, point, contact, **options)

    def history(self, point: int, dof: Names = None, **options: Any) -> DrawnAxes:
        """Motion of dofs over a period, or the friction force of ``contact=``."""
        return _plots().history(self._branch, point, dof, **options)

    def spectrum(self, point: int, dof: Names = None, **options: Any) -> DrawnAxes:
        """Harmonics of the motion of dofs, or of the friction force of ``contact=``."""
        return _plots().spectrum(self._branch, point, dof, **options)


def _plots() -> Any:
    from slipstick import plots

    return plots
