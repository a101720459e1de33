"""The public names: few, all there, and cheap to import."""

from __future__ import annotations

import ast
import inspect
import json
import subprocess
import sys
from pathlib import Path

import pytest

import slipstick

HEAVY = ("numba", "scipy", "xarray", "matplotlib", "pandas", "h5py", "pydantic", "typer", "rich")


def test_public_names_fit_on_one_screen() -> None:
    assert len(slipstick.__all__) == len(set(slipstick.__all__)) <= 49


@pytest.mark.parametrize("name", slipstick.__all__)
def test_public_name_can_be_loaded_and_is_documented(name: str) -> None:
    thing = getattr(slipstick, name)
    assert inspect.getdoc(thing)
    assert name in dir(slipstick)


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_thing"):
        slipstick.no_such_thing  # noqa: B018


def test_import_loads_nothing_heavy() -> None:
    code = f"import sys, json, slipstick; print(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=600)
    assert json.loads(done.stdout) == []


def test_editors_see_every_public_name() -> None:
    """The imports that only type checkers read are those of the table."""
    tree = ast.parse(Path(slipstick.__file__).read_text(encoding="utf-8"))
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    seen = {a.asname: node.module for node in block.body if isinstance(node, ast.ImportFrom) for a in node.names}
    assert seen == {**slipstick._PUBLIC, **dict.fromkeys(slipstick._ROOMS, "slipstick")}


@pytest.mark.parametrize("name", slipstick.__all__)
def test_signatures_name_every_argument(name: str) -> None:
    """What ``help`` and editors show; ``**options`` alone tells nobody anything."""
    thing = getattr(slipstick, name)
    if inspect.isfunction(thing):
        kinds = {p.kind for p in inspect.signature(thing).parameters.values()}
        assert inspect.Parameter.VAR_KEYWORD not in kinds
        assert "Parameters" in inspect.getdoc(thing) or "arguments" in inspect.getdoc(thing) or ">>>" in thing.__doc__


@pytest.mark.parametrize("room", [slipstick, slipstick.models, slipstick.plots, slipstick.runs])
def test_completion_lists_public_names_alone(room: object) -> None:
    assert dir(room) == sorted({*room.__all__, *(("models", "plots", "runs") if room is slipstick else ())})
    assert all(getattr(room, name) is not None for name in dir(room))
