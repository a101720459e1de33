"""The verb ``preload``: load steps before the vibration."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.cli.options import CasePath, Force, folder_option
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import DONE, quietly, say, say_results, warn_user
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.runs.folder import LOADED, OutputFolder

if TYPE_CHECKING:
    from slipstick.analysis.preload.preload import Preload


@verb
def preload(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-preload")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
) -> int:
    """Compute the load steps of a case with bolts and preload: forces, pressures, gaps before the vibration."""
    from slipstick.case.case import Case

    read = Case.from_file(case, say)
    for sentence in read.noticed:
        warn_user(sentence)
    folder = output or Path(f"{read.name}-preload")
    with OutputFolder(folder, writes="preload", force=force) as place:
        state = quietly(lambda: read.preloaded)
        if state is None:
            example = 'bolts = { "bolt 1" = 12e3 }'
            raise InputError(f"{case}: there are no load steps; give [[preload]], such as {example}")
        names = [str(name) for name in state.dataset["step"].to_numpy()]
        for step in range(len(names)):
            for line in state.table(step).splitlines():
                say(line)
        for note in state.notes:
            say(note)
        state.dataset.attrs.update(read.names)
        _write(place.work, state, figures=figures)
        place.complete()
    joints = [str(name) for name in state.dataset["joint"].to_numpy()]
    quantities = ("normal_resultant", "friction_resultant", "open_share", "largest_pressure")
    answer["steps"] = [
        {"step": name, **{
            joint: {q: float(state.dataset[q].to_numpy()[k, j]) for q in quantities if q in state.dataset}
            for j, joint in enumerate(joints)
        }}
        for k, name in enumerate(names)
    ]  # fmt: skip
    answer["notes"] = list(state.notes)
    answer |= files_in(folder)
    say_results(folder, LOADED, reported=False)
    return DONE


def _write(folder: Path, state: Preload, *, figures: bool) -> None:
    """The dataset, the points of joints for ParaView, a figure."""
    from slipstick.io.store import save_dataset
    from slipstick.io.xdmf import write_preload
    from slipstick.plots import preload as draw
    from slipstick.plots import save_figure

    save_dataset(state.dataset, folder / LOADED)
    if "position" in state.dataset:
        write_preload(state.dataset, folder / "preload.xdmf")
    if figures:
        save_figure(draw(state.dataset), folder / "preload", formats=("png",))
