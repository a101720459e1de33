"""The command line: stateless commands; heavy modules are imported inside them."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.terminal.answers import answering
from slipstick.cli.terminal.guard import guarded
from slipstick.cli.terminal.wrong_calls import Verbs
from slipstick.cli.verbs.completion import case_files, example_names, results_files
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.cli.verbs.manner import Manner

app = typer.Typer(
    name="slipstick",
    help="Steady vibration of structures that stick, slip, separate and rub.",
    epilog="Exit codes: 0 done, 1 stopped early with what was found saved, 2 bad input.",
    cls=Verbs,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

AsJson = Annotated[bool, typer.Option("--json", help="The answer as JSON on standard output.")]
CasePath = Annotated[
    Path, typer.Argument(metavar="CASE.toml", help="The case file.", show_default=False, autocompletion=case_files)
]


def _folder(by_default: str) -> Any:
    """The option that names the folder of the results."""
    return typer.Option("-o", "--output", help=f"Folder of the results; by default {by_default}, here.")


Figures = Annotated[
    str | None,
    typer.Option("--figures", help='Draw these too: "all", or names such as "response,loop".', metavar="NAMES"),
]
Formats = Annotated[
    str | None, typer.Option("--format", help="Of the figures: png (the default), svg, pdf.", metavar="FORMATS")
]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw none, also of a study.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="No progress.")]
TimeLimit = Annotated[
    str | None,
    typer.Option("--time-limit", help='End after this time, such as "90 s" or "2 h"; resume goes on.', metavar="TIME"),
]


def _version(wanted: bool) -> None:
    if wanted:
        from slipstick import __version__

        typer.echo(f"slipstick {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    pass


@app.command()
def run(
    case: CasePath,
    output: Annotated[Path | None, _folder("CASE-results")] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Replace earlier results, once the new ones are complete.")
    ] = False,
    figures: Figures = None,
    formats: Formats = None,
    no_figures: NoFigures = False,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
    as_json: AsJson = False,
) -> None:
    """Compute a case: results.nc, written point by point, and report.html."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.run import run_case

        manner = _manner(
            time_limit, (figures, formats), figures=not no_figures, report=report, quiet=quiet, answer=answer
        )
        raise typer.Exit(run_case(case, output, force=force, manner=manner))


@app.command()
def resume(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the run or study.", show_default=False)],
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Of a study: processes; by default one a processor.")
    ] = None,
    figures: Figures = None,
    formats: Formats = None,
    no_figures: NoFigures = False,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
    as_json: AsJson = False,
) -> None:
    """Go on with a run that was killed, interrupted or out of time: the same points as without the interruption."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.resume import resume_run

        manner = _manner(
            time_limit, (figures, formats), figures=not no_figures, report=report, quiet=quiet, answer=answer
        )
        raise typer.Exit(resume_run(folder, manner, workers))


def _manner(time_limit: str | None, wanted: tuple[str | None, str | None] = (None, None), **how: Any) -> Manner:
    from slipstick.cli.verbs.manner import Manner, wanted_figures
    from slipstick.quantities import read_duration

    if wanted[0] is not None and not how["figures"]:
        raise InputError("--no-figures: --figures is given too; leave one of them out")
    try:
        seconds = None if time_limit is None else read_duration(time_limit)
    except ValueError as error:
        raise InputError(f"--time-limit: found '{time_limit}'; {error}") from None
    return Manner(time_limit=seconds, wanted=wanted_figures(*wanted), **how)


@app.command()
def report(
    results: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULTS.nc...",
            help="Results files or folders, overlaid; or a study, its study.nc or folder.",
            autocompletion=results_files,
        ),
    ],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="The page; by default report.html beside the first file.")
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page; by default that of the first results.")] = "",
    contacts: Annotated[int, typer.Option(help="How many contacts: those that dissipate most.")] = 12,
    dofs: Annotated[int, typer.Option(help="How many dofs: those that move most.")] = 12,
    case: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Case N of a study, computed again: its loops and states.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write one self-contained page of results, for any browser: curves, loops, states, provenance."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.report import report_results

        answer |= report_results(results, output, title=title, contacts=contacts, dofs=dofs, case=case)


@app.command()
def study(
    case: CasePath,
    output: Annotated[Path | None, _folder("CASE-study")] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, max=1024, help="Processes on this machine; by default one a processor.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask cluster instead, such as tcp://host:8786.")
    ] = None,
    index: Annotated[int | None, typer.Option(min=0, help="Compute share I of N alone, as one of N jobs.")] = None,
    of: Annotated[int | None, typer.Option(min=1, metavar="N", help="How many shares there are.")] = None,
    missing: Annotated[bool, typer.Option("--missing", help="Also cases once more that did not complete.")] = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    report: Annotated[bool, typer.Option(help="Write report.html.")] = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
    as_json: AsJson = False,
) -> None:
    """Compute a case for all values that its table "study" names: study.nc, curves.nc, figures, report.html."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.study import Spread, run_study, share_of

        spread = Spread(workers=workers, scheduler=scheduler, share=share_of(index, of))
        manner = _manner(time_limit, figures=figures, report=report, quiet=quiet, answer=answer)
        raise typer.Exit(run_study(case, output, spread=spread, missing=missing, manner=manner))


