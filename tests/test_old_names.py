"""Old names of public arguments: they go on working, say the new one, and compute the same."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.oscillator import oscillator
from helpers.stability import brake

import slipstick as ss
from slipstick.analysis.curve.response import follow
from slipstick.case.requests import TrackTable

SHORT = {"max_points": 4}
CALLS: dict[str, tuple[Callable[..., Any], tuple[Any, ...], dict[str, Any], Any]] = {
    "forced_response": (ss.forced_response, (oscillator(), (2.0, 2.2)), {}, 2.1),
    "parameter_response": (ss.parameter_response, (oscillator(), "damper.mu", (0.3, 0.32)), {"omega": 2.0}, [0.31]),
    "track_peak": (
        ss.track_peak, (oscillator(), "damper.mu", (0.3, 0.32)), {"omega": (8.0, 13.0), "options": SHORT}, [0.31],
    ),
    "wear": (ss.wear, (oscillator(), 1e-4, (0, 10)), {"omega": 10.0, "tolerance": 1e-4}, (5.0,)),
    "limit_cycles": (ss.limit_cycles, (brake(), "pad.mu", (0.5, 0.6)), {}, 0.55),
}  # fmt: skip


def called(name: str, **points: Any) -> ss.Branch:
    function, arguments, named, _ = CALLS[name]
    return function(*arguments, **named, **points)


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_points_wanted_may_be_called_as_before(name: str) -> None:
    """At the caller's line, where Python shows it."""
    wanted = CALLS[name][-1]
    with pytest.warns(DeprecationWarning, match=f"^{name}: the argument 'requested' is now called 'at'$") as said:
        old = called(name, requested=wanted).dataset
    assert [w.filename for w in said if w.category is DeprecationWarning] == [__file__]
    new = called(name, at=wanted).dataset
    assert "requested" in new["kind"].values or old.attrs["outcome"] != "COMPLETED"
    assert old.attrs["requested"] == new.attrs["requested"]
    assert list(old["kind"].values) == list(new["kind"].values)
    for variable in ("omega", "amplitude", "displacement"):
        np.testing.assert_array_equal(old[variable].values, new[variable].values)
    with raises_fault("at", says="'requested' is its old name, and both are given; leave 'requested' out"):
        called(name, at=wanted, requested=wanted)


def test_one_word_in_every_signature() -> None:
    functions = [getattr(ss, name) for name in ss.__all__]
    signatures = {f.__name__: inspect.signature(f).parameters for f in functions if inspect.isfunction(f)}
    assert {name for name, parameters in signatures.items() if "at" in parameters} == set(CALLS)
    assert not any("requested" in parameters for parameters in signatures.values())


def test_points_one_by_one_take_the_old_name() -> None:
    with pytest.warns(DeprecationWarning, match="'at'"):
        points = follow(oscillator(), omega=(2.0, 2.1), requested=2.05)
    assert [point.omega for point in points if point.kind == "requested"] == [2.05]


def test_the_default_filter_shows_it_in_a_script(tmp_path: Path) -> None:
    """Python hides what it says of other modules than the one that runs."""
    script = "import slipstick as ss\nss.forced_response(problem, (2.0, 2.1), requested=2.05)\n"
    with warnings.catch_warnings(record=True) as caught:
        warnings.resetwarnings()
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        warnings.filterwarnings("default", category=DeprecationWarning, module="__main__")
        exec(compile(script, str(tmp_path / "own.py"), "exec"), {"__name__": "__main__", "problem": oscillator()})
    assert any("'at'" in str(warning.message) for warning in caught)


def test_a_peak_is_tracked_with_the_arguments_of_a_curve_in_their_order() -> None:
    """Positional ones and those that both have, and the keys of the table that says the same."""
    curve, track = (list(inspect.signature(f).parameters) for f in (ss.parameter_response, ss.track_peak))
    assert track[:3] == curve[:3] == ["problem", "parameter", "span"]
    both = [name for name in curve if name in track]
    assert [name for name in track if name in both] == both
    keys = [field.alias or name for name, field in TrackTable.model_fields.items()]
    assert keys == ["parameter", "from", "to", *(name for name in track[3:] if name not in ("options", "listeners"))]
