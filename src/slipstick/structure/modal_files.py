"""Arrays of a modal structure from an .npz file: checked against each other, and cut to the first modes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.structure.npz import array_shapes, read_any, read_arrays

_NEEDED = {"omega": 1, "mode_shapes": 2, "static_compliance": 2}
_DAMPING = ("loss_factor", "damping_ratio")
_LOAD = ("load_participation", "static_load_response", "second_load_response")


def modal_arrays(path: Path) -> dict[str, Any]:
    """The arrays of a file that ``ModalStructure.from_arrays`` knows.

    Raises
    ------
    InputError
        One sentence for each array that is missing, not real and finite, or does not fit the mode shapes.
    """
    arrays: dict[str, Any] = dict(read_arrays(path, _NEEDED, (*_LOAD, *_DAMPING, "second_residual")))
    faults = list(_shape_faults(path.name, arrays))
    if faults:
        raise InputError(faults)
    if "dofs" in array_shapes(path):
        arrays["dofs"] = read_any(path)["dofs"]
    return arrays


def first_modes(arrays: Mapping[str, Any], modes: int) -> dict[str, Any]:
    """The arrays of the first modes; the second residuals hold what the dropped ones leave."""
    if modes == arrays["omega"].size:
        return dict(arrays)
    dropped = arrays["mode_shapes"][:, modes:] / arrays["omega"][modes:] ** 4
    kept = {**arrays, "omega": arrays["omega"][:modes], "mode_shapes": arrays["mode_shapes"][:, :modes]}
    kept |= {name: arrays[name][:modes] for name in _DAMPING if name in arrays and arrays[name].ndim == 1}
    kept["second_residual"] = arrays.get("second_residual", 0.0) + dropped @ arrays["mode_shapes"][:, modes:].T
    if "load_participation" in arrays:
        participation = arrays["load_participation"]
        kept["load_participation"] = participation[:modes]
        kept["second_load_response"] = arrays.get("second_load_response", 0.0) + dropped @ participation[modes:]
    return kept


def modal_dofs(arrays: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the rows of the mode shapes: the file's own, else three directions a node.

    >>> modal_dofs({"mode_shapes": np.eye(6)})
    ('n1x', 'n1y', 'n1z', 'n2x', 'n2y', 'n2z')
    """
    if "dofs" in arrays:
        return tuple(str(name) for name in np.asarray(arrays["dofs"]).ravel())
    rows = np.asarray(arrays["mode_shapes"]).shape[0]
    if rows % 3:
        raise InputError(
            Fault(
                "dofs",
                IS_MISSING,
                remedy=f"{rows} rows of mode_shapes are not whole nodes of x, y, z: give their names",
            )
        )
    return tuple(f"n{row // 3 + 1}{'xyz'[row % 3]}" for row in range(rows))


def size_faults(shape: tuple[int, int], modes: int | None, dofs: Sequence[str] | None) -> Iterator[Fault]:
    """Whether mode shapes (n_dofs, n_modes) have as many modes, and as many rows as there are names."""
    rows, available = shape
    if modes is not None and not 1 <= modes <= available:
        yield Fault("modes", found=str(modes), expected=f"1 to {available}, the modes in the file")
    if dofs is not None and len(dofs) != rows:
        yield Fault("dofs", found=f"{len(dofs)} names", expected=f"{rows}, one for each row of mode_shapes")


def _shape_faults(file: str, arrays: Mapping[str, Any]) -> Iterator[Fault]:
    n_dofs, n_modes = arrays["mode_shapes"].shape
    expected = {
        "omega": (n_modes,),
        "static_compliance": (n_dofs, n_dofs),
        "second_residual": (n_dofs, n_dofs),
        "load_participation": (n_modes,),
        "static_load_response": (n_dofs,),
        "second_load_response": (n_dofs,),
        **{name: (n_modes,) for name in _DAMPING if name in arrays and arrays[name].ndim},
    }
    for name, shape in expected.items():
        if name in arrays and arrays[name].shape != shape:
            yield (
                Fault(
                    file,
                    f"'{name}' has shape {arrays[name].shape}",
                    expected=f"{shape} to agree with mode_shapes {(n_dofs, n_modes)}",
                )
            )
