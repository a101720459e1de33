"""Systems of units: from the texts that users state them by, and as what a material looks like."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from slipstick.errors import Fault, InputError
from slipstick.fem.conversion import Conversion
from slipstick.fem.materials import Material

_LENGTHS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "micrometre": 1e-6}
_LENGTHS |= {"in": 0.0254, "inch": 0.0254, "ft": 0.3048, "foot": 0.3048}
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3}
_POUND = 0.45359237
_FORCES = {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "kN": 1e3, "MN": 1e6, "lbf": _POUND * 9.80665, "kgf": 9.80665}
_MASSES = {"kg": 1.0, "g": 1e-3, "t": 1e3, "tonne": 1e3, "Mg": 1e3, "lb": _POUND, "lbm": _POUND}
_MASSES |= {"slug": _FORCES["lbf"] / 0.3048, "slinch": _FORCES["lbf"] / 0.0254}
_IN_WORDS = {"length": _LENGTHS, "mass": _MASSES, "force": _FORCES, "time": _TIMES}
_SLINCH = re.compile(r"lbf?[ .*]*s(\^?2|²)[ ]*/[ ]*in(ch)?")
SI = "N, m, kg, s"

_YOUNG, _DENSITY = (1e6, 2e12), (50.0, 3e4)
"""Of solids, from rubber and foam to diamond and osmium, SI."""
_TOLERANCE = 1e-3


def system(units: str, name: str = "units") -> Conversion:
    """Conversion to SI of a system stated as "N, mm, t, s": a length, a force or a mass, and a time (s by default).

    >>> system("N, mm, t, s").length, round(system("lbf, in").mass, 3)
    (0.001, 175.127)

    Raises
    ------
    InputError
        If it is not understood, or its mass, force, length and time do not fit together.
    """
    text = _SLINCH.sub("slinch", re.sub(r"^\s*SI\b", "", units)) or SI
    factors: dict[str, float] = {}
    for word in re.findall(r"[^\s,;()]+", text):
        dimension = next((d for d, known in _IN_WORDS.items() if word in known), "")
        if not dimension or dimension in factors:
            raise InputError(Fault(name, found=f"'{units}'", expected='units such as "N, mm, t, s" or "lbf, in, s"'))
        factors[dimension] = _IN_WORDS[dimension][word]
    if "length" not in factors or not {"mass", "force"} & set(factors):
        raise InputError(Fault(name, found=f"'{units}'", expected='a length with a force or a mass: "N, mm, t, s"'))
    return factors_of(factors, name)


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


def material_doubts(materials: Mapping[str, Material], units: str, source: str) -> Iterator[str]:
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
            if not any(_solid(factors.material(material)) for factors in _COMMON):
                yield (
                    f"{numbers} fit no common system of units (Pa and kg/m3; MPa and t/mm3; psi and lbf s2/in4): "
                    "check them"
                )
        elif not _solid(si := stated.material(material)):
            like = system_like(material)
            more = f"; they look like {like}" if like else ""
            yield (
                f"{numbers} would be {si.young:.3g} Pa and {si.density:.3g} kg/m3 in the units stated ({units}), which "
                f"no solid has{more}: check them"
            )


_COMMON = tuple(Conversion(length=a, force=b) for a, b in ((1.0, 1.0), (1e-3, 1.0), (0.0254, 4.448), (1e-3, 1e-3)))


def _solid(material: Material) -> bool:
    return _YOUNG[0] <= material.young <= _YOUNG[1] and _DENSITY[0] <= material.density <= _DENSITY[1]


_SYSTEMS = (
    ("SI (N, m, kg)", (1e8, 2e12), (500.0, 3e4)),
    ("N, mm, tonne", (1e2, 2e6), (5e-10, 3e-8)),
    ("lbf, inch, s", (1e4, 2e8), (4e-5, 3e-3)),
    ("mN, mm, kg", (1e5, 2e9), (5e-7, 3e-5)),
)


def system_like(material: Material) -> str:
    """The common system of units that the numbers of a material look like; nothing where there is none.

    Metals have E about 1e11 Pa and density 2000 to 20000 kg/m3; in N, mm, tonne 1e5 and 1e-9; in lbf, in 1e7 and 1e-4.
    """
    for name, (low, high), (lightest, heaviest) in _SYSTEMS:
        if low <= material.young <= high and lightest <= material.density <= heaviest:
            return name
    return ""
