"""Where compiled functions are kept: files there are executed, so nobody else may have written them."""

from __future__ import annotations

import os
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import pytest
from numba.core import caching
from numba.core.base import BaseContext

from slipstick.trig import compiled as compilation
from slipstick.trig.compiled import compiled

posix = pytest.mark.skipif(not hasattr(os, "getuid"), reason="owners and modes are those of POSIX")


@posix
def test_a_new_folder_is_private(tmp_path: Path) -> None:
    folder = compilation._private(tmp_path / "slipstick" / "key")
    assert folder is not None
    assert (folder.stat().st_mode & 0o777, folder.parent.stat().st_mode & 0o777) == (0o700, 0o700)
    assert list(folder.iterdir()) == []


@posix
def test_a_folder_of_ours_that_others_can_read_becomes_private(tmp_path: Path) -> None:
    (tmp_path / "slipstick" / "key").mkdir(parents=True)
    for path in (tmp_path / "slipstick", tmp_path / "slipstick" / "key"):
        path.chmod(0o755)
    folder = compilation._private(tmp_path / "slipstick" / "key")
    assert folder is not None
    assert folder.stat().st_mode & 0o777 == 0o700


@posix
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
        monkeypatch.setattr(compilation.os, "getuid", lambda: tmp_path.stat().st_uid + 1)
    assert compilation._private(folder) is None


@posix
def test_a_known_name_in_a_shared_folder_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where only the temporary folder is left and its known name is taken, a new one is made."""
    monkeypatch.setattr(compilation, "_roots", lambda: [tmp_path / "slipstick"])
    monkeypatch.setattr(compilation.tempfile, "tempdir", str(tmp_path))
    (tmp_path / "slipstick").mkdir()
    (tmp_path / "slipstick").chmod(0o777)
    folder = compilation.cache_folder.__wrapped__()
    assert folder.parent == tmp_path
    assert folder.name.startswith("slipstick-")
    assert folder.stat().st_mode & 0o777 == 0o700


def double(x: float) -> float:
    return 2.0 * x


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(compilation, "cache_folder", lambda: tmp_path)
    return tmp_path


def test_a_function_is_kept_and_found_until_any_compiled_code_changes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def hits() -> int:
        dispatcher = compiled(double, allocates=True)
        assert dispatcher(2.0) == 4.0
        return sum(dispatcher.stats.cache_hits.values())

    assert (hits(), hits()) == (0, 1)
    assert {path.suffix for path in folder.iterdir()} == {".nbi", ".nbc"}
    monkeypatch.setattr(compilation, "code_key", lambda: "other")
    assert (hits(), hits()) == (0, 1)


@pytest.mark.usefixtures("folder")
def test_a_kept_function_is_found_without_the_rules_of_compilation(monkeypatch: pytest.MonkeyPatch) -> None:
    assert compiled(double, allocates=True)(2.0) == 4.0
    monkeypatch.setattr(BaseContext, "refresh", lambda self: pytest.fail("the rules were made ready"))
    assert compiled(double, allocates=True)(2.0) == 4.0


def test_the_key_is_that_of_the_compiled_rooms() -> None:
    package = Path(compilation.__file__).parents[1]
    users = {path.parent for path in package.rglob("*.py") if "import compiled" in path.read_text(encoding="utf-8")}
    assert users == {package / room for room in compilation.ROOMS}


@pytest.fixture
def untouchable() -> Iterator[None]:
    """Numba's configuration, shared by all in the process, cannot be written."""

    class Frozen(types.ModuleType):
        def __setattr__(self, name: str, value: Any) -> None:
            raise AssertionError(f"numba.config.{name} was set")

    config, kind = numba.config, type(numba.config)
    object.__setattr__(config, "__class__", Frozen)
    yield
    object.__setattr__(config, "__class__", kind)


@pytest.mark.usefixtures("folder", "untouchable")
def test_other_users_of_numba_in_the_process_notice_nothing(tmp_path: Path) -> None:
    assert compiled(double, allocates=True)(3.0) == 6.0
    theirs = numba.njit(cache=True)(double)
    assert Path(theirs.stats.cache_path) != tmp_path


@pytest.mark.usefixtures("folder")
def test_a_numba_that_keeps_functions_in_another_way_is_slow_and_not_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(caching, "FunctionCache")
    compilation._warn.cache_clear()
    with pytest.warns(RuntimeWarning, match="compiled in each process"):
        dispatcher = compiled(double, allocates=True)
    assert dispatcher(4.0) == 8.0
