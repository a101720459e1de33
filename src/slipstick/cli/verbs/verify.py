"""The verb ``verify``: one table of claims, results, tolerances and verdicts."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.options import ForceFile, refuse_file, results_files
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import DONE, STOPPED, prepare_kernel, put, say, warn_user, warnings_said
from slipstick.cli.verb import verb
from slipstick.errors import InputError
from slipstick.replacing import unwritable, writing
from slipstick.runs.folder import results_of
from slipstick.units import Units, after_number, compared

if TYPE_CHECKING:
    from slipstick.analysis.time_domain.check import TimeCheck
    from slipstick.branch import Branch
    from slipstick.verify.table import Row

AGREES = 0.01
"""Relative difference up to which a point agrees."""

_CHECKED_PEAKS = 5
"""Peaks that are checked where no point is named."""


@verb
def verify(
    answer: Answer,
    results: Annotated[
        Path | None,
        typer.Argument(
            metavar="[RESULTS]", help="A results file, or its folder, to check in time.", autocompletion=results_files
        ),
    ] = None,
    point: Annotated[
        list[int] | None, typer.Option("--point", help="Number of a point, as on the page; repeatable.")
    ] = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", help='Take the point nearest to this value, such as "50 Hz".')
    ] = None,
    tolerance: Annotated[float, typer.Option(help="Largest relative difference that agrees.", min=0.0)] = AGREES,
    only: Annotated[
        str | None, typer.Option("--only", help="Without RESULTS: the rows of this name, CF1, or family, CF.")
    ] = None,
    markdown: Annotated[
        Path | None, typer.Option(help="Without RESULTS: also write the table to this file, as markdown.")
    ] = None,
    force: ForceFile = False,
) -> int:
    """Check this installation against closed forms and reference values, or points of RESULTS by time integration."""
    if results is None:
        if point or at:
            raise InputError("--point, --at: found no RESULTS; give the results file they belong to")
        return show_verification(only, answer, markdown, force=force)
    if only is not None:
        raise InputError("--only: chooses rows of the installation's table; give --point or --at with RESULTS")
    if markdown is not None:
        raise InputError("--markdown: writes the installation's table; leave it out with RESULTS")
    return verify_results(results, point or (), at or (), tolerance, answer)


def show_verification(only: str | None, answer: Answer, markdown: Path | None = None, *, force: bool = False) -> int:
    """Run the checks and print their table; 1 if any fails. ``markdown``: the file that gets the table, too.

    Raises
    ------
    InputError
        If no check has the name asked for, the file cannot be written, or is there and not to be replaced (``force``).
    """
    from slipstick.verify import run

    if markdown is not None and not markdown.absolute().parent.is_dir():
        raise unwritable(f"--markdown {markdown}", f"there is no folder {markdown.parent}")
    if markdown is not None and markdown.is_dir():
        raise unwritable(f"--markdown {markdown}", "found a folder; expected a file such as table.md")
    if markdown is not None:
        refuse_file(markdown, force=force)
    prepare_kernel(say)
    rows: list[Row] = []
    live = sys.stderr.isatty()
    for row in run(only):
        rows.append(row)
        if live:
            print(f"\r{len(rows)} checks, last {row.name:<12}", end="", file=sys.stderr, flush=True)
    if live:
        print("\r" + " " * 40 + "\r", end="", file=sys.stderr)
    if not rows:
        raise InputError(f"no check is called '{only}'; run 'slipstick verify' without --only to see their names")
    print_rows(rows)
    if markdown is not None:
        _write(rows, markdown)
    failed = [row for row in rows if not row.ok]
    answer["checks"] = [{**row._asdict(), "ok": row.ok} for row in rows]
    say(f"{len(rows) - len(failed)} of {len(rows)} checks pass")
    for row in failed:
        say(f"failed: {row.name} {row.what}: expected {row.expected}, found {row.found} ({row.verdict})")
    return STOPPED if failed else DONE


def _write(rows: Sequence[Row], path: Path) -> None:
    from slipstick import __version__
    from slipstick.verify.table import table_page

    with writing(path) as temporary:
        temporary.write_text(table_page(rows, __version__), encoding="utf-8")


def print_rows(rows: Sequence[Row]) -> None:
    """The table, as wide as the terminal or 140 characters."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(show_edge=False, pad_edge=False)
    for title, right in (("", False), ("what", False), ("expected", True), ("found", True), ("allowed", True)):
        table.add_column(title, justify="right" if right else "left", no_wrap=right)
    table.add_column("verdict")
    for row in rows:
        cells = (row.name, row.what, row.expected, row.found, row.tolerance)
        table.add_row(*map(Text, cells), Text(row.verdict, "green" if row.ok else "bold red"))
    console, text = Console(), StringIO()
    width = console.width if console.is_terminal else 140
    Console(file=text, width=width, force_terminal=console.is_terminal).print(table)
    put(text.getvalue().rstrip("\n"))


