"""Every argument of every figure and wrong values: the obvious meaning, or an InputError."""

from __future__ import annotations

import inspect
from typing import Any

import numpy as np
import pytest
from helpers.figures import branch

import slipstick as ss
from slipstick import plots

WRONG = (
    float("nan"), 1j, "", "q", "\0", b"x", 2.5, 10**400, [], [1.0], [None], (), {}, {"a": 1}, {1: "x"}, object(), len,
    Ellipsis, np.array(3.0), np.array([]), np.zeros((2, 2)), np.float32(2.0), np.int64(2), slice(3), iter([1.0]), True,
)  # fmt: skip
GOOD: dict[str, Any] = {
    "branch": None, "branches": None, "dof": "x0", "contact": "c0", "point": 3, "harmonic": 1, "frequency": "Hz",
    "label": "a", "labels": ["a"], "references": None, "peaks": True, "log": None, "over": "sliding", "limit": True,
    "ax": None,
}  # fmt: skip
DRAWN = [name for name in plots.__all__ if name not in ("save_figure", "abscissa_text", "temperature")]


@pytest.mark.parametrize("name", DRAWN)
def test_a_wrong_value_is_refused_with_a_sentence_or_means_the_obvious(name: str) -> None:
    draw = getattr(plots, name)
    names = list(inspect.signature(draw).parameters)
    good = {key: GOOD[key] for key in names if key != "label" and not (key == "contact" and "dof" in names)}
    good |= {key: [branch()] if name == "compare" else branch() for key in ("branch", "branches") if key in names}
    draw(**good)
    poor = []
    for argument in names:
        for value in WRONG:
            given = {k: v for k, v in good.items() if not (argument == "contact" and k == "dof")} | {argument: value}
            try:
                draw(**given)
            except ss.InputError:
                continue
            except Exception as error:
                poor.append(f"{argument} = {type(value).__name__}: {type(error).__name__}: {error}")
    assert not poor, "\n".join(poor)
