"""Names of the units a user computes in: labels alone, nothing is converted by them.

Every quantity is declared by its dimension in words, such as "force length/time"; ``Units.label`` puts the names of the
base units in their place.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from slipstick.errors import UNKNOWN_KEY, Fault, InputError
from slipstick.faults import Gathering, shown, suggestion, table
from slipstick.quantities import FREQUENCIES

LONGEST = 30

ANGULAR = "rad/time"
"""The dimension of a frequency."""

_PREFIXES = {"u": 1e-6, "m": 1e-3, "": 1.0, "k": 1e3, "M": 1e6}
_JOULES = {
    f"{force}N {length}m": value * size
    for force, value in _PREFIXES.items()
    for length, size in (("", 1.0), ("m", 1e-3), ("u", 1e-6))
}
"""Energy units in J, by the names of a force and a length."""

_POUND = 0.45359237
_FORCE = {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "kN": 1e3, "MN": 1e6, "dyn": 1e-5, "kgf": 9.80665, "lbf": _POUND * 9.80665}
SIZES: Mapping[str, Mapping[str, float]] = {
    "length": {
        "m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "micrometre": 1e-6,
        "in": 0.0254, "inch": 0.0254, "ft": 0.3048, "foot": 0.3048,
    },
    "mass": {
        "kg": 1.0, "g": 1e-3, "t": 1e3, "tonne": 1e3, "Mg": 1e3, "lb": _POUND, "lbm": _POUND,
        "slug": _FORCE["lbf"] / 0.3048, "slinch": _FORCE["lbf"] / 0.0254,
    },
    "force": _FORCE,
    "time": {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3},
}  # fmt: skip
"""Sizes of the units whose names are understood, SI."""

MIXED = " or rad"
"""What is in the unit of the motion of dofs of which some are rotations, after that of the others."""

_SECONDS = tuple(name for name, size in SIZES["time"].items() if size == 1.0)
_ROTATION = re.compile(r"n\d+r[xyz](?:@.*)?")
_MODAL_COORDINATE = re.compile(r"mode \d+")
_WORD = re.compile(r"\b(?:length|force|time|temperature)\b")
_COMPOUND = re.compile(r"[\s/*·^]")


@dataclass(frozen=True, kw_only=True)
class Units:
    """Names of the base units, such as "mm", "N", "s", "degC"; what is not named keeps the word for its dimension.

    Raises
    ------
    InputError
        For a name that is not a short text.

    Examples
    --------
    >>> units = Units(length="mm", force="N", time="s")
    >>> units.label("force length/time"), units.label("rad/time"), units.label("temperature")
    ('N mm/s', 'rad/s', 'temperature')
    """

    length: str = "length"
    force: str = "force"
    time: str = "time"
    temperature: str = "temperature"

    def __post_init__(self) -> None:
        faults = [fault.inside("units", f.name) for f in fields(self) for fault in label_faults(getattr(self, f.name))]
        if faults:
            raise InputError(faults)

    @classmethod
    def of(cls, units: object) -> Units:
        """Units from themselves or a table ``{"length": "mm"}``; InputError for any other name in it."""
        if isinstance(units, cls):
            return units
        names = table("units", units, 'names of units such as {"length": "mm", "force": "N", "time": "s"}')
        gathering, known = Gathering(), [f.name for f in fields(cls)]
        gathering.faults += [
            Fault(("units", key), UNKNOWN_KEY, remedy=suggestion(key, known)) for key in names if key not in known
        ]
        checked = gathering.take(cls, **{key: value for key, value in names.items() if key in known})
        gathering.end()
        assert checked is not None
        return checked

    @classmethod
    def of_results(cls, attributes: Mapping[str, Any]) -> Units:
        """The units that results were written with; those of files without any are not named."""
        names = {f.name: str(attributes.get(f"{f.name}_unit", "")) for f in fields(cls)}
        return cls(**{name: value for name, value in names.items() if not label_faults(value)})

    def filled(self, known: Units | None) -> Units:
        """These, and where they name none those that a structure is known to be in.

        Raises
        ------
        InputError
            Where both name one, and not of the same size.

        >>> Units(force="N").filled(Units(length="mm", force="N", time="s")).label("force/length")
        'N/mm'
        """
        if known is None:
            return self
        chosen: dict[str, str] = {}
        faults = []
        for name in (f.name for f in fields(self)):
            given, own = getattr(self, name), getattr(known, name)
            chosen[name] = own if given == name else given
            sizes = SIZES.get(name, {})
            if name not in (given, own) and sizes.get(given, given) != sizes.get(own, own):
                expected = f"'{own}', the unit of the numbers of the structure"
                remedy = "leave it out, or convert the model when it is imported"
                faults.append(Fault(("units", name), found=f"'{given}'", expected=expected, remedy=remedy))
        if faults:
            raise InputError(faults)
        return Units(**chosen)

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of results, by name."""
        return {f"{f.name}_unit": getattr(self, f.name) for f in fields(self)}

    def label(self, dimension: str) -> str:
        """The unit of a dimension in words; other words stay as they are. A time without a name is the second."""
        if dimension == ANGULAR:
            return "rad/s" if self.time == "time" else f"rad/{self._part('time')}"
        if dimension in self.__dataclass_fields__:
            return str(getattr(self, dimension))
        return _WORD.sub(lambda word: self._part(word[0]), dimension)

    def _part(self, name: str) -> str:
        """A name that can stand beside others."""
        label = str(getattr(self, name))
        return f"({label})" if _COMPOUND.search(label) else label

    def after(self, dimension: str) -> str:
        """The unit as it stands after a number, " N mm/s"; nothing where one of its base units has no name."""
        return after_number(self.label(dimension))

    def of_dofs(self, dofs: Iterable[str], dimension: str = "length") -> str:
        """The unit of the motion or velocity of some dofs; both where some are displacements and some rotations.

        >>> Units(length="m").of_dofs(["n2x", "n2y"]), Units(length="m").of_dofs(["n2x", "n2ry"])
        ('m', 'm or rad')
        """
        label = self.label(dimension)
        if dimension not in ("length", "length/time"):
            return label
        return " or ".join(dict.fromkeys(unit_of_dof(label, dof) for dof in sorted(dofs, key=is_rotation))) or label

    @property
    def angular(self) -> str:
        """The unit of frequencies in input and results, "rad/s"."""
        return self.label(ANGULAR)

    @property
    def in_seconds(self) -> bool:
        """Whether the unit of time is the second, so that Hz and rpm have a meaning."""
        return self.time in ("time", *_SECONDS)

    @property
    def frequencies(self) -> Mapping[str, float]:
        """Units that frequencies can be shown in, and how many rad/time they are."""
        return {self.angular: 1.0, **(FREQUENCIES if self.in_seconds else {})}

    def frequency_factor(self, unit: str) -> float:
        """How many rad/time a frequency unit is: "Hz", "kHz", "rpm", or the angular one; InputError for another."""
        known = self.frequencies
        if not isinstance(unit, str) or unit not in known:
            raise InputError(f"frequency: found {shown(unit)}; expected one of {', '.join(known)}")
        return known[unit]

    def frequency_text(self, omega: float, unit: str = "Hz") -> str:
        """A frequency for the reader: "4.26 rad/s (0.678 Hz)"; with a time other than the second in rad/time alone."""
        text = f"{omega:.6g} {self.angular}"
        unit = "Hz" if unit == self.angular else unit
        return f"{text} ({omega / self.frequency_factor(unit):.5g} {unit})" if self.in_seconds else text


