"""An independent writer of Nastran files, and bulk data by hand."""

import struct

import numpy as np

K = np.array([[4.0, -1.0, 0.0], [-1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])


M = np.diag([1.0, 0.0, 0.7])


def runs(column: np.ndarray) -> list[tuple[int, np.ndarray]]:
    """First row (from 1) and values of each run without zeros."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], column != 0, [0]])))
    return [(int(a) + 1, column[a:b]) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def write_text(matrices: dict[str, np.ndarray], form: str) -> str:
    lines = []
    for name, a in matrices.items():
        rows = -len(a) if form == "big" else len(a)
        lines.append(f"{a.shape[1]:8d}{rows:8d}{6:8d}{2:8d}{name:8s}1P,3E24.16")
        for j, column in enumerate(a.T, 1):
            strings = runs(column)
            if not strings:
                continue
            if form == "dense":
                first, last = strings[0][0], strings[-1][0] + len(strings[-1][1]) - 1
                parts = [(f"{j:8d}{first:8d}{last - first + 1:8d}", column[first - 1 : last])]
            else:
                extra = 2 if form == "big" else 1
                total = sum(2 * len(v) + extra for _, v in strings)
                lines.append(f"{j:8d}{0:8d}{total:8d}")
                heads = {
                    "big": lambda r, v: f"{2 * len(v) + 1:8d}{r:8d}",
                    "strings": lambda r, v: f"{r + 65536 * (2 * len(v) + 1):8d}",
                }
                parts = [(heads[form](r, v), v) for r, v in strings]
            for head, values in parts:
                lines.append(head)
                words = [f"{v:24.16E}" for v in values]
                lines += ["".join(words[i : i + 3]) for i in range(0, len(words), 3)]
        lines += [f"{a.shape[1] + 1:8d}{1:8d}{1:8d}", f"{1.0:24.16E}"]
    return "\n".join(lines) + "\n"


def write_binary(
    matrices: dict[str, np.ndarray], form: str, order: str = "<", kind: int = 2, wide: bool = False
) -> bytes:
    integer, size = ("q", 8) if wide else ("i", 4)
    real, each = ("d", 8 // size) if kind == 2 or wide else ("f", 1)
    out = b""

    def record(data: bytes) -> bytes:
        return struct.pack(f"{order}i", len(data)) + data + struct.pack(f"{order}i", len(data))

    def ints(*values: int) -> bytes:
        return struct.pack(f"{order}{len(values)}{integer}", *values)

    def reals(values) -> bytes:
        return struct.pack(f"{order}{len(values)}{real}", *values)

    for name, a in matrices.items():
        rows = -len(a) if form == "big" else len(a)
        out += record(ints(a.shape[1], rows, 6, kind) + name.ljust(2 * size).encode())
        for j, column in enumerate(a.T, 1):
            strings = runs(column)
            if form == "dense" and strings:
                first, last = strings[0][0], strings[-1][0] + len(strings[-1][1]) - 1
                values = column[first - 1 : last]
                out += record(ints(j, first, each * len(values)) + reals(values))
            elif strings:
                body = b""
                for row, v in strings:
                    words = each * len(v)
                    body += ints(words + 1, row) if form == "big" else ints(row + 65536 * (words + 1))
                    body += reals(v)
                out += record(ints(j, 0, len(body) // size) + body)
        out += record(ints(a.shape[1] + 1, 1, each) + reals([1.0]))
    return out


BULK = f"""\
SOL 103
BEGIN BULK
$ small, large and free fields, in one file
GRID    3               0.0     0.0     0.0             123
{"GRID*":8s}{1:16d}{"":16s}{"2.5D+0":>16s}{"-1.5":>16s}
{"*":8s}{"3.-1":>16s}
GRID,2,,1.,2.,3.
SPOINT,9
SPC1,5,13,1,2
CTETRA,1,1,1,2,3
ENDDATA
"""