def verify_results(path: Path, points: Sequence[int], values: Sequence[str], tolerance: float, answer: Answer) -> int:
    """Check points of a results file in time and print what was found; 1 if one is off by more than ``tolerance``.

    ``points`` are numbers of points, ``values`` frequencies (rad/s, or with their unit) or values of the parameter,
    whose nearest point is taken; without any, the highest peaks are.

    Raises
    ------
    InputError
        If it is no results file, holds no such point, or its problem is not known.
    """
    branch = _loaded(path)
    chosen = _chosen(branch, points, values)
    say(str(branch.dataset.attrs.get("title", "")) or str(path))
    return check_points(branch, chosen, tolerance, answer)


def check_curve(branch: Branch, tolerance: float, answer: Answer) -> int:
    """The highest peaks of a curve against integration in time; 1 if it stopped early or one is off."""
    if not branch.outcome.ok:
        warn_user(branch.message)
    if not len(branch):
        return STOPPED
    agreed = check_points(branch, _highest(branch), tolerance, answer)
    return agreed if branch.outcome.ok else STOPPED


def check_points(branch: Branch, chosen: Sequence[int], tolerance: float, answer: Answer) -> int:
    """Check points of a branch in time and print what was found; 1 if one is off."""
    from slipstick.results.view import unit_shown

    prepare_kernel(say)
    units, rows = Units.of_results(branch.dataset.attrs), []
    say("point: amplitude from the balance, in time, relative difference")
    for point in chosen:
        check = branch.check_in_time(point)
        rows.append(_row(branch, point, check, tolerance))
        unit = unit_shown(branch.dataset, "amplitude", rows[-1]["dof"])
        say(f"  {_line(rows[-1], units, str(branch.dataset.attrs.get('frequency_unit', units.angular)), unit)}")
    answer["points"] = rows
    for sentence in _remarks(rows):
        warn_user(sentence)
    good = sum(row["agrees"] for row in rows)
    say(f"{good} of {len(rows)} points agree within {tolerance:g}")
    return DONE if good == len(rows) else STOPPED


def _loaded(path: Path) -> Branch:
    """The branch with its problem."""
    from slipstick.io.loading import load

    path = results_of(path)
    with warnings_said():
        branch = load(path)
    if branch.problem is None:
        raise InputError(f"{path}: cannot be integrated in time: {branch.without}")
    return branch


def _chosen(branch: Branch, points: Sequence[int], values: Sequence[str]) -> list[int]:
    """Numbers of the points, each once."""
    count = len(branch)
    chosen = []
    for point in points:
        if not -count <= point < count:
            raise InputError(f"--point: found {point}; expected a whole number from {-count} to {count - 1}")
        chosen.append(point % count)
    chosen += [branch.at(_inside(branch, _value(branch, text), text)) for text in values]
    return list(dict.fromkeys(chosen or _highest(branch)))


