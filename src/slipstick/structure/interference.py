"""Interference of a disc's waves with engine orders (SAFE diagram): resonances of frequency AND shape.

A pattern of n lobes that stands in space excites a disc of N equal sectors at the frequency ``n W`` and in the nodal
diameter d that looks alike on the sectors: ``n = k N + d`` or ``n = k N - d`` [M. P. Singh et al., SAFE diagram, Texas
A&M Turbomachinery Symposium, 1988].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import Gathering, in_radians, shown, whole, wrong
from slipstick.typing import Array, Frequency

if TYPE_CHECKING:
    import xarray as xr

_STEPS = 64
"""Intervals of the range of speeds, each searched for crossings of a disc that changes with the speed."""


class Disc(Protocol):
    """Members of a disc that are used, as of an ``ss.CyclicStructure``."""

    @property
    def sectors(self) -> int:
        """Number of equal sectors."""

    def natural_frequencies(self, nodal_diameter: int) -> Array:
        """Rad/s, ascending, of a nodal diameter from 0 to half the number of sectors."""


def nodal_diameter(engine_order: int, sectors: int) -> int:
    """The nodal diameter that an engine order excites.

    >>> [nodal_diameter(n, 24) for n in (4, 12, 20, 24, 25)]
    [4, 12, 4, 0, 1]
    """
    d = engine_order % sectors
    return min(d, sectors - d)


def interference(
    disc: Disc | Callable[[float], Disc], speed: tuple[Frequency, Frequency], *, engine_orders: Sequence[int],
    modes: int = 3,
) -> xr.Dataset:  # fmt: skip
    """The interference (SAFE) diagram of a disc: its frequencies by nodal diameter, and which engine orders meet them.

    Parameters
    ----------
    disc
        With ``sectors`` and ``natural_frequencies(nodal_diameter)``, such as an ``ss.CyclicStructure``; or a function
        that gives it at a speed, of a disc that stiffens as it turns.
    speed
        Lowest and highest speed of rotation, rad/s or texts such as "9000 rpm".
    engine_orders
        Whole numbers n >= 1: lobes of the patterns, such as numbers of vanes and their multiples.
    modes
        So many modes (families) of each nodal diameter.

    Returns
    -------
    xarray.Dataset
        ``frequency`` over ``nodal_diameter`` and ``mode``, rad/s, at the highest speed; over ``crossing``, in ascending
        speed: ``crossing_speed``, ``crossing_frequency`` (rad/s), ``crossing_order``, ``crossing_nodal_diameter``,
        ``crossing_mode`` and ``crossing_wave``, 1 where the pattern runs round the disc as it stands in space
        (n = k N - d counted with the blades is backwards: -1), 0 for a standing wave (d = 0 or N/2).

    Raises
    ------
    InputError
        For something that is no disc, speeds out of order, engine orders below 1.

    Examples
    --------
    Four blades: engine orders 3 and 1 both excite one nodal diameter, the first one backwards.

    >>> import slipstick as ss
    >>> disc = ss.CyclicStructure(M=([[1.0]], [[0.0]]), K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=4)
    >>> diagram = ss.models.interference(disc, (0.1, 2.0), engine_orders=(1, 2, 3), modes=1)
    >>> diagram.crossing_speed.values.round(4), diagram.crossing_order.values, diagram.crossing_wave.values
    (array([0.5774, 1.118 , 1.7321]), array([3, 2, 1]), array([-1,  0,  1]))
    """
    import xarray as xr

    checks = Gathering()
    orders = [checks.take(whole, ("engine_orders", i), n, 1) for i, n in enumerate(engine_orders)]
    count = checks.take(whole, "modes", modes, 1)
    ends = [checks.take(in_radians, "speed", end) for end in speed]
    checks.end()
    assert count is not None
    low, high = (float(cast(float, end)) for end in ends)
    if not 0.0 <= low < high:
        raise wrong("speed", speed, "two speeds >= 0, the second one above the first")
    at_speed, fixed = _at_speed(disc)
    top = at_speed(high)
    N = top.sectors
    found = np.full((N // 2 + 1, count), np.nan)
    for d in range(N // 2 + 1):
        known = np.asarray(top.natural_frequencies(d), dtype=float)[:count]
        found[d, : known.size] = known
    met = []
    for n in orders:
        assert n is not None
        d = nodal_diameter(n, N)
        for mode in np.flatnonzero(np.isfinite(found[d])).tolist():
            speeds = [found[d, mode] / n] if fixed else _speeds(at_speed, d, mode, n, low, high)
            wave = 0 if d in (0, N - d) else 1 if n % N == d else -1
            met += [(float(w), n * float(w), n, d, mode + 1, wave) for w in speeds if low <= w <= high]
    names = ("speed", "frequency", "order", "nodal_diameter", "mode", "wave")
    columns = list(zip(*sorted(met), strict=True)) or [()] * len(names)
    data = xr.Dataset(
        {
            "frequency": (("nodal_diameter", "mode"), found),
            **{
                f"crossing_{name}": ("crossing", np.array(column, dtype=float if i < 2 else int))
                for i, (name, column) in enumerate(zip(names, columns, strict=True))
            },
        },
        coords={"nodal_diameter": np.arange(N // 2 + 1), "mode": np.arange(1, count + 1)},
        attrs={"sectors": N, "speed": np.array([low, high]), "engine_orders": np.array(orders, dtype=int)},
    )
    for name in ("frequency", "crossing_speed", "crossing_frequency"):
        data[name].attrs["units"] = "rad/s"
    return data


def _at_speed(disc: Any) -> tuple[Callable[[float], Disc], bool]:
    """The disc as a function of the speed, and whether it is constant."""
    if hasattr(disc, "sectors") and hasattr(disc, "natural_frequencies"):
        return lambda _: disc, True
    if callable(disc):
        return disc, False
    raise InputError(f"disc: found {shown(disc)}; expected an ss.CyclicStructure, or a function of the speed")


def _speeds(at_speed: Callable[[float], Disc], d: int, mode: int, n: int, low: float, high: float) -> list[float]:
    """All speeds between two ends at which a frequency is n times the speed."""
    from scipy.optimize import brentq

    def difference(speed: float) -> float:
        return float(at_speed(speed).natural_frequencies(d)[mode]) - n * speed

    grid = np.linspace(low, high, _STEPS + 1)
    values = np.array([difference(speed) for speed in grid.tolist()])
    inside = np.flatnonzero((values[:-1] > 0.0) != (values[1:] > 0.0))
    return [float(brentq(difference, grid[i], grid[i + 1], xtol=1e-13 * high, rtol=1e-14)) for i in inside.tolist()]
