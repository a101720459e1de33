"""Systems of units: the text that states one, its conversion and names, and the one that a material looks like."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from slipstick.errors import Fault, InputError
from slipstick.fem.materials import Material
from slipstick.units import SIZES, Units

NOT_STATED = "not stated"
"""What is said of units that neither the files nor their user name."""

_SLINCH = re.compile(r"lbf?[ .*]*s(\^?2|²)[ ]*/[ ]*in(ch)?")
SI = "N, m, kg, s"

_SOLID = (1e6, 2e12), (50.0, 3e4)
"""Young's modulus and density of solids, from rubber and foam to diamond and osmium, SI."""
_STIFF = (6e7, 2e12), (420.0, 3.2e4)
"""Of those by which a system of units is recognised: metals have about 1e11 Pa and 2000 to 20000 kg/m3."""
_TOLERANCE = 1e-3


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """New number over old number, by dimension; the mass follows.

    >>> inch = Conversion(length=0.0254, force=4.4482216152605)
    >>> round(inch.mass, 3), round(inch.stiffness, 3)
    (175.127, 175.127)
    """

    length: float = 1.0
    force: float = 1.0
    time: float = 1.0

    @property
    def mass(self) -> float:
        """Force time^2/length."""
        return self.force * self.time**2 / self.length

    @property
    def stiffness(self) -> float:
        """Force/length."""
        return self.force / self.length

    def material(self, old: Material) -> Material:
        """A material in the new units; temperatures stay."""
        young = [(at, value * self.force / self.length**2) for at, value in old.tables.get("young", ())]
        return old.but(
            young=young or old.young * self.force / self.length**2,
            density=old.density * self.mass / self.length**3,
            conductivity=old.conductivity * self.force / self.time,
        )

    @property
    def inverse(self) -> Conversion:
        """From the new units to the old ones."""
        return Conversion(length=1.0 / self.length, force=1.0 / self.force, time=1.0 / self.time)


def system(units: str, name: str = "units") -> Conversion:
    """Conversion to SI of a system stated as "N, mm, t, s": a length, a force or a mass, and a time (s by default).

    >>> system("N, mm, t, s").length, round(system("lbf, in").mass, 3)
    (0.001, 175.127)

    Raises
    ------
    InputError
        If it is not understood, or its mass, force, length and time do not fit together.
    """
    words = _words(units, name)
    if "length" not in words or not {"mass", "force"} & set(words):
        raise InputError(Fault(name, found=f"'{units}'", expected='a length with a force or a mass: "N, mm, t, s"'))
    return factors_of({dimension: SIZES[dimension][word] for dimension, word in words.items()}, name)


def _words(units: str, name: str) -> dict[str, str]:
    """The unit of each dimension that a text names."""
    text = SI if units.strip() == "SI" else _SLINCH.sub("slinch", re.sub(r"^\s*SI\b", "", units))
    words: dict[str, str] = {}
    for word in re.findall(r"[^\s,;()]+", text):
        dimension = next((d for d, known in SIZES.items() if word in known), "")
        if not dimension or dimension in words:
            raise InputError(Fault(name, found=f"'{units}'", expected='units such as "N, mm, t, s" or "lbf, in, s"'))
        words[dimension] = word
    return words


def names_of(units: str) -> Units | None:
    """What quantities in a system are called; None where the text names none. A force follows from a mass.

    >>> names_of("mm, tonne, s")
    Units(length='mm', force='N', time='s', temperature='temperature')
    """
    try:
        force, words = system(units).force, _words(units, "units")
    except InputError:
        return None
    like = next((word for word, size in SIZES["force"].items() if abs(size / force - 1.0) <= _TOLERANCE), "force")
    return Units(length=words["length"], force=words.get("force", like), time=words.get("time", "s"))


