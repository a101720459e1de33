"""What type checkers say of every documented use, and of wrong ones; part of `make lint`, for they take half a minute.

A block of a page is checked with those before it, whose names it uses; libraries without types of their own are taken
as unknown by both checkers.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from test_docs import NOTEBOOKS, PAGES, ROOT, blocks, not_run

import slipstick as ss

pytestmark = pytest.mark.verify

SOURCE = Path(ss.__file__).parent.parent
WRONG = Path(__file__).with_name("wrong_uses.py")


def documented() -> Iterator[tuple[str, str]]:
    """Name and text of every script that a page shows, and of every page as one script."""
    for page in (*PAGES, *NOTEBOOKS):
        rest, name = "", re.sub(r"\W", "_", page.name)
        for language, text in blocks(page):
            if language != "python" or not_run(text):
                continue
            file = re.match(r"# ([\w-]+)\.py\b", text)
            if file:
                yield f"{name}__{file[1].replace('-', '_')}.py", text
            else:
                rest += text + "\n"
        if rest:
            yield f"{name}.py", rest


@pytest.fixture(scope="module")
def scripts(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of all of them and of the examples, which import from each other."""
    folder = tmp_path_factory.mktemp("documented")
    for name, text in documented():
        (folder / name).write_text(text, encoding="utf-8")
    for example in sorted((ROOT / "examples").rglob("*.py")):
        taken = (folder / example.name).exists()
        shutil.copy(example, folder / (f"{example.parent.name}_{example.name}" if taken else example.name))
    return folder


def mypy(folder: Path) -> list[str]:
    environment = {**os.environ, "MYPYPATH": str(SOURCE)}
    options = ["--allow-untyped-defs", "--allow-redefinition", "--no-error-summary", "--hide-error-context"]
    settings = ["--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(ROOT / ".mypy_cache" / "uses")]
    files = sorted(file.name for file in folder.glob("*.py"))
    command = [sys.executable, "-m", "mypy", *settings, *options, *files]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=folder)
    assert done.returncode in (0, 1), done.stderr + done.stdout
    return [line for line in done.stdout.splitlines() if ": error:" in line]


def pyright(folder: Path) -> list[str]:
    settings = {"extraPaths": [str(SOURCE)], "pythonVersion": "3.11", "useLibraryCodeForTypes": False}
    (folder / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    command = [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable]
    done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
    found = json.loads(done.stdout)
    assert found["summary"]["filesAnalyzed"] == len(list(folder.glob("*.py"))), done.stdout
    wrong = [one for one in found["generalDiagnostics"] if one["severity"] == "error"]
    return [f"{Path(one['file']).name}:{one['range']['start']['line'] + 1}: {one['message']}" for one in wrong]


def wrong_lines() -> set[int]:
    """Of the body of its function."""
    lines = WRONG.read_text(encoding="utf-8").splitlines()
    first = next(number for number, line in enumerate(lines, start=1) if line.startswith("def wrong("))
    return set(range(first + 1, len(lines) + 1))


def numbers_of(found: list[str]) -> set[int]:
    return {int(match[1]) for line in found if (match := re.search(r"wrong_uses\.py:(\d+)", line))}


def test_mypy_takes_every_documented_use(scripts: Path) -> None:
    found = mypy(scripts)
    assert not found, "\n".join(found)


def test_pyright_takes_every_documented_use(scripts: Path) -> None:
    pytest.importorskip("pyright")
    found = pyright(scripts)
    assert not found, "\n".join(found)


def test_mypy_refuses_every_wrong_use(tmp_path: Path) -> None:
    shutil.copy(WRONG, tmp_path)
    assert numbers_of(mypy(tmp_path)) == wrong_lines()


def test_pyright_refuses_every_wrong_use(tmp_path: Path) -> None:
    pytest.importorskip("pyright")
    shutil.copy(WRONG, tmp_path)
    assert numbers_of(pyright(tmp_path)) == wrong_lines()
