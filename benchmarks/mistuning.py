"""Seconds of many samples of a disc of 24 blades that differ at random, with friction between neighbours.

    OMP_NUM_THREADS=1 python benchmarks/mistuning.py [--samples N] [--workers W] [--keep FILE.npz]

Sample i is the same whatever the number of samples and of workers: ``--against FILE.npz`` compares bit by bit with what
an earlier run kept.
"""

from __future__ import annotations

import argparse
import os
import warnings
from time import perf_counter, process_time

import numpy as np

import slipstick as ss
from slipstick.studies.mistuning import mistuning_study

SECTORS, OMEGA, SPREAD = 24, (345.0, 385.0), 0.02


def a_disc() -> ss.Problem:
    """That of the page on discs: a blade on a disc, a shroud contact between neighbours, engine order 4."""
    blade, disc, between = 4.0e4, 4.0e5, 1.5e5
    share = blade * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K0 = share + np.diag([0.0, disc + 2.0 * between])
    K1 = np.diag([0.0, -between])
    sector = ss.CyclicStructure(
        M=np.diag([0.3, 1.2]), K=(K0, K1), dofs=["tip", "disc"], sectors=SECTORS, loss_factor=2e-3
    )
    shroud = ss.ContactPair(
        name="shroud", contact=ss.FrictionContact(kt=4.0e3, mu=0.3, normal_load=10.0),
        tangential={"tip": 1.0, "tip@next": -1.0},
    )  # fmt: skip
    problem = ss.Problem(
        sector.travelling_wave(4), contacts=shroud, loads=ss.Load(dof="tip", amplitude=1.0), harmonics=[0, 1, 3],
        outputs=["tip"],
    )  # fmt: skip
    return sector.mistuned(blade=share).problem(problem)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", help="the study's own, so that a run that was stopped goes on")
    parser.add_argument("--keep", help="a file for deviations and amplitudes")
    parser.add_argument("--against", help="what an earlier run kept; its first samples are compared")
    asked = parser.parse_args()
    warnings.simplefilter("ignore", ss.SlipstickWarning)
    began, used = perf_counter(), process_time()
    found = mistuning_study(
        a_disc(), omega=OMEGA, spread=SPREAD, samples=asked.samples, seed=1, workers=asked.workers, folder=asked.folder,
        options={"output_step": 1.0},  # peaks are exact without the points drawn between
    )  # fmt: skip
    seconds = perf_counter() - began
    alone = f", {process_time() - used:.0f} s of processor time" if asked.workers == 1 else ""
    print(f"{asked.samples} samples, {asked.workers} workers, {os.cpu_count()} cores: {seconds:.0f} s{alone}")
    rows = zip(found.percentile.values, found.amplification_percentile.values, strict=True)
    percentiles = ", ".join(f"{p:g} %: {v:.4f}" for p, v in rows)
    print(f"{found.attrs['failed']} failed; amplification {percentiles}")
    print("largest", float(found.amplification.max()))
    numbers = {name: found[name].to_numpy() for name in ("deviation", "largest_amplitude", "omega", "worst")}
    if asked.keep:
        np.savez(asked.keep, **numbers)
    if asked.against:
        earlier, n = np.load(asked.against), asked.samples
        shorter = min(n, len(earlier["omega"]))
        equal = {
            name: bool(np.array_equal(v[:shorter], earlier[name][:shorter], equal_nan=v.dtype.kind == "f"))
            for name, v in numbers.items()
        }
        print(f"bit by bit equal in the first {shorter}:", equal)


if __name__ == "__main__":
    main()
