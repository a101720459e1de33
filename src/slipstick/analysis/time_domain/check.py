"""A point of a branch against time integration: an independent check that cuts off no harmonics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.time_domain.initial_state import HarmonicStart
from slipstick.analysis.time_domain.piecewise_model import friction_elements, integration_faults, sticks_and_slips
from slipstick.analysis.time_domain.transient import transient
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.reduction import worst_error
from slipstick.contact.friction_law import FrictionLaw, is_friction
from slipstick.contact.rest import REST
from slipstick.errors import InputError
from slipstick.results.contacts import FRICTION_VARIABLES
from slipstick.results.record import Point, Recorder, contact_states
from slipstick.results.view import analysis_of
from slipstick.solve.newton import newton
from slipstick.solve.norm import norm
from slipstick.typing import AnyArray, Array
from slipstick.units import compared

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions

_FREE_PHASE = 1e-4
"""Change of the state over a period of self-excited vibration, that its slightly inexact frequency explains."""


@dataclass(frozen=True, kw_only=True)
class TimeCheck:
    """A point of a branch against time integration, by output dof, both (n_outputs,).

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    >>> check = ss.steady_response(problem, omega=8.0).check_in_time(0)
    >>> check.converged, check.amplitude.round(3), check.amplitude_in_time.round(3)
    (True, array([0.205]), array([0.205]))
    >>> round(check.relative_difference, 5)
    0.00033
    """

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
    time_error: float = np.nan
    """Estimated error of the time integration itself, relative; nan: unknown. See ``TransientResult.error``."""
    reduction_error: float | None = None
    """Estimated error of the reduced structure here, which both share: the comparison cannot see it. None: unknown."""


def check_in_time(branch: Solutions, point: int, **options: Any) -> TimeCheck:
    """As ``Branch.check_in_time``."""
    data, problem = branch.point(point), branch.problem_at(point)
    if faults := list(integration_faults(problem)):
        raise InputError(faults)
    omega = float(data["omega"])
    between = "kind" in data and str(data["kind"].to_numpy()) == "interpolated"
    d = corrected(branch, point) if between else {str(name): array.to_numpy() for name, array in data.data_vars.items()}
    friction, none = friction_elements(problem), np.zeros((0, problem.harmonics.size))
    still = np.zeros((len(problem.elements), problem.harmonics.size))
    tangential, normal = (d.get(f"contact_{port}", still)[friction] for port in FrictionLaw.ports)
    others = [b for b in problem.batches if not sticks_and_slips(b.law)]
    ports = np.concatenate([none, *(d[f"contact_{port}"][b.elements] for b in others for port in b.law.ports)])
    means = [d[f"{name}_force"][b.elements][:, 0] for b in others for name in b.law.force_names]
    start = HarmonicStart(
        harmonics=problem.harmonics, tangential=tangential, normal=normal, ports=ports,
        mean_force=np.concatenate([np.zeros(0), *means]), friction=_known_means(problem, d)[friction],
    )  # fmt: skip
    held = {name: np.nan_to_num(d[v]) for name, v in FRICTION_VARIABLES.items() if v in d}
    if analysis_of(branch.table) == "cycles":
        # shooting at a given period has no isolated solution: the phase is free
        options = {"method": "march", "tolerance": _FREE_PHASE, **options}
    result = transient(problem, omega, initial=start, held=held, **options)
    amplitude, mean = d["amplitude"], d["mean"]
    pairs = ((amplitude, result.amplitude), (mean, result.mean))
    worst = worst_error(problem, [omega])
    straight = compared(result.outputs)  # radians are not measured by lengths
    alike = [group for group in (straight, np.setdiff1d(np.arange(len(result.outputs)), straight)) if len(group)]
    return TimeCheck(
        omega=omega,
        dofs=tuple(result.outputs),
        amplitude=amplitude,
        amplitude_in_time=result.amplitude,
        mean=mean,
        mean_in_time=result.mean,
        relative_difference=max(_difference([(a[group], b[group]) for a, b in pairs]) for group in alike),
        converged=result.converged,
        time_error=result.error,
        reduction_error=None if worst is None or worst.kind == "unknown" else worst.value,
    )


def _known_means(problem: Problem, d: Mapping[str, AnyArray]) -> Array:
    """Mean friction forces (n_contacts,) of the contacts that remember where they were at rest; nan of all others."""
    out = np.full(len(problem.elements), np.nan)
    for batch in problem.batches:
        if is_friction(batch.law) and REST in batch.law.values:
            out[batch.elements] = d["friction_force"][batch.elements][:, 0]
    return out


def _difference(pairs: Sequence[tuple[Array, Array]]) -> float:
    """Largest difference between numbers of one unit over the largest of them."""
    size = max(float(np.abs(value).max()) for pair in pairs for value in pair) or 1.0
    return max(float(np.abs(a - b).max()) for a, b in pairs) / size


def corrected(branch: Solutions, point: int) -> Mapping[str, AnyArray]:
    """Every variable of the schema at the frequency and parameter of a point, solved for from there.

    The point's own numbers where no solution is found near them. Raises InputError if the branch has no problem.
    """
    numbers_there, problem = branch.point(point), branch.problem_at(point)
    balance, omega = Balance(problem), float(numbers_there["omega"])
    balance.anchor_if_undamped(omega)
    near = contact_states(branch.table, balance, point)
    system, start = FrequencySystem(balance, problem.inputs), branch.guess(point).ravel()
    result = newton(lambda x: system.evaluate(x, omega, near), start, scale=norm(start) or 1.0)
    if not result.converged:
        return {str(name): np.asarray(numbers_there[name]) for name in numbers_there}
    solution = Point.at(
        result.evaluation.detail, x=result.x, residual=result.residual_norm, iterations=result.iterations,
        kind="regular", parameter=omega, peak_of="",
    )  # fmt: skip
    return Recorder(balance).record(solution)
