"""One writer at a time in a folder, whoever ends how."""

import os
import subprocess
import sys

import pytest

from slipstick.errors import InputError
from slipstick.io.lock import NAME, FolderLock

HOLDER = "import sys, time; from pathlib import Path; from slipstick.io.lock import FolderLock\n"
HOLDER += "lock = FolderLock(Path(sys.argv[1])); print('held', flush=True); time.sleep(1000)"


def test_the_second_one_is_told_who_holds_it(tmp_path):
    lock = FolderLock(tmp_path)
    with pytest.raises(InputError, match=rf"another run writes there \(process {os.getpid()} on .*, since 20\d\d-"):
        FolderLock(tmp_path)
    lock.release()
    assert not (tmp_path / NAME).exists()
    FolderLock(tmp_path).release()
    lock.release()  # twice does no harm
    assert not (tmp_path / NAME).exists()


def test_a_killed_holder_holds_nobody_up(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLDER, str(tmp_path)], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout.readline() == "held\n"
        with pytest.raises(InputError, match=f"process {child.pid} "):
            FolderLock(tmp_path)
        child.kill()
    assert (tmp_path / NAME).exists()
    FolderLock(tmp_path).release()


def test_a_file_that_says_nothing_or_is_left_from_elsewhere(tmp_path):
    (tmp_path / NAME).write_text("not a lock at all")
    lock = FolderLock(tmp_path)
    os.truncate(tmp_path / NAME, 0)
    with pytest.raises(InputError, match="its process is not known"):
        FolderLock(tmp_path)
    lock.release()


def test_a_folder_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        FolderLock(tmp_path / "none")
