"""A case file as the Python script that says the same: public names only, and the same numbers to the last bit."""

from __future__ import annotations

import json
import re
import textwrap
from pathlib import Path
from typing import Any

from slipstick.case import RENAMED
from slipstick.case.contact import contact_table, contacts_script
from slipstick.case.fe import reaching
from slipstick.case.joint import joint_tables, joint_variable
from slipstick.case.load import LoadTable
from slipstick.case.preload import BoltTable, StepTable, bolt_call, preload_script, step_calls
from slipstick.case.response import OutputTable, ResponseTable, frequencies_script, response_script
from slipstick.case.script_text import Call, Code, call, listed_text
from slipstick.case.sections import CASE_SECTIONS, REQUESTS, structure_kind
from slipstick.case.source import parse
from slipstick.case.table import RawTable
from slipstick.case.thermal import ThermalTable, thermal_script
from slipstick.case.top import TopTable

_CONSTANTS = {"HZ": "2 * np.pi", "KHZ": "2e3 * np.pi", "RPM": "np.pi / 30", "DEG": "np.pi / 180"}
_IMPORTS = {
    "mmread(": "from scipy.io import mmread",
    "load_npz(": "from scipy.sparse import load_npz",
    "blade_shape(": "from slipstick.models.blade_mesh import blade_shape",
    "sector_shape(": "from slipstick.models.parametric_sector import sector_shape",
}
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


def python_script(text: str, name: str, folder: Path) -> str:
    """The script of a case that has no faults; ``folder`` holds the files the case names.

    Raises
    ------
    InputError
        If a key has no counterpart.
    """
    raw = parse(text, name)
    study = raw.pop("study", None)
    notes = [] if study is None else [
        f"# The case has [study] too: ss.study(ss.Case.from_file({name!r})) computes its curves.\n"
    ]  # fmt: skip
    notes += [
        f"# The case has [{section}] too: see ss.{REQUESTS[RENAMED.get(section, section)].verb}, which takes problem() "
        "and what stands there.\n"
        for section in (*REQUESTS, *RENAMED)
        if raw.pop(section, None) is not None
    ]
    made, followed = textwrap.indent(_problem(raw, folder), "    "), response_script(raw["response"])
    top = TopTable.model_validate({key: value for key, value in raw.items() if key not in CASE_SECTIONS})
    body = _BODY.format(
        unit="" if "parameter" in raw["response"] else f" {top.units.units.angular}",
        made=made,
        followed=textwrap.indent(followed, "    ").lstrip(),
    )
    title = _docstring(top.title or Path(name).stem)
    about = [f"Author: {top.author}"] * bool(top.author) + top.remarks.strip().splitlines()
    said = "".join(f"{_docstring(line)}\n" for line in about)
    said = f"\n{said}" if said else ""
    script = f'"""{title}\n\nWhat {_docstring(name)} says, in Python.\n{said}"""\n\n{_head(body)}\n\n\n{body}'
    return "\n".join([script, *notes])


def _head(body: str) -> str:
    """Imports and constants that the rest needs."""
    constants = [f"{name} = {value}" for name, value in _CONSTANTS.items() if re.search(rf"\* {name}\b", body)]
    here = ["HERE = Path(__file__).resolve().parent"] * ("HERE" in body)
    used = [line for word, line in _IMPORTS.items() if word in body]
    others = ["import numpy as np"] * ("np." in body or bool(constants)) + [n for n in used if "scipy" in n]
    ours = ["import slipstick as ss", *(n for n in used if "scipy" not in n)]
    blocks = (["from pathlib import Path"], others, ours, [*here, *constants])
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _problem(raw: RawTable, folder: Path) -> str:
    """The lines that make the problem, table by table."""
    thermal = ThermalTable.model_validate(raw["thermal"]) if "thermal" in raw else None
    tables: list[Any] = [contact_table(contact).model_validate(contact) for contact in raw.get("contact", [])]
    joints = [joint_variable(number) for number, _ in enumerate(raw.get("joint", []))]
    bolts = [BoltTable.model_validate(bolt) for bolt in raw.get("bolt", [])]
    cut = [bolt.name for bolt in bolts if bolt.section is not None]
    screws = [bolt_call(b).written() if b.section is None else f"bolts[{cut.index(b.name)}]" for b in bolts]
    contacts = contacts_script(tables, thermal, [*(f"*{joint}" for joint in joints), *screws])
    loads = [LoadTable.model_validate(load).call.written() for load in raw.get("load", [])]
    loads += [f"*{name}.loads" for name, one in zip(joints, raw.get("joint", []), strict=True) if "pressure" in one]
    lines = [*_structure(raw, folder), *contacts.lines, *([f"loads = {listed_text(loads)}"] if loads else [])]
    top = TopTable.model_validate({key: value for key, value in raw.items() if key not in CASE_SECTIONS})
    orders, response = top.harmonics, ResponseTable.model_validate(raw["response"])
    named = {"contacts": Code("contacts"), "loads": Code("loads") if loads else []}
    named["harmonics"] = Code(f"range({len(orders)})") if orders == list(range(len(orders))) else orders
    outputs = {"outputs": OutputTable.model_validate(raw["output"]).dofs} if "output" in raw else {}
    whole_disc = "mistuning" in raw["structure"]
    named |= {} if whole_disc else outputs
    ratio = top.period_ratio or response.period_ratio
    named |= {} if ratio is None else {"period_ratio": ratio}
    named |= top.given("title", "units")
    if thermal is not None or any(table.thermal is not None for table in tables):
        lines += thermal_script(tables, thermal, contacts.blocks, folder)
        named["thermal"] = Code("thermal")
    made = Call("ss.Problem", (Code("structure"),), named).written()
    if contacts.chosen:
        chosen = f"[pair.name for pair in {' + '.join(contacts.chosen)}]"
        made = call("ss.models.straight_contacts", made, omega=frequencies_script(raw["response"]), contacts=chosen)
    if whole_disc:
        made = Call("disc.problem", (Code(made),), outputs).written()
    of_file = [Code("*bolts.steps")] * any(bolt.section is not None and not bolt.tightened for bolt in bolts)
    steps = step_calls(bolts, [StepTable.model_validate(step) for step in raw.get("preload", [])], of_file)
    gathering = {name: own for name, one in zip(joints, joint_tables(raw), strict=True) if (own := one.gathering)}
    ends = preload_script(made, steps, joints, gathering) if steps else [f"return {made}"]
    return "\n".join([*lines, *ends])


def _structure(raw: RawTable, folder: Path) -> list[str]:
    table = reaching(raw)
    kind = structure_kind(table)
    assert kind is not None
    return kind.script(kind.table.model_validate(table), folder)


def _docstring(title: str) -> str:
    """A title as it can stand in a docstring."""
    return json.dumps(title, ensure_ascii=False)[1:-1].replace('\\"', "'")
