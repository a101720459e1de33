"""An input file (.inp) as blocks: a keyword with its parameters and its data lines."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field


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