def is_rotation(dof: str) -> bool:
    """Whether a dof is a rotation, in rad, by the names that shafts and imported models give: n<node>rx, ry, rz.

    >>> is_rotation("n7ry"), is_rotation("n7ry@next"), is_rotation("n7y"), is_rotation("rx")
    (True, True, False, False)
    """
    return _ROTATION.fullmatch(dof) is not None


def modal_coordinate(number: int) -> str:
    """Name of the coordinate of a mode beside dofs that are kept; see ``is_modal_coordinate``."""
    return f"mode {number}"


def is_modal_coordinate(dof: str) -> bool:
    """Whether a dof is the coordinate of a mode, which is no motion of a place, by the name that reductions give.

    >>> is_modal_coordinate("mode 3"), is_modal_coordinate("mode"), is_modal_coordinate("n3x")
    (True, False, False)
    """
    return _MODAL_COORDINATE.fullmatch(dof) is not None


def compared(dofs: Sequence[str]) -> list[int]:
    """Places of the dofs whose sizes are compared: the displacements, and rotations only where there are no others.

    >>> compared(["n2x", "n2rx", "n2y"]), compared(["n2rx", "n2ry"])
    ([0, 2], [0, 1])
    """
    straight = [place for place, dof in enumerate(dofs) if not is_rotation(dof)]
    return straight or list(range(len(dofs)))