def _inside(branch: Branch, value: float, text: str) -> float:
    """A value where the branch has points."""
    if branch.reaches(value):
        return value
    low, high = branch.span
    units = Units.of_results(branch.dataset.attrs)
    unit = str(branch.dataset.attrs.get("frequency_unit", units.angular)) if branch.followed == "omega" else ""
    size = units.frequency_factor(unit) if unit else 1.0
    between = f"{low / size:.6g} to {high / size:.6g} {unit}".rstrip()
    raise InputError(f"--at: found '{text}', which lies outside the range computed; expected a value from {between}")


def _value(branch: Branch, text: str) -> float:
    """A value of what was followed."""
    try:
        return float(text)
    except ValueError:
        pass
    from slipstick.quantities import read_frequency

    try:
        if branch.followed == "omega":
            return read_frequency(text)
    except ValueError:
        pass
    expected = 'a frequency such as 6.3 or "50 Hz"' if branch.followed == "omega" else "a number"
    raise InputError(f"--at: found '{text}'; expected {expected}")


def _highest(branch: Branch) -> list[int]:
    """The highest peaks, else the highest point; rotations are not compared with displacements."""
    import numpy as np

    from slipstick.results.view import names_of

    data = branch.dataset
    among = compared(names_of(data, "dof"))
    size = data["amplitude"].to_numpy()[:, among].max(axis=1)
    located = data["kind"].to_numpy() == "peak"
    peaks = np.flatnonzero(located & np.isin(data["peak_dof"].to_numpy(), among) if "peak_dof" in data else located)
    if not len(peaks):
        return [int(size.argmax())] if len(size) else [0]
    return sorted(int(i) for i in peaks[np.argsort(-size[peaks])][:_CHECKED_PEAKS])


def _row(branch: Branch, point: int, check: TimeCheck, tolerance: float) -> dict[str, Any]:
    data, among = branch.dataset.isel(point=point), compared(check.dofs)
    d = among[int(check.amplitude[among].argmax())]
    return {
        "point": point,
        branch.followed: float(data[branch.followed]),
        "dof": check.dofs[d],
        "amplitude": check.amplitude[d],
        "amplitude_in_time": check.amplitude_in_time[d],
        "mean": check.mean[d],
        "mean_in_time": check.mean_in_time[d],
        "difference": check.relative_difference,
        "periodic": check.converged,
        "agrees": bool(check.converged and check.relative_difference <= tolerance),
        "truncation": float(data["truncation"]) if "truncation" in data else None,
        "reduction_error": check.reduction_error,
    }


def _line(row: dict[str, Any], units: Units, frequency_unit: str, prefixed: tuple[float, str]) -> str:
    if "omega" in row:
        at = f"{row['omega'] / units.frequency_factor(frequency_unit):.6g} {frequency_unit}"
    else:
        at = f"{row['parameter']:.6g}"
    verdict = "agrees" if row["agrees"] else "differs" if row["periodic"] else "not periodic"
    factor, unit = prefixed
    size, in_time = (f"{row[name] * factor:.5g}" for name in ("amplitude", "amplitude_in_time"))
    sizes = f"{row['dof']} {size}, {in_time}{after_number(unit) if factor != 1.0 else ''}"
    return f"{row['point']:>4} at {at}: {sizes}, {row['difference']:.1e}, {verdict}"


def _remarks(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
    off = [row for row in rows if row["periodic"] and not row["agrees"]]
    if any((row["truncation"] or 0.0) > 0.3 * row["difference"] for row in off):
        yield "the harmonics left out would add about as much as the difference; keep more of them"
    if any(not row["periodic"] for row in rows):
        yield (
            "the motion in time did not become periodic: the periodic motion may not be stable, or the structure has "
            "next to no damping"
        )
    worst = max((row["reduction_error"] or 0.0 for row in rows), default=0.0)
    if worst > 1e-3:
        yield f"both use the same reduced structure, whose own error, estimated at {worst:.1e}, cannot be seen here"
