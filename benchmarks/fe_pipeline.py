"""From nothing to a reduced rubbing blade: seconds by stage, peak memory, error against the full model.

    OMP_NUM_THREADS=1 python benchmarks/fe_pipeline.py [--size large] [--modes 128] [--check 20] [--solver rslab]

Targets on two quiet cores for the large blade (at least 101 200 dofs): everything within 35 s, 128 modes within 25 s of
it, below 2.5 GB, read again in under 2 s, receptance right to 1e-7 up to five times the first resonance.
"""

from __future__ import annotations

import argparse
import resource
import tempfile
from time import perf_counter

import numpy as np

from slipstick.models.blade import BladeModel, finite_element_blade
from slipstick.models.blade_mesh import ELEMENT_SIZES, BladeShape
from slipstick.solve.linear.modes import StageProgress
from slipstick.structure.reduction.reduce import estimate_error, reduce_model


def peak() -> float:
    """Largest resident memory so far, GB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6


def show(event: StageProgress) -> None:
    print(f"\r  {event.stage} {event.done}/{event.total}, peak {peak():.2f} GB".ljust(70), end="", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", default="large", help="small, medium, large or an element size in metres")
    parser.add_argument("--modes", type=int, default=128, help="0: as many as 1e-7 needs up to 1 100 Hz")
    parser.add_argument("--check", type=int, default=0, help="frequencies at which the full model is solved directly")
    parser.add_argument("--solver", default=None)
    options = parser.parse_args()
    size = ELEMENT_SIZES.get(options.size) or float(options.size)

    began = perf_counter()
    whole = finite_element_blade(BladeModel(shape=BladeShape(element_size=size)))
    K, M = whole.model.K, whole.model.M
    assembled = perf_counter() - began
    print(f"{K.shape[0]} dofs, {K.nnz} entries; mesh, matrices and influence matrix {assembled:.1f} s")
    wanted = {"modes": options.modes} if options.modes else {"frequency_range": (0.0, 2.0 * np.pi * 1100.0)}
    with tempfile.TemporaryDirectory() as folder:
        request = {**whole.request, **wanted, "cache": folder, "solver": options.solver}
        reduction = reduce_model(K, M, listener=show, **request)
        total = perf_counter() - began
        print(f"\r  {reduction.solver}:", ", ".join(f"{name} {s:.1f} s" for name, s in reduction.seconds.items()))
        omega = reduction.structure.omega
        print(f"  {omega.size} modes, complete: {reduction.complete}, worst residual {reduction.residuals.max():.0e}")
        print(f"  everything {total:.1f} s, peak {peak():.2f} GB")
        again = reduce_model(K, M, **request)
        print(f"  read again in {again.seconds['reading the stored reduction']:.2f} s: {again.reused}")
    if options.check:
        frequencies = omega[0] * np.linspace(0.1, 5.0, options.check)
        errors = estimate_error(reduction, K, M, frequencies)
        print(f"  relative error at {options.check} frequencies up to 5 omega_1: at most {max(errors.values()):.1e}")


if __name__ == "__main__":
    main()
