"""Self-excited vibration over a parameter: from steady sliding through the Hopf point to limit cycles."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.analysis.arguments import common_arguments, followed_problem
from slipstick.analysis.cycles import SelfExcited
from slipstick.analysis.threads import one_thread
from slipstick.balance.checks import range_faults, requested_faults, requested_values, two_numbers
from slipstick.balance.parameters import parameter_path
from slipstick.balance.problem import Problem
from slipstick.contact.friction_law import is_friction
from slipstick.errors import Fault
from slipstick.faults import Gathering, text
from slipstick.results.branch import Branch
from slipstick.typing import Real

CYCLE_OPTIONS = {"jacobian": "dense", "event_tolerance": 1e-8}
"""Options of limit cycles where nothing else is said."""


def limit_cycles(
    problem: Problem,
    parameter: str,
    span: tuple[Real, Real],
    *,
    requested: Iterable[Real] | Real = (),
    options: Mapping[str, Any] | None = None,
) -> Branch:
    """Follow self-excited vibration over a parameter: steady sliding, its Hopf point, and the limit cycles from there.

    Nothing may vary in time but the motion itself: loads have harmonic 0 alone, the opposing surfaces move at constant
    velocity. The frequency is found with the motion (``omega`` in the dataset, another one at every point); the
    multiplier 1 of a shift in time is left out.

    Parameters
    ----------
    problem
        What rubs: friction contacts, or laws without memory that tell their ``rate``, on a structure that is known by
        matrices or modes.
    parameter, span
        As of ``parameter_response``: a name such as "brake.mu", its first and last value. Begin where steady sliding is
        stable.
    requested
        Values of the parameter at which exact points are wanted; one or a list.
    options
        Step control, as of ``forced_response``. Jacobians are written out.

    Returns
    -------
    Branch
        With stability at every point. ``branch_part`` 1 are the limit cycles that begin at the first Hopf point, with
        small motion; 2 is steady sliding over the whole range (amplitude 0; ``omega`` is the frequency of the
        disturbance that decays least, its multipliers are over that period) with every "Hopf" point. As long as all
        contacts keep their state motion of any size belongs to the Hopf point's parameter: the curve rises straight up
        to the first change of state. Look at ``outcome`` and ``message``.

    Raises
    ------
    InputError
        For a parameter, range or option that cannot be used, and for whatever varies in time by itself.

    Warns
    -----
    SlipstickWarning
        As ``parameter_response``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(
    ...     M=[[1.0, 0.0], [0.0, 1.0]], C=[[0.5, 0.0], [0.0, 0.5]], K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"])
    >>> pad = ss.FrictionContact(kt=200.0, mu=0.4, kn=40.0, gap=0.0)
    >>> brake = ss.ContactPair(
    ...     name="brake", tangential="x", normal="y", contact=pad, rubbing=ss.RubbingMotion(velocity=1.0))
    >>> problem = ss.Problem(
    ...     structure, contacts=brake, loads=ss.Load(dof="y", harmonic=0, cos=50.0), harmonics=range(11))
    >>> branch = limit_cycles(problem, "brake.mu", (0.4, 0.56), requested=0.55)
    >>> [(point.kind, round(point.value, 6), round(point.omega, 6)) for point in branch.bifurcations()][-1]
    ('Hopf', 0.53125, 10.0)
    >>> round(float(branch.dataset.omega[branch.at(0.55)]), 4)
    9.9945
    """
    request = asked_cycles(problem, parameter, span, requested, options)
    with one_thread():
        return request.branch()


def asked_cycles(problem: Any, parameter: Any, span: Any, requested: Any, options: Any) -> SelfExcited:
    """What is asked for, checked; InputError with all faults."""
    found = Gathering()
    checked = found.take(followed_problem, problem)
    name = found.take(text, "parameter", parameter, 'a name such as "brake.mu"') or ""
    points = found.take(requested_values, requested) or ()
    ends = found.take(two_numbers, span, f"range of {name}" if name else "range")
    if ends is not None:
        found.faults += range_faults(*ends, name=f"range of {name}", positive=False) or requested_faults(points, *ends)
    if checked is not None:
        own = autonomous_faults(checked)
        found.faults += own
        if name:
            varied = found.take(_varied_faults, checked, name, ends) or []
            found.faults += [fault for fault in varied if fault not in own]
    given = CYCLE_OPTIONS if options is None else options
    if isinstance(given, Mapping):
        given = {**CYCLE_OPTIONS, **given}
        found.faults += _option_faults(given)
    common = found.take(common_arguments, checked, points, None, given)
    found.end()
    assert checked is not None
    assert ends is not None
    assert common is not None
    return SelfExcited(
        problem=checked, balance=common["balance"], parameter=name, span=ends, requested=points,
        options=replace(common["options"], output_step=np.inf),
    )  # fmt: skip


def _option_faults(given: Mapping[str, Any]) -> Iterator[Fault]:
    if given.get("adapt_harmonics") is not None:
        yield Fault("options, adapt_harmonics", "limit cycles are computed with all harmonics", remedy="leave it out")
    if given.get("jacobian") == "iterative":
        yield Fault("options, jacobian", "limit cycles are computed with dense Jacobians", remedy="leave it out")


def autonomous_faults(problem: Problem) -> list[Fault]:
    """What varies in time by itself, or is not known of self-excited vibration."""
    return list(_autonomous_faults(problem))


def _autonomous_faults(problem: Problem) -> Iterator[Fault]:
    instead = "use ss.forced_response or ss.parameter_response"
    for load in problem.loads:
        if load.harmonic:
            found = f"it excites at harmonic {load.harmonic}"
            where = ("load", load.dof or load.shape or "")
            yield Fault(where, found, expected="harmonic 0 alone", remedy=instead)
    for pair in problem.contacts:
        if other := [name for name in pair.rubbing.names if name != "velocity"]:
            found = f"the rubbing motion has {', '.join(other)}"
            yield Fault(("contact", pair.name), found, expected="a constant velocity alone", remedy=instead)
        law = pair.contact
        if not is_friction(law) and (law.memory or not law.in_time):
            found = "it follows a law that remembers" if law.in_time else "its law does not tell its rate in time"
            yield Fault(("contact", pair.name), found, expected="friction, or forces of motion and velocity")
    if problem.heated is not None:
        yield Fault("thermal", "self-excited vibration of heated contacts is not known", remedy="leave it out")
    if 1 not in problem.harmonics.orders:
        yield Fault("harmonics", "harmonic 1 is left out", expected="harmonics with 0 and 1, such as 0 to 10")


def _varied_faults(problem: Problem, parameter: str, span: tuple[float, float] | None) -> list[Fault]:
    """InputError where the parameter does not take an end of its range; what varies in time there."""
    parameter_path(problem, parameter)
    ends = [autonomous_faults(problem.at_parameter(parameter, end)) for end in span or ()]
    return max(ends, key=len, default=[])
