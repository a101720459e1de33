"""The compiled batch of contact elements: forces, tangents and sensitivities of many elements at once."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.contact.kernel.element import evaluate, states_alone
from slipstick.contact.kernel.tuples import (
    V_DV,
    V_FX,
    BatchOutputs,
    ElementInputs,
    ElementOutputs,
    Intervals,
    Search,
    Segments,
    States,
    Sums,
    Workspace,
)
from slipstick.contact.law import Placed
from slipstick.trig.basis import Grid, Scratch
from slipstick.trig.compiled import compiled, inlined, part
from slipstick.trig.roots import FULL, STACK

ALL_DONE = -1
"""Return value of a run that has computed every element."""


@part
def workspace(grid: Grid) -> Workspace:
    """Arrays for the worst case: every polynomial with all its ``2 m_n`` roots, a slip onset in every segment."""
    padded, cells, room = grid.orders.size, grid.cos.shape[1], grid.top + 2
    many = 3 * room + 1
    return Workspace(
        np.empty((4, padded)),
        Scratch(np.empty(padded), np.empty(padded), np.empty((2, padded)), np.empty((2, padded))),
        Search(
            np.empty((9, cells)), np.empty((6, padded)), np.empty(cells, np.bool_), np.empty(cells),
            np.empty((STACK, 2)), np.empty((3, room)), np.empty((3, room), np.bool_), np.empty(3, np.int64),
            np.empty(3, np.int64),
        ),
        Segments(
            np.empty(many), np.empty(many, np.int64), np.empty(many, np.bool_), np.empty(many), np.empty(many),
            np.empty(many), np.empty(many, np.bool_), np.empty(many), np.empty(many),
        ),
        Intervals(np.empty((2 * many, 3)), np.empty((2 * many, 2), np.int64)),
        np.empty((2, 4)),
        Sums(
            np.empty((2 * many, 2, grid.top + 4)), np.empty((6, grid.top + 4)), np.empty(3), np.empty(3, np.int64),
        ),
        np.empty((8, 2 * grid.n + 1)),
    )  # fmt: skip


@inlined
def place(e: int, placed: Placed, out: BatchOutputs) -> None:
    """Write the motion and the parameters of an element."""
    i, c = e // placed.rows.shape[1], e % placed.rows.shape[1]
    motion, parameters = out.motion[e], out.parameters[e]
    for port in range(2):
        row = placed.rows[port, c]
        for j in range(motion.shape[1]):
            motion[port, j] = placed.rubbing[port, e, j]
            if row >= 0:
                motion[port, j] += placed.X[i, row, j]
    parameters[0] = placed.velocity[0, e] / placed.omega[i] + placed.velocity_per_omega[0, e]
    for j in range(placed.values.shape[1]):
        parameters[j + 1] = placed.values[e, j]


@inlined
def put_on_ports(e: int, placed: Placed, out: BatchOutputs) -> None:
    """Write the forces of an element on its ports, and their derivatives by omega at fixed motion."""
    i, c = e // placed.rows.shape[1], e % placed.rows.shape[1]
    vectors, omega = out.vectors[e], placed.omega[i]
    for port in range(2):
        row = placed.rows[port, c]
        if row >= 0:
            rate = placed.velocity[0, e] / -(omega * omega) if port == 0 else 0.0
            for j in range(vectors.shape[1]):
                out.on_ports[0, i, row, j] = vectors[V_FX + port, j]
                out.on_ports[1, i, row, j] = rate * vectors[V_DV, j]


@compiled(allocates=True, nogil=True)
def run_elements(first: int, last: int, inputs: Any, tables: Any, outputs: Any, states: Any) -> int:
    """Elements from ``first`` to ``last`` with one workspace; other threads may run theirs at the same time.

    The last four are plain tuples of the fields of ``Placed``, ``Grid``, ``BatchOutputs`` and ``States``: numba knows
    the type of a plain tuple at once, that of a named one only after microseconds.

    Returns ``ALL_DONE``, or the number of an element that cannot be computed, where the run ends.
    """
    placed, grid, out, kept = Placed(*inputs), Grid(*tables), BatchOutputs(*outputs), States(*states)
    k = workspace(grid)
    for e in range(first, last):
        place(e, placed, out)
        inputs = ElementInputs(out.motion[e, 0], out.motion[e, 1], out.parameters[e])
        if len(out.vectors):
            total = evaluate(inputs, grid, k, ElementOutputs(out.vectors[e], out.matrices[e], out.scalars[e]))
        else:
            total = states_alone(inputs, grid, k)
        if total == FULL:
            return e
        if len(out.vectors):
            put_on_ports(e, placed, out)
        if kept.totals.size:
            kept.totals[e] = total
            at, code = k.intervals.at, k.intervals.code
            for i in range(total):
                kept.at[e, i, 0], kept.at[e, i, 1], kept.at[e, i, 2] = at[i, 0], at[i, 1], at[i, 2]
                kept.code[e, i, 0], kept.code[e, i, 1] = code[i, 0], code[i, 1]
    return ALL_DONE


def most_intervals(top: int) -> int:
    """Largest number of intervals of one element."""
    return 2 * (3 * (top + 2) + 1)
