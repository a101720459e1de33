"""A problem as a notebook shows it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from slipstick.html import html_table, some

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.problem import Problem


def problem_html(problem: Problem) -> str:
    """A small table of what is to be computed."""
    return html_table(f"Problem{': ' if problem.title else ''}{problem.title}", _rows(problem))


def _rows(problem: Problem) -> Iterator[tuple[str, object]]:
    structure, units = problem.structure, problem.units
    yield "structure", f"{type(structure).__name__}, {len(structure.dofs)} dofs: {some(structure.dofs)}"
    natural = np.asarray(structure.natural_frequencies, dtype=float)
    if natural.size:
        yield "undamped natural frequencies", f"{some((f'{w:.5g}' for w in natural), 4)} {units.angular}"
    for pair in problem.contacts[:1]:
        kinds = dict.fromkeys(type(each.contact).__name__ for each in problem.contacts)
        yield "contacts", f"{some(problem.elements)} ({some(kinds)}); first: {_numbers(pair)}"
    for state in problem.contact_states:
        yield state.has, some(state.names)
    if problem.loads:
        yield "loads", some((f"{load.target} (harmonic {load.harmonic})" for load in problem.loads), 4)
    if problem.relative:
        yield "motion", "relative to the moving support"
    unknowns = sum(pair.n_ports for pair in problem.contacts) * problem.harmonics.size
    yield "harmonics", f"{some(problem.harmonics.orders, 14)}; {unknowns} unknowns"
    yield "outputs", some(problem.outputs or ())


def _numbers(pair: ContactPair) -> str:
    """The parameters of a contact, those of its rubbing motion included."""
    values = {name: float(np.asarray(pair.values(name))[0]) for name in pair.quantities}
    return ", ".join(f"{name} {value:g}" for name, value in values.items())
