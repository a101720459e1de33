"""Whirl frequencies over the speed of rotation, and the speeds at which engine orders meet them (Campbell diagram)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import numbers, whole, wrong
from slipstick.structure.complex_modes import ComplexModes, complex_modes
from slipstick.structure.cyclic import TravellingWave
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.protocol import Structure
from slipstick.typing import Array, ComplexArray, IntArray

if TYPE_CHECKING:
    import xarray as xr

_NEAR = 1e-12
_ROUNDS = 60
_HALVINGS = 6
_SURE = 0.6
"""Likeness of two mode shapes from which on they are taken for one mode."""

AtSpeed = Callable[[float], MatrixStructure]


@dataclass(frozen=True, kw_only=True)
class _Point:
    """Modes at a speed, in an order of their own."""

    speed: float
    modes: ComplexModes

    @property
    def states(self) -> ComplexArray:
        """Right vectors with their velocities, of unit size, (2 n, k)."""
        poles, right, _ = self.modes
        stacked = np.vstack([right * np.maximum(np.abs(poles), 1e-300), right * poles])
        return np.asarray(stacked / np.linalg.norm(stacked, axis=0))

    def ordered(self, order: IntArray) -> _Point:
        poles, right, left = self.modes
        return _Point(speed=self.speed, modes=ComplexModes(poles[order], right[:, order], left[:, order]))


def campbell(
    structure: MatrixStructure | AtSpeed, speeds: Sequence[float] | Array, *, engine_orders: Sequence[int] = (1,),
    modes: int | None = None,
) -> xr.Dataset:  # fmt: skip
    """The Campbell diagram of a rotor: damped frequencies and damping of its modes over its speed, one by one.

    ``natural_frequencies`` of the structure are the undamped ones.

    Parameters
    ----------
    structure
        With gyroscopic or circulatory matrices (at any speed: it is set here), or a function that gives the structure
        at a speed, such as of matrices in the rotating frame. Contacts are not in it, damping is: hysteretic damping as
        viscous damping that is equal at each natural frequency.
    speeds
        Rad/s, ascending, two or more. Modes are followed from the highest one down, with more speeds between where
        their shapes change fast.
    engine_orders
        Whole numbers n >= 1: the speeds at which a frequency is n times the speed are found to rounding.
    modes
        So many of the lowest at the highest speed; all by default, at most 20.

    Returns
    -------
    xarray.Dataset
        ``frequency`` (rad/s, damped: imaginary part of the pole), ``damping_ratio`` and ``whirl`` over ``speed`` and
        ``mode``, which counts frequencies at the highest speed; over ``crossing`` in ascending speed:
        ``crossing_speed``, ``crossing_frequency`` (rad/s), ``crossing_order``, ``crossing_mode``, ``crossing_whirl``.
        Whirl is 1 forwards, -1 backwards, 0 along a line or unknown: it is the sense of the orbits that dofs named
        alike but for x and y make, summed over their areas.

    Raises
    ------
    InputError
        For speeds that are not ascending, a structure without rotation, engine orders below 1.

    Examples
    --------
    >>> import numpy as np
    >>> turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    >>> top = MatrixStructure(M=np.eye(2), K=4.0 * np.eye(2), gyroscopic=turn, speed=0.0, dofs=["x", "y"])
    >>> found = campbell(top, [0.0, 1.0, 3.0])                              # w^2 -+ W w - 4 = 0
    >>> found.frequency.values.round(9).tolist()
    [[2.0, 2.0], [1.561552813, 2.561552813], [1.0, 4.0]]
    >>> found.crossing_speed.values.round(9).tolist(), found.crossing_whirl.values.tolist()
    ([1.414213562], [-1])
    """
    import xarray as xr

    at_speed = _at_speed(structure)
    given = np.atleast_1d(numbers("speeds", speeds, "speeds in rad/s, ascending, two or more"))
    if given.ndim != 1 or given.size < 2 or np.any(np.diff(given) <= 0.0):
        raise wrong("speeds", speeds, "speeds in rad/s, ascending, two or more")
    orders = [whole(("engine_orders", i), n, 1) for i, n in enumerate(engine_orders)]
    count = None if modes is None else whole("modes", modes, 1)
    dofs = at_speed(float(given[-1])).dofs
    pairs = whirl_pairs(dofs)
    top = _modes_at(at_speed, float(given[-1]))
    kept = min(top.modes.poles.size, 20 if count is None else count)
    # some modes more than are told, so that what crosses the last of them is known
    followed = [top.ordered(np.arange(min(top.modes.poles.size, kept + 6)))]
    asked = [followed[0]]
    for speed in given[-2::-1].tolist():
        followed += _followed(at_speed, followed[-1], speed, _HALVINGS)
        asked.append(followed[-1])
    asked.reverse()
    frequency, damping = (np.array([of(p.modes.poles)[:kept] for p in asked]) for of in (np.imag, _ratio))
    sense = np.array([_whirl(p.modes.right, pairs)[:kept] for p in asked])
    met = sorted(_crossings(at_speed, followed[::-1], orders, kept, pairs))
    columns = list(zip(*met, strict=True)) or [()] * 5
    names = ("speed", "frequency", "order", "mode", "whirl")
    crossings = {
        f"crossing_{name}": ("crossing", np.array(column, dtype=float if name in ("speed", "frequency") else int))
        for name, column in zip(names, columns, strict=True)
    }
    data = xr.Dataset(
        {
            "frequency": (("speed", "mode"), frequency), "damping_ratio": (("speed", "mode"), damping),
            "whirl": (("speed", "mode"), sense), **crossings,
        },
        coords={"speed": given, "mode": np.arange(1, kept + 1)},
        attrs={"engine_orders": np.array(orders, dtype=int)},
    )  # fmt: skip
    for name in ("speed", "frequency", "crossing_speed", "crossing_frequency"):
        data[name].attrs["units"] = "rad/s"
    for name in ("frequency", "crossing_frequency"):
        data[name].attrs["long_name"] = "damped frequency without contacts"
    return data


def _at_speed(structure: Any) -> AtSpeed:
    if isinstance(structure, MatrixStructure):
        if structure.gyroscopic is None and structure.circulatory is None:
            raise InputError(Fault("structure", "nothing in it turns", remedy="give it gyroscopic=..., speed=..."))
        return structure.at_speed
    if isinstance(structure, TravellingWave):
        raise InputError(
            Fault(
                "structure", "is a sector of a disc, whose frequencies stand over its nodal diameters",
                remedy="draw its interference diagram: 'slipstick interference', in Python ss.models.interference",
            )
        )  # fmt: skip
    if isinstance(structure, Structure):
        raise InputError(
            Fault(
                "structure", "has no gyroscopic matrices",
                expected='kind = "rotor", or "matrices" with gyroscopic; in Python an ss.MatrixStructure',
            )
        )  # fmt: skip
    if not callable(structure):
        raise wrong("structure", structure, "an ss.MatrixStructure with gyroscopic=..., or a function of the speed")
    made: AtSpeed = structure
    return made


def _modes_at(at_speed: AtSpeed, speed: float) -> _Point:
    own = at_speed(speed)
    none = np.zeros((len(own.dofs), 0))
    equations = own.time_equations(none, none)
    return _Point(speed=speed, modes=complex_modes(equations.M, equations.C, equations.K).upper)


def _followed(at_speed: AtSpeed, known: _Point, speed: float, halvings: int) -> list[_Point]:
    """Points from a known one to a speed, more of them where modes are not found again for sure."""
    from scipy.optimize import linear_sum_assignment

    new = _modes_at(at_speed, speed)
    likeness = np.abs(known.states.conj().T @ new.states) ** 2
    apart = np.abs(known.modes.poles[:, None] - new.modes.poles) / np.abs(new.modes.poles).max(initial=1e-300)
    rows, order = linear_sum_assignment(apart - likeness)
    sure = likeness[rows, order].min(initial=1.0) > _SURE
    if not sure and halvings:
        between = _followed(at_speed, known, 0.5 * (known.speed + speed), halvings - 1)
        return [*between, *_followed(at_speed, between[-1], speed, halvings - 1)]
    return [new.ordered(order)]


def _crossings(
    at_speed: AtSpeed, points: Sequence[_Point], orders: Sequence[int], kept: int, pairs: Array
) -> list[tuple[float, float, int, int, int]]:
    """Speed, frequency, engine order, mode and whirl of every crossing between neighbours."""
    out = []
    for low, high in pairwise(points):
        for n in orders:
            ends = [p.modes.poles.imag[:kept] - n * p.speed for p in (low, high)]
            for mode in np.flatnonzero((ends[0] > 0.0) != (ends[1] > 0.0)).tolist():
                speed, pole, shape = _crossing(at_speed, low, high, n, mode)
                out.append((speed, pole.imag, n, mode + 1, int(_whirl(shape[:, None], pairs)[0])))
    return out


def _crossing(at_speed: AtSpeed, low: _Point, high: _Point, n: int, mode: int) -> tuple[float, complex, ComplexArray]:
    """Where ``Im pole = n speed``, by false position with bisection; the mode is the nearest in pole and shape."""
    ends = [(p.speed, complex(p.modes.poles[mode]), p.states[:, mode], p.modes.right[:, mode]) for p in (low, high)]
    for round_ in range(_ROUNDS):
        (a, first, first_state, _), (b, last, last_state, _) = ends
        rest = first.imag - n * a, last.imag - n * b
        share = 0.5 if round_ % 3 == 2 else rest[0] / (rest[0] - rest[1])
        speed = a + min(max(share, 0.0), 1.0) * (b - a)
        new = _modes_at(at_speed, speed)
        expected = first + (speed - a) / (b - a) * (last - first)
        near, state = (first_state, last_state)[share > 0.5], new.states
        apart = np.abs(new.modes.poles - expected) / max(abs(expected), 1e-300)
        k = int(np.argmin(apart - np.abs(near.conj() @ state) ** 2))
        found = (speed, complex(new.modes.poles[k]), state[:, k], new.modes.right[:, k])
        off = found[1].imag - n * speed
        if abs(off) <= _NEAR * abs(found[1]) or b - a <= _NEAR * abs(b):
            break
        ends[0 if (off > 0.0) == (rest[0] > 0.0) else 1] = found
    return found[0], found[1], found[3]


def _ratio(poles: ComplexArray) -> Array:
    return np.asarray(-poles.real / np.maximum(np.abs(poles), 1e-300))


def whirl_pairs(dofs: Sequence[str]) -> Array:
    """Numbers of dofs named alike but for "x" and "y" at the end, of which no tilts "rx", "ry", (k, 2).

    >>> whirl_pairs(["n0x", "n0y", "n0rx", "n0ry"]).tolist()
    [[0, 1]]
    """
    place = {name: i for i, name in enumerate(dofs)}
    found = [
        (i, place[f"{name[:-1]}y"])
        for name, i in place.items()
        if name.endswith("x") and not name.endswith("rx") and f"{name[:-1]}y" in place
    ]
    return np.array(found, dtype=int).reshape(-1, 2)


def _whirl(shapes: ComplexArray, pairs: Array) -> Array:
    """Sense of each shape (n, k): that of the areas of its orbits, 0 where they are thin."""
    x, y = shapes[pairs[:, 0]], shapes[pairs[:, 1]]
    # x = Re(x e^{iwt}), y alike: forwards (from x to y) where y lags x by a quarter, y = -i x
    area = -np.imag(x.conj() * y).sum(axis=0)
    size = 0.5 * (np.abs(x) ** 2 + np.abs(y) ** 2).sum(axis=0)
    return np.where(np.abs(area) > 1e-3 * np.maximum(size, 1e-300), np.sign(area), 0.0).astype(int)
