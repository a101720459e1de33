"""The journal: what a kill or damage leaves of it, and what is none."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.results import LAYOUT, point

from slipstick.errors import InputError
from slipstick.io.journal import journal_of, read_journal
from slipstick.io.store import ResultStore


def test_a_torn_or_damaged_record_ends_the_journal(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    for i in range(4):
        store.append(point(i))
    file = journal_of(path)
    data = file.read_bytes()
    file.write_bytes(data[:-3])
    assert len(read_journal(file)[1]) == 3
    file.write_bytes(data[:-9] + b"\0" + data[-8:])
    assert len(read_journal(file)[1]) == 3
    store.close()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"nothing\n",
        b'{"magic": "x"}\n',
        b'{"magic": "slipstick journal 3"}\n',
        b"[]",
        b"[" * 10**6,
        b'{"magic": ' + b"9" * 5000 + b"}",
        b'{"magic": "slipstick journal 3", "labels": {"a": "'
        + b"x" * 2000
        + b'"}, "variables": {"v": '
        + b'["a", "a", "a", "a", "a", "a", "a"]}, "meanings": {}, "attributes": {}}\n',
        b'{"magic": "slipstick journal 3", "labels": {"a": "x"}, "variables": {"v": ['
        + b'"a", ' * 99
        + b'"a"]}, "meanings": {}, "attributes": {}}\n',
        b'{"magic": "slipstick journal 3", "labels": {}, "variables": {}, "meanings": {}, "attributes": {}}\n'
        + bytes(99),
    ],
)
def test_a_foreign_journal_is_refused_with_a_sentence(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "j").write_bytes(content)
    with pytest.raises(InputError, match="not a journal of slipstick"):
        read_journal(tmp_path / "j")
