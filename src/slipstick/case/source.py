"""The text of a case and the files it names: perhaps a stranger's, so bounds are looked at before anything is read."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from slipstick.case.table import toml
from slipstick.errors import Fault, InputError
from slipstick.faults import real_path, unreached

LARGEST_FILE = 6 * 1024**2
DEEPEST = 50
"""Brackets within brackets, and parts of a dotted key."""
LONGEST_NUMBER = 400
_LARGEST_INTEGER = 2**63
_STRING = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"""|\Z)|'
    r"'''(?:[^']|'(?!''))*+(?:'''|\Z)|"
    r'"(?:[^"\\\n]|\\.)*+"?|'
    r"'[^'\n]*+'?|"
    r"#[^\n]*+",
    re.DOTALL,
)
_DOTTED = re.compile(rf"(?<![\w\-.])(?:[\w\-]++[ \t]*+\.[ \t]*+){{{DEEPEST},}}+")
_NUMBER = re.compile(rf"(?<![\w\-])[+\-]?(?:0[xob])?\d[\w.]{{{LONGEST_NUMBER},}}+")
_COPY = "copy the file beside the case and name it relatively"
_TWICE = re.compile(r"Cannot declare \((.*)\) twice")
_PART = r"'([^']*)'"
_SHOWN = 60


def read_text(path: Path) -> str:
    """The text of a case file.

    Raises
    ------
    InputError
        If there is none, it is no plain file, too large, or not UTF-8.
    """
    if path.is_dir():
        raise InputError(f"{path}: found a folder; expected a case file such as case.toml")
    if not path.exists():
        raise InputError(f"{path}: there is no such file; check the name, or write an example with 'slipstick init'")
    if not path.is_file():
        raise InputError(f"{path}: found a device or a pipe; expected a case file such as case.toml")
    with path.open("rb") as stream:
        content = stream.read(LARGEST_FILE + 1)
    if len(content) > LARGEST_FILE:
        raise InputError(f"{path}: larger than {LARGEST_FILE >> 20} MB; put large matrices into .npz or .mtx files")
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError:
        raise InputError(f"{path}: not a text file; expected a case in TOML (UTF-8)") from None


def inside(folder: Path, name: str) -> Path:
    """The file ``name`` in ``folder``; raises InputError where it leaves the folder or is no file."""
    pure = PurePosixPath(name.replace("\\", "/"))
    if "\0" in name or not name.strip():
        raise InputError(Fault(found=toml(name), expected="the name of a file in the folder of the case"))
    if pure.is_absolute() or PureWindowsPath(name).drive or ".." in pure.parts:
        raise _refused(name, "the path leaves the folder of the case", _COPY)
    path = folder / pure
    real, home = real_path(path), real_path(folder)
    if not real.is_relative_to(home):
        raise _refused(name, "the link leads out of the folder of the case", "copy the file itself beside the case")
    if reason := unreached(path):
        raise _refused(name, f"it cannot be reached ({reason})", "put the file itself there")
    if not real.is_file():
        raise _refused(name, f"there is no such file in {home}", "check its name")
    return path


def _refused(name: str, why: str, remedy: str) -> InputError:
    return InputError(Fault(found=toml(name), statement=why, remedy=remedy))


def parse(text: str, name: str) -> dict[str, Any]:
    """The tables of a case.

    Raises
    ------
    InputError
        If it is not TOML, nested too deeply, or holds numbers that no computer word holds.
    """
    fault = _bounds_fault(text)
    if fault:
        raise InputError(f"{name}: {fault}")
    try:
        raw = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        reason = _reason(str(error), text) if isinstance(error, tomllib.TOMLDecodeError) else "nested too deeply"
        raise InputError(f"{name}: not valid TOML: {reason}") from None
    except ValueError:  # a date such as 2024-13-45
        raise InputError(f"{name}: not valid TOML: it holds a date or a number that does not exist") from None
    huge = list(_huge_integers(raw, ""))
    if huge:
        raise InputError([f"{name}: {key}: found a whole number beyond 64 bits; write it as 1e20" for key in huge[:20]])
    return raw


def _reason(said: str, text: str) -> str:
    """The message of the parser, with the line it is about."""
    said = _TWICE.sub(lambda match: f"the table [{'.'.join(re.findall(_PART, match[1]))}] stands twice", said)
    at = re.search(r"at line (\d+)", said)
    line = text.splitlines()[int(at[1]) - 1 : int(at[1])] if at else []
    shown = "".join(c if c.isprintable() else " " for c in line[0]).strip() if line else ""
    shown = f": {shown[:_SHOWN]}" + "..." * (len(shown) > _SHOWN) if shown else ""
    return f"{said}; correct that line{shown}"


def _bounds_fault(text: str) -> str | None:
    """Text that costs the parser, or the code after it, more time and memory than any case needs."""
    bare = _STRING.sub(lambda match: "_" + "\n" * match[0].count("\n"), text)
    depth = 0
    for bracket in re.finditer(r"[\[\]{}]", bare):
        depth = depth + 1 if bracket[0] in "[{" else max(depth - 1, 0)
        if depth > DEEPEST:
            return f"line {_line(bare, bracket)}: nested more than {DEEPEST} deep; expected tables and lists of a case"
    if match := _DOTTED.search(bare):
        return f"line {_line(bare, match)}: a key of more than {DEEPEST} parts; expected keys of a case"
    if match := _NUMBER.search(bare):
        return f"line {_line(bare, match)}: a number of {len(match[0])} characters; expected at most {LONGEST_NUMBER}"
    return None


def _line(text: str, match: re.Match[str]) -> int:
    return text.count("\n", 0, match.start()) + 1


def _huge_integers(value: object, key: str) -> Iterator[str]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _huge_integers(inner, f"{key}.{name}".lstrip("."))
    elif isinstance(value, list):
        for inner in value:
            yield from _huge_integers(inner, key)
    elif isinstance(value, int) and not -_LARGEST_INTEGER <= value < _LARGEST_INTEGER:
        yield key
