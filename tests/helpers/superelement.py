"""Craig-Bampton deliveries written by hand: op4 matrices, rows and points in a punch file, as EXTSEOUT leaves them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import eigh

from helpers.nastran import write_text

PUNCH_HEAD = """\
$***********************************************************************
$ THE FOLLOWING BULK DATA ENTRIES RELATED TO EXT. SUPERELEMENT      101
$ ARE FOR USE IN THE BEGIN SUPER      101 PORTION OF THE ASSEMBLY RUN
$***********************************************************************
BEGIN SUPER      101
$
"""
FIRST_MODE = 995001


@dataclass(kw_only=True)
class Frame:
    """A cylindrical system about z through an origin, and its directions at a point."""

    number: int
    origin: np.ndarray

    def coordinates(self, point: np.ndarray) -> tuple[float, float, float]:
        x, y, z = point - self.origin
        return float(np.hypot(x, y)), float(np.degrees(np.arctan2(y, x))), float(z)

    def directions(self, point: np.ndarray) -> np.ndarray:
        _, degrees, _ = self.coordinates(point)
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    @property
    def card(self) -> str:
        """In large fields, its z axis and x z plane as the basic ones."""
        a, b, c = self.origin, self.origin + np.array([0.0, 0.0, 1.0]), self.origin + np.array([1.0, 0.0, 0.0])
        values = [f"{x:16.9E}" for x in (*a, *b, *c)]
        lines = [f"{'CORD2C':7s}*{self.number:16d}{0:16d}{values[0]}{values[1]}"]
        lines += [f"{'*':8s}{''.join(values[2:6])}", f"{'*':8s}{''.join(values[6:9])}"]
        return "\n".join(lines)


def craig_bampton(K: np.ndarray, M: np.ndarray, boundary: np.ndarray, modes: int) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of boundary rows and of the lowest modes with the boundary held."""
    inner = np.setdiff1d(np.arange(len(K)), boundary)
    shape = np.zeros((len(K), len(boundary) + modes))
    shape[boundary, : len(boundary)] = np.eye(len(boundary))
    shape[inner, : len(boundary)] = -np.linalg.solve(K[np.ix_(inner, inner)], K[np.ix_(inner, boundary)])
    held = np.ix_(inner, inner)
    shape[inner, len(boundary) :] = eigh(K[held], M[held], subset_by_index=(0, modes - 1))[1]
    k, m = shape.T @ K @ shape, shape.T @ M @ shape
    k[: len(boundary), len(boundary) :] = k[len(boundary) :, : len(boundary)] = 0.0
    return (k + k.T) / 2, (m + m.T) / 2


def grid_card(label: int, point: np.ndarray, frame: Frame | None) -> str:
    """GRID with its star in column 8, position and displacements in the same system."""
    at = point if frame is None else frame.coordinates(point)
    system = 0 if frame is None else frame.number
    x, y, z = (f"{value:16.9E}" for value in at)
    return f"{'GRID':7s}*{label:16d}{system:16d}{x}{y}\n{'*':8s}{z}{system:16d}"


def pairs_of(name: str, pairs: list[tuple[int, str]]) -> str:
    """Small fields, four pairs a line."""
    rows = [pairs[i : i + 4] for i in range(0, len(pairs), 4)]
    lines = ["".join(f"{node:8d}{directions:>8s}" for node, directions in row) for row in rows]
    return "\n".join(f"{name if not i else '':8s}{line}" for i, line in enumerate(lines))


def write_delivery(
    folder: Path,
    points: dict[int, np.ndarray],
    frames: dict[int, Frame],
    matrices: dict[str, np.ndarray],
    *,
    form: str = "strings",
    spare: int = 2,
) -> None:
    """se.op4 and se.pch; rows are x, y, z of each point in ascending order, then modes; ``spare`` modes stay empty."""
    turn = np.eye(len(matrices["KAA"]))
    for i, (label, point) in enumerate(sorted(points.items())):
        if label in frames:
            turn[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = frames[label].directions(point)
    padded = {name: np.pad(turn.T @ a @ turn, (0, spare)) for name, a in matrices.items()}
    others = {"K4XX1": np.zeros((1, 1)), "PX1": np.zeros((1, 1)), "VA": np.ones((3, 1)), "MUG1": np.ones((4, 4))}
    (folder / "se.op4").write_text(write_text(padded | others, form))
    count = len(matrices["KAA"]) - 3 * len(points) + spare
    modes = [(FIRST_MODE + i, "0") for i in range(count)]
    boundary = [(label, "123") for label in sorted(points)]
    lines = [frame.card for frame in {f.number: f for f in frames.values()}.values()]
    lines += ["$ EXTRN DATA", pairs_of("EXTRN", boundary + modes), "$"]
    lines += [grid_card(label, points[label], frames.get(label)) for label in sorted(points)]
    lines += [pairs_of("ASET", boundary[i : i + 4]) for i in range(0, len(boundary), 4)]
    lines += [f"QSET1   {0:8d}{FIRST_MODE:8d}    THRU{FIRST_MODE + count - 1:8d}"]
    lines += [f"SPOINT  {FIRST_MODE:8d}    THRU{FIRST_MODE + count - 1:8d}"]
    lines += ["DTI     TUG1    0       66      105     32767   0       7       0", "        PHIP            7"]
    (folder / "se.pch").write_text(PUNCH_HEAD + "\n".join(lines) + "\n")
