"""An elastic pad on 30 friction contacts wears over a million cycles: seconds, steps, motions.

    OMP_NUM_THREADS=1 python benchmarks/wear.py [auto explicit implicit]

The pad is pressed more at one end, and vibrates to and fro; then it slides all the time beside. Its load goes over to
the contacts that wear less.
"""

from __future__ import annotations

import argparse
from time import perf_counter

import numpy as np

import slipstick as ss

CONTACTS, CYCLES, OMEGA = 30, 1e6, 30.0
KAPPA, VELOCITIES = 1e-5, (0.0, 2.0)
"""Gap opened per energy, and velocities of the opposing surface."""


def pad(velocity: float = 0.0, n: int = CONTACTS) -> ss.Problem:
    """Nodes with a tangential motion u and a normal one v, each tied to its neighbours, each on a contact."""
    ties = np.diff(np.eye(n), axis=0)
    chain = 4e3 * ties.T @ ties
    none = np.zeros((n, n))
    K = np.block([[chain + 20.0 / n * np.eye(n), none], [none, chain + 1.0 / n * np.eye(n)]])
    M = np.eye(2 * n) / n
    u, v = ([f"{name}{i}" for i in range(n)] for name in "uv")
    contact = ss.FrictionContact(kt=np.full(n, 2e3 / n), mu=0.3, kn=np.full(n, 3e3 / n), gap=0.0)
    feet = ss.ContactPair(
        name="foot", contact=contact, tangential=u, normal=v, rubbing=ss.RubbingMotion(velocity=velocity)
    )
    pressed = 100.0 / n * np.linspace(0.5, 1.5, n)
    loads = [ss.Load(dof=name, harmonic=0, cos=float(p)) for name, p in zip(v, pressed, strict=True)]
    loads += [ss.Load(dof=name, sin=60.0 / n) for name in u]
    structure = ss.MatrixStructure(M=M, C=0.4 * M + 1e-5 * K, K=K, dofs=[*u, *v])
    return ss.Problem(structure, contacts=feet, loads=loads, harmonics=range(4), outputs=["u0", "v0"])


def measure(velocity: float, method: str) -> str:
    """One line of what it took."""
    begin = perf_counter()
    branch = ss.wear(pad(velocity), KAPPA, (0.0, CYCLES), omega=OMEGA, method=method)
    seconds, d = perf_counter() - begin, branch.dataset
    depth, load = d["worn_depth"].to_numpy()[-1], d["normal_load"].to_numpy()
    worn = f"worn {depth.min():.3g} to {depth.max():.3g}"
    moved = f"loads {load[0].min():.3g} to {load[0].max():.3g}, then {load[-1].min():.3g} to {load[-1].max():.3g}"
    took = f"{d.attrs['wear_steps']} steps, {d.attrs['motions']} motions, {d.attrs['rejected_steps']} rejected"
    what = f"{CONTACTS} contacts, {CYCLES:g} cycles, velocity {velocity:g}, {method}"
    return f"{what}: {seconds:.1f} s, {took}; {worn}; {moved}; {branch.outcome.name}"


def main() -> None:
    """Ask for each method."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("methods", nargs="*", default=["auto"], help="auto, explicit, implicit")
    chosen = parser.parse_args()
    for method in chosen.methods:
        for velocity in VELOCITIES:
            print(measure(velocity, method), flush=True)


if __name__ == "__main__":
    main()
