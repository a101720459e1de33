"""Power series of a structure's modes driven through its ports, and the steps in which no switching function vanishes.

The state is ``z = [q, p, e, forcing]`` with ``q' = p``, ``p' = -K q - C p + columns w``, ``w = acting z`` (forces of
contacts and loads, which do not depend on p), ``e' = sliding forcing`` and the forcing's own rates. Where K and C are
diagonal a term of the series costs a few numbers a mode and port instead of a dense product.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slipstick.trig.compiled import compiled
from slipstick.typing import Array


class Rates(NamedTuple):
    """``dz/dtau`` of one combination of contact states."""

    K: Array
    """(n, n), or (1, n) its diagonal."""
    C: Array
    columns: Array
    """Transposed, (n_forces, n)."""
    by_motion: Array
    """``acting`` on q, (n_forces, n)."""
    by_rest: Array
    """``acting`` on e and the forcing, (n_forces, size - 2 n)."""
    rest: Array
    """Rates of e and of the forcing by these, (size - 2 n, size - 2 n)."""


@compiled(allocates=True, nogil=True)
def series(path: Array, rates: Rates, step: float) -> None:
    """Fills ``path`` (degree + 1, size), whose first row is z, with the power series of z in steps."""
    n, forces, diagonal = rates.by_motion.shape[1], rates.by_motion.shape[0], rates.K.shape[0] == 1
    size = path.shape[1]
    w, moved = np.empty(forces), np.empty(n)
    for k in range(1, path.shape[0]):
        before, now, scale = path[k - 1], path[k], step / k
        for j in range(forces):
            total = 0.0
            for i in range(n):
                total += rates.by_motion[j, i] * before[i]
            for i in range(size - 2 * n):
                total += rates.by_rest[j, i] * before[2 * n + i]
            w[j] = total
        if diagonal:
            for i in range(n):
                moved[i] = -rates.K[0, i] * before[i] - rates.C[0, i] * before[n + i]
        else:
            for i in range(n):
                total = 0.0
                for j in range(n):
                    total += rates.K[i, j] * before[j] + rates.C[i, j] * before[n + j]
                moved[i] = -total
        for j in range(forces):
            for i in range(n):
                moved[i] += rates.columns[j, i] * w[j]
        for i in range(n):
            now[i] = scale * before[n + i]
            now[n + i] = scale * moved[i]
        for i in range(size - 2 * n):
            total = 0.0
            for j in range(size - 2 * n):
                total += rates.rest[i, j] * before[2 * n + j]
            now[2 * n + i] = scale * total


@compiled(allocates=True, nogil=True)
def steady_steps(
    starts: Array, forcing: Array, rates: Rates, step: float, degree: int, margins: Array, rounding: Array,
    samples: Array,
) -> int:  # fmt: skip
    """Whole steps from ``starts[0]`` on until one in which a contact may change its state: how many were taken.

    ``starts`` (k + 1, size) gets the state at the start of each step, ``forcing`` (k, n_forcing) is that at each.
    ``margins`` (size, m) are the switching functions, ``rounding`` (size, m) times ``|z|`` their accuracy, and
    ``samples`` (k, degree + 1) the powers at which they are sampled: a step in which one comes close to zero is not
    taken.
    """
    size, forced = starts.shape[1], starts.shape[1] - forcing.shape[1]
    path = np.empty((degree + 1, size))
    c, values = np.empty((degree + 1, margins.shape[1])), np.empty((samples.shape[0], margins.shape[1]))
    for taken in range(forcing.shape[0]):
        starts[taken, forced:] = forcing[taken]
        path[0] = starts[taken]
        series(path, rates, step)
        if margins.shape[1]:
            np.dot(path, margins, c)
            np.dot(samples, c, values)
            near = np.dot(np.abs(path[0]), rounding)
            for j in range(margins.shape[1]):
                lowest = c[0, j]
                for i in range(samples.shape[0]):
                    lowest = min(lowest, values[i, j])
                if not lowest > near[j]:
                    return taken
        end = starts[taken + 1]
        end[:] = path[degree]
        for k in range(degree - 1, -1, -1):
            end += path[k]
    return forcing.shape[0]
