"""Where compiled functions are kept: files there are executed, so nobody else may have written them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from slipstick.trig import compiled

pytestmark = pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes are those of POSIX")


def test_a_new_folder_is_private(tmp_path: Path) -> None:
    folder = compiled._private(tmp_path / "slipstick" / "key")
    assert folder is not None
    assert (folder.stat().st_mode & 0o777, folder.parent.stat().st_mode & 0o777) == (0o700, 0o700)
    assert list(folder.iterdir()) == []


def test_a_folder_of_ours_that_others_can_read_becomes_private(tmp_path: Path) -> None:
    (tmp_path / "slipstick" / "key").mkdir(parents=True)
    for path in (tmp_path / "slipstick", tmp_path / "slipstick" / "key"):
        path.chmod(0o755)
    folder = compiled._private(tmp_path / "slipstick" / "key")
    assert folder is not None
    assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("part", ["slipstick", "slipstick/key"])
@pytest.mark.parametrize("how", ["writable", "link", "foreign"])
def test_a_folder_others_can_write_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, part: str, how: str
) -> None:
    folder, spoilt = tmp_path / "slipstick" / "key", tmp_path / part
    if how == "link":
        (tmp_path / "elsewhere" / "key").mkdir(parents=True, mode=0o700)
        spoilt.parent.mkdir(exist_ok=True, mode=0o700)
        spoilt.symlink_to(tmp_path / "elsewhere")
    else:
        folder.mkdir(parents=True, mode=0o700)
        folder.parent.chmod(0o700)
        spoilt.chmod(0o777 if how == "writable" else 0o700)
    if how == "foreign":
        monkeypatch.setattr(compiled.os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    assert compiled._private(folder) is None


def test_a_known_name_in_a_shared_folder_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where only the temporary folder is left and its known name is taken, a new one is made."""
    monkeypatch.setattr(compiled, "_roots", lambda: [tmp_path / "slipstick"])
    monkeypatch.setattr(compiled.tempfile, "tempdir", str(tmp_path))
    (tmp_path / "slipstick").mkdir()
    (tmp_path / "slipstick").chmod(0o777)
    folder = compiled.cache_folder.__wrapped__()
    assert folder.parent == tmp_path
    assert folder.name.startswith("slipstick-")
    assert folder.stat().st_mode & 0o777 == 0o700
