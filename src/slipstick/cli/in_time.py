"""The ``verify`` verb on a results file: its points held against an integration in time that knows no harmonics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.cli.output import RESULTS, results_in
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import DONE, STOPPED, complain, say, warnings_said
from slipstick.cli.terminal.prepare import prepare_kernel
from slipstick.errors import InputError
from slipstick.quantities import read_frequency
from slipstick.studies.folder import STUDY_FILE
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.analysis.time_domain.check import TimeCheck
    from slipstick.branch import Branch

AGREES = 0.01
"""Relative difference up to which a point agrees."""

_MOST = 5
"""Peaks that are looked at where no point is named."""


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
        complain(f"warning: {branch.message}")
    if not len(branch):
        return STOPPED
    agreed = check_points(branch, _highest(branch), tolerance, answer)
    return agreed if branch.outcome.ok else STOPPED


def check_points(branch: Branch, chosen: Sequence[int], tolerance: float, answer: Answer) -> int:
    """Check points of a branch in time and print what was found; 1 if one is off."""
    prepare_kernel(say)
    units, rows = Units.of_results(branch.dataset.attrs), []
    say("point: amplitude from the balance, in time, relative difference")
    for point in chosen:
        check = branch.check_in_time(point)
        rows.append(_row(branch, point, check, tolerance))
        say(f"  {_line(rows[-1], units, str(branch.dataset.attrs.get('frequency_unit', units.angular)))}")
    answer["points"] = rows
    _remarks(rows)
    good = sum(row["agrees"] for row in rows)
    say(f"{good} of {len(rows)} points agree within {tolerance:g}")
    return DONE if good == len(rows) else STOPPED


def _loaded(path: Path) -> Branch:
    """The branch with its problem."""
    from slipstick.io.loading import load

    path = results_in(path, RESULTS, STUDY_FILE)
    with warnings_said():
        branch = load(path)
    if branch.problem is None:
        raise InputError(f"{path}: cannot be integrated in time: {branch.without}")
    return branch


def _chosen(branch: Branch, points: Sequence[int], values: Sequence[str]) -> list[int]:
    """Numbers of the points, each once."""
    count = len(branch)
    found = []
    for point in points:
        if not -count <= point < count:
            raise InputError(f"--point: found {point}; expected a whole number from {-count} to {count - 1}")
        found.append(point % count)
    found += [branch.at(_inside(branch, _value(branch, text), text)) for text in values]
    return list(dict.fromkeys(found or _highest(branch)))


def _inside(branch: Branch, value: float, text: str) -> float:
    """A value where the branch has points."""
    known = branch.table[branch.followed].to_numpy()
    low, high = (float(end) for end in (known.min(), known.max())) if known.size else (0.0, 0.0)
    if low - _ROUNDED * abs(low) <= value <= high + _ROUNDED * abs(high):
        return value
    units = Units.of_results(branch.dataset.attrs)
    unit = str(branch.dataset.attrs.get("frequency_unit", units.angular)) if branch.followed == "omega" else ""
    size = units.frequency_factor(unit) if unit else 1.0
    between = f"{low / size:.6g} to {high / size:.6g} {unit}".rstrip()
    raise InputError(f"--at: found '{text}', which lies outside the range computed; expected a value from {between}")


_ROUNDED = 1e-5
"""Of an end of the range as it is read from a figure."""


def _value(branch: Branch, text: str) -> float:
    """A value of what was followed."""
    try:
        return float(text)
    except ValueError:
        pass
    try:
        if branch.followed == "omega":
            return read_frequency(text)
    except ValueError:
        pass
    expected = 'a frequency such as 6.3 or "50 Hz"' if branch.followed == "omega" else "a number"
    raise InputError(f"--at: found '{text}'; expected {expected}")


def _highest(branch: Branch) -> list[int]:
    """The highest peaks, else the highest point."""
    data = branch.dataset
    size = data["amplitude"].to_numpy().max(axis=1)
    peaks = np.flatnonzero(data["kind"].to_numpy() == "peak")
    if not len(peaks):
        return [int(size.argmax())] if len(size) else [0]
    return sorted(int(i) for i in peaks[np.argsort(-size[peaks])][:_MOST])


def _row(branch: Branch, point: int, check: TimeCheck, tolerance: float) -> dict[str, Any]:
    data, d = branch.dataset.isel(point=point), int(np.argmax(check.amplitude))
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


def _line(row: dict[str, Any], units: Units, frequency_unit: str) -> str:
    if "omega" in row:
        at = f"{row['omega'] / units.frequency_factor(frequency_unit):.6g} {frequency_unit}"
    else:
        at = f"{row['parameter']:.6g}"
    verdict = "agrees" if row["agrees"] else "differs" if row["periodic"] else "not periodic"
    sizes = f"{row['dof']} {row['amplitude']:.5g}, {row['amplitude_in_time']:.5g}"
    return f"{row['point']:>4} at {at}: {sizes}, {row['difference']:.1e}, {verdict}"


def _remarks(rows: Sequence[dict[str, Any]]) -> None:
    for sentence in _sentences(rows):
        complain(f"warning: {sentence}")


def _sentences(rows: Sequence[dict[str, Any]]) -> Iterator[str]:
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
