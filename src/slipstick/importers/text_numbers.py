"""Numbers out of text files written by Fortran and C programs."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError, Where
from slipstick.importers.findings import DAMAGED, refused
from slipstick.typing import Array

LARGEST_TEXT_FILE = 16 * 1024**3
"""Bytes of the largest file that is read."""


def read_bytes(path: Path) -> bytes:
    """Content of a file.

    Raises
    ------
    InputError
        If it is missing, not a file, empty or larger than ``LARGEST_TEXT_FILE``.
    """
    try:
        size = path.stat().st_size if path.is_file() else -1
    except OSError:
        size = -1
    if size < 0:
        raise refused(str(path), "there is no such file")
    if size == 0:
        raise refused(path.name, "the file is empty")
    if size > LARGEST_TEXT_FILE:
        raise refused(
            path.name, f"the file is larger than {LARGEST_TEXT_FILE / 1e9:.3g} GB", remedy="reduce the model first"
        )
    return path.read_bytes()


@contextmanager
def reading(where: str | Where) -> Iterator[None]:
    """Words that are no numbers, or too few of them, raise an InputError that says where they stand."""
    try:
        yield
    except InputError:
        raise
    except (ValueError, IndexError) as error:
        raise refused(where, f"cannot be read ({error})") from None


def number_table(data: bytes, columns: int, path: Path) -> Array:
    """Numbers separated by blanks, commas or line ends as (n, columns); Fortran's D exponents are understood.

    Raises
    ------
    InputError
        If something else stands between the numbers, or the last row is not whole.
    """
    text = data.translate(bytes.maketrans(b"Dd,", b"Ee "))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(text.decode("ascii"), dtype=float, sep=" ")
        except (ValueError, UnicodeDecodeError, DeprecationWarning):
            raise refused(path.name, "holds something else than numbers", remedy=DAMAGED) from None
    if not len(values) or len(values) % columns:
        raise refused(path.name, found=f"{len(values)} numbers, expected rows of {columns}", remedy=DAMAGED)
    return values.reshape(-1, columns)


def whole_numbers(values: Array, what: str, path: Path, low: int = 1) -> NDArray[np.int64]:
    """Numbers that must be integers from ``low`` up."""
    if len(values) and not (np.all(values == np.floor(values)) and values.min() >= low and values.max() < 2**53):
        raise refused(path.name, f"{what} are not all whole numbers from {low} up", remedy=DAMAGED)
    return values.astype(np.int64)


def require_plausible(rows: int, entries: int, path: Path) -> None:
    """Refuse sizes that a file of this length cannot hold, before memory is taken for them."""
    size = path.stat().st_size
    if rows <= 0 or rows > max(2**20, size) or entries < 0 or entries > max(size, 1):
        raise refused(path.name, f"claims {rows} rows and {entries} entries in a file of {size} bytes", remedy=DAMAGED)


_REAL = re.compile(r"^([+-]?[0-9]*\.?[0-9]*)(?:[eEdD]?([+-][0-9]+)|[eEdD]([0-9]+))?$")


def fortran_real(text: str) -> float:
    """A real as Fortran and Nastran write it: the exponent letter may be D or missing.

    >>> fortran_real("1.5D+3"), fortran_real("-2.1-2"), fortran_real("7.")
    (1500.0, -0.021, 7.0)
    """
    match = _REAL.match(text.strip())
    if not match or not any(c.isdigit() for c in match.group(1)):
        raise ValueError(f"'{text.strip()}' is not a number")
    return float(f"{match.group(1)}e{match.group(2) or match.group(3) or '0'}")


def whole_number(text: str) -> int:
    """A whole number such as a label; ValueError where it is none, or longer than any label.

    >>> whole_number(" 12 ")
    12
    """
    number = int(text) if len(text) < 40 else 2**62
    if abs(number) >= 2**62:
        raise ValueError(f"{text.strip()[:20]}... is too long for a label")
    return number
