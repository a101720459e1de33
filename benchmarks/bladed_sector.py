"""Seconds from mesh to curve of a bladed sector: matrices, phases, a wave with friction; then stored, from disk.

Of the wall, of the processor (all cores, so that other load shows), and the largest memory by then.

python benchmarks/bladed_sector.py [small | medium | large] [--cache FOLDER]
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from clocks import peak_memory

import slipstick as ss

ENGINE_ORDER = 4
HARMONICS = 6


def curve(size: str, cache: Path) -> None:
    """Once from mesh to curve, each stage with its seconds."""
    began = last = np.array([perf_counter(), process_time()])

    def told(what: str, since: np.ndarray | None = None) -> None:
        nonlocal last
        now = np.array([perf_counter(), process_time()])
        wall, processor = now - (last if since is None else since)
        memory = peak_memory()
        print(f"  {what:60s} {wall:8.2f} s, {processor:8.2f} s of processor, {memory:.2f} GB", flush=True)
        last = now

    model = ss.models.bladed_sector(size)
    told(f"mesh and matrices, {model.n_dofs} dofs")
    sector = ss.reduced_sector(
        model, surface="tip", contacts=4, between=("shroud_low", "shroud_high"), between_contacts=4,
        pressure="concave", loss_factor=1e-3, cache=cache,
    )  # fmt: skip
    told("faces paired, contact points")
    wave = sector.travelling_wave(ENGINE_ORDER)
    for k in sorted({h.nodal_diameter for h in wave.harmonics(range(HARMONICS + 1))}):
        n = sector.natural_frequencies(k).size
        told(f"nodal diameter {k}: {n} modes, complete: {sector.complete(k)}")
    first = sector.natural_frequencies(ENGINE_ORDER)[0]
    tip = ss.surface_contacts(
        sector, "tip", contact=ss.FrictionContact(kt=1e5, mu=0.3, normal_load=0.5), direction="circumferential",
        rubbing=ss.RubbingMotion(velocity=1.0),
    )  # fmt: skip
    shroud = ss.surface_contacts(
        sector, "shroud", contact=ss.FrictionContact(kt=1e5, mu=0.4, normal_load=1.0), direction="axial", between=True
    )
    problem = ss.Problem(
        wave, contacts=[*tip, *shroud], loads=[ss.Load(shape="pressure", harmonic=1, sin=20.0)],
        harmonics=ss.Harmonics(range(HARMONICS + 1)), outputs=["c1x", "c1y", "c1z"],
    )  # fmt: skip
    branch = ss.forced_response(problem, omega=(0.9 * first, 1.3 * first))
    told(f"curve of {branch.dataset.sizes['point']} points, {len(problem.contacts)} contacts: {branch.outcome}")
    told(f"from mesh to curve; largest amplitude {float(np.abs(branch.dataset.amplitude).max()):.4g} m", began)


def main() -> None:
    """Twice: the second time phases are read from disk."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("size", nargs="?", default="medium")
    parser.add_argument("--cache", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for what in ("computed", "stored"):
            print(f"{given.size}, {what}")
            curve(given.size, given.cache or Path(folder))


if __name__ == "__main__":
    main()
