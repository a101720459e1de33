"""``[study]``: parameters and their values, and how these make cases."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from slipstick.case.table import RawTable, toml
from slipstick.errors import IS_MISSING, Fault, InputError

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.studies.plan import StudyPlan

STUDY_KEYS = ("method", "samples", "seed", "spread")
"""Keys of ``[study]`` besides the names of parameters."""


def study_plan(section: object, problem: Problem) -> StudyPlan:
    """The cases that ``[study]`` asks for; raises InputError with all faults in it."""
    from slipstick.structure.disc import Disc
    from slipstick.studies.plan import MISTUNED, make_plan

    values, options = _read(section)
    if options.get("method") == MISTUNED and not isinstance(problem.structure, Disc):
        remedy = f'method = "{MISTUNED}" in [study] needs it, such as {{ blade = [[1.0]], spread = 0.01 }} of a disc'
        raise InputError(Fault(("structure", "mistuning"), IS_MISSING, remedy=remedy))
    return make_plan(problem, values, **options)


def check_study(section: object) -> None:
    """InputError with the faults of ``[study]`` that show without a problem."""
    from slipstick.studies.plan import study_faults

    values, options = _read(section)
    if faults := study_faults(values, **options):
        raise InputError(faults)


def _read(section: object) -> tuple[dict[str, Any], dict[str, Any]]:
    """Parameters with their values, and the other keys."""
    if not isinstance(section, Mapping):
        expected = 'a table of parameters such as "damper.velocity" = [0, 1, 10]'
        raise InputError(Fault("study", found=toml(section), expected=expected))
    options = {key: section[key] for key in STUDY_KEYS if key in section}
    return dict(_flat({key: value for key, value in section.items() if key not in options}, "")), options


def cases_text(plan: StudyPlan) -> str:
    """The number of cases, and the parameters they vary."""
    if plan.tuned is not None:
        own = "the deviations of [structure] are not used"
        return f"{plan.size} discs whose blades differ at random (spread {plan.spread:g}; {own}), and the tuned one"
    sizes = zip(plan.dims, plan.shape, strict=True)
    along = " x ".join(f"{name} ({size})" for name, size in sizes) if plan.axes else ", ".join(plan.names)
    return f"{len(plan)} cases, {along}"


def _flat(table: RawTable, prefix: str) -> Iterator[tuple[str, Any]]:
    """``damper.velocity = [0, 1]`` without quotes is a table in TOML; it means the same."""
    from slipstick.studies.parameter_values import DISTRIBUTION, KEYS

    values = {*KEYS, DISTRIBUTION}
    for key, value in table.items():
        if isinstance(value, Mapping) and value and not set(value) & values:
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