def factors_of(factors: Mapping[str, float], name: str) -> Conversion:
    """Conversion by dimension; force stays without a force or mass, mass follows.

    Raises
    ------
    InputError
        If mass, force, length and time are given and do not fit together.
    """
    length, time = factors.get("length", 1.0), factors.get("time", 1.0)
    follows = factors["mass"] * length / time**2 if "mass" in factors else 1.0
    force = factors.get("force", follows)
    if "mass" in factors and abs(force / follows - 1.0) > _TOLERANCE:
        raise InputError(
            Fault(
                name, f"mass, length and time make a force {follows:.6g}, given is {force:.6g}", remedy="leave one out"
            )
        )
    return Conversion(length=length, force=force, time=time)


def conversion(units: str, wanted: str) -> Conversion:
    """Conversion from the units of a model to others.

    Raises
    ------
    InputError
        If one of them is not understood.
    """
    first, last = system(units), system(wanted, "to")
    return Conversion(length=first.length / last.length, force=first.force / last.force, time=first.time / last.time)


def material_warnings(materials: Mapping[str, Material], units: str, source: str) -> Iterator[str]:
    """A sentence for each material whose E and density do not go together, or not with the units that are stated."""
    try:
        stated: Conversion | None = system(units)
    except InputError:
        stated = None
    for name, material in materials.items():
        if not material.density > 0.0:
            continue
        numbers = f"{source}: {name}: E = {material.young:.4g} and density = {material.density:.4g}"
        if stated is None:
            if not any(_within(factors.material(material), *_SOLID) for factors in _COMMON.values()):
                yield (
                    f"{numbers} fit no common system of units (Pa and kg/m3; MPa and t/mm3; psi and lbf s2/in4): "
                    "check them"
                )
        elif not _within(si := stated.material(material), *_SOLID):
            like = system_like(material)
            more = f"; they look like {like}" if like else ""
            yield (
                f"{numbers} would be {si.young:.3g} Pa and {si.density:.3g} kg/m3 in the units stated ({units}), which "
                f"no solid has{more}: check them"
            )


_COMMON = {
    "SI (N, m, kg)": Conversion(),
    "N, mm, tonne": Conversion(length=1e-3),
    "lbf, inch, s": Conversion(length=SIZES["length"]["in"], force=SIZES["force"]["lbf"]),
    "mN, mm, kg": Conversion(length=1e-3, force=1e-3),
}


def system_like(material: Material) -> str:
    """The common system of units that the numbers of a material look like, those of a metal or of another stiff solid;
    nothing where there is none.
    """
    return next((name for name, factors in _COMMON.items() if _within(factors.material(material), *_STIFF)), "")


def stated_units(units: str, materials: Mapping[str, Material]) -> str:
    """A text of the units: those stated, or those that the materials look like."""
    like = looks(materials) if units == NOT_STATED else ""
    return f"{units}; {like}" if like else units


def looks(materials: Mapping[str, Material]) -> str:
    """The one common system that materials look like, as a sentence; nothing where there is none, or several."""
    systems = {system_like(material) for material in materials.values()} - {""}
    return f"E and density look like {systems.pop()}" if len(systems) == 1 else ""


def _within(material: Material, young: tuple[float, float], density: tuple[float, float]) -> bool:
    return young[0] <= material.young <= young[1] and density[0] <= material.density <= density[1]


_RATIOS = {1000.0: ("mm", "m"), 25.4: ("mm", "inch"), 39.37: ("inch", "m")}


def other_units(first: float, second: float) -> str:
    """A doubt for two sizes that should be alike, and are as if their units were not; nothing where they are not.

    >>> other_units(0.05, 48.0), other_units(1.0, 1.2)
    ('; they span 0.05 and 48: is one in mm, one in m?', '')
    """
    if not min(first, second) > 0.0:
        return ""
    ratio = max(first, second) / min(first, second)
    like = next((units for size, units in _RATIOS.items() if abs(ratio / size - 1.0) < 0.2), None)
    return "" if like is None else f"; they span {first:.3g} and {second:.3g}: is one in {like[0]}, one in {like[1]}?"
