"""From nothing to a reduced rubbing blade: seconds by stage, peak memory, error against the full model.

OMP_NUM_THREADS=1 python benchmarks/fe_pipeline.py [--size large] [--modes 128] [--check 20] [--solver rslab]
"""

from __future__ import annotations

import argparse
import json
import tempfile
from time import perf_counter, process_time
from typing import Any

import numpy as np
from clocks import peak_memory

from slipstick.models.blade import BladeModel, finite_element_blade
from slipstick.models.blade_mesh import ELEMENT_SIZES, BladeShape
from slipstick.solve.linear.modes import StageProgress
from slipstick.structure.reduction.reduce import estimate_error, reduce_model


def measure(size: str, *, modes: int | None, solver: str | None = None, check: int = 0) -> dict[str, Any]:
    """One row of the table: seconds of processor time by stage, of the clock for everything."""
    began, clock = process_time(), perf_counter()
    element = ELEMENT_SIZES.get(size) or float(size)
    whole = finite_element_blade(BladeModel(shape=BladeShape(element_size=element)))
    K, M = whole.model.K, whole.model.M
    assembled = process_time() - began
    starts: dict[str, float] = {}

    def listen(event: StageProgress) -> None:
        starts.setdefault(event.stage, process_time())

    with tempfile.TemporaryDirectory() as folder:
        request = {**whole.request, **({} if modes is None else {"modes": modes}), "cache": folder, "solver": solver}
        reduction = reduce_model(K, M, listener=listen, **request)
        ended, everything, memory = process_time(), perf_counter() - clock, peak_memory()
        again = reduce_model(K, M, **request)
    stages = [name for name in reduction.seconds if name in starts]
    ends = [*(starts[name] for name in stages[1:]), ended]
    omega = reduction.structure.omega
    row = {
        "dofs": K.shape[0], "asked": "by accuracy" if modes is None else str(modes), "modes": omega.size,
        "matrices, s": assembled, **{f"{name}, s": end - starts[name] for name, end in zip(stages, ends, strict=True)},
        "everything, s": ended - began, "by the clock, s": everything,
        "GB": memory, "read again, s": again.seconds["reading the stored reduction"], "solver": reduction.solver,
        "complete": str(reduction.complete), "residual": float(reduction.residuals.max()),
    }  # fmt: skip
    if check:
        frequencies = omega[0] * np.linspace(0.1, 5.0, check)
        row["error to 5 omega_1"] = max(estimate_error(reduction, K, M, frequencies).values())
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="large", help="small, medium, large or an element size in metres")
    parser.add_argument("--modes", type=int, default=128, help="0: as many as the accuracy asks for")
    parser.add_argument("--check", type=int, default=0, help="frequencies at which the full model is solved directly")
    parser.add_argument("--solver", default=None)
    given = parser.parse_args()
    print(json.dumps(measure(given.size, modes=given.modes or None, solver=given.solver, check=given.check)))


if __name__ == "__main__":
    main()
