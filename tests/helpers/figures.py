"""Results to draw, made up and computed, and what stands in a figure."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import xarray

import slipstick as ss

OMEGA = np.linspace(2.0, 15.0, 40)
UNITS = {"length": "mm", "force": "N", "time": "s", "temperature": "degC"}


def dataset(factor: float = 1.0) -> xarray.Dataset:
    """Two dofs and two contacts over 40 points of made up numbers, peaks at points 13 (of z) and 20 (of x)."""
    x, z = (factor / np.abs(OMEGA[peak] ** 2 - OMEGA**2 + 0.4j * OMEGA) for peak in (20, 13))
    kinds, peak_of = np.full(40, "regular"), np.full(40, -1)
    kinds[[0, 13, 20]] = "start", "peak", "peak"
    peak_of[[13, 20]] = 1, 0
    units = {"omega": "rad/s", "amplitude": "m", "mean": "m", "dissipated_power": "W"}
    data = {
        "omega": ("point", OMEGA.copy()),
        "kind": ("point", kinds),
        "peak_dof": ("point", peak_of),
        "amplitude": (("point", "dof"), np.stack([x, 2 * z], axis=1)),
        "mean": (("point", "dof"), np.stack([-x, z], axis=1)),
        "dissipated_power": (("point", "contact"), np.stack([x, 3 * z], axis=1)),
        "friction_coefficient": (("point", "contact"), np.full((40, 2), 0.3)),
        "stick_fraction": (("point", "contact"), np.full((40, 2), 0.25)),
        "slip_fraction": (("point", "contact"), np.full((40, 2), 0.7)),
        "separation_fraction": (("point", "contact"), np.full((40, 2), 0.05)),
    }
    result = xarray.Dataset(data, coords={"dof": ["x", "z"], "contact": ["tip", "root"]})
    for name in result.data_vars:
        result[name].attrs = {"units": units.get(str(name), "1"), "long_name": str(name).replace("_", " ")}
    return result


def problem(velocity: float = 0.0, force: float = 100.0, **more: Any) -> ss.Problem:
    """Three masses in a chain, each with a friction contact on a surface that oscillates and may slide."""
    K = 50.0 * np.eye(3) - 5.0 * np.eye(3, k=1) - 5.0 * np.eye(3, k=-1)
    structure = ss.MatrixStructure(M=np.eye(3), C=0.4 * np.eye(3), K=K, dofs=["x0", "x1", "x2"])
    pairs = [
        ss.ContactPair(
            name=f"c{k}",
            contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=200.0),
            tangential=f"x{k}",
            rubbing=ss.RubbingMotion(velocity=velocity, cos={1: 0.5, 3: 0.1}),
        )
        for k in range(3)
    ]
    loads = [ss.Load(dof="x0", sin=force)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(6), units=UNITS, title="Chain", **more)


@cache
def branch(velocity: float = 0.0) -> ss.Branch:
    """The response of that chain."""
    return ss.forced_response(problem(velocity), omega=(5.0, 8.0))


def drawn(line: Any) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of a line."""
    x, y = line.get_data()
    return np.asarray(x), np.asarray(y)


def named(ax: Any) -> list[str]:
    """The names in the legend."""
    return [text.get_text() for text in ax.get_legend().get_texts()] if ax.get_legend() else []


def title(ax: Any) -> str:
    """The title of the figure."""
    return str(ax.figure.get_suptitle())
