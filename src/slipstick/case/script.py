"""A case file as the Python script that says the same: public names only, and the same numbers to the last bit."""

from __future__ import annotations

import builtins
import json
import keyword
import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from slipstick.case.fe_tables import BladeTable, FeTable, ModelTable, SurfaceContactTable, contact_table
from slipstick.case.heating import background_of, cold_value
from slipstick.case.reach import reaching
from slipstick.case.reducing import CACHE
from slipstick.case.response_table import ResponseTable
from slipstick.case.rotor import WORDS, axis_arguments, motion_arguments
from slipstick.case.script_heat import heat_lines
from slipstick.case.script_text import GivenText, call, file_code, here, listed_text, literal, quantity_text
from slipstick.case.source import parse
from slipstick.case.spacing import Spacing
from slipstick.case.steps import STEP_KEYS
from slipstick.case.structure_tables import MatricesTable, ModalTable
from slipstick.case.tables import (
    LoadTable,
    OutputTable,
    Table,
    ThermalTable,
    TopTable,
    UnitsTable,
)

_STRUCTURES: dict[str, type[Table]] = {
    "matrices": MatricesTable,
    "modal": ModalTable,
    "fe": FeTable,
    "blade": BladeTable,
}
_SECTIONS = ("structure", "load", "contact", "thermal", "response", "output")
_OWN = {
    *(
        "at",
        "body",
        "contacts",
        "C",
        "curve",
        "friction",
        "heated",
        "i",
        "K",
        "loads",
        "M",
        "model",
        "names",
        "np",
        "own",
    ),
    *("p", "pair", "Path", "points", "resistance", "ss", "structure", "thermal", *dir(builtins)),
}
"""Names that a script uses itself."""
_CONSTANTS = {"HZ": "2 * np.pi", "KHZ": "2e3 * np.pi", "RPM": "np.pi / 30", "DEG": "np.pi / 180"}
_IMPORTS = {
    "mmread(": "from scipy.io import mmread",
    "load_npz(": "from scipy.sparse import load_npz",
    "blade_shape(": "from slipstick.models.blade_mesh import blade_shape",
}


def python_script(text: str, name: str, folder: Path) -> str:
    """The script of a case that has no faults; ``folder`` holds the files the case names.

    Raises
    ------
    InputError
        If a key has no counterpart.
    """
    raw = parse(text, name)
    study = raw.pop("study", None)
    further = {"track": "track_peak", "optimal": "optimal", "modes": "nonlinear_modes", "cycles": "limit_cycles"}
    calls = [
        f"# The case has [{section}] too: see ss.{verb}, which takes problem() and what stands there.\n"
        for section, verb in further.items()
        if raw.pop(section, None) is not None
    ]
    script = _Script(raw, folder).text(name)
    if study is not None:
        calls.insert(0, f"# The case has [study] too: ss.study(ss.Case.from_file({name!r})) computes its curves.\n")
    return "\n".join([script, *calls]) if calls else script


_BODY = '''\
def problem():
    """The structure, its contacts and its loads."""
{made}


def compute():
    """The curve."""
    return {followed}


if __name__ == "__main__":
    branch = compute()
    print(branch.outcome.text)
    for dof in branch.problem.outputs:
        for at, amplitude in branch.peaks(dof):
            print(f"peak of {{dof}}: {{amplitude:.6g}} at {{at:.6g}}{unit}")
    branch.save(Path(__file__).with_suffix(".nc"))
'''


def _head(body: str) -> str:
    """Imports and constants that the rest needs."""
    constants = [f"{name} = {value}" for name, value in _CONSTANTS.items() if re.search(rf"\* {name}\b", body)]
    here = ["HERE = Path(__file__).resolve().parent"] * ("HERE" in body)
    used = [line for word, line in _IMPORTS.items() if word in body]
    others = ["import numpy as np"] * ("np." in body or bool(constants)) + [n for n in used if "scipy" in n]
    own = ["import slipstick as ss", *(n for n in used if "scipy" not in n)]
    blocks = (["from pathlib import Path"], others, own, [*here, *constants])
    return "\n\n".join("\n".join(block) for block in blocks if block)


