"""Files that are replaced as a whole or not at all."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest

from slipstick.replacing import remove_leftovers, replacing


def test_a_failure_leaves_the_file_as_it_was_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        _interrupted(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_is_the_old_one_until_the_new_one_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("old")
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_threads_that_write_one_name_do_not_write_into_each_other(tmp_path: Path) -> None:
    path, both = tmp_path / "a.txt", Barrier(2, timeout=600)

    def write(letter: str) -> Path:
        with replacing(path) as temporary:
            both.wait()
            temporary.write_text(letter * 1000)
            both.wait()
        return temporary

    with ThreadPoolExecutor(2) as pool:
        names = list(pool.map(write, "ab"))
    assert names[0] != names[1]
    assert path.read_text() in ("a" * 1000, "b" * 1000)
    assert list(tmp_path.iterdir()) == [path]


def test_leftovers_of_killed_writers_are_removed(tmp_path: Path) -> None:
    for name in (".r.nc.7.tmp", "r.nc", ".q.nc.7.tmp"):
        (tmp_path / name).write_bytes(b"")
    remove_leftovers(tmp_path / "r.nc")
    assert sorted(p.name for p in tmp_path.iterdir()) == [".q.nc.7.tmp", "r.nc"]


def _interrupted(path: Path) -> None:
    with replacing(path) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
