"""``axis`` and ``rotor`` of contacts on a surface: directions, rubbing velocity and casing of what turns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.case.sentences import unexpected
from slipstick.case.tables import Frequency, Harmonic, Periodic, Table, is_number
from slipstick.errors import IS_MISSING, Fault
from slipstick.faults import Gathering
from slipstick.quantities import harmonic_orders

if TYPE_CHECKING:
    from slipstick.contact.rubbing import RubbingMotion
    from slipstick.typing import Array

WORDS = ("radial", "circumferential", "axial")
"""Directions about an axis."""


def _place(value: Any) -> tuple[float, ...]:
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value))):
        raise unexpected("three numbers such as [0, 0, 0]")
    return tuple(map(float, value))


def vector(value: Any) -> tuple[float, ...]:
    """Three numbers, not all zero."""
    if not (isinstance(value, list) and len(value) == 3 and all(map(is_number, value)) and any(value)):
        raise unexpected("three numbers such as [0, 1, 0], not all 0")
    return tuple(map(float, value))


def _profile(value: Any) -> Any:
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


Vector = Annotated[tuple[float, float, float], PlainValidator(vector)]


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


def rotor_faults(raw: Mapping[str, Any]) -> list[Fault]:
    """What does not go together in a block of contacts."""
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


def axis_arguments(table: AxisTable | None) -> dict[str, Any] | None:
    """The axis as ``ss.surface_contacts`` takes it."""
    return None if table is None else {key: getattr(table, key) for key in table.model_fields_set}


def motion_arguments(table: RotorTable) -> dict[str, Any]:
    """Arguments of ``ss.casing_motion`` but radius and angles."""
    profile = table.profile
    if isinstance(profile, SeriesTable):
        profile = {key: getattr(profile, key) for key in profile.model_fields_set}
    given: dict[str, Any] = {"profile": {} if profile is None else profile}
    if table.speed is not None:
        given["speed"] = -table.speed if table.backward else table.speed
    elif table.backward:
        given["backward"] = True
    given |= {} if table.orders is None else {"orders": table.orders}
    return given | ({} if table.engine_order == 1 else {"lobes": table.engine_order})


def rotor_motion(table: RotorTable) -> Callable[[Array, Array], RubbingMotion]:
    """The rubbing motion of contacts by their radius and angle; its faults are those of ``rotor``."""
    from slipstick.contact.casing import casing_motion

    def motion(radius: Array, angles: Array) -> RubbingMotion:
        found, given = Gathering(), motion_arguments(table)
        made = found.inside(("rotor",), casing_motion, given.pop("profile"), radius=radius, angles=angles, **given)
        found.end()
        assert made is not None
        return made

    return motion
