"""Every ``[structure]`` of a case: the results of its kinds, and the common part of finite element reductions."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.case.script_text import Call
from slipstick.case.table import Table
from slipstick.case.validation import ReadTable
from slipstick.errors import Fault, InputError, SlipstickError, SlipstickWarning
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.fem.model import ImportedModel
    from slipstick.models.bolts import PretensionBolts
    from slipstick.models.reduced_body import ReducedBody
    from slipstick.models.reduced_sector import ReducedSector
    from slipstick.models.surface_pair import SurfacePair
    from slipstick.solve.linear.modes import StageProgress
    from slipstick.structure.disc import Disc
    from slipstick.structure.modal_fit import ModalFit
    from slipstick.structure.protocol import Structure
    from slipstick.structure.tabulated import TabulatedStructure

Tell = Callable[[str], None]
CACHE = "slipstick-cache"
"""Folder beside the case in which reductions are kept."""
_EVERY = 4.0


def silent(_text: str) -> None:
    """A listener that says nothing."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """The structure of a case, and the finite element model behind it where there is one.

    ``disc``: the whole disc of which the structure is a sector in a wave, where blades differ.
    ``joints``: contacts between its surfaces. ``bolts``: sections of the model that are cut.
    ``sector``: the reduced finite element sector whose wave the structure is.
    ``model``: an imported model that is the structure itself. ``force``: a reduction that is too coarse is taken all
    the same. ``seconds``: the time to make or to read it. ``fit``: the modal analysis of a test, or its table.
    """

    structure: Structure
    reduced: ReducedBody | None = None
    joints: tuple[SurfacePair, ...] = ()
    bolts: PretensionBolts | None = None
    model: ImportedModel | None = None
    force: bool = False
    seconds: float = 0.0
    disc: Disc | None = None
    sector: ReducedSector | None = None
    fit: ModalFit | TabulatedStructure | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Approximations and suspicious values of the model, one sentence each."""
        behind = self.reduced or self.sector or self.model or self.fit
        return () if behind is None else behind.warnings


@dataclass(frozen=True, kw_only=True)
class Described:
    """The result of a ``[structure]`` table: the body where it has no fault, and the dofs as far as known."""

    body: Body | None = None
    dofs: Sequence[str] | None = None
    made: bool = False
    """Whether the kind of structure is known, though some of its keys may be wrong."""

    @property
    def structure(self) -> Structure | None:
        """The structure, where nothing is wrong with it."""
        return self.body.structure if self.body is not None else None

    @property
    def disc(self) -> Disc | None:
        """The whole disc, where blades differ: results are those of all sectors."""
        return self.body.disc if self.body is not None else None


@dataclass(frozen=True, kw_only=True)
class StructureKind:
    """One ``kind`` of ``[structure]``; :data:`slipstick.case.sections.STRUCTURES` lists them.

    ``table``: its keys. ``build``: the structure, as far as they are right; the faults it finds go to the
    gathering. ``script``: the lines of Python that make ``structure`` (``body`` too where there is one) of a table.
    """

    table: type[Table]
    build: Callable[[ReadTable, Path, Tell, Gathering], Described]
    script: Callable[[Any, Path], list[str]]


def within(fault: Fault, keys: Sequence[str]) -> Fault:
    """A fault of the model at the key it belongs to, else at its file or the table as a whole."""
    if fault.where and fault.where[0] in keys:
        return fault
    return fault.inside("file") if "file" in keys else fault


def reducing_kind(
    table: type[Table], make: Callable[..., Body], script: Callable[[Any, Path], list[str]]
) -> StructureKind:
    """A finite element kind, which takes time to make: nothing is made of a table with faults, here or elsewhere."""
    keys = tuple(table.model_fields)

    def build(row: ReadTable, folder: Path, tell: Tell, gathering: Gathering) -> Described:
        if not row.complete or getattr(row.table, "waits", False):
            return Described()
        try:
            body = make(row.table, folder, tell)
        except InputError as error:
            gathering.faults += [within(fault, keys) for fault in error.faults]
            return Described()
        return Described(body=body, dofs=body.structure.dofs)

    return StructureKind(table=table, build=build, script=script)


def reduction_folder(folder: Path) -> Path | None:
    """Where reductions are kept; None where the folder of the case cannot be written."""
    cache = folder / CACHE
    return cache if os.access(cache if cache.exists() else folder, os.W_OK) else None


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


def reduced(tell: Tell, body: Call, folder: Path, *, force: bool) -> Body:
    """A reduction; one that does not succeed is a fault of the case. Its error is judged with the whole case."""
    began = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            made = body.but(cache=reduction_folder(folder), listener=stages(tell)).made()
    except InputError:
        raise
    except SlipstickError as error:
        raise InputError(Fault(statement=str(error))) from None
    tell(f"  {made.structure.omega.size} modes")
    return Body(structure=made.structure, reduced=made, force=force, seconds=time.perf_counter() - began)
