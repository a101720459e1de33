"""The verb ``identify``: parameters that fit what was measured."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from slipstick.cli.options import CasePath, Force, KeptTimeLimit, Quiet, Report, files, folder_option, run_options
from slipstick.cli.terminal.answers import Answer, files_in
from slipstick.cli.terminal.guard import (
    DONE,
    STOPPED,
    complain,
    prepare_kernel,
    quietly,
    report_or_warn,
    say,
    say_results,
    termination_as_interrupt,
    warn_user,
)
from slipstick.cli.verb import verb
from slipstick.cli.verbs.run import case_with
from slipstick.replacing import writing
from slipstick.runs.folder import FITTED, REPORT, OutputFolder

if TYPE_CHECKING:
    from slipstick.analysis.identification.identification import Identification


def data_files(incomplete: str) -> list[str]:
    """Files of measurements, and folders on the way to them."""
    return files(incomplete, (".nc", ".csv", ".mat", ".unv", ".uff"))


@verb
def identify(
    answer: Answer,
    case: CasePath,
    data: Annotated[
        Path,
        typer.Argument(
            metavar="DATA",
            help="What was measured: .csv, .nc, .mat (MATLAB), .unv or .uff.",
            show_default=False,
            autocompletion=data_files,
        ),
    ],
    output: Annotated[Path | None, folder_option("CASE-identify")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: KeptTimeLimit = None,
) -> int:
    """Fit the parameters of the table "identify" to measured vibration, loops, backbones or time series."""
    from slipstick.analysis.identification.identify import identify
    from slipstick.cli.terminal.display import curve_display
    from slipstick.report.writing import write_fit_report
    from slipstick.runs.run import Clock

    options = run_options(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
    read = case_with(case, "identify", 'parameters = { "damper.mu" = 0.3 }', options.tell)
    table = read.further["identify"]
    prepare_kernel(complain)
    folder = output or Path(f"{read.name}-identify")
    with OutputFolder(folder, writes="identify", force=force) as place:
        with termination_as_interrupt(), curve_display(0.0, 1.0, "", quiet=quiet) as display:
            listeners = (lambda event: display.search((event.text,)), Clock(options.until))
            found = quietly(
                identify, read.problem(), data, table.parameters, bounds=table.bounds, noise=table.noise,
                relative_noise=table.relative_noise, starts=table.starts, seed=table.seed, columns=table.columns,
                quantity=table.quantity, listeners=listeners,
            )  # fmt: skip
        for sentence in found.warnings:
            warn_user(sentence)
        for line in found.summary().splitlines():
            say(line)
        found.dataset.attrs.update(read.names)
        _write(place.work, found, figures=figures)
        reported = report and report_or_warn(lambda: write_fit_report(found.dataset, place.work / REPORT))
        place.complete()
    answer |= {
        "values": dict(found.values), "standard_errors": dict(found.standard_errors), "misfit": found.misfit,
        "noise": found.noise, "indistinct": list(found.indistinct), "warnings": list(found.warnings),
        "message": found.message,
    }  # fmt: skip
    answer |= files_in(folder)
    say_results(folder, reported=reported)
    return DONE if found.converged else STOPPED


def _write(folder: Path, found: Identification, *, figures: bool) -> None:
    """The dataset, the summary, the values for a case or a script, and a figure."""
    from slipstick.io.store import save_dataset

    save_dataset(found.dataset, folder / FITTED)
    texts = {"summary.txt": found.summary(), "values.json": json.dumps(dict(found.values), indent=1)}
    for name, content in texts.items():
        with writing(folder / name) as temporary:
            temporary.write_text(f"{content}\n", encoding="utf-8")
    if figures:
        from slipstick.plots import save_figure
        from slipstick.plots.fits import fit

        save_figure(fit(found.dataset), folder / "fit", formats=("png",))
