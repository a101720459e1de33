"""The journal: what a kill or damage leaves of it, and what is none."""

from __future__ import annotations

import itertools
import os
import zlib
from pathlib import Path

import pytest
from helpers.results import LAYOUT, point

from slipstick.errors import InputError
from slipstick.io import journal as journal_module
from slipstick.io.journal import Journal, journal_of, read_journal
from slipstick.io.store import ResultStore


def test_a_torn_or_damaged_record_ends_the_journal(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    for i in range(4):
        store.append(point(i))
    file = journal_of(path)
    data = file.read_bytes()
    file.write_bytes(data[:-3])
    assert len(read_journal(file)) == 3
    file.write_bytes(data[:-9] + b"\0" + data[-8:])
    assert len(read_journal(file)) == 3
    store.close()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"nothing\n",
        b'{"magic": "x"}\n',
        b'{"magic": "slipstick journal 4"}\n',
        b"[]",
        b"[" * 10**6,
        b'{"magic": ' + b"9" * 5000 + b"}",
        b'{"magic": "slipstick journal 4", "labels": {"a": "'
        + b"x" * 2000
        + b'"}, "variables": {"v": '
        + b'["a", "a", "a", "a", "a", "a", "a"]}, "meanings": {}, "attributes": {}}\n',
        b'{"magic": "slipstick journal 4", "labels": {"a": "x"}, "variables": {"v": ['
        + b'"a", ' * 99
        + b'"a"]}, "meanings": {}, "attributes": {}}\n',
        b'{"magic": "slipstick journal 4", "labels": {}, "variables": {}, "meanings": {}, "attributes": {}}\n'
        + bytes(99),
    ],
)
def test_a_foreign_journal_is_refused_with_a_sentence(tmp_path: Path, content: bytes) -> None:
    header, _, rest = content.partition(b"\n")
    for data in (content, b"%08x " % zlib.crc32(header) + header + b"\n" + rest):  # also with the right check sum
        (tmp_path / "j").write_bytes(data)
        with pytest.raises(InputError, match="not a journal of slipstick"):
            read_journal(tmp_path / "j")


def test_a_system_that_writes_a_few_bytes_at_a_time_loses_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = os.write
    monkeypatch.setattr(journal_module.os, "write", lambda file, data: whole(file, bytes(data)[:7]))
    journal = Journal(tmp_path / "j", LAYOUT, {"run": 1})
    for i in range(3):
        journal.append(LAYOUT.pack(point(i)), {"note": i})
    journal.close(remove=False)
    found = read_journal(tmp_path / "j")
    assert LAYOUT.unpack(found.rows)["omega"].tolist() == [0.0, 1.0, 2.0]
    assert len(found.ends) == 4
    assert found.ends[-1] == (tmp_path / "j").stat().st_size
    assert found.about == {"run": 1}


def test_points_are_brought_to_the_disk_in_a_tenth_of_the_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Clock:
        now = 0.0

        def perf_counter(self) -> float:
            return self.now

    clock, synced = Clock(), []

    def fsync(file: int) -> None:
        clock.now += 1.0
        synced.append(clock.now)

    journal = Journal(tmp_path / "j", LAYOUT)
    monkeypatch.setattr(journal_module, "time", clock)
    monkeypatch.setattr(journal_module.os, "fsync", fsync)
    journal._when = 0.0
    for i in range(60):
        clock.now += 0.5
        journal.append(LAYOUT.pack(point(i)))
    assert synced[0] == 1.5  # the first point at once
    assert all(10.0 < wait < 12.0 for wait in (b - a for a, b in itertools.pairwise(synced)))
    before = len(synced)
    journal.close(remove=False)
    assert len(synced) == before + 1  # and all of them at the end
    journal.close(remove=True)
    assert not (tmp_path / "j").exists()


def test_what_is_too_large_to_be_a_journal_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    journal = Journal(tmp_path / "j", LAYOUT)
    journal.append(LAYOUT.pack(point(0)))
    journal.close(remove=False)
    size = (tmp_path / "j").stat().st_size
    monkeypatch.setattr(journal_module, "_LARGEST_FILE", size)
    assert len(read_journal(tmp_path / "j").rows) == 1
    monkeypatch.setattr(journal_module, "_LARGEST_FILE", size - 1)
    with pytest.raises(InputError, match="larger than"):
        read_journal(tmp_path / "j")


def test_a_journal_of_another_version_is_refused(tmp_path: Path) -> None:
    journal = Journal(tmp_path / "j", LAYOUT)
    journal.append(LAYOUT.pack(point(0)))
    journal.close(remove=False)
    data = (tmp_path / "j").read_bytes()
    magic = journal_module._MAGIC.encode()
    assert data.count(magic) == 1
    (tmp_path / "j").write_bytes(data.replace(magic, magic[:-1] + b"1"))
    with pytest.raises(InputError, match="not a journal of slipstick"):
        read_journal(tmp_path / "j")
