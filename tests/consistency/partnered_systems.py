"""Random systems with structured partners: what symmetry, equal parts and whole ratios make, and random numbers never.

Equal contacts, commensurate frequencies, two equal halves, one harmonic alone, loads shifted in time; every dof has a
damping of its own, several of them are loaded, and some are felt by no contact, or hardly.
"""

from __future__ import annotations

import numpy as np

import slipstick as ss

RATIOS = [1.0, 1.5, 2.0, 3.0, 0.5, 4.0 / 3.0]


def frequencies(rng, n):
    """Natural frequencies of the dofs on their own: commensurate, equal in pairs, or any."""
    kind = rng.choice(["commensurate", "pairs", "any"])
    if kind == "commensurate":
        return np.sort(rng.choice(RATIOS, n))
    if kind == "pairs":
        return np.sort(np.repeat(rng.uniform(0.6, 3.0, n), 2)[:n])
    return np.sort(rng.uniform(0.6, 3.0, n))


def structure_of(rng, n):
    """Oscillators with couplings from none to strong; a damping ratio of its own for each mode."""
    own = frequencies(rng, n)
    K = np.diag(own**2)
    for i in range(n - 1):
        if rng.random() < 0.6:
            k = rng.choice([1e-4, 1e-2, 0.1, 0.5])
            K[i, i] += k
            K[i + 1, i + 1] += k
            K[i, i + 1] -= k
            K[i + 1, i] -= k
    squares, modes = np.linalg.eigh(K)
    ratios = 10.0 ** rng.uniform(-3.3, -1.0, n)
    C = modes @ np.diag(2 * ratios * np.sqrt(squares)) @ modes.T
    dofs = [f"d{i}" for i in range(n)]
    if rng.random() < 0.5:
        return ss.MatrixStructure(M=np.eye(n), C=C, K=K, dofs=dofs), np.sqrt(squares)
    modal = ss.ModalStructure(
        omega=np.sqrt(squares), mode_shapes=modes, static_compliance=np.linalg.inv(K), dofs=dofs, damping_ratio=ratios
    )
    return modal, np.sqrt(squares)


def contact_of(rng):
    """A law, whether its normal direction moves, and a rubbing motion."""
    kt, kn = rng.choice([0.3, 1.0, 5.0, 30.0]), rng.choice([0.5, 1.0, 5.0])
    moves = rng.random() < 0.3
    load = 10.0 ** rng.uniform(-1.5, 0.5)
    rubbing = ss.RubbingMotion(
        velocity=float(rng.choice([0.0, 0.0, 0.3, 3.0])), cos={1: 0.5} if rng.random() < 0.2 else {}
    )
    return ss.FrictionContact(kt=kt, mu=rng.choice([0.2, 0.5]), kn=kn, gap=-load / kn), moves, rubbing


def partnered_system(seed: int) -> tuple[ss.Problem, tuple[float, float], dict]:
    """Problem, range and options of a seed, always the same."""
    rng = np.random.default_rng([1016, seed])
    n = int(rng.integers(2, 6))
    structure, natural = structure_of(rng, n)
    count = int(rng.choice([1, 1, 2, 3]))
    law, moves, rubbing = contact_of(rng)
    pairs = []
    for j in range(count):
        if rng.random() < 0.3:  # else the same again
            law, moves, rubbing = contact_of(rng)
        at = structure.dofs[int(rng.integers(0, max(1, n - 1)))]
        across = {str(rng.choice(structure.dofs)): 1.0} if moves else None
        pairs.append(ss.ContactPair(name=f"c{j}", contact=law, tangential={at: 1.0}, normal=across, rubbing=rubbing))
    orders = [range(4), range(6), [0, 1, 3, 5], [0, 1], range(8)][int(rng.integers(0, 5))]
    highest = [m for m in (1, 1, 1, 2, 3) if m in list(orders)]
    shift = rng.choice([0.0, np.pi / 2, np.pi / 3, rng.uniform(0, 2 * np.pi)])
    loads = []
    for i in rng.choice(n, int(rng.integers(2, n + 1)), replace=False):
        m, size = int(rng.choice(highest)), 10.0 ** rng.uniform(-1.5, 0.5)
        loads.append(ss.Load(dof=f"d{i}", harmonic=m, cos=size * np.cos(m * shift), sin=size * np.sin(m * shift)))
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=orders, outputs=structure.dofs)
    low, high = natural[0] * rng.uniform(0.4, 0.9), natural[-1] * rng.uniform(1.05, 1.6)
    if rng.random() < 0.4:
        low, high = np.sort(rng.uniform(0.4, 3.5, 2))
        high = max(high, 1.1 * low)
    span = (float(low), float(high)) if rng.random() < 0.7 else (float(high), float(low))
    options = [{}, {}, {}, {"max_step": 0.1, "first_step": 0.05}, {"output_tolerance": 5e-5}][int(rng.integers(0, 5))]
    return problem, span, options
