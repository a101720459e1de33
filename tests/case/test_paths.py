"""Files named by a case stay inside its folder."""

from __future__ import annotations

from pathlib import Path

import pytest

from slipstick.case.source import inside


def test_files_inside(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "k.npz").write_bytes(b"")
    (tmp_path / "link.npz").symlink_to(tmp_path / "sub" / "k.npz")
    assert inside(tmp_path, "sub/k.npz") == tmp_path / "sub" / "k.npz"
    assert inside(tmp_path, "link.npz").exists()


@pytest.mark.parametrize(
    "name, words",
    [
        ("../k.npz", "leaves the folder"),
        ("sub/../../k.npz", "leaves the folder"),
        ("/etc/passwd", "leaves the folder"),
        ("..\\k.npz", "leaves the folder"),
        ("C:\\k.npz", "leaves the folder"),
        ("C:k.npz", "leaves the folder"),
        ("link.npz", "link leads out"),
        ("folder/k.npz", "link leads out"),
        ("none.npz", "no such file"),
        ("here", "no such file"),
        ("", "expected the name"),
        ("a\0b", "expected the name"),
    ],
)
def test_files_outside(tmp_path: Path, name: str, words: str) -> None:
    outside, home = tmp_path / "outside", tmp_path / "home"
    (home / "here").mkdir(parents=True)
    outside.mkdir()
    (outside / "k.npz").write_bytes(b"")
    (home / "link.npz").symlink_to(outside / "k.npz")
    (home / "folder").symlink_to(outside)
    with pytest.raises(ValueError, match=words):
        inside(home, name)
