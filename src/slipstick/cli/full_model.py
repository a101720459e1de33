"""What ``check`` tells of a finite element model: its size, how well it is reduced, where its contacts lie."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from slipstick.case.structure import Body
from slipstick.cli.terminal.guard import say
from slipstick.progress import duration

if TYPE_CHECKING:
    from slipstick.fem.contact_points import ContactPoints
    from slipstick.models.reduced_body import ReducedBody

_LARGE = 20_000
"""From this many dofs a direct solution takes seconds."""

_FEW, _MANY = 3, 6


def show_full_model(
    body: Body, omega: tuple[float, float], highest_order: int, frequency_text: Callable[[float], str]
) -> None:
    """Print the full model behind a reduced structure, the error of the reduction and the contact points."""
    full = body.reduced
    if full is None:
        return
    kept = "read from disk" if full.reused else "made"
    say(
        f"full model: {full.n_dofs} dofs ({full.source}); {len(full.structure.omega)} modes, solver {full.solver}; "
        f"{kept} in {duration(body.seconds)}"
    )
    for note in full.notes:
        say(f"  {note}")
    _errors(full, omega, highest_order, frequency_text)
    if full.points is not None:
        _points(full.points)


def frequencies(omega: tuple[float, float], highest_order: int, count: int) -> list[float]:
    """Where the reduction is compared: over the range asked for and up to the highest harmonic of its end.

    >>> frequencies((10.0, 20.0), 5, 3)
    [10.0, 20.0, 100.0]
    """
    low, high = sorted(omega)
    top = high * max(highest_order, 1)
    wanted = [low, high, top] if count <= _FEW else [*np.linspace(low, high, 3), *np.linspace(high, top, count - 2)[1:]]
    return [float(value) for value in dict.fromkeys(wanted)]


def _errors(
    full: ReducedBody, omega: tuple[float, float], highest_order: int, frequency_text: Callable[[float], str]
) -> None:
    large = full.n_dofs > _LARGE
    wanted = frequencies(omega, highest_order, _FEW if large else _MANY)
    few = "; the model is large, so at few frequencies" if large else ""
    say(f"reduction against direct solutions of the full model, relative error of the receptance{few}:")
    if large:
        say("  putting the full model together, then a direct solution for each of the frequencies ...")
    for value, error in full.receptance_errors(wanted):
        say(f"  {frequency_text(value)}: {error:.1e}")


def _points(points: ContactPoints) -> None:
    say(f"{points.count} contact points on the surface: position, outward normal, share of the area")
    for k, (at, normal, area) in enumerate(zip(points.positions, points.normals, points.areas, strict=True), 1):
        say(f"  {k:>3}  {_vector(at)}  {_vector(normal)}  {area:.4g}")
    if points.influence is not None:
        own = np.diag(points.influence)
        say(f"temperature over power of the points themselves: {own.min():.4g} to {own.max():.4g}")


def _vector(values: Sequence[float]) -> str:
    size = max(np.abs(values).max(), 1e-300)
    clean = np.where(np.abs(values) < 1e-9 * size, 0.0, values)  # rounding of normals
    return "(" + ", ".join(f"{value:.4g}" for value in clean) + ")"