Force = Annotated[bool, typer.Option("--force", help="Replace earlier results, once the new ones are complete.")]


@app.command()
def track(
    case: CasePath,
    output: Annotated[Path | None, _folder("CASE-track")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    as_json: AsJson = False,
) -> None:
    """Follow the peak of a case over the parameter of its table "track", without the curves between."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.peaks import track_case

        raise typer.Exit(track_case(case, output, answer, force=force, figures=figures))


@app.command()
def optimal(
    case: CasePath,
    output: Annotated[Path | None, _folder("CASE-optimal")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    as_json: AsJson = False,
) -> None:
    """Find the value of a parameter, that of its table "optimal", at which the peak is lowest."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.peaks import optimal_case

        raise typer.Exit(optimal_case(case, output, answer, force=force, figures=figures))


@app.command()
def modes(
    case: CasePath,
    output: Annotated[Path | None, _folder("CASE-modes")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    as_json: AsJson = False,
) -> None:
    """Follow free vibration in a mode (table "modes") over its amplitude: frequency, damping, peaks of all loads."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.peaks import modes_case

        raise typer.Exit(modes_case(case, output, answer, force=force, figures=figures))


@app.command()
def cycles(
    case: CasePath,
    output: Annotated[Path | None, _folder("CASE-cycles")] = None,
    force: Force = False,
    figures: Annotated[bool, typer.Option(help="Draw the figures.")] = True,
    as_json: AsJson = False,
) -> None:
    """Follow self-excited vibration, such as squeal, over the parameter of the table "cycles"."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.cycles import cycles_case

        raise typer.Exit(cycles_case(case, output, answer, force=force, figures=figures))


@app.command()
def check(
    case: CasePath,
    in_time: Annotated[
        bool,
        typer.Option("--in-time", help="Follow the curve too, and check its highest peaks by time integration."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Everything run would refuse or warn of, and the modes of the structure."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.check import check_case

        raise typer.Exit(check_case(case, answer, in_time=in_time))


@app.command()
def init(
    example: Annotated[
        str | None, typer.Argument(help="Name of an example; without it they are listed.", autocompletion=example_names)
    ] = None,
    folder: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Where to write it; here by default.")] = None,
    python: Annotated[
        bool, typer.Option("--python", help="Write the Python script instead; EXAMPLE may be a case file of your own.")
    ] = False,
    listed: Annotated[bool, typer.Option("--list", help="List the examples.")] = False,
) -> None:
    """Write a commented example case, or the same as a Python script."""
    with guarded():
        from slipstick.cli.verbs.init import list_examples, write_example

        if example is None or listed:
            list_examples()
        else:
            write_example(example, folder, python=python)


@app.command("import")
def import_(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Matrices, maps and meshes of one model.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The model to write, such as model.h5.")],
    mass: Annotated[Path | None, typer.Option(help="The mass matrix, where its name does not show it.")] = None,
    damping: Annotated[Path | None, typer.Option(help="The damping matrix.")] = None,
    dof_map: Annotated[Path | None, typer.Option("--map", help="Node and direction of every row.")] = None,
    nodes: Annotated[Path | None, typer.Option(help="Positions: bulk data or a mesh.")] = None,
    name: Annotated[list[str] | None, typer.Option(help="Name of a matrix in a Nastran file: K=KGG.")] = None,
    spc: Annotated[int | None, typer.Option(help="Number of the Nastran SPC set in force.")] = None,
    young: Annotated[float | None, typer.Option(help="Material of a mesh: Young's modulus.")] = None,
    poisson: Annotated[float | None, typer.Option(help="Poisson's ratio.")] = None,
    density: Annotated[float | None, typer.Option(help="Density.")] = None,
    conductivity: Annotated[float | None, typer.Option(help="Thermal conductivity.")] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(help="Node set, surface, node (n12) or dof (n12y) to constrain; may be repeated."),
    ] = None,
    quadratic: Annotated[bool, typer.Option(help="Put a node in the middle of every edge of a linear mesh.")] = False,
    units: Annotated[str | None, typer.Option(help='Units of the numbers, kept with them: "N, mm, t, s".')] = None,
    scale: Annotated[
        list[str] | None, typer.Option(help="Multiply the numbers of the files: length=25.4e-3; mass, force, time too.")
    ] = None,
    to: Annotated[str | None, typer.Option(help='Convert from --units to these: SI, or "N, mm, t, s".')] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier model of that name.")] = False,
) -> None:
    """Bring a finite element model of another code into one file, model.h5."""
    with guarded():
        from slipstick.cli.verbs.importing import ImportRequest, import_files

        import_files(
            ImportRequest(
                files=files,
                output=output,
                mass=mass,
                damping=damping,
                dof_map=dof_map,
                nodes=nodes,
                names=name or (),
                constraints=spc,
                young=young,
                poisson=poisson,
                density=density,
                conductivity=conductivity,
                fixed=fix or (),
                quadratic=quadratic,
                units=units,
                scale=scale or (),
                to=to,
                force=force,
            )
        )


@app.command()
def info(as_json: AsJson = False) -> None:
    """Versions, platform, threads, and whether the contact kernel is compiled."""
    with answering(as_json) as answer:
        from slipstick.cli.verbs.info import show_info

        show_info(answer)


@app.command()
def verify(
    results: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RESULTS]", help="A results file, or its folder, to check in time.", autocompletion=results_files
        ),
    ] = None,
    point: Annotated[
        list[int] | None, typer.Option("--point", help="Number of a point, repeatable; else the highest peaks.")
    ] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", help='Take the point nearest to this value, such as "50 Hz".')
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Largest relative difference that agrees.", min=0.0)] = 0.01,
    only: Annotated[
        str | None, typer.Option("--only", help="Without RESULTS: only the rows whose name contains this.")
    ] = None,
    markdown: Annotated[
        Path | None, typer.Option(help="Without RESULTS: also write the table to this file, as markdown.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Check this installation against closed forms and reference values, or points of RESULTS by time integration."""
    with answering(as_json) as answer:
        if results is None:
            if point or at:
                raise InputError("--point, --at: found no RESULTS; give the results file they belong to")
            from slipstick.cli.verbs.verify import show_verification

            raise typer.Exit(show_verification(only, answer, markdown))
        if only is not None:
            raise InputError("--only: chooses rows of the installation's table; give --point or --at with RESULTS")
        if markdown is not None:
            raise InputError("--markdown: writes the installation's table; leave it out with RESULTS")
        from slipstick.cli.verbs.in_time import verify_results

        raise typer.Exit(verify_results(results, point or (), at or (), tolerance, answer))


def main() -> None:
    """Entry point of the ``slipstick`` command."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")
    app(prog_name="slipstick")