def unit_of_dof(label: str, dof: str) -> str:
    """The unit of one dof from that of the motion, or the velocity, of several.

    >>> unit_of_dof("mm or rad", "n2x"), unit_of_dof("mm or rad", "n2rx"), unit_of_dof("mm", "x")
    ('mm', 'rad', 'mm')
    >>> unit_of_dof("mm/s or rad/s", "n2x"), unit_of_dof("mm/s or rad/s", "n2rx")
    ('mm/s', 'rad/s')
    """
    straight = label.partition(MIXED)[0]
    return "".join(("rad", *straight.partition("/")[1:])) if is_rotation(dof) else straight


_SMALLER = ((1e-4, 1e6, "µm"), (0.1, 1e3, "mm"))
"""Below which largest number of metres, factor and name of a unit."""


def length_shown(label: str, largest: float) -> tuple[float, str]:
    """The unit that lengths are shown in, of which the largest is known: factor and name.

    Metres get a prefix, a unit the user chose stays as it is.

    >>> length_shown("m", 7.9e-4), length_shown("m or rad", 2e-5), length_shown("m", 0.0), length_shown("mm", 7.9e-4)
    ((1000.0, 'mm'), (1000000.0, 'µm or rad'), (1.0, 'm'), (1.0, 'mm'))
    """
    straight, mixed, rest = label.partition(MIXED)
    if straight == "m" and largest > 0.0:
        factor, name = next(((factor, name) for below, factor, name in _SMALLER if largest < below), (1.0, "m"))
        return factor, f"{name}{mixed}{rest}"
    return 1.0, label


def after_number(label: str) -> str:
    """A unit of results as it stands after a number; nothing where a word stands for a base unit without a name."""
    return "" if label in ("", "1") or _WORD.search(label) else f" {label}"


def energy_unit(label: str) -> str:
    """The unit of an energy as it is read, "J" for "N m" and "mJ" for "N mm"; any other label stays as it is.

    >>> energy_unit("N mm"), energy_unit("lbf in")
    ('mJ', 'lbf in')
    """
    size = _JOULES.get(label)
    prefixes = [prefix for prefix, value in _PREFIXES.items() if size is not None and abs(size / value - 1.0) < 1e-9]
    return f"{prefixes[0]}J" if prefixes else label


def power_unit(label: str) -> str:
    """The unit of a power as it is read, "W" for "N m/s" and "mW" for "N mm/s"; any other label stays as it is.

    >>> power_unit("N m/s"), power_unit("force length/time")
    ('W', 'force length/time')
    """
    energy, _, time = label.partition("/")
    joules = energy_unit(energy)
    return f"{joules[:-1]}W" if joules != energy and time in _SECONDS else label


def label_faults(value: object) -> list[Fault]:
    """Why a text cannot name a unit; empty where it can."""
    if isinstance(value, str) and value.strip() and value.isprintable() and len(value) <= LONGEST:
        return []
    return [Fault(found=shown(value), expected=f'a short text such as "mm", at most {LONGEST} characters')]