@dataclass
class _Script:
    """One pass over the tables of a case that collects lines of code."""

    raw: Mapping[str, Any]
    folder: Path
    on_surface: list[tuple[str, SurfaceContactTable]] = field(default_factory=list)
    """Variable and table of each block of contacts on the surface."""

    def text(self, name: str) -> str:
        """The whole script."""
        top = GivenText({key: value for key, value in self.raw.items() if key not in _SECTIONS}, TopTable)
        self.thermal = ThermalTable.model_validate(self.raw["thermal"]) if "thermal" in self.raw else None
        lines = [*self._structure(), *self._contacts(), *self._loads()]
        heat = self._heat()
        lines += [*heat, f"return {self._problem(top, heated=bool(heat))}"]
        made, followed = "\n".join(lines), self._response()
        title = self.raw.get("title") or Path(name).stem
        angular = UnitsTable.model_validate(self.raw.get("units", {})).units.angular
        body = _BODY.format(
            unit="" if "parameter" in self.raw["response"] else f" {angular}",
            made=textwrap.indent(made, "    "),
            followed=textwrap.indent(followed, "    ").lstrip(),
        )
        return f'"""{_docstring(title)}\n\nWhat {_docstring(name)} says, in Python.\n"""\n\n{_head(body)}\n\n\n{body}'

    def _structure(self) -> list[str]:
        raw = reaching(self.raw)
        of_model = raw["kind"] == "matrices" and "file" in raw
        given = GivenText(raw, ModelTable if of_model else _STRUCTURES[raw["kind"]])
        given.take("kind")
        lines: list[str] = self._model(given) if of_model else getattr(self, f"_{raw['kind']}")(given)
        given.end("[structure]")
        return lines

    def _matrices(self, given: GivenText) -> list[str]:
        named = {"M": "mass", "C": "damping", "K": "stiffness"}
        known = {letter: value for letter, key in named.items() if (value := given.take(key)) is not None}
        lines = [f"{letter} = {self._matrix(value)}" for letter, value in known.items()]
        dofs, _ = given.take("dofs"), given.take("count")
        arguments = {letter: letter for letter in known}
        arguments["dofs"] = literal(dofs) if dofs else "[str(i + 1) for i in range(K.shape[0])]"
        arguments |= given.rest("loss_factor")
        return [*lines, f"structure = {call('ss.MatrixStructure', **arguments)}"]

    def _matrix(self, value: list[Any] | str) -> str:
        if not isinstance(value, str):
            return call("np.array", literal(value))
        return file_code(value, self.folder)

    def _model(self, given: GivenText) -> list[str]:
        arguments = {letter: f"model.{letter}" for letter in "MCK"} | {"dofs": "model.dofs"} | given.rest("loss_factor")
        model = f"model = {call('ss.import_model', here(given.take('file')))}"
        return [model, *self._turning(given), f"structure = {call('ss.MatrixStructure', **arguments)}"]

    def _turning(self, given: GivenText) -> list[str]:
        """The model at the speed of its ``rotation``."""
        table = given.take("rotation")
        if table is None:
            return []
        raw = given.raw["rotation"]
        axis = axis_arguments(table.axis)
        arguments = {} if axis is None else {"axis": literal(axis)}
        if table.models is not None:
            models = (f"{literal(s)}: {call('ss.import_model', here(name))}" for s, name in table.models.items())
            arguments["others"] = f"{{{', '.join(models)}}}"
        return [f"model = {call('ss.at_speed', 'model', quantity_text(raw['speed']), **arguments)}"]

    def _modal(self, given: GivenText) -> list[str]:
        given.take("force")
        arguments = given.rest("dofs", "modes", "loss_factor", "damping_ratio")
        return [f"structure = {call('ss.ModalStructure.load', here(given.take('file')), **arguments)}"]

    def _fe(self, given: GivenText) -> list[str]:
        arguments: dict[str, str] = {}
        material = given.take("material")
        if material is not None:
            known = {name: value for name, value in material.model_dump().items() if value is not None}
            whole = "young" in known
            arguments = {"material": _material(known)} if whole else {name: literal(v) for name, v in known.items()}
        arguments |= given.rest("fixed", "quadratic")
        up_to = given.take("up_to")
        reduction = given.rest(
            "surface", "contacts", "radius", "pressure", "base", "films", "cold", "keep", "modes", "accuracy",
            "loss_factor", "damping_ratio", "force",
        )  # fmt: skip
        if up_to is not None:
            reduction["up_to"] = quantity_text(given.raw["up_to"])
        turning = self._turning(given)
        model = f"model = {call('ss.import_model', here(given.take('file')), **arguments)}"
        body = call("ss.reduced_body", "model", **reduction, cache=here(CACHE))
        return [model, *turning, f"body = {body}", "structure = body.structure"]

    def _blade(self, given: GivenText) -> list[str]:
        size, _ = given.take("size"), given.take("force")
        dimensions = given.rest("height", "chord", "thickness", "twist")
        shape = call("blade_shape", literal(size), **dimensions) if dimensions else literal(size)
        material = given.take("material")
        arguments = {} if material is None else {"material": _material(material.model_dump(exclude_none=True))}
        arguments |= given.rest("contacts", "radius", "film", "modes", "loss_factor")
        if given.take("up_to") is not None:
            arguments["up_to"] = quantity_text(given.raw["up_to"])
        body = call("ss.reduced_blade", shape, **arguments, cache=here(CACHE))
        return [f"body = {body}", "structure = body.structure"]

    def _contacts(self) -> list[str]:
        laws: dict[str, str] = {}
        pairs, blocks, lines = [], [], []
        for i, raw in enumerate(self.raw["contact"]):
            kind = contact_table(raw)
            given, table = GivenText(raw, kind), kind.model_validate(raw)
            law = self._law(given, table)
            if law not in laws:
                laws[law] = "friction" if not laws else f"friction_{len(laws) + 1}"
                lines.append(f"{laws[law]} = {law}")
            if isinstance(table, SurfaceContactTable):
                variable = _variable(table.name, [name for name, _ in self.on_surface])
                self.on_surface.append((variable, table))
                blocks.append(f"{variable} = {_surface_call(given, table, laws[law])}")
                pairs.append(f"*{variable}")
            else:
                pairs.append(_pair_call(given, laws[law]))
            given.take("thermal")
            given.end(f"[[contact]] number {i + 1}")
        return [*lines, *blocks, f"contacts = {listed_text(pairs)}"]

    def _law(self, given: GivenText, table: Any) -> str:
        background = background_of(table, self.thermal)
        values = {name: given.take(name) for name in ("kt", "mu", "kn", "gap", "normal_load")}
        total = given.take("normal_load_total") if isinstance(table, SurfaceContactTable) else None
        values["normal_load"] = values["normal_load"] if total is None else total
        cold = {name: cold_value(value, background) for name, value in values.items() if value is not None}
        return call("ss.FrictionContact", **{name: literal(value) for name, value in cold.items()})

    def _loads(self) -> list[str]:
        made = []
        for i, raw in enumerate(self.raw.get("load", [])):
            given = GivenText(raw, LoadTable)
            phase = given.take("phase")
            arguments = given.rest("dof", "shape", "base", "motion", "harmonic", "cos", "sin", "amplitude")
            if phase is not None:
                arguments["phase"] = quantity_text(raw["phase"])
            made.append(call("ss.Load", **arguments))
            given.end(f"[[load]] number {i + 1}")
        return [f"loads = {listed_text(made)}"] if made else []

    def _heat(self) -> list[str]:
        tables = [contact_table(raw).model_validate(raw) for raw in self.raw["contact"]]
        if self.thermal is None and all(getattr(table, "thermal", None) is None for table in tables):
            return []
        variables = {table.name: variable for variable, table in self.on_surface}
        return heat_lines(tables, self.thermal, variables, self.folder)

    def _problem(self, top: GivenText, *, heated: bool) -> str:
        top.take("format")
        orders, ratio, units = top.take("harmonics"), top.take("period_ratio"), top.take("units")
        whole = orders == list(range(len(orders)))
        arguments = {"contacts": "contacts", "loads": "loads" if self.raw.get("load") else "[]"}
        arguments["harmonics"] = f"range({len(orders)})" if whole else literal(orders)
        if "output" in self.raw:
            arguments["outputs"] = literal(OutputTable.model_validate(self.raw["output"]).dofs)
        ratio = ratio or ResponseTable.model_validate(self.raw["response"]).period_ratio
        arguments |= {} if ratio is None else {"period_ratio": literal(tuple(ratio))}
        arguments |= top.rest("title")
        arguments |= {} if units is None else {"units": literal(units.model_dump(exclude_none=True))}
        top.end("the case file")
        if heated:
            arguments["thermal"] = "thermal"
        return call("ss.Problem", "structure", **arguments)

    def _response(self) -> str:
        raw = self.raw["response"]
        given = GivenText(raw, ResponseTable)
        given.take("period_ratio")
        ends = [quantity_text(raw[key]) for key in ("from", "to")]
        parameter, at = given.take("parameter"), given.take("at")
        for key in ("start", "stop", "omega"):
            given.take(key)
        more = {"requested": _requested(at, ends)} if at else {}
        more |= given.rest("peaks_of", "stability", "follow")
        options = given.rest(*STEP_KEYS)
        if options:
            more["options"] = "{" + ", ".join(f'"{name}": {value}' for name, value in options.items()) + "}"
        given.end("[response]")
        span = f"({', '.join(ends)})"
        if parameter is None:
            return call("ss.forced_response", "problem()", omega=span, **more)
        return call(
            "ss.parameter_response", "problem()", literal(parameter), span, omega=quantity_text(raw["omega"]), **more
        )


