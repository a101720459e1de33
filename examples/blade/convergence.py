"""What the mesh, the number of modes and the number of harmonics change in the blade study, as tables.

    python examples/blade/convergence.py [--large] [--cache FOLDER]

The large mesh takes a minute where it is not in the cache yet.
"""

import argparse
from pathlib import Path

import numpy as np
from shrouded_blade import DEFAULT_CACHE, OUTPUT, RANGE, highest, reduced_blade, rubbed

import slipstick as ss

CASES = {"100 %, at rest": (100, 0.0), "40 %, 1 m/s": (40, 1.0), "100 %, 0.1 m/s": (100, 0.1)}
MODES = (1, 4, 16, 64, 128)
HARMONICS = (1, 3, 5, 7, 9, 13)
COMPARED = tuple(2 * np.pi * np.arange(160.0, 321.0, 10.0))
"""Frequencies at which whole curves are compared, rad/s."""

CONTACTS = tuple((x, y, 0.22) for x, y in (
    (0.020, 0.0085), (-0.0122, -0.0107), (0.0, 0.0036), (-0.0045, -0.0055), (0.0078, 0.0052), (0.0104, 0.0119),
    (-0.0118, -0.0183), (-0.0107, -0.0035),
))  # fmt: skip
"""The same places and patches on every mesh, so that only the mesh differs."""
RADIUS = 3e-3


def respond(blade, load, velocity, harmonics=range(6), at=()):
    problem = rubbed(blade, load, velocity, harmonics=harmonics)
    return ss.forced_response(problem, omega=RANGE, at=at, peaks_of=OUTPUT)


def by_mesh(sizes, cache):
    """Rows: size, degrees of freedom, first two frequencies (Hz), peaks of the cases (µm)."""
    for size in sizes:
        blade = reduced_blade(size, contacts=CONTACTS, radius=RADIUS, cache=cache)
        frequencies = blade.structure.omega[:2] / (2 * np.pi)
        peaks = [1e6 * highest(respond(blade, *case))[1] for case in CASES.values()]
        yield size, blade.n_dofs, *frequencies, *peaks


def curves(blade, harmonics=range(6)):
    """By case: peak amplitude, and amplitudes at the compared frequencies."""
    found = {}
    for name, case in CASES.items():
        branch = respond(blade, *case, harmonics=harmonics, at=COMPARED)
        at = [branch.at(omega) for omega in COMPARED]
        found[name] = highest(branch)[1], branch.dataset.amplitude.sel(dof=OUTPUT).values[at]
    return found


def differences(variants):
    """Rows: name, then by case the relative difference of the peak and the largest one along the curve.

    ``variants`` are (name, curves) pairs of which the last is the reference.
    """
    *others, (_, reference) = variants
    for name, found in others:
        pairs = [(found[case], reference[case]) for case in CASES]
        changes = [(abs(a / b - 1), np.max(np.abs(x / y - 1))) for (a, x), (b, y) in pairs]
        yield name, *(value for change in changes for value in change)


def by_modes(cache, modes=MODES):
    """Against the largest number of modes; the residuals are part of every reduction."""
    return differences([(n, curves(reduced_blade("small", modes=n, cache=cache))) for n in modes])


def by_harmonics(cache, highest_orders=HARMONICS):
    """Against the largest number of harmonics."""
    blade = reduced_blade("small", cache=cache)
    return differences([(f"0..{n}", curves(blade, range(n + 1))) for n in highest_orders])


def table(title, heads, rows, style):
    """Print a table in the format of the documentation; ``style`` is for numbers."""
    print(f"\n{title}\n\n| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for cells in rows:
        print("| " + " | ".join(format(c, style) if isinstance(c, float) else str(c) for c in cells) + " |", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Convergence of the blade study")
    parser.add_argument("--large", action="store_true", help="the large mesh too")
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE)
    given = parser.parse_args()
    sizes = ("small", "medium", "large") if given.large else ("small", "medium")
    peaks = [f"peak {name} [µm]" for name in CASES]
    both = [text for name in CASES for text in (f"{name}: peak", "curve")]
    table("Mesh", ["mesh", "dofs", "f1 [Hz]", "f2 [Hz]", *peaks], by_mesh(sizes, given.cache), ".2f")
    table("Modes, against 128", ["modes", *both], by_modes(given.cache), ".0e")
    table("Harmonics, against 0..13", ["harmonics", *both], by_harmonics(given.cache), ".0e")
