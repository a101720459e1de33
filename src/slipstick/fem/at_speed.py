"""Models at speed: by centrifugal stress of their mesh, or between matrices given at several speeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, in_radians, number, one, warn, wrong
from slipstick.fem.axis import Axis
from slipstick.fem.imported import ImportedModel
from slipstick.fem.rotation import Centrifugal
from slipstick.fem.rotation_store import kept_centrifugal
from slipstick.typing import Frequency, IntArray, Sparse

_LARGE_STRAIN = 1e-2
_MASS_BESIDE = 1e-2
"""Part of the mass that may be missing in the mesh."""


def at_speed(
    model: ImportedModel,
    speed: Frequency,
    *,
    axis: Axis | Mapping[str, Any] | None = None,
    others: Mapping[float, ImportedModel] | None = None,
) -> ImportedModel:
    """The model in a frame that turns with it: stiffness about its static state under centrifugal forces.

    Parameters
    ----------
    model
        At rest; with its mesh and materials, or with ``others``.
    speed
        rad/s, fixed for whatever is computed with the model.
    axis
        Of rotation, ``{"point": (0, 0, 0), "direction": (0, 0, 1)}``; not with ``others``, whose matrices hold it.
    others
        The same model by its other speeds, rad/s: then the stiffness is interpolated between the two nearest ones,
        linear in the square of the speed; else it is computed from the mesh.

    Returns
    -------
    ImportedModel
        With another ``K`` and with ``speed``; its last note says what was done.

    Raises
    ------
    InputError
        If it has no mesh or material, is not held, turns already, or the others are of another model.

    Warns
    -----
    SlipstickWarning
        A strain that no metal bears; mass that is not in the mesh.
    """
    moving = turned_model(model, speed, axis=axis, others=others)
    warn(moving.warnings[len(model.warnings) :])
    return moving


def turned_model(
    model: Any, speed: Any, *, axis: Any = None, others: Any = None, cache: Path | None = None
) -> ImportedModel:
    """The same, kept in a folder; what is suspicious is in the model's warnings alone."""
    found = Gathering()
    found.take(one, "model", model, ImportedModel, "what ss.import_model returns")
    wanted = found.take(_speed, speed)
    about = None if axis is None and others is not None else found.take(Axis.of, axis)
    if axis is not None and others is not None:
        found.faults.append(Fault("axis", "is given together with others", remedy="they hold it: leave it out"))
    given = None if others is None else found.take(_by_speed, others)
    found.end()
    assert wanted is not None
    if model.speed:
        raise InputError(Fault("speed", f"{model.source} is a model at {model.speed:g} rad/s already"))
    if given is not None:
        return _between(model, given, wanted)
    from scipy.sparse import csr_array

    assert about is not None
    turning = kept_centrifugal(model, wanted, about, cache)
    moved = np.linalg.norm(turning.displacement, axis=1).max()
    return replace(
        model,
        K=csr_array(model.K + turning.stiffness),
        speed=wanted,
        notes=(
            *model.notes,
            f"at {wanted:g} rad/s about {_shown(about.direction)} through {_shown(about.point)}: largest static "
            f"displacement {moved:.4g}, strain {turning.strain:.3g}; Coriolis forces are left out",
        ),
        warnings=(*model.warnings, *_doubts(model, turning)),
    )


def _speed(given: Any) -> float:
    return number("speed", in_radians("speed", given), "a speed >= 0, rad/s", above=0.0)


def _by_speed(others: Any) -> dict[float, ImportedModel]:
    expected = "models by their speed > 0, rad/s"
    if not isinstance(others, Mapping) or not others:
        raise wrong("others", others, expected)
    if not all(isinstance(model, ImportedModel) for model in others.values()):
        raise wrong("others", others, expected)
    speeds = [number("others", in_radians("others", speed), expected, above=SMALLEST) for speed in others]
    return dict(zip(speeds, others.values(), strict=True))


def _shown(vector: ArrayLike) -> str:
    return f"({', '.join(f'{x:g}' for x in np.asarray(vector))})"


def _doubts(model: ImportedModel, turning: Centrifugal) -> Iterator[str]:
    if turning.strain > _LARGE_STRAIN:
        yield (
            f"{model.source}: the strain at speed is {turning.strain:.2g}, beyond what metals bear: check speed, axis "
            "and units"
        )
    along = (model.dof_components == np.arange(3)[:, None]).astype(float)
    mass = float(np.mean([e @ (model.M @ e) for e in along]))
    if abs(mass - turning.mass) > _MASS_BESIDE * mass:
        yield (
            f"{model.source}: the mass is {mass:.4g}, that of the mesh {turning.mass:.4g}: centrifugal forces are "
            "those of the mesh"
        )


def _between(model: ImportedModel, others: Mapping[float, ImportedModel], speed: float) -> ImportedModel:
    """Matrices at a speed between those at which they are given, linear in its square."""
    known = {0.0: model, **others}
    speeds = sorted(known)
    if speed > speeds[-1]:
        raise InputError(
            Fault("speed", found=f"{speed:g}", expected=f"at most {speeds[-1]:g}, the highest speed with matrices")
        )
    low, high = next(pair for pair in pairwise(speeds) if speed <= pair[1])
    share = (speed**2 - low**2) / (high**2 - low**2)
    first, last = _stiffness_like(model, known[low]), _stiffness_like(model, known[high])
    note = f"at {speed:g} rad/s: stiffness between {low:g} and {high:g} rad/s, linear in the square of the speed"
    from scipy.sparse import csr_array

    return replace(model, K=csr_array((1.0 - share) * first + share * last), speed=speed, notes=(*model.notes, note))


def _stiffness_like(model: ImportedModel, other: ImportedModel) -> Sparse:
    """The stiffness of another model in the order of rows of this one."""
    order = np.argsort(_keys(other))
    place = order[np.searchsorted(_keys(other), _keys(model), sorter=order).clip(max=len(order) - 1)]
    if other.n_dofs != model.n_dofs or np.any(_keys(other)[place] != _keys(model)):
        raise InputError(f"{model.source} and {other.source}: have different dofs; matrices at speeds are of one model")
    mass = other.M[place][:, place]
    if abs(mass - model.M).max() > 1e-6 * abs(model.M).max():
        raise InputError(f"{model.source} and {other.source}: have different mass; matrices at speeds are of one model")
    return other.K[place][:, place]


def _keys(model: ImportedModel) -> IntArray:
    return model.dof_nodes * 8 + model.dof_components
