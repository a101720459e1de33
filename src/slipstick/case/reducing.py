"""What the finite element kinds of a case file share: the folder of reductions, progress, materials."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from slipstick.case.body import Body, Tell
from slipstick.case.fe_tables import MaterialTable
from slipstick.errors import IS_MISSING, Fault, InputError, SlipstickError, SlipstickWarning

if TYPE_CHECKING:
    from slipstick.fem.materials import Material
    from slipstick.models.reduced_body import ReducedBody
    from slipstick.solve.linear.modes import StageProgress

CACHE = "slipstick-cache"
"""Folder beside the case in which reductions are kept."""

_EVERY = 4.0
NEEDED = ("young", "poisson", "density")
"""What a material has at least."""


def reduction_folder(folder: Path) -> Path | None:
    """Where reductions are kept; None where the folder of the case cannot be written."""
    own = folder / CACHE
    return own if os.access(own if own.exists() else folder, os.W_OK) else None


def stages(tell: Tell) -> Callable[[StageProgress], None]:
    """A listener that tells each stage when it begins, and now and then how far it is."""
    last, stage = [time.monotonic()], [""]

    def hear(event: StageProgress) -> None:
        now = time.monotonic()
        if event.stage != stage[0]:
            tell(f"  {event.stage} ...")
        elif now - last[0] >= _EVERY:
            tell(f"  {event.stage}: {event.done} of {event.total}")
        else:
            return
        last[0], stage[0] = now, event.stage

    return hear


def reduced(tell: Tell, make: Callable[[Callable[[StageProgress], None]], ReducedBody], *, force: bool) -> Body:
    """A reduction; one that does not succeed is a fault of the case. Its error is judged with the whole case."""
    began = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            body = make(stages(tell))
    except InputError:
        raise
    except SlipstickError as error:
        raise InputError(Fault(statement=str(error))) from None
    tell(f"  {body.structure.omega.size} modes")
    return Body(structure=body.structure, reduced=body, force=force, seconds=time.perf_counter() - began)


def material_of(table: MaterialTable) -> Material:
    """The material of a table that must be complete."""
    from slipstick.fem.materials import Material

    given = {name: value for name, value in table.model_dump().items() if value is not None}
    missing = [
        Fault(("material", name), IS_MISSING, remedy="a material needs young, poisson and density")
        for name in NEEDED
        if name not in given
    ]
    if missing:
        raise InputError(missing)
    return Material(**given)
