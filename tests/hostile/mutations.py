"""Damaged and malicious variants of files: of text line by line and key by key, of any file byte by byte."""

from __future__ import annotations

import random
import re
from collections.abc import Callable
from contextlib import suppress

VALUES = (
    "0", "-1", "1", "3", "-0.0", "0.5", "1e308", "-1e308", "1e-308", "5e-324", "1e400", "1e40", "1e-40", "1e12",
    "nan", "inf", "-inf", "9" * 310, "-" + "9" * 310, "9" * 5000, "0." + "3" * 5000, "9223372036854775808",
    "0x" + "f" * 400, "true", "false", '""', '"x"', '"text"', '"\\u0000"', '"\\u001b[31mred\\u0007"', '"ä\\u202eö"',
    '"' + "x" * 100_000 + '"', '"3000 rpm"', '"1e400 Hz"', '"1/0"', '"0..9999999"', '"../../etc/passwd"', '"/dev/zero"',
    "[]", "{}", "[[]]", "[1.0]", "[1, 2, 3]", "[[1.0, 2.0]]", "[[1.0], [2.0]]", "[[1e308]]", "[[nan]]", '["x", "x"]',
    '["x", "y"]', '["a", 1]', "[true]", "[[[[]]]]", "{ a = 1 }", '{ x = 0.0 }', "{ x = 1e308 }", '{ "1" = 1e308 }',
    '{ "-1" = 1.0 }', '{ "99999" = 1.0 }', "{ velocity = 1e308 }", "{ velocity = nan }", "{ table = [[1, 2]] }",
    "{ table = [] }", "{ table = [[20, 0.3], [20, 0.4]] }", "{ table = [[0, 1e308], [1, 0.0]] }",
    "{ direction = [0, 0, 0] }",
    "1979-05-27", "07:32:00", "1979-05-27T07:32:00Z", "[" * 300 + "]" * 300, "{a=" * 300 + "1" + "}" * 300,
    "[" * 20_000 + "]" * 20_000, "[" + "1," * 50_000 + "]", '"""\nmany\nlines\n"""', "'\x1b[2J'", "'\x07'",
)  # fmt: skip
KEYS = (
    "x", '""', '"\\u0000"', '"\\u001b]0;title\\u0007"', "'ä'", "a.b.c", "format", "kt", "a" * 10_000, "1", "nan",
    ".".join("a" * 5000), "name", "kind",
)  # fmt: skip
_LINE = re.compile(r"^(\s*)([^=\[#\s]+)(\s*=\s*)(.*)$")


def _line(kind: Callable[[random.Random, list[str], int], None]) -> Callable[[random.Random, str], str]:
    def mutate(rng: random.Random, text: str) -> str:
        lines = text.splitlines()
        with suppress(IndexError):  # nothing is left to be changed in this way
            kind(rng, lines, rng.randrange(max(len(lines), 1)))
        return "\n".join(lines) + "\n"

    return mutate


def _value(rng: random.Random, lines: list[str], at: int) -> None:
    keys = [i for i, line in enumerate(lines) if _LINE.match(line)]
    at = rng.choice(keys)
    lines[at] = _LINE.sub(lambda m: f"{m[1]}{m[2]}{m[3]}{rng.choice(VALUES)}", lines[at])


def _key(rng: random.Random, lines: list[str], at: int) -> None:
    at = rng.choice([i for i, line in enumerate(lines) if _LINE.match(line)])
    lines[at] = _LINE.sub(lambda m: f"{m[1]}{rng.choice(KEYS)}{m[3]}{m[4]}", lines[at])


def _number(rng: random.Random, lines: list[str], at: int) -> None:
    """One number inside a value."""
    found = [(i, m) for i, line in enumerate(lines) for m in re.finditer(r"\d+\.?\d*(e[+-]?\d+)?", line)]
    i, match = rng.choice(found)
    lines[i] = lines[i][: match.start()] + rng.choice(VALUES[:24]) + lines[i][match.end() :]


def _added(rng: random.Random, lines: list[str], at: int) -> None:
    lines.insert(at, f"{rng.choice(KEYS)} = {rng.choice(VALUES)}")


def _header(rng: random.Random, lines: list[str], at: int) -> None:
    at = rng.choice([i for i, line in enumerate(lines) if line.startswith("[")])
    lines[at] = rng.choice(
        ["[x]", "[[structure]]", "[contact]", "[load]", "[[response]]", "[output]", "[thermal]", "[a.b.c]"]
    )


def _delete(rng: random.Random, lines: list[str], at: int) -> None:
    del lines[at]


def _repeat(rng: random.Random, lines: list[str], at: int) -> None:
    lines.insert(at, lines[at])


def _swap(rng: random.Random, lines: list[str], at: int) -> None:
    other = rng.randrange(len(lines))
    lines[at], lines[other] = lines[other], lines[at]


def _cut(rng: random.Random, lines: list[str], at: int) -> None:
    del lines[at:]


def _copied_block(rng: random.Random, lines: list[str], at: int) -> None:
    stop = rng.randrange(at, len(lines)) + 1
    lines[at:at] = lines[at:stop] * rng.choice([1, 2, 50])


_CHANGES = (
    _value,
    _value,
    _value,
    _key,
    _number,
    _number,
    _added,
    _header,
    _delete,
    _repeat,
    _swap,
    _cut,
    _copied_block,
)
_TEXT = tuple(map(_line, _CHANGES))


def mutated_text(text: str, seed: int) -> bytes:
    """One to three changes of lines, keys and values; one in six is damaged byte by byte."""
    rng = random.Random(seed)
    if rng.random() < 1 / 6:
        return mutated_bytes(text.encode(), seed)
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        text = rng.choice(_TEXT)(rng, text) or "\n"
    return text.encode()


def mutated_bytes(data: bytes, seed: int, *, front: int = 4096) -> bytes:
    """Cut, flipped, deleted, inserted or overwritten somewhere; often near the beginning, where sizes are."""
    rng = random.Random(seed)
    out = bytearray(data[: data.rfind(b"sealed:\0")] if b"sealed:\0" in data else data)  # a stranger sets no seal
    for _ in range(rng.choice([1, 1, 2, 5])):
        at = rng.randrange(min(len(out), front if rng.random() < 0.5 else len(out)) or 1)
        width = rng.choice([1, 1, 2, 4, 8])
        kind = rng.randrange(7)
        if kind == 0:
            del out[at:]
        elif kind == 1:
            out[at : at + 1] = bytes([out[at] ^ (1 << rng.randrange(8))]) if at < len(out) else b""
        elif kind == 2:
            del out[at : at + rng.choice([1, 3, 64])]
        elif kind == 3:
            out[at:at] = rng.choice([b"\0", b"\xff\xfe", b"9" * 400, b"\x1b[2J", b"-1 ", b"nan ", b"1e999 ", bytes(64)])
        elif kind == 4:
            out[at : at + width] = b"\xff" * width
        elif kind == 5:
            out[at : at + width] = rng.randbytes(width)
        else:
            digits = [i for i in range(at, min(at + 2000, len(out))) if 48 <= out[i] < 58]
            if digits:
                chosen = rng.choice(digits)
                out[chosen : chosen + 1] = rng.choice([b"0", b"7", b"99999999", b"-1", b"e", b"1e400"])
        if not out:
            return b""
    return bytes(out)
