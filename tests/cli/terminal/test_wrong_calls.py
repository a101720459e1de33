"""Calls that the parser refuses are answered too, where ``--json`` asks for it."""

from __future__ import annotations

import json

import pytest
from helpers.command import slipstick


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (["run", "--json"], "Missing argument"),
        (["run", "case.toml", "--json", "--nonsense"], "--nonsense"),
        (["study", "case.toml", "--workers", "many", "--json"], "--workers"),
        (["nonsense", "--json"], "nonsense"),
        (["--nonsense", "info", "--json"], "--nonsense"),
    ],
)
def test_one_document_and_exit_code_2(call: list[str], said: str) -> None:
    result = slipstick(*call)
    found = json.loads(result.stdout)
    assert result.exit_code == found["exit_code"] == 2
    (sentence,) = found["errors"]
    (fault,) = found["faults"]
    assert said in sentence
    assert fault["statement"] == sentence
    assert said in result.stderr


def test_nothing_is_answered_where_nothing_was_asked() -> None:
    result = slipstick("nonsense")
    assert (result.exit_code, result.stdout) == (2, "")
