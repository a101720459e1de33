"""The page on the case file names every key, and its case is a case."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slipstick.case.case import Case
from slipstick.case.study import STUDY_KEYS
from slipstick.case.table import Table
from slipstick.studies.parameter_values import KEYS, SPACINGS
from slipstick.studies.plan import METHODS

PAGE = Path(__file__).parents[2] / "docs" / "case-file.md"


def tables(base: type[Table] = Table) -> list[type[Table]]:
    """Every table that a case file may have."""
    named = [model for model in base.__subclasses__() if model.__module__.startswith("slipstick.case.")]
    return [*named, *(inner for model in named for inner in tables(model))]


MODELS = [model for model in tables() if model.model_fields]


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.__name__)
def test_every_key_is_explained(model: type[Table]) -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name, field in model.model_fields.items():
        key = field.alias or name
        assert re.search(rf"[`{{ ]{re.escape(key)}[` ]", text), key


def test_every_key_of_a_study_is_explained() -> None:
    text = PAGE.read_text(encoding="utf-8").partition("## `[study]`")[2].partition("\n## ")[0]
    for key in (*STUDY_KEYS, *KEYS, *METHODS, *SPACINGS[1:]):
        assert re.search(rf"[`{{\", ]{re.escape(key)}[`\", ]", text), key


def test_its_case_is_a_case() -> None:
    block, _ = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    assert Case.from_text(block).span == (2.0, 15.0)
