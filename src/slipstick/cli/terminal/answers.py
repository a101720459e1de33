"""The answer of a verb as one JSON document on standard output; what it says to people then goes to standard error."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from slipstick.cli.terminal.guard import DONE, guarded, put
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.case.case import Case
    from slipstick.results.table import ResultTable

Answer = dict[str, Any]


@contextmanager
def answering(wanted: bool) -> Iterator[Answer]:
    """``guarded``, and if ``wanted`` the answer is printed at the end, with ``exit_code`` and ``errors``.

    >>> with answering(True) as answer:
    ...     answer["points"] = 3
    {"exit_code": 0, "errors": [], "points": 3}
    """
    answer: Answer = {"exit_code": DONE, "errors": []}
    if not wanted:
        with guarded():
            yield answer
        return

    def hear(sentences: Sequence[str]) -> None:
        answer["errors"] = [*answer["errors"], *sentences]

    try:
        with redirect_stdout(sys.stderr), guarded(hear):
            try:
                yield answer
            except InputError as error:
                answer["faults"] = _faults(error)["faults"]
                raise
    except typer.Exit as ended:
        answer["exit_code"] = ended.exit_code
        raise
    finally:
        print_answer(answer)


def print_answer(answer: Answer, error: InputError | None = None) -> None:
    """The document, with the faults of an error if there is one; a full disk behind it is told as any other."""
    whole = answer if error is None else answer | _faults(error)
    with guarded():
        put(json.dumps(plain_json(whole), ensure_ascii=False, allow_nan=False))


def _faults(error: InputError) -> Answer:
    """Faults as sentences and as data."""
    return {"errors": list(error.sentences), "faults": [asdict(fault) for fault in error.faults]}


def plain_json(value: object) -> Any:
    """A value as JSON holds it: paths as texts, arrays as lists, nan and infinite numbers as null.

    >>> plain_json({"a": (1.0, float("nan")), "b": Path("x")})
    {'a': [1.0, None], 'b': 'x'}
    """
    if isinstance(value, Mapping):
        return {str(key): plain_json(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [plain_json(item) for item in value]
    if hasattr(value, "tolist"):
        return plain_json(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def case_answer(case: Case) -> Answer:
    """What a case describes."""
    problem, structure = case.problem(), case.problem().structure
    return {
        "case": case.path,
        "title": case.title,
        "followed": case.parameter or "omega",
        "range": case.span,
        "omega": None if case.parameter is None else case.omega[0],
        "units": problem.units.attributes,
        "dofs": len(structure.dofs),
        "load_shapes": structure.load_shapes,
        "natural_frequencies": structure.natural_frequencies,
        "harmonics": problem.harmonics.orders,
        "unknowns": sum(pair.n_ports for pair in problem.contacts) * problem.harmonics.size,
        "contacts": problem.elements,
        "loads": len(problem.loads),
        "outputs": problem.outputs,
    }


def results_answer(data: ResultTable) -> Answer:
    """What was found, from the results."""
    from slipstick.results.view import followed_of, listed_peaks

    axis = followed_of(data)
    peaks = [
        {"dof": peak.dof, axis: peak.at, "amplitude": peak.amplitude, "point": peak.point}
        for peak in listed_peaks(data)
    ]
    return {
        "points": int(data.sizes["point"]),
        "newton_iterations": int(data["newton_iterations"].to_numpy().sum()),
        "peaks": peaks,
    }


def files_in(folder: Path) -> Answer:
    """The files of a folder of results."""
    names = sorted(path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    return {"folder": folder, "files": names}
