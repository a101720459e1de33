"""Reading of a case: every fault is collected, and as many of its objects are built as can be."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.body import Body, Tell, silent
from slipstick.app.fe_tables import SurfaceContactTable, contact_table
from slipstick.app.frequencies import blade_faults, display_unit, frequency_faults
from slipstick.app.heating import background_of, heating_faults, thermal_model
from slipstick.app.sentences import model_faults, section_name, shown, suggestion
from slipstick.app.structures import build_structure, named_dofs
from slipstick.app.surface_contacts import (
    INFLUENCE,
    Placed,
    cold_contact,
    contacts_on_surface,
    own_influence,
    rubbing_motion,
)
from slipstick.app.tables import (
    ContactTable,
    LoadTable,
    OutputTable,
    ResponseTable,
    Table,
    ThermalTable,
    TopTable,
    frequencies_met,
)
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem
    from slipstick.structure.protocol import Structure

MOST_TABLES = 10_000
MOST_UNKNOWNS = 12_000
_SECTIONS = ("structure", "load", "contact", "thermal", "response", "output")


class Reading:
    """One pass over a case that collects every fault and as many objects as can be built."""

    def __init__(self, raw: dict[str, Any], folder: Path, tell: Tell = silent) -> None:
        self.raw, self.folder, self.tell = raw, folder, tell
        self.faults: list[str] = []
        self.meant: set[str] = set()
        self.title = ""
        self.body: Body | None = None
        self.response: ResponseTable | None = None
        self.problem: Problem | None = None
        self.thermal: ThermalTable | None = None
        self.frequency_unit = ""

    def read(self) -> None:
        """Go through the whole case."""
        top = self._top()
        self.body, faults = self._structure()
        self.faults += faults
        loads = self._list("load", LoadTable)
        blocks = self._list("contact", contact_table)
        if not self.raw.get("contact", []) and "contact" not in self.meant:
            self.faults.append("[[contact]] is missing; give at least one contact, without any the response is linear")
        self.thermal = self._one("thermal", ThermalTable, optional=True)
        self.response = self._one("response", ResponseTable)
        output = self._one("output", OutputTable, optional=True)
        if top is not None:
            self.frequency_unit = display_unit(self.raw, top.units.units)
            self.faults += [*frequency_faults(self.raw, top.units.units), *blade_faults(self.raw, top.units.units)]
        self._references(loads, blocks, output)
        contacts = self._contacts(blocks)
        tables = [c.table for c in contacts]
        if self._heat_is_known(blocks):
            self.faults += heating_faults(tables, self.thermal)
        pairs = [p for c in contacts if (p := c.pair or self._built("contact", c.block, c.table, self._pair))]
        forces = [p for i, c in loads if (p := self._built("load", i, c, read_load))]
        if not self.faults and top is not None and self.structure is not None:
            self.title = top.title
            self._problem(self.structure, top, pairs, forces, output, tables)

    @property
    def structure(self) -> Structure | None:
        """The structure, once it is built."""
        return self.body.structure if self.body is not None else None

    def _heat_is_known(self, blocks: list[tuple[int, Any]]) -> bool:
        """Whether the contacts on a surface and the structure's own influence matrix are written out."""
        if self.thermal is not None and self.thermal.influence == INFLUENCE:
            return False
        return self.body is not None or not any(isinstance(block, SurfaceContactTable) for _, block in blocks)

    def _contacts(self, blocks: list[tuple[int, Any]]) -> list[Placed]:
        """Single contacts, and those on a surface; the influence matrix of the structure written out."""
        if self.body is None:
            blocks = [(i, block) for i, block in blocks if not isinstance(block, SurfaceContactTable)]
        reduced = self.body.reduced if self.body is not None else None
        contacts: list[Placed] = []
        for i, block in blocks:
            if not isinstance(block, SurfaceContactTable):
                contacts.append(Placed(block=i, table=block))
                continue
            cold = background_of(block, self.thermal)
            placed = self._built("contact", i, block, partial(contacts_on_surface, i, body=reduced, background=cold))
            taken = {c.point for c in contacts if c.point is not None}
            for c in placed or []:
                if c.point in taken:
                    self.faults.append(f"[[contact]] '{block.name}' points: point {c.point + 1} has a contact already")
            contacts += placed or []
        if self.body is None or self.thermal is None or self.thermal.influence != INFLUENCE or self.faults:
            return contacts
        try:
            self.thermal, contacts = own_influence(self.thermal, contacts, reduced)
        except InputError as error:
            self.faults += error.problems
        return contacts

    def _top(self) -> Any:
        flat = {key: value for key, value in self.raw.items() if key not in _SECTIONS}
        known = (*(f.alias or n for n, f in TopTable.model_fields.items()), *_SECTIONS)
        unknown = [key for key in flat if key not in TopTable.model_fields]
        absent = [key for key in known if key not in self.raw]
        for key in unknown:
            meant = get_close_matches(key, absent, n=1)
            self.meant.update(meant)
            self.faults.append(f"unknown key '{key}' in the case file; {suggestion(key, meant or known)}")
        table, faults = model_faults(TopTable, {k: v for k, v in flat.items() if k not in unknown}, "")
        self.faults += [
            fault for fault in faults if not fault.startswith(tuple(f"{key} is missing" for key in self.meant))
        ]
        return table

    def _structure(self) -> tuple[Body | None, list[str]]:
        if "structure" not in self.raw:
            missing = "[structure] is missing; describe the structure by its matrices or its modes"
            return None, [missing] if "structure" not in self.meant else []
        return build_structure(self.raw["structure"], self.folder, self.tell)

    def _one(self, section: str, model: type[Table], *, optional: bool = False) -> Any:
        raw = self.raw.get(section)
        where = section_name(section)
        if raw is None:
            if not optional and section not in self.meant:
                self.faults.append(f"{where} is missing; give it with the keys from and to")
            return None
        if not isinstance(raw, Mapping):
            self.faults.append(f"{where}: found {shown(raw)}; expected one table {where}")
            return None
        return self._validated(model, raw, where)

    def _list(self, section: str, model: type[Table] | Callable[[Any], type[Table]]) -> list[tuple[int, Any]]:
        raw = self.raw.get(section, [])
        tables = isinstance(raw, list) and all(isinstance(t, Mapping) for t in raw)
        if not tables or len(raw) > MOST_TABLES:
            expected = f"at most {MOST_TABLES}" if tables else f"tables that begin with [[{section}]] (double brackets)"
            self.faults.append(f"[[{section}]]: found {shown(raw)}; expected {expected}")
            return []
        models = [model if isinstance(model, type) else model(t) for t in raw]
        found = ((i, self._validated(models[i], t, section_name(section, i, t))) for i, t in enumerate(raw))
        return [(i, table) for i, table in found if table is not None]

    def _validated(self, model: type[Table], raw: Mapping[str, Any], where: str) -> Any:
        table, faults = model_faults(model, raw, where)
        cross = [
            f"{where} {fault}" if fault.startswith(("from", "to:", "at")) else f"{where}: {fault}"
            for fault in model.cross_check(raw)
        ]
        self.faults += faults + cross
        return None if faults or cross else table

    def _references(self, loads: list[tuple[int, Any]], contacts: list[tuple[int, Any]], output: Any) -> None:
        """Names used in one section and made in another."""
        dofs = list(self.structure.dofs) if self.structure is not None else named_dofs(self.raw.get("structure"))
        names = [c.get("name") for c in self.raw.get("contact", []) if isinstance(c, Mapping)] if contacts else []
        twice = sorted(n for n, times in Counter(n for n in names if isinstance(n, str)).items() if times > 1)
        self.faults += [
            f"[[contact]] name: '{n}' is used more than once; give every contact its own name" for n in twice
        ]
        if dofs is None:
            return
        for where, dof in self._dof_uses(output):
            if dof not in dofs:
                self.faults.append(f"{where}: there is no dof '{dof}' in the structure; {suggestion(dof, dofs)}")
        if self.structure is not None:
            shapes = self.structure.load_shapes
            for i, table in loads:
                if table.shape is not None and table.shape not in shapes:
                    where = section_name("load", i)
                    hint = suggestion(table.shape, shapes)
                    self.faults.append(f"{where} shape: there is no load shape '{table.shape}'; {hint}")

    def _dof_uses(self, output: Any) -> list[tuple[str, str]]:
        uses: list[tuple[str, Any]] = []
        for i, t in enumerate(_tables(self.raw.get("load"))):
            uses.append((f"{section_name('load', i, t)} dof", t.get("dof")))
            moved = t.get("base")
            uses += [
                (f"{section_name('load', i, t)} base", dof) for dof in (moved if isinstance(moved, Mapping) else ())
            ]
        for i, t in enumerate(_tables(self.raw.get("contact"))):
            if contact_table(t) is SurfaceContactTable:
                continue
            for key in ("tangential", "normal"):
                where = f"{section_name('contact', i, t)} {key}"
                used = t.get(key)
                uses += [(where, dof) for dof in (used if isinstance(used, Mapping) else [used])]
        uses += [("[output] dofs", dof) for dof in (output.dofs if output else [])]
        peaks = self.response.peaks_of if self.response else None
        uses += [("[response] peaks_of", dof) for dof in ([peaks] if isinstance(peaks, str) else peaks or [])]
        return [(where, dof) for where, dof in uses if isinstance(dof, str)]

    def _built(self, section: str, index: int, table: Any, build: Callable[[Any], Any]) -> Any:
        try:
            return build(table)
        except InputError as error:
            where = section_name(section, index, {"name": getattr(table, "name", None)})
            self.faults += [f"{where} {problem}" for problem in error.problems]
            return None

    def _pair(self, table: ContactTable) -> ContactPair:
        return contact_pair(table, background_of(table, self.thermal))

    def _problem(
        self,
        structure: Structure,
        top: TopTable,
        pairs: list[ContactPair],
        loads: list[Load],
        output: Any,
        contacts: list[ContactTable],
    ) -> None:
        from slipstick.balance.problem import Problem
        from slipstick.trig.harmonics import Harmonics

        harmonics = Harmonics(top.harmonics)
        unknowns = sum(pair.n_ports for pair in pairs) * harmonics.size
        if unknowns > MOST_UNKNOWNS:
            self.faults.append(
                f"{len(pairs)} contacts with {harmonics.size} coefficients make {unknowns} unknowns; "
                f"expected at most {MOST_UNKNOWNS}: keep fewer harmonics or contacts"
            )
            return
        ratios = [r for r in (top.period_ratio, self.response.period_ratio if self.response else None) if r]
        if len(ratios) == 2 and ratios[0] != ratios[1]:
            self.faults.append("period_ratio is given at the top and in [response] with different values; keep one")
            return
        try:
            self.problem = Problem(
                structure,
                contacts=pairs,
                loads=loads,
                harmonics=harmonics,
                outputs=output.dofs if output else None,
                period_ratio=ratios[0] if ratios else (1, 1),
                title=top.title,
                units=top.units.units,
                thermal=thermal_model(contacts, self.thermal, self.folder),
                told=None,
            )
            self._parameter()
            self._reduction()
        except InputError as error:
            self.faults += error.problems

    def _reduction(self) -> None:
        """The structure is not reduced too far for what is asked of it."""
        from slipstick.balance.reduction import reduction_faults

        if self.problem is None or self.response is None or self.body is None or self.body.force or self.faults:
            return
        count = self.body.reduced.modes_below if self.body.reduced is not None else None
        found = reduction_faults(self.problem, frequencies_met(self.response), count)
        self.faults += [f"[structure] {fault}" for fault in found]

    def _parameter(self) -> None:
        """The followed parameter exists and takes both ends of its range."""
        name = self.response.parameter if self.response else None
        if name is None or self.problem is None or self.response is None:
            return
        try:
            self.problem.parameter(name)
            for end in (self.response.start, self.response.stop):
                self.problem.at_parameter(name, float(end))
        except InputError as error:
            self.faults += [f"[response] parameter: {problem}" for problem in error.problems]


def _tables(raw: Any) -> list[Mapping[str, Any]]:
    return [t for t in raw if isinstance(t, Mapping)] if isinstance(raw, list) else []


def read_load(table: LoadTable) -> Load:
    """The load of a ``[[load]]`` table: amplitude cos(m tau + phase) becomes its cosine and sine parts."""
    from slipstick.balance.loads import Load

    cos, sin = table.cos, table.sin
    if table.amplitude is not None:
        phase = table.phase or 0.0
        cos, sin = table.amplitude * math.cos(phase), -table.amplitude * math.sin(phase)
    where: dict[str, Any] = {"dof": table.dof, "shape": table.shape, "base": table.base, "motion": table.motion}
    return Load(**where, harmonic=table.harmonic, cos=cos, sin=sin)


def contact_pair(table: ContactTable, background: float | None = None) -> ContactPair:
    """The contact of a ``[[contact]]`` table, cold; a normal load N0 is the interference gap = -N0 / kn."""
    from slipstick.balance.contacts import ContactPair

    return ContactPair(
        name=table.name,
        contact=cold_contact(table, background),
        tangential=table.tangential,
        normal=table.normal,
        rubbing=rubbing_motion(table),
    )