def _requested(at: list[Any] | Spacing, ends: list[str]) -> str:
    """Values at which points are wanted."""
    if isinstance(at, Spacing):
        return call("np.geomspace" if at.spacing == "log" else "np.linspace", *ends, literal(at.count))
    return f"[{', '.join(quantity_text(value) for value in at)}]"


def _pair_call(given: GivenText, law: str) -> str:
    arguments = {"name": literal(given.take("name")), "contact": law}
    for port in ("tangential", "normal"):
        direction = given.take(port)
        if direction is not None:
            alone = len(direction) == 1 and next(iter(direction.values())) == 1.0
            arguments[port] = literal(next(iter(direction)) if alone else direction)
    return call("ss.ContactPair", **arguments, **_rubbing(given))


def _surface_call(given: GivenText, table: SurfaceContactTable, law: str) -> str:
    direction = given.take("direction")
    arguments = {"contact": law, "direction": literal(direction if isinstance(direction, str) else list(direction))}
    points, _, normal = given.take("points"), given.take("tangential"), given.take("normal")
    arguments |= {} if points in (None, "all") else {"points": literal(points)}
    arguments |= {} if normal is None else {"normal": literal(normal) if normal in WORDS else "True"}
    axis, rotor = axis_arguments(given.take("axis")), given.take("rotor")
    arguments |= {} if axis is None else {"axis": literal(axis)}
    if rotor is not None:
        own = {key: literal(value) for key, value in motion_arguments(rotor).items()}
        motion = call("ss.casing_motion", own.pop("profile"), radius="radius", angles="angles", **own)
        arguments["rubbing"] = f"lambda radius, angles: {motion}"
    arguments |= {} if table.normal_load_total is None else {"shared": "True"}
    return call("ss.surface_contacts", "body", literal(given.take("name")), **arguments, **_rubbing(given))


def _rubbing(given: GivenText) -> dict[str, str]:
    rub = given.take("rubbing")
    if rub is None:
        return {}
    own = {key: literal(getattr(rub, key)) for key in type(rub).model_fields if key in rub.model_fields_set}
    return {"rubbing": call("ss.RubbingMotion", **own)}


def _material(known: Mapping[str, Any]) -> str:
    return call("ss.Material", **{name: literal(value) for name, value in known.items()})


def _variable(name: str, taken: list[str]) -> str:
    """A variable that is called like a contact."""
    plain = re.sub(r"\W", "_", name)
    own = plain in _OWN or re.fullmatch(r"(curve|friction|contacts)_\d+", plain)
    free = plain.isidentifier() and not keyword.iskeyword(plain) and plain not in taken and not own
    return plain if free else f"contacts_{len(taken) + 1}"


def _docstring(title: str) -> str:
    """A title as it can stand in a docstring."""
    return json.dumps(title, ensure_ascii=False)[1:-1].replace('\\"', "'")
