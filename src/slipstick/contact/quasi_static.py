"""Dry friction under slow motion: forces after an increment, from those before it, with exact slopes.

Stick is a spring, slip scales its force back to the circle of radius ``mu N`` (return mapping; J. C. Simo and T. J. R.
Hughes, Computational Inelasticity, Springer 1998, section 1.2). An increment is a straight piece of path. Along one
direction the force at its end is exact (THEORY.md (3.1)); in the plane it is exact where the force does not turn. A
contact that closes within an increment is dragged along its spring from the moment at which it touches.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.typing import Array


class Increment(NamedTuple):
    """State of n elements after an increment. The last port is the normal one."""

    force: Array
    """Forces at the ports, (n_ports, n)."""
    slopes: Array
    """``slopes[i, j]``: derivative of force i by motion j at the end, (n_ports, n_ports, n)."""
    closed: NDArray[np.bool_]
    """Whether the surfaces touch at the end, (n,)."""
    slipping: NDArray[np.bool_]
    """Whether the friction force is at its limit at the end, (n,)."""
    slip: Array
    """Slip in this increment along the tangential ports, length, (n_ports - 1, n)."""


def incremented(
    force: Array, before: Array, after: Array, values: Mapping[str, Array], gap_before: Array | None = None
) -> Increment:
    """Forces after a straight piece of path.

    Parameters
    ----------
    force
        Friction and normal forces before, (n_ports, n).
    before, after
        Motion at the ports before and after, (n_ports, n): one or two tangential ports, then the normal one.
    values
        kt, mu, kn and gap, (n,) each; the gap is that after the increment.
    gap_before
        The gap before, (n,), where it changes.
    """
    kt, mu, kn, gap = (values[name] for name in ("kt", "mu", "kn", "gap"))
    ports, count = after.shape
    y0 = before[-1] - (gap if gap_before is None else gap_before)
    y = after[-1] - gap
    closed = y >= 0.0
    # the share of the increment in which the surfaces touch, and its derivative by the motion at the end
    beginning = closed & (y0 < 0.0)
    rise = np.where(beginning, y - y0, 1.0)
    share = np.where(beginning, y / rise, closed)
    by_y = np.where(beginning, -y0 / rise**2, 0.0)
    moved = (after - before)[:-1]
    trial = np.where(beginning, 0.0, force[:-1]) * closed + kt * share * moved
    limit = mu * kn * np.where(closed, y, 0.0)
    size = np.sqrt(np.sum(trial**2, axis=0))
    slipping = closed & (size > limit)
    scale = np.divide(limit, size, out=np.ones(count), where=slipping)
    unit = np.divide(trial, size, out=np.zeros_like(trial), where=slipping)
    out, slopes = np.empty((ports, count)), np.zeros((ports, ports, count))
    out[:-1], out[-1] = scale * trial, kn * np.where(closed, y, 0.0)
    slopes[-1, -1] = kn * closed
    for i in range(ports - 1):
        slopes[i, i] += kt * share * scale
        slopes[i, -1] += kt * moved[i] * by_y * scale
        for j in range(ports - 1):
            turned = np.where(slipping, scale * unit[i] * unit[j], 0.0)
            slopes[i, j] -= kt * share * turned
            slopes[i, -1] -= kt * moved[j] * by_y * turned
        slopes[i, -1] += np.where(slipping, mu * kn * unit[i], 0.0)
    gained, elastic = out[:-1] - np.where(beginning, 0.0, force[:-1]), np.broadcast_to(kt > 0, moved.shape)
    stretched = np.divide(gained, kt, out=np.zeros_like(moved), where=elastic)
    return Increment(out, slopes, closed, slipping, np.where(closed, share * moved - stretched, 0.0))
