"""*INCLUDE: files beside an input file become part of its text."""

from __future__ import annotations

import re
from pathlib import Path

from slipstick.errors import InputError
from slipstick.importers.findings import Findings
from slipstick.importers.text_numbers import LARGEST_TEXT_FILE, read_bytes

_DEPTH = 10
_INCLUDE = re.compile(r"^\s*\*\s*INCLUDE\s*,(.*)$", re.IGNORECASE)
_FILE = re.compile(r'^\s*INPUT\s*=\s*"?([^",]*)"?\s*,?\s*$', re.IGNORECASE)


def whole_text(path: Path, findings: Findings) -> str:
    """The text of a file with those it includes, which must lie in its folder or below.

    Raises
    ------
    InputError
        If one is missing, lies elsewhere, includes itself, or all together are too long; with the line.
    """
    read: list[int] = []
    lines = _lines(path, path.resolve().parent, (path.resolve(),), read)
    if len(read) > 1:
        findings.origin = [where for where, _ in lines]
        findings.extra.append(f"{path.name}: {len(read) - 1} included files were read")
    return "\n".join(line for _, line in lines)


def _lines(path: Path, folder: Path, above: tuple[Path, ...], read: list[int]) -> list[tuple[str, str]]:
    """Place and text of each line."""
    text = read_bytes(path)
    read.append(len(text))
    if sum(read) > LARGEST_TEXT_FILE:
        raise InputError(f"{path.name}: with what it includes it is larger than {LARGEST_TEXT_FILE / 1e9:.3g} GB")
    lines: list[tuple[str, str]] = []
    for number, line in enumerate(text.decode("latin-1").splitlines(), 1):
        match = _INCLUDE.match(line)
        if not match:
            lines.append((f"{path.name}, line {number}", line))
            continue
        where = f"{path.name}, line {number}: *INCLUDE"
        inner = _included(match.group(1), folder, where)
        if inner in above or len(above) >= _DEPTH:
            raise InputError(
                f"{where}: {inner.name} includes itself, or files include each other more than {_DEPTH} deep"
            )
        lines += _lines(inner, folder, (*above, inner), read)
    return lines


def _included(words: str, folder: Path, where: str) -> Path:
    """The file of "INPUT=name", in the folder of the deck."""
    match = _FILE.match(words)
    if not match or not match.group(1).strip():
        raise InputError(f"{where} lacks INPUT=; expected the name of a file")
    name = match.group(1).strip()
    inner = (folder / name.replace("\\", "/")).resolve()
    if not inner.is_relative_to(folder):
        raise InputError(f"{where}: {name} does not lie in the folder of the file; put it there, or merge the two")
    if not inner.is_file():
        raise InputError(f"{where}: there is no file {name} in the folder of the file")
    return inner
