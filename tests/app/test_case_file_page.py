"""The page on the case file names every key, and its case is a case."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from slipstick.case import fe_tables, peak_tables, response_table, tables
from slipstick.case.case import Case
from slipstick.case.studying import STUDY_KEYS
from slipstick.studies.plan import METHODS
from slipstick.studies.ranges import KEYS, SPACINGS

PAGE = Path(__file__).parents[2] / "docs" / "case-file.md"

FOUND = {**vars(tables), **vars(response_table), **vars(peak_tables), **vars(fe_tables)}.values()
MODELS = list({m: m for m in FOUND if isinstance(m, type) and issubclass(m, tables.Table)})


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.__name__)
def test_every_key_is_explained(model: type[tables.Table]) -> None:
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
