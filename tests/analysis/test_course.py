"""A walk taken up from any of its checkpoints finds the points to come to the last bit."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_parts import opening_contact
from test_thermal_folds import STEEP
from test_thermal_folds import oscillator as heated

from slipstick.analysis.course import Checkpoint, resumable
from slipstick.analysis.response import frequency_task, parameter_task
from slipstick.analysis.task import Task
from slipstick.analysis.walking import walk
from slipstick.errors import InputError
from slipstick.verify.cases import oscillator

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

COARSE = {"max_step": 0.05, "first_step": 0.05}
TASKS: dict[str, Callable[[], Task]] = {
    "frequency": lambda: frequency_task(oscillator(velocity=0.5), (2.0, 15.0), (5.0, 7.5)),
    "two parts": lambda: frequency_task(opening_contact(), (2.0, 15.0)),
    "through velocity 0": lambda: parameter_task(oscillator(velocity=10.0), "damper.velocity", (-10.0, 20.0), 6.0),
    "thermal fold": lambda: parameter_task(
        heated(STEEP, 100.0, 1900.0, 0.012), "damper.velocity", (1900.0, 2400.0), 6.0
    ),
    "point limit": lambda: frequency_task(oscillator(velocity=0.5), (2.0, 15.0), (), None, {"max_points": 12}),
}


def walked(task: Task) -> tuple[list[dict[str, Any]], list[dict[str, Any]], dict[str, Any]]:
    """Values and plain checkpoints of every point, and how it ended."""
    values: list[dict[str, Any]] = []
    checkpoints: list[dict[str, Any]] = []
    end: dict[str, Any] = {}

    def listen(event: Any) -> None:
        if type(event).__name__ == "PointFound":
            values.append(dict(event.values))
            checkpoints.append(event.checkpoint.plain())
        elif type(event).__name__ == "Stopped":
            end.update({k: v for k, v in event.attributes.items() if k != "seconds"})

    for _ in walk(replace(task, listeners=(listen,))):
        pass
    return values, checkpoints, end


def same(a: dict[str, Any], b: dict[str, Any]) -> None:
    for name, value in a.items():
        assert np.asarray(value).tobytes() == np.asarray(b[name]).tobytes(), name


@pytest.mark.parametrize("name", TASKS)
def test_points_to_come_are_the_same_to_the_last_bit(name: str) -> None:
    task = TASKS[name]()
    values, plain, end = walked(task)
    checkpoints = [Checkpoint.from_plain(p, task.balance.size) for p in plain]
    cuts = sorted(
        {resumable(checkpoints[:k]) for k in np.linspace(0, len(plain), 9).astype(int).tolist()} | {len(plain)}
    )
    cuts = [*cuts, *(k for k in range(1, len(plain)) if plain[k]["part"] != plain[k - 1]["part"])]
    for cut in cuts:
        if cut and checkpoints[cut - 1].place is None:
            continue
        again, noted, ended = walked(replace(TASKS[name](), checkpoints=checkpoints[:cut]))
        assert len(again) == len(values) - cut
        assert ended == end
        for new, old in zip(again, values[cut:], strict=True):
            same(new, old)
        for new, old in zip(noted, plain[cut:], strict=True):
            del new["seconds"]
            same(
                {k: json.dumps(v) if isinstance(v, tuple) else v for k, v in new.items()},
                {k: json.dumps(v) if isinstance(v, tuple) else v for k, v in old.items()},
            )
