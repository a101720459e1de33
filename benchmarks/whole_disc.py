"""Seconds and memory of a whole disc with blades that differ: 90 sectors with 8 contacts each, by iterative Jacobians.

python benchmarks/whole_disc.py [--sectors N] [--contacts K] [--points P]
"""

from __future__ import annotations

import argparse
from time import perf_counter

import numpy as np
from clocks import peak_memory

import slipstick as ss

HARMONICS = (0, 1, 2, 3)


def a_disc(sectors: int, contacts: int) -> ss.Problem:
    """Chains of ``contacts + 1`` masses as blades, on a ring; shroud contacts with separation along them."""
    n = contacts + 1
    share = 4e4 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    share[0, 0] = 4e4
    K0 = share + 1e3 * np.eye(n)
    K0[-1, -1] += 4e5
    K1 = np.zeros((n, n))
    K1[-1, -1] = -1.5e5
    K0[-1, -1] += 3e5
    dofs = [f"p{i}" for i in range(contacts)] + ["disc"]
    sector = ss.CyclicStructure(M=np.eye(n) * 0.1, K=(K0, K1), dofs=dofs, sectors=sectors, loss_factor=2e-3)
    law = ss.FrictionContact(kt=2e3, mu=0.3, normal_load=2.0)
    across = [{f"p{i}": 1.0, f"p{i}@next": -1.0} for i in range(contacts)]
    shroud = ss.ContactPair(name="shroud", contact=law, tangential=across)
    problem = ss.Problem(
        sector.travelling_wave(6), contacts=shroud, loads=ss.Load(dof="p0", amplitude=20.0), harmonics=HARMONICS,
        outputs=["p0"],
    )  # fmt: skip
    return sector.mistuned(blade=share, spread=0.01, seed=3).problem(problem)


def main() -> None:
    """A few points by ``steady_response``, each with its seconds; then the deviations as a parameter."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sectors", type=int, default=90)
    parser.add_argument("--contacts", type=int, default=8)
    parser.add_argument("--points", type=int, default=3)
    asked = parser.parse_args()
    began = perf_counter()
    problem = a_disc(asked.sectors, asked.contacts)
    made = perf_counter()
    unknowns = asked.sectors * asked.contacts * problem.harmonics.size
    print(f"{unknowns} unknowns, {problem.structure.omega.size} modes, made in {made - began:.2f} s")
    first = float(problem.structure.natural_frequencies[0])
    omega = np.linspace(1.0, 1.06, asked.points) * first
    branch = ss.steady_response(problem, omega=omega, options={"jacobian": "iterative"})
    solved = perf_counter()
    print(branch.dataset.attrs.get("jacobian"), branch.message)
    print(f"{(solved - made) / asked.points:.2f} s a point of {asked.points}")
    print("largest amplitudes", branch.dataset.amplitude.values.max(axis=1))
    stuck = branch.dataset.stick_fraction.values if "stick_fraction" in branch.dataset else np.zeros(0)
    if stuck.size:
        print(f"contacts stuck all period: {np.mean(stuck > 1 - 1e-9):.2f}")
    print(f"memory {peak_memory():.2f} GB")


if __name__ == "__main__":
    main()
