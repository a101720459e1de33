"""Materials of an Ansys archive (.cdb): isotropic and constant ones, and why others cannot be used."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from slipstick.errors import Fault, InputError, Place
from slipstick.fem.materials import Material
from slipstick.importers.ansys.commands import COMMANDS, commands
from slipstick.importers.findings import Findings, Verdict
from slipstick.importers.text_numbers import fortran_real, reading

_PROPERTIES = {"EX": "young", "NUXY": "poisson", "PRXY": "poisson", "DENS": "density", "KXX": "conductivity"}
_OTHER_AXES = {"EY": "EX", "EZ": "EX", "NUYZ": "NUXY", "NUXZ": "NUXY", "PRYZ": "PRXY", "PRXZ": "PRXY"}
_DAMPING = {"DAMP", "ALPD", "BETD", "DMPR", "DMPS"}
_LAWS = {"ELAS", "ANEL", "HYPE", "AHYPER", "USER", "DENS", "PRONY", "SMA", "GASKET", "CONCR", "MPLANE"}
_UNUSED = {"CTE", "THERM", "FRIC", "FLUID", "PIEZ", "DPER", "SDAMP", "PERF", "FCON", "CGCR", "FATI", "STATE"}

Values = dict[tuple[int, str], list[float]]


@dataclass(frozen=True, kw_only=True)
class MaterialTable:
    """Materials by number, and for others what is wrong with them."""

    materials: Mapping[int, Material] = field(default_factory=dict)
    faults: Mapping[int, list[Fault]] = field(default_factory=dict)


@COMMANDS.reads("MP MPDATA TB")
def read_materials(findings: Findings, text: str) -> MaterialTable:
    """Materials of the MP, MPDATA and TB commands; what is left out of them goes to ``findings``."""
    values: Values = {}
    faults: dict[int, list[Fault]] = {}
    for line, name, words in commands(text):
        where = Place(findings.source, f"line {line}", name)
        with reading(where):
            if name == "MP":
                _property(findings, line, values, faults, where, words[0], words[1], words[2:])
            elif name == "MPDATA":
                at = 1 if words[0][:1].isalpha() else 0  # a release such as R5.0, or UNBL
                _property(
                    findings, line, values, faults, where, words[at + 1], words[at + 2], words[at + 4 :], table=True
                )
            elif name == "TB":
                _table(findings, line, faults, where, words)
    materials: dict[int, Material] = {}
    for number in sorted({number for number, _ in values}):
        known = _constant(findings.source, values, number, faults)
        try:
            if {"young", "poisson"} <= known.keys():
                materials[number] = Material(**known)
        except InputError as error:
            faults.setdefault(number, []).extend(
                fault.inside(findings.source, f"material {number}") for fault in error.faults
            )
    return MaterialTable(materials=materials, faults=faults)


def _property(
    findings: Findings,
    line: int,
    values: Values,
    faults: dict[int, list[Fault]],
    where: Place,
    label: str,
    number: str,
    words: list[str],
    *,
    table: bool = False,
) -> None:
    label, material = label.upper(), int(number)
    if label in _DAMPING:
        what = "damping is not read; give the structure's loss_factor or damping_ratio"
        findings.add(Verdict.APPROXIMATED, f"{label} of material {material}", what, line)
    if label not in (*_PROPERTIES, *_OTHER_AXES, "GXY", "GYZ", "GXZ"):
        return
    numbers = [fortran_real(word) for word in words if word]
    if not table and any(numbers[1:]):
        faults.setdefault(material, []).append(
            Fault(Place(*where[:-1], f"{where[-1]} of material {material}"), f"{label} depends on temperature")
        )
    values.setdefault((material, label), []).extend(numbers if table else numbers[:1])


def _table(findings: Findings, line: int, faults: dict[int, list[Fault]], where: Place, words: list[str]) -> None:
    law = words[0].upper()
    if any(law.startswith(name) for name in _LAWS):
        fault = Fault((*where, f"{law} of material {words[1]}"), "is not isotropic elasticity by MP")
        faults.setdefault(int(words[1]), []).append(fault)
    elif not any(law.startswith(name) for name in _UNUSED):
        what = "is left out: the structure is linear, its material elastic"
        findings.add(Verdict.APPROXIMATED, f"TB, {law} of material {words[1]}", what, line)


def _constant(source: str, values: Values, number: int, faults: dict[int, list[Fault]]) -> dict[str, float]:
    """The properties of one material where they are the same at every temperature and along every axis."""
    tables = {label: numbers for (material, label), numbers in values.items() if material == number and numbers}
    known: dict[str, float] = {}
    wrong: list[str] = []
    for label, numbers in tables.items():
        if len(set(numbers)) > 1:
            wrong.append(f"{label} depends on temperature ({numbers[0]:.6g} to {numbers[-1]:.6g})")
        first = tables.get(_OTHER_AXES.get(label, label), numbers)
        if first[0] != numbers[0]:
            wrong.append(f"{label} is {numbers[0]:.6g}, along x {first[0]:.6g}: not isotropic")
        if label in _PROPERTIES:
            known[_PROPERTIES[label]] = numbers[0]
    if {"young", "poisson"} <= known.keys():
        shear = known["young"] / (2.0 * (1.0 + known["poisson"]))
        for label in ("GXY", "GYZ", "GXZ"):
            if label in tables and abs(tables[label][0] - shear) > 1e-3 * abs(shear):
                wrong.append(f"{label} is {tables[label][0]:.6g}, of an isotropic material {shear:.6g}: not isotropic")
    faults.setdefault(number, []).extend(Fault(Place(source, f"material {number}"), what) for what in wrong)
    return known
