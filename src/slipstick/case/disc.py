"""``[structure] kind = "disc"``: a sector in a travelling wave, or a disc of blades that differ.

The sector is given by its matrices, or with a ``file`` or a ``size`` as a finite element model.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, PlainValidator

from slipstick.case.fe import (
    MOST_CONTACTS,
    RELATIVE_ERROR,
    Contacts,
    MaterialTable,
    ReductionTable,
    RelativeError,
    Shapes,
    SurfaceName,
    accuracy_faults,
    import_call,
    imported_model,
    material_call,
)
from slipstick.case.matrices import KEYS, matrix_text, read_given, renamed
from slipstick.case.rotor import AxisTable
from slipstick.case.script_text import Call, Code, call, here
from slipstick.case.structure import (
    CACHE,
    Body,
    Described,
    StructureKind,
    Tell,
    reducing_kind,
    reduction_folder,
    stages,
)
from slipstick.case.table import (
    Frequency,
    MatrixGiven,
    NotNegative,
    Positive,
    RawTable,
    Table,
    at,
    list_or_file,
    unexpected,
)
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, Fault, InputError, SlipstickError, SlipstickWarning
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.fem.model import ImportedModel


def _is_matrix(value: Any) -> bool:
    """Rows of numbers, or the name of a file."""
    rows = isinstance(value, list) and value and all(isinstance(row, list) for row in value)
    return isinstance(value, str) or bool(rows and not any(isinstance(x, list) for row in value for x in row))


def _one_or_pair(value: Any) -> Any:
    """A matrix, or a list of two: that of the sector and that from the next one."""
    pair = isinstance(value, list) and len(value) == 2 and all(map(_is_matrix, value))
    if pair and not _is_matrix(value):
        return [list_or_file(matrix) for matrix in value]
    if not _is_matrix(value):
        raise unexpected("a square list of rows, or a list of two: of the sector and from the next one, [M0, M1]")
    return list_or_file(value)


SectorMatrix = Annotated[Any, PlainValidator(_one_or_pair)]
_PAIR = "a list of two, [M0, M1]: rows or a file, of the sector and from the next one"


class DeviationTable(Table):
    """By how much blades differ."""

    stiffness: list[float] | None = Field(default=None, description="a list of relative deviations, one for each blade")
    spread: NotNegative | None = Field(default=None, description="a number >= 0, the standard deviation of random ones")
    seed: int = Field(default=0, ge=0, description="a whole number >= 0: the same one gives the same blades")
    families: int | None = Field(default=None, ge=1, description="a whole number >= 1, families of tuned modes kept")


class MistuningTable(DeviationTable):
    """``mistuning = { spread = 0.02, seed = 1, blade = [[1.0]] }``."""

    blade: MatrixGiven = Field(description="rows or a file, the blade's share of the stiffness of the sector")


def deviation_faults(raw: Mapping[str, Any]) -> list[Fault]:
    """The deviations are said in one way."""
    given = raw.get("mistuning")
    if not isinstance(given, Mapping):
        return []
    if "stiffness" in given and "spread" in given:
        return [Fault(("mistuning", "spread"), "is given together with stiffness", remedy="keep one of them")]
    if not {"stiffness", "spread"} & set(given):
        return [Fault(("mistuning", "stiffness"), IS_MISSING, remedy="give one for each blade, or spread and seed")]
    return []


class DiscTable(Table):
    """``[structure] kind = "disc"``."""

    kind: Literal["disc"]
    dofs: list[str] = Field(min_length=1, description='a list of names such as ["tip", "left", "right"]')
    sectors: int = Field(ge=2, le=1000, description="a whole number >= 2, how many sectors the disc has")
    engine_order: int = Field(
        ge=-1_000_000, le=1_000_000,
        description="a whole number, of the fundamental frequency, < 0 for blades numbered in the sense of rotation",
    )  # fmt: skip
    mass: SectorMatrix = Field(description=_PAIR)
    damping: SectorMatrix | None = Field(default=None, description=_PAIR)
    stiffness: SectorMatrix = Field(description=_PAIR)
    loss_factor: NotNegative = Field(default=0.0, description="a number >= 0, the hysteretic loss factor")
    mistuning: MistuningTable | None = Field(
        default=None, description="a table such as { spread = 0.02, seed = 1, blade = [[1.0]] }"
    )

    @classmethod
    def cross_check(cls, raw: Mapping[str, Any]) -> list[Fault]:
        """The deviations are said in one way."""
        return deviation_faults(raw)


def _disc(row: ReadTable, folder: Path, tell: Tell, found: Gathering) -> Described:
    from slipstick.structure.cyclic import NEXT

    dofs = row.get("dofs")
    names = None if dofs is None else [*dofs, *(name + NEXT for name in dofs)]
    given = {
        letter: pair
        for letter, key in KEYS.items()
        if (value := row.get(key)) is not None and (pair := _matrices(value, key, folder, found)) is not None
    }
    if not row.complete or found.faults:
        return Described(dofs=names, made=True)
    table = row.table
    try:
        sector = _sector(table, given).made()
        wave = sector.travelling_wave(table.engine_order)
        for d in {wave.phase_number(0), wave.phase_number(1)}:
            sector.phase_modes(d)
    except InputError as error:
        found.faults += [renamed(fault) for fault in error.faults]
        return Described(dofs=names, made=True)
    if table.mistuning is None:
        return Described(body=Body(structure=wave), dofs=names, made=True)
    mistuning = table.mistuning
    blade = found.inside(("mistuning", "blade"), read_given, mistuning.blade, folder)
    if blade is None:
        return Described(dofs=names, made=True)
    disc = found.inside(("mistuning",), lambda: sector.mistuned(**{**mistuning.stated, "blade": blade}))
    if disc is None:
        return Described(dofs=names, made=True)
    return Described(body=Body(structure=wave, disc=disc), dofs=names, made=True)


def _matrices(value: Any, key: str, folder: Path, found: Gathering) -> Any:
    """A matrix, or a pair of them."""
    if _is_matrix(value):
        return found.inside((key,), read_given, value, folder)
    both = [found.inside((key, i), read_given, one, folder) for i, one in enumerate(value)]
    return None if any(one is None for one in both) else tuple(both)


def _sector(table: DiscTable, matrices: Mapping[str, Any]) -> Call:
    return Call("ss.CyclicStructure", named={**matrices, **table.given("dofs", "sectors", "loss_factor")})


def _script(table: DiscTable, folder: Path) -> list[str]:
    made = {}
    for letter, key in KEYS.items():
        value = getattr(table, key)
        if value is not None:
            alone = _is_matrix(value)
            made[letter] = matrix_text(value, folder) if alone else call("", *(matrix_text(m, folder) for m in value))
    made["sector"] = _sector(table, {letter: Code(letter) for letter in made}).written()
    made["structure"] = Call("sector.travelling_wave", (table.engine_order,)).written()
    if table.mistuning is not None:
        own = table.mistuning.stated
        own["blade"] = Code(matrix_text(own.pop("blade"), folder))
        made["disc"] = Call("sector.mistuned", named=own).written()
    return [f"{name} = {text}" for name, text in made.items()]


DISC = StructureKind(table=DiscTable, build=_disc, script=_script)


_OF_FILE = ("quadratic", "fixed", "low", "high", "axis", "tolerance")
_REDUCED = (
    "low", "high", "tolerance", "surface", "contacts", "radius", "between", "between_contacts", "pressure", "keep",
    "modes", "accuracy", "loss_factor", "damping_ratio", "axis", "speed", "up_to",
)  # fmt: skip


def _one_or_more(value: Any, expected: str) -> Any:
    several = value if isinstance(value, list) else [value]
    if not (several and all(isinstance(name, str) and name for name in several)):
        raise unexpected(expected)
    return value


def _one_or_more_names(value: Any) -> Any:
    return _one_or_more(value, 'a node set or surface such as "LOW", or a list of them')


def _two_names(value: Any) -> Any:
    if not (isinstance(value, list) and len(value) == 2 and all(isinstance(name, str) and name for name in value)):
        raise unexpected('two surfaces, low and high, such as ["SHROUD_LOW", "SHROUD_HIGH"]')
    return tuple(value)


def _one_or_more_sets(value: Any) -> Any:
    return _one_or_more(value, 'an element set such as "BLADE", or a list of them')


Pair = Annotated[Any, PlainValidator(_two_names)]
Face = Annotated[Any, PlainValidator(_one_or_more_names)]


class SetMistuningTable(DeviationTable):
    """``mistuning = { spread = 0.02, seed = 1, blade = "BLADE" }``."""

    blade: Annotated[Any, PlainValidator(_one_or_more_sets)] = Field(
        description='an element set such as "BLADE", or a list of them, whose stiffness deviates'
    )


class DiscFeTable(ReductionTable):
    """``[structure] kind = "disc"`` from a finite element model of a sector."""

    kind: Literal["disc"]
    file: str | None = Field(default=None, description="the name of a model.h5, or of a mesh (.cdb, .inp, .msh, .bdf)")
    size: str | None = Field(default=None, description='"coarse", "small", "medium" or "large": the parametric sector')
    engine_order: int = Field(
        ge=-1_000_000, le=1_000_000,
        description="a whole number, of the fundamental frequency, < 0 for blades numbered in the sense of rotation",
    )  # fmt: skip
    sectors: int | None = Field(default=None, ge=2, le=1000, description="a whole number >= 2, how many the disc has")
    low: Face | None = Field(default=None, description="a node set or surface: the face towards the sector before")
    high: Face | None = Field(default=None, description="a node set or surface: the face towards the next sector")
    axis: AxisTable | None = Field(default=None, description="a table such as { direction = [0, 0, 1] }")
    tolerance: Positive | None = Field(default=None, description="a number > 0, the largest distance of paired nodes")
    speed: Frequency | None = Field(default=None, description='the speed of the disc such as "3000 rpm"')
    material: MaterialTable | None = Field(
        default=None, description="a table such as { young = 2e11, poisson = 0.3, density = 7800.0 }"
    )
    quadratic: bool = Field(default=False, description="true or false: nodes in the middle of the edges of a mesh")
    fixed: list[str] = Field(default=[], description='a list of node sets or surfaces such as ["BORE"]')
    surface: SurfaceName | None = Field(default=None, description="the surface of contacts with the casing")
    contacts: Contacts | None = Field(default=None, description="a number of contacts, node numbers, or positions")
    between: Pair | None = Field(
        default=None, description='surfaces that touch the neighbours such as ["SHROUD_LOW", "SHROUD_HIGH"]'
    )
    between_contacts: Contacts | None = Field(
        default=None, description="a number of contacts, or places on the high one"
    )
    pressure: Shapes = Field(default={}, description='a surface, or a table such as { pressure = "PRESSURE_SURF" }')
    keep: list[str] = Field(
        default=[],
        max_length=3 * MOST_CONTACTS,
        description='a list of dofs of the mesh such as ["n123y", "HEAD z"]',
    )
    accuracy: RelativeError | None = Field(default=None, description=RELATIVE_ERROR)
    damping_ratio: float = Field(default=0.0, description="a number, the ratio to critical damping")
    mistuning: SetMistuningTable | None = Field(
        default=None, description='a table such as { spread = 0.02, seed = 1, blade = "BLADE" }'
    )

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """The model is said in one way, and something is kept."""
        faults = [*super().cross_check(raw), *deviation_faults(raw), *accuracy_faults(raw)]
        if "file" in raw and "size" in raw:
            faults.append(Fault("size", "is given together with file", remedy="keep one"))
        if "size" in raw:
            faults += [
                Fault(key, "is that of the parametric sector", remedy="leave it out") for key in _OF_FILE if key in raw
            ]
        if not {"surface", "between", "keep"} & set(raw):
            remedy = 'give surface or between for contacts, or keep = ["n123y"]'
            faults.append(Fault(statement="nothing is kept", remedy=remedy))
        for key, other in (("contacts", "surface"), ("between_contacts", "between")):
            if key in raw and other not in raw:
                faults.append(Fault(other, IS_MISSING, remedy=f"{key} lie on it"))
        return faults


def _fe_disc(table: DiscFeTable, folder: Path, tell: Tell) -> Body:
    """The sector in its wave, the phases of whose low harmonics are computed.

    Raises
    ------
    InputError
        For files, sets and surfaces that are not there, and faces that do not meet.
    """
    began = time.perf_counter()
    model = _model(table, folder, tell)
    tell(f"structure: a sector of {model.n_dofs} dofs, reduced or read from {CACHE} ...")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            body = _body(table, Code("model", model))
            sector = body.but(force=True, cache=reduction_folder(folder), listener=stages(tell)).made()
            # the error is judged once range and harmonics are known
            wave = sector.travelling_wave(table.engine_order)
            disc = None
            if table.mistuning is not None:
                tell(f"structure: the modes of all {sector.sectors // 2 + 1} nodal diameters ...")
                with at("mistuning"):
                    disc = sector.mistuned(**table.mistuning.stated)
            else:
                for d in {wave.phase_number(0), wave.phase_number(1)}:
                    sector.structure.phase_modes(d)
    except InputError:
        raise
    except SlipstickError as error:
        raise InputError(Fault(statement=str(error))) from None
    return Body(structure=wave, sector=sector, disc=disc, force=table.force, seconds=time.perf_counter() - began)


def _body(table: DiscFeTable, model: Code) -> Call:
    sectors = table.given("sectors") if table.file is not None else {}
    return Call("ss.reduced_sector", (model,), {**sectors, **table.given(*_REDUCED)})


def _model(table: DiscFeTable, folder: Path, tell: Tell) -> ImportedModel:
    from slipstick.models.parametric_sector import bladed_sector, sector_shape

    material = {} if table.material is None else {"material": material_call(table.material).made()}
    if table.size is not None:
        own = {} if table.sectors is None else {"sectors": table.sectors}
        tell(f"structure: {table.size} bladed sector ...")
        try:
            return bladed_sector(sector_shape(table.size, **own), **material)
        except InputError as error:
            raise InputError([_at_size(fault) for fault in error.faults]) from None
    return imported_model(table, folder, tell)


def _at_size(fault: Fault) -> Fault:
    own = fault.below("sector")
    return own if own.where[:1] in (("size",), ("sectors",)) else own.inside("size")


def _fe_script(table: DiscFeTable, _folder: Path) -> list[str]:
    if table.file is not None:
        model = import_call(table)
    else:
        own = table.given("sectors")
        shape = Code(Call("sector_shape", (table.size,), own).written()) if own else table.size
        material = {} if table.material is None else {"material": material_call(table.material)}
        model = Call("ss.models.bladed_sector", (shape,), material)
    wave = Call("body.travelling_wave", (table.engine_order,))
    made = {"model": model, "body": _body(table, Code("model")).but(cache=here(CACHE)), "structure": wave}
    if table.mistuning is not None:
        made["disc"] = Call("body.mistuned", named=table.mistuning.stated)
    return [f"{name} = {call.written()}" for name, call in made.items()]


DISC_FE = reducing_kind(DiscFeTable, _fe_disc, _fe_script)
