"""What the compiled functions of the contact element hand each other: named tuples of arrays, and codes."""

from __future__ import annotations

from typing import Any, NamedTuple

from slipstick.trig.basis import Polynomial, Scratch

SEPARATION, STICK, SLIP_PLUS, SLIP_MINUS = 0, 1, 2, 3
"""State codes of an interval."""

NAMES = ("separation", "stick", "slip+", "slip-")
"""Their names."""

NONE, NORMAL, UPPER, LOWER, BOTH = -1, 0, 1, 2, 3
"""Kinds of critical times: a root of ``y - g``, of ``phi_+'``, of ``phi_-'``, of both alike (constant load);
``NONE`` stands for a start where nothing happens."""

V_FX, V_FY, V_DV, V_DMU, V_DKT, V_DKN, V_YKN = range(7)
"""Rows of the vector output: Fx, Fy, dFx/dv, dFx/dmu, dFx/dkt, dFx/dkn, dFy/dkn."""

S_WORK, S_STICK, S_SLIP, S_SEPARATION, S_LOW, S_HIGH = range(6)
"""Columns of the scalar output: work per radian, state fractions, interval of the mean friction force."""

P_V, P_KT, P_MU, P_KN, P_GAP = range(5)
"""Columns of the parameter input."""


class Inputs(NamedTuple):
    """Of a batch, or of one element without the first axis."""

    X: Any
    """Tangential motion, the counter surface's included (elements, L)."""
    Y: Any
    """Normal motion likewise (elements, L)."""
    parameters: Any
    """``v, kt, mu, kn, gap`` (elements, 5)."""


class Outputs(NamedTuple):
    """Of a batch, or of one element without the first axis."""

    vectors: Any
    """Rows ``V_...`` (elements, 7, L)."""
    matrices: Any
    """dFx/dX, dFx/dY, dFy/dY (elements, 3, L, L)."""
    scalars: Any
    """``S_...`` (elements, 6)."""


class States(NamedTuple):
    """Intervals of every element of a batch; arrays without elements where they are not asked for."""

    totals: Any
    """Number of intervals (elements,)."""
    at: Any
    """Start, end, force at start (elements, room, 3)."""
    code: Any
    """State, and origin of a stick (elements, room, 2)."""


class Element(NamedTuple):
    """Motion and constants of one element."""

    X: Polynomial
    """Without its mean, which does not matter to the law and would cost digits."""
    Y: Polynomial
    """Less the gap."""
    v: Any
    kt: Any
    mu: Any
    kn: Any
    limit: Any
    """``mu kn``: friction limit over penetration."""
    steep: Any
    """See ``contact.kernel.steep_sticks``."""


class Search(NamedTuple):
    """Room to find critical times."""

    g: Any
    """``y, y', y''``, then ``p, p', p''`` of ``phi_+'`` and of ``phi_-'`` at the cell middles (9, cells)."""
    p: Any
    """Cosines and sines of the same three polynomials (6, n4)."""
    skip: Any
    margin: Any
    stack: Any
    lists: Any
    """Roots of each (3, room)."""
    rising: Any
    counts: Any
    signs: Any


class Segments(NamedTuple):
    """Critical times, and what holds from each to the next."""

    time: Any
    kind: Any
    up: Any
    """Whether the root that makes the time is a rising one."""
    w: Any
    """Total tangential motion at the time."""
    dw: Any
    """Motion gained to the next."""
    b: Any
    """Friction limit at the time."""
    contact: Any
    plus: Any
    """Sign of ``phi_+'``."""
    minus: Any


class Intervals(NamedTuple):
    """The periodic sequence of states of one element."""

    at: Any
    """Start, end, force at start (room, 3)."""
    code: Any
    """State, and origin of a stick (room, 2)."""


class Sums(NamedTuple):
    """Primitives accumulated over the intervals of stick, signed slip and contact."""

    edge: Any
    """``cos k t, sin k t`` at every interval start (room, 2, top)."""
    primitives: Any
    """``C_k, S_k`` of each (6, top)."""
    lengths: Any
    ends: Any
    """Number of interval ends of each: without any the state lasts all period, or never is."""


class Workspace(NamedTuple):
    """Room for the worst case of one element; one for each thread."""

    parts: Any
    """Cosines and sines of the motion, padded (4, n4)."""
    scratch: Scratch
    search: Search
    segments: Segments
    intervals: Intervals
    clamps: Any
    """See ``find_states``."""
    sums: Sums
    rows: Any
    """Vectors (8, L)."""


class Stick(NamedTuple):
    """How a stick interval ``c h`` moves with its start ``a``."""

    c: Any
    """``f_x(a) - kt x(a)``."""
    by_kt: Any
    load: Any
    """``f_x(a)``."""
    by_X: Any
    """Factor of ``H_-(a)`` in ``dc/dX``."""
    by_Y: Any


class StickRows(NamedTuple):
    """Vectors of one stick interval, (L,) each."""

    h: Any
    """``(1/pi) int H_+``."""
    hv: Any
    """``(1/pi) int (tau - a) H_+``."""
    H: Any
    """``H_-(a)``."""
