"""The verb ``interference``: frequencies of a disc by nodal diameter, and which engine orders meet them."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Annotated, Any

import typer

from slipstick.cli.options import CasePath, ForceFile
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import DONE, say
from slipstick.cli.verb import verb
from slipstick.cli.verbs.campbell import diagram_file, parsed_speed, shown_unit, whole_numbers, write_diagram
from slipstick.errors import InputError

_WAVES = {1: "wave with the pattern", -1: "wave against the pattern", 0: "standing wave"}


@verb
def interference(
    answer: Answer,
    case: CasePath,
    to: Annotated[str, typer.Option("--to", help='The highest speed, or "9000 rpm".', metavar="SPEED")],
    orders: Annotated[str, typer.Option("--orders", help="Engine orders, such as 24,48.", metavar="LIST")],
    start: Annotated[str, typer.Option("--from", help="The lowest speed.", metavar="SPEED")] = "0 rpm",
    modes: Annotated[int, typer.Option("--modes", help="So many modes of each nodal diameter.", min=1)] = 3,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The figure; by default CASE-interference.png, here.")
    ] = None,
    force: ForceFile = False,
) -> int:
    """Undamped frequencies of a disc without contacts by nodal diameter, met by engine orders (SAFE diagram)."""
    from slipstick.case.case import Case
    from slipstick.plots import interference as draw
    from slipstick.structure.interference import interference as diagram

    read = Case.from_file(case)
    disc: Any = getattr(read.problem().structure, "sector", None)
    if disc is None:
        raise InputError(f'{case}: the structure is no sector of a disc; expected [structure] kind = "disc"')
    file = diagram_file(output, f"{read.name}-interference.png", force=force)
    speeds = parsed_speed("--from", start), parsed_speed("--to", to)
    found = diagram(disc, speeds, engine_orders=whole_numbers("--orders", orders), modes=modes)
    names = ("speed", "frequency", "order", "nodal_diameter", "mode", "wave")
    rows = list(zip(*(found[f"crossing_{name}"].to_numpy().tolist() for name in names), strict=True))
    answer["crossings"] = [dict(zip(names, row, strict=True)) for row in rows]
    for speed, frequency, order, diameter, mode, wave in rows:
        say(
            f"engine order {order} meets mode {mode} of nodal diameter {diameter} ({_WAVES[wave]}) at "
            f"{speed:.6g} rad/s ({speed * 30.0 / pi:.5g} rpm): {read.frequency_text(frequency)}"
        )
    if not rows:
        say("no engine order meets a frequency of its nodal diameter")
    write_diagram(draw(found, frequency=shown_unit(read, to, start)), file, answer)
    return DONE
