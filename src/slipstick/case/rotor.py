"""Rotation: ``axis`` and ``rotor`` of contacts on a surface, ``rotation`` of a structure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.case.script_text import Call, Code, here
from slipstick.case.source import inside
from slipstick.case.structure import CACHE, Tell, reduction_folder
from slipstick.case.table import Frequency, Harmonic, Periodic, RawTable, Table, Vector, at, is_number, unexpected
from slipstick.errors import IS_MISSING, Fault
from slipstick.quantities import harmonic_orders, read_frequency

if TYPE_CHECKING:
    from slipstick.fem.model import ImportedModel
    from slipstick.typing import Array

WORDS = ("radial", "circumferential", "axial")
"""Directions about an axis."""
ROTATION = 'a table such as { speed = "3000 rpm", axis = { point = [0, 0, 0], direction = [0, 0, 1] } }'


def _place(value: object) -> tuple[float, ...]:
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value))):
        raise unexpected("three numbers such as [0, 0, 0]")
    return tuple(map(float, value))


def _profile(value: object) -> Any:
    """Rows of angle and height, or a table of series."""
    if isinstance(value, dict):
        return SeriesTable.model_validate(value)
    if not (
        isinstance(value, list) and all(isinstance(r, list) and len(r) == 2 and all(map(is_number, r)) for r in value)
    ):
        raise unexpected(
            'rows of angle (rad) and height, or a series by orders per turn such as { cos = { "2" = 3e-4 } }'
        )
    return value


class AxisTable(Table):
    """``axis = { point = [0, 0, 0], direction = [0, 0, 1] }``."""

    point: Annotated[tuple[float, float, float], PlainValidator(_place)] = Field(
        default=(0.0, 0.0, 0.0), description="a point of the axis such as [0, 0, 0]"
    )
    direction: Vector = Field(description="the direction of the axis such as [0, 0, 1]")
    zero: Vector | None = Field(default=None, description="the direction in which the angle is 0, such as [1, 0, 0]")


class SeriesTable(Table):
    """``profile = { cos = { "2" = 3e-4 } }``."""

    cos: Periodic = Field(default={}, description='a table such as { "2" = 3e-4 }, by orders per turn')
    sin: Periodic = Field(default={}, description='a table such as { "2" = 3e-4 }, by orders per turn')


class RotorTable(Table):
    """``rotor = { engine_order = 2, profile = { cos = { "2" = 3e-4 } } }``."""

    speed: Frequency | None = Field(default=None, description='the speed of the rotor such as "12800 rpm"')
    engine_order: Annotated[Harmonic, Field(ge=1)] = Field(
        default=1, description="a whole number >= 1: omega over the speed"
    )
    backward: bool = Field(default=False, description="true or false: the contacts move towards falling angles")
    profile: Annotated[Any, PlainValidator(_profile)] = Field(
        default=None, description="rows of angle and height, or a series, of the surface they run along"
    )
    orders: Annotated[list[int], PlainValidator(harmonic_orders)] | None = Field(
        default=None, description='orders of omega kept of the profile, such as "0..10"'
    )


def rotor_faults(raw: RawTable) -> list[Fault]:
    """Keys of a block of contacts that contradict each other."""
    words = [key for key in ("direction", "normal") if raw.get(key) in WORDS]
    needing = [key for key in (*words, "rotor") if key in raw]
    faults = []
    if "axis" not in raw and needing:
        remedy = f"{' and '.join(needing)} need it: give axis = {{ point = [0, 0, 0], direction = [0, 0, 1] }}"
        faults.append(Fault("axis", IS_MISSING, remedy=remedy))
    if "axis" in raw and not needing:
        remedy = 'give direction = "circumferential", normal = "radial" or rotor, or leave it out'
        faults.append(Fault("axis", "is given, but nothing goes by it", remedy=remedy))
    if "rotor" in raw and "rubbing" in raw:
        faults.append(Fault("rotor", "is given together with rubbing", remedy="keep one"))
    return faults


def rotor_motion(table: RotorTable) -> Code:
    """The rubbing motion of contacts as a function of their radius and angle; its faults are those of ``rotor``."""
    profile, more = table.given("profile").get("profile", {}), dict[str, Any]()
    if table.speed is not None:
        more["speed"] = -table.speed if table.backward else table.speed
    elif table.backward:
        more["backward"] = True
    more |= table.given("orders") | ({} if table.engine_order == 1 else {"lobes": table.engine_order})

    def call(radius: Any, angles: Any) -> Call:
        return Call("ss.casing_motion", (profile,), {"radius": radius, "angles": angles, **more})

    def motion(radius: Array, angles: Array) -> Any:
        with at("rotor"):
            return call(radius, angles).made()

    return Code(f"lambda radius, angles: {call(Code('radius'), Code('angles')).written()}", motion)


def _by_speed(value: Any) -> dict[float, str]:
    """Speeds as keys: ``{ "3000 rpm" = "model_3000.h5" }``."""
    files = isinstance(value, dict) and value and all(isinstance(name, str) and name for name in value.values())
    if not files:
        raise unexpected('a table of model files by speed, such as { "3000 rpm" = "model_3000.h5" }')
    speeds = {read_frequency(_as_number(key)): name for key, name in value.items()}
    if min(speeds) <= 0.0 or len(speeds) < len(value):
        raise unexpected("speeds > 0, each once")
    return speeds


def _as_number(key: str) -> Any:
    """A key of digits is a number, rad/s."""
    try:
        return float(key)
    except ValueError:
        return key


class RotationTable(Table):
    """``rotation = { speed = "3000 rpm", axis = { point = [0, 0, 0], direction = [0, 0, 1] } }``."""

    speed: Frequency = Field(description='a speed > 0 such as "3000 rpm", fixed for the run')
    axis: AxisTable | None = Field(
        default=None, description="a table such as { point = [0, 0, 0], direction = [0, 0, 1] }"
    )
    models: Annotated[dict[float, str], PlainValidator(_by_speed)] | None = Field(
        default=None, description='a table of model files by speed, such as { "3000 rpm" = "model_3000.h5" }'
    )
    coriolis: bool = Field(default=False, description="true or false: Coriolis forces of the mesh too")


def rotation_faults(raw: RawTable) -> list[Fault]:
    """Either the axis is given, or matrices that hold it."""
    rotation = raw.get("rotation")
    if not isinstance(rotation, dict):
        return []
    if "models" in rotation and "axis" in rotation:
        return [Fault(("rotation", "axis"), "is given together with models", remedy="they hold it: leave it out")]
    if not {"models", "axis"} & set(rotation):
        remedy = "give axis = { point = [0, 0, 0], direction = [0, 0, 1] }, or models by speed"
        return [Fault(("rotation", "axis"), IS_MISSING, remedy=remedy)]
    return []


def turning(model: ImportedModel, table: RotationTable | None, folder: Path, tell: Tell) -> ImportedModel:
    """The model at the speed of its ``rotation`` table; its warnings name suspicious values."""
    from slipstick.fem.rotation import turned_model
    from slipstick.io.model_file import load_model

    if table is None:
        return model
    tell(f"structure: stiffness at {table.speed:g} rad/s{'' if table.models else f', or reading it from {CACHE}'} ...")
    with at("rotation"):
        if table.models is None:
            cache = reduction_folder(folder)
            return turned_model(model, table.speed, **table.given("axis", "coriolis"), cache=cache)
        others = {s: load_model(inside(folder, name), quiet=True) for s, name in table.models.items()}
        return turned_model(model, table.speed, others=others, coriolis=table.coriolis)


def rotation_script(table: RotationTable | None) -> list[str]:
    """The model at the speed of its ``rotation``."""
    if table is None:
        return []
    named = table.given("axis")
    if table.models is not None:
        named["others"] = {speed: Call("ss.import_model", (here(name),)) for speed, name in table.models.items()}
    named |= {"coriolis": True} if table.coriolis else {}
    return [f"model = {Call('ss.at_speed', (Code('model'), table.speed), named).written()}"]
