"""Points of a small results file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray

from slipstick.io.journal import Journal, journal_of
from slipstick.io.store import ResultStore
from slipstick.results.schema import Declared, Layout

LAYOUT = Layout(
    labels={"dof": ("x", "y"), "coefficient": ("0", "c1", "s1"), "contact": ("tip",)},
    variables={
        "omega": Declared((), "rad/s", "fundamental frequency"),
        "displacement": Declared(("dof", "coefficient"), "length", "displacement coefficients"),
        "power": Declared(("contact",), "force length/s", "dissipated power"),
        "count": Declared((), "1", "count", whole=True),
        "kind": Declared((), "1", "kind of point", texts=("start", "end")),
    },
    attributes={"analysis": "response", "case": "format = 1\n" + "# a long case\n" * 8000},
)


def point(i: int) -> dict[str, object]:
    return {
        "omega": float(i),
        "displacement": np.arange(6.0).reshape(2, 3) + i,
        "power": np.array([i / 7]),
        "count": i,
        "kind": "start" if i == 0 else "end",
    }


def corrected(dataset: xarray.Dataset) -> xarray.Dataset:
    """The points that were solved for, without those interpolated between them."""
    return dataset.isel(point=np.flatnonzero(dataset["kind"].to_numpy() != "interpolated"))


def opened(path: Path) -> xarray.Dataset:
    return xarray.load_dataset(path, engine="h5netcdf")


def journal_of_three(path: Path, layout: Layout = LAYOUT, first: int = 0) -> None:
    """A sound journal beside ``path``, as a killed run leaves it."""
    journal = Journal(journal_of(path), layout)
    for i in range(first, first + 3):
        journal.append(layout.pack(point(i)))
    journal.close(remove=False)


def written(path: Path, count: int, layout: Layout = LAYOUT) -> None:
    with ResultStore(path, layout) as store:
        for i in range(count):
            store.append(point(i))
