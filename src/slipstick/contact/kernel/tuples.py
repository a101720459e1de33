"""Named tuples of arrays, and codes, between the compiled functions of the contact element."""

from __future__ import annotations

from typing import NamedTuple

from slipstick.trig.basis import Polynomial, Scratch
from slipstick.typing import Array, BoolArray, IntArray

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


class BatchOutputs(NamedTuple):
    """Results of all elements, and what they were computed from."""

    vectors: Array
    """Rows ``V_...`` (elements, 7, L)."""
    matrices: Array
    """dFx/dX, dFx/dY, dFy/dY (elements, 3, L, L)."""
    scalars: Array
    """``S_...`` (elements, 6)."""
    motion: Array
    """Tangential and normal motion, the rubbing motion included (elements, 2, L)."""
    parameters: Array
    """``P_...`` (elements, 5)."""
    on_ports: Array
    """Forces on all ports, and their derivatives by omega at fixed motion (2, motions, n_ports, L)."""


class ElementInputs(NamedTuple):
    """Of one element."""

    X: Array
    """Tangential motion, the rubbing motion included (L,)."""
    Y: Array
    """Normal motion likewise (L,)."""
    parameters: Array
    """``P_...`` (5,)."""


class ElementOutputs(NamedTuple):
    """Of one element."""

    vectors: Array
    """Rows ``V_...`` (7, L)."""
    matrices: Array
    """dFx/dX, dFx/dY, dFy/dY (3, L, L)."""
    scalars: Array
    """``S_...`` (6,)."""


class States(NamedTuple):
    """Intervals of every element of a batch; arrays without elements where they are not asked for."""

    totals: IntArray
    """Number of intervals (elements,)."""
    at: Array
    """Start, end, force at start (elements, room, 3)."""
    code: IntArray
    """State, and origin of a stick (elements, room, 2)."""


class ElementMotion(NamedTuple):
    """Motion and constants of one element."""

    X: Polynomial
    """Without its mean, which does not matter to the law and would cost digits."""
    Y: Polynomial
    """Less the gap."""
    v: float
    kt: float
    mu: float
    kn: float
    limit: float
    """``mu kn``: friction limit over penetration."""
    steep: bool
    """See ``contact.kernel.steep_sticks``."""


class Search(NamedTuple):
    """Arrays for the search of critical times."""

    g: Array
    """``y, y', y''``, then ``p, p', p''`` of ``phi_+'`` and of ``phi_-'`` at the cell middles (9, cells)."""
    p: Array
    """Cosines and sines of the same three polynomials (6, n4)."""
    skip: BoolArray
    margin: Array
    stack: Array
    lists: Array
    """Roots of each (3, room)."""
    rising: BoolArray
    counts: IntArray
    signs: IntArray


class Segments(NamedTuple):
    """Critical times, and the state of the motion from each to the next."""

    time: Array
    kind: IntArray
    up: BoolArray
    """Whether the root that makes the time is a rising one."""
    w: Array
    """Total tangential motion at the time."""
    dw: Array
    """Motion gained to the next."""
    b: Array
    """Friction limit at the time."""
    contact: BoolArray
    plus: Array
    """Sign of ``phi_+'``."""
    minus: Array


class Intervals(NamedTuple):
    """The periodic sequence of states of one element."""

    at: Array
    """Start, end, force at start (room, 3)."""
    code: IntArray
    """State, and origin of a stick (room, 2)."""


class Sums(NamedTuple):
    """Primitives accumulated over the intervals of stick, signed slip and contact."""

    edge: Array
    """``cos k t, sin k t`` at every interval start (room, 2, top)."""
    primitives: Array
    """``C_k, S_k`` of each (6, top)."""
    lengths: Array
    ends: IntArray
    """Number of interval ends of each: without any the state lasts all period, or never occurs."""


class Workspace(NamedTuple):
    """Arrays for the worst case of one element; one for each thread."""

    parts: Array
    """Cosines and sines of the motion, padded (4, n4)."""
    scratch: Scratch
    search: Search
    segments: Segments
    intervals: Intervals
    clamps: Array
    """See ``find_states``."""
    sums: Sums
    rows: Array
    """Vectors (8, L)."""


class Stick(NamedTuple):
    """Coefficients of a stick interval ``c h`` and its derivatives by its start ``a``."""

    c: float
    """``f_x(a) - kt x(a)``."""
    by_kt: float
    load: float
    """``f_x(a)``."""
    by_X: float
    """Factor of ``H_-(a)`` in ``dc/dX``."""
    by_Y: float


class StickRows(NamedTuple):
    """Vectors of one stick interval, (L,) each."""

    h: Array
    """``(1/pi) int H_+``."""
    hv: Array
    """``(1/pi) int (tau - a) H_+``."""
    H: Array
    """``H_-(a)``."""
