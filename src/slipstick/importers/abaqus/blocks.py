"""The text of an input file (.inp) with what it includes, as blocks: a keyword, its parameters and its data lines."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from slipstick.errors import Place
from slipstick.importers.findings import Findings, refused
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


Line = tuple[tuple[str, int], str]
"""File and number, and text."""


def _lines(path: Path, folder: Path, above: tuple[Path, ...], read: list[int]) -> list[Line]:
    """Place and text of each line."""
    text = read_bytes(path)
    read.append(len(text))
    if sum(read) > LARGEST_TEXT_FILE:
        raise refused(path.name, f"with what it includes it is larger than {LARGEST_TEXT_FILE / 1e9:.3g} GB")
    lines: list[Line] = []
    for number, line in enumerate(text.decode("latin-1").splitlines(), 1):
        match = _INCLUDE.match(line)
        if not match:
            lines.append(((path.name, number), line))
            continue
        where = Place(path.name, f"line {number}", "*INCLUDE")
        inner = _included(match.group(1), folder, where)
        if inner in above or len(above) >= _DEPTH:
            raise refused(where, f"{inner.name} includes itself, or files include each other more than {_DEPTH} deep")
        lines += _lines(inner, folder, (*above, inner), read)
    return lines


def _included(words: str, folder: Path, where: Place) -> Path:
    """The file of "INPUT=name", in the folder of the deck."""
    match = _FILE.match(words)
    if not match or not match.group(1).strip():
        raise refused(where, "lacks INPUT=", expected="the name of a file")
    name = match.group(1).strip()
    inner = (folder / name.replace("\\", "/")).resolve()
    if not inner.is_relative_to(folder):
        raise refused(where, f"{name} does not lie in the folder of the file", remedy="put it there, or merge the two")
    if not inner.is_file():
        raise refused(where, f"there is no file {name} in the folder of the file")
    return inner


@dataclass(frozen=True, kw_only=True)
class Block:
    """A keyword without blanks, its parameters in capitals, and its data lines as words.

    ``continued`` holds the indices of the rows that end with a comma: an element goes on in the next one.
    """

    keyword: str
    shown: str
    parameters: dict[str, str]
    line: int
    rows: list[list[str]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    continued: set[int] = field(default_factory=set)

    def joined(self) -> Iterator[tuple[int, list[str]]]:
        """Line and words of each entry, continued rows joined."""
        start = self.line
        words: list[str] = []
        for index, row in enumerate(self.rows):
            start = start if words else self.lines[index]
            words = words + [word for word in row if word]
            if index not in self.continued:
                yield start, words
                words = []
        if words:
            yield start, words


def blocks(text: str) -> Iterator[Block]:
    """The blocks of a file; a keyword line that ends with a comma goes on in the next line.

    >>> [(b.shown, b.parameters, b.rows) for b in blocks("*NSET,\\n nset=Tip\\n1, 2,\\n3")]
    [('*NSET', {'NSET': 'TIP'}, [['1', '2'], ['3']])]
    """
    block: Block | None = None
    head, head_line = "", 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if line.startswith("**") or not line:
            continue
        if line.startswith("*") and head:
            if block:
                yield block
            block, head = _start(head, head_line), ""
        if head or line.startswith("*"):
            head, head_line = head + line, head_line if head else number
            if line.endswith(","):
                continue
            if block:
                yield block
            block, head = _start(head, head_line), ""
        elif block:
            if line.endswith(","):
                block.continued.add(len(block.rows))
            block.rows.append([word.strip() for word in line.rstrip(",").split(",")])
            block.lines.append(number)
    if head:
        if block:
            yield block
        block = _start(head, head_line)
    if block:
        yield block


def _start(head: str, line: int) -> Block:
    name, *parameters = (part.strip().upper() for part in head[1:].split(","))
    pairs = (part.split("=", 1) for part in parameters if part)
    named = {pair[0].replace(" ", ""): pair[-1].strip().strip('"') for pair in pairs}
    return Block(keyword=name.replace(" ", ""), shown=f"*{' '.join(name.split())}", parameters=named, line=line)
