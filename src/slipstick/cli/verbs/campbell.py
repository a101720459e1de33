"""The verb ``campbell``: whirl frequencies over the speed of rotation, and where engine orders meet them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.options import CasePath, ForceFile, refuse_file
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import DONE, say
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.quantities import FREQUENCIES, frequency_unit

if TYPE_CHECKING:
    from slipstick.case.case import Case


def whole_numbers(option: str, given: str) -> list[int]:
    """Numbers such as "1,2"."""
    found = [word.strip() for word in given.split(",")]
    if not all(word.isdecimal() for word in found):
        raise InputError(f"{option} {given}: expected whole numbers such as 1,2")
    return [int(word) for word in found]


def parsed_speed(option: str, given: str) -> float:
    """A speed, rad/s: a plain number, or one with a unit such as "9000 rpm"."""
    from slipstick.faults import in_radians, number

    try:
        value: Any = float(given)
    except ValueError:
        value = in_radians(option, given)
    return number(option, value, 'a speed in rad/s, or one with its unit such as "9000 rpm"')


def shown_unit(read: Case, *speeds: str) -> str:
    """The unit that speeds are given in, else that of the case's range."""
    known = [unit for speed in speeds if (unit := frequency_unit(speed)) is not None]
    return known[0] if known else read.frequency_unit if read.frequency_unit in FREQUENCIES else "rad/s"


def diagram_file(output: Path | None, default: str, *, force: bool) -> Path:
    """The file of a diagram, refused before anything is computed if it is there already."""
    path = output or Path(default)
    path = path if path.suffix else path.with_suffix(".png")
    refuse_file(path, force=force)
    return path


def write_diagram(axes: Any, path: Path, answer: Answer) -> None:
    """A diagram in the format that the file's ending says, told."""
    from slipstick.plots import save_figure

    written = save_figure(axes, path.with_suffix(""), formats=(path.suffix.removeprefix("."),))
    answer["figures"] = [str(each) for each in written]
    say(f"figure in {', '.join(map(str, written))}")


_SENSE = {1: "forward", -1: "backward", 0: "no whirl"}


@verb
def campbell(
    answer: Answer,
    case: CasePath,
    to: Annotated[str, typer.Option("--to", help='The highest speed, rad/s, or such as "9000 rpm".', metavar="SPEED")],
    start: Annotated[str, typer.Option("--from", help="The lowest speed.", metavar="SPEED")] = "0 rpm",
    orders: Annotated[str, typer.Option("--orders", help="Engine orders, such as 1,2.", metavar="LIST")] = "1",
    points: Annotated[int, typer.Option("--points", help="Speeds in the diagram.", min=2, max=2000)] = 61,
    modes: Annotated[int | None, typer.Option("--modes", help="So many of the lowest modes.", min=1)] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The figure; by default CASE-campbell.png, here.")
    ] = None,
    force: ForceFile = False,
) -> int:
    """Damped frequencies of a rotor without contacts over its speed ("gyroscopic"), and its critical speeds."""
    import numpy as np

    from slipstick.case.case import Case
    from slipstick.plots import campbell as draw
    from slipstick.structure.campbell import campbell as diagram

    read = Case.from_file(case)
    first, last = parsed_speed("--from", start), parsed_speed("--to", to)
    if not 0.0 <= first < last:
        raise InputError(f"--from {start} --to {to}: expected two speeds >= 0, the second one above the first")
    file = diagram_file(output, f"{read.name}-campbell.png", force=force)
    structure: Any = read.problem().structure
    found = diagram(
        structure, np.linspace(first, last, points), engine_orders=whole_numbers("--orders", orders), modes=modes
    )
    met = {
        name: found[f"crossing_{name}"].to_numpy().tolist() for name in ("speed", "frequency", "order", "mode", "whirl")
    }
    answer["crossings"] = [dict(zip(met, row, strict=True)) for row in zip(*met.values(), strict=True)]
    say("damped frequencies, without contacts ('slipstick check' has the undamped ones):")
    for speed, frequency, order, mode, whirl in zip(*met.values(), strict=True):
        say(
            f"engine order {order} meets mode {mode} ({_SENSE[whirl]}) at {speed:.6g} rad/s "
            f"({speed * 30 / np.pi:.5g} rpm), at the frequency {read.frequency_text(frequency)}"
        )
    if not answer["crossings"]:
        say(f"no crossing between {first:g} and {last:g} rad/s")
    write_diagram(draw(found, frequency=shown_unit(read, to, start)), file, answer)
    return DONE
