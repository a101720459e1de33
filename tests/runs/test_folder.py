"""The folder of a run: one run at a time, the second is told who holds it, a killed one holds nobody up."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from slipstick.errors import InputError
from slipstick.io.lock import NAME, FolderLock
from slipstick.runs.folder import OutputFolder


def output(folder: Path, *, force: bool = False) -> OutputFolder:
    return OutputFolder(folder, case_path=folder.parent / "case.toml", case_text="", force=force)


@pytest.mark.parametrize("force", [False, True])
def test_two_runs_into_one_new_folder(tmp_path: Path, force: bool) -> None:
    first = output(tmp_path / "out")
    with pytest.raises(InputError, match=rf"another run writes there \(process {os.getpid()} on .*, since "):
        output(tmp_path / "out", force=force)
    assert (tmp_path / "out").is_dir()
    first.release()
    assert list((tmp_path / "out").iterdir()) == []
    output(tmp_path / "out").abandon()


def test_earlier_results_are_refused_again_under_the_lock(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "results.nc").write_bytes(b"")
    with pytest.raises(InputError, match=r"already holds results\.nc"):
        output(tmp_path / "out")
    again = output(tmp_path / "out", force=True)
    assert again.replaces
    with pytest.raises(InputError, match="another run writes there"):
        output(tmp_path / "out", force=True)
    again.release()
    assert not (tmp_path / "out" / NAME).exists()


def test_a_lock_removed_under_ones_feet_is_taken_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that waited at the door of the one before holds a file that is no longer there: it tries again."""
    seen = []

    def current(lock: FolderLock) -> bool:
        if not seen:
            seen.append(1)
            (tmp_path / NAME).unlink()
        return whole(lock)

    whole = FolderLock._is_current
    monkeypatch.setattr(FolderLock, "_is_current", current)
    lock = FolderLock(tmp_path)
    assert (tmp_path / NAME).exists()
    with pytest.raises(InputError, match="another run"):
        FolderLock(tmp_path)
    lock.release()


HOLDER = "import sys, time; from pathlib import Path; from slipstick.io.lock import FolderLock\n"
HOLDER += "lock = FolderLock(Path(sys.argv[1])); print('held', flush=True); time.sleep(1000)"


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
def test_the_lock_of_a_killed_process_is_free(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=f"process {child.pid} on "):
            FolderLock(tmp_path)
        child.send_signal(signal.SIGKILL)
    assert (tmp_path / NAME).exists()
    FolderLock(tmp_path).release()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"", b"[]", b"\xff", b"[" * 900, b'{"process": "x"}'])
def test_a_lock_file_with_strange_content(tmp_path: Path, content: bytes) -> None:
    held = FolderLock(tmp_path)
    (tmp_path / NAME).write_bytes(content)
    with pytest.raises(InputError, match="its process is not known"):
        FolderLock(tmp_path)
    held.release()
