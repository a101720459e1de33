"""``[structure] kind = "disc"``: a sector by its matrices, in a travelling wave; or a disc of blades that differ."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator

from slipstick.case.matrices import KEYS, matrix_text, read_given, renamed
from slipstick.case.script_text import Call, Code, call
from slipstick.case.structure import Body, Described, StructureKind, Tell
from slipstick.case.table import MatrixGiven, NotNegative, Table, list_or_file, unexpected
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import Gathering


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
