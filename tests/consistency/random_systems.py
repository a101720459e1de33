"""Random systems, each with its own independent residual: what the continuation is tried on.

1 to 20 contacts, with and without normal directions (so with separation), rubbing constant, periodic, both or none,
structures by matrices and by modes with static compliance, light and moderate damping. The residual is written here with
numpy from the matrices or modes and ``contact_forces``; of the balance nothing is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import slipstick as ss


@dataclass(frozen=True)
class RandomSystem:
    """A problem, its range, and the numbers its structure was built from."""

    problem: ss.Problem
    span: tuple[float, float]
    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    modes: np.ndarray | None
    """Mass-normalised mode shapes kept (n, n_modes); None: matrices."""
    squares: np.ndarray
    ratio: float

    def receptance(self, w: float) -> np.ndarray:
        """Motion of all dofs by unit forces, (n, n), complex; real at 0."""
        if self.modes is None:
            return np.linalg.inv(self.K - w * w * self.M + 1j * w * self.C)
        rest = np.linalg.inv(self.K) - self.modes @ np.diag(1 / self.squares) @ self.modes.T
        natural = np.sqrt(self.squares)
        dynamic = 1 / (self.squares - w * w + 2j * self.ratio * natural * w)
        return rest + self.modes @ np.diag(dynamic) @ self.modes.T


def structure(rng, n):
    """A chain-like random structure, by matrices or by most of its modes."""
    M = np.diag(rng.uniform(0.5, 2.0, n))
    B = rng.normal(size=(n, n)) / np.sqrt(n)
    K = 10.0 ** rng.uniform(1, 4) * (B @ B.T + 0.05 * np.eye(n))
    root = np.diag(np.diag(M) ** -0.5)
    squares, vectors = np.linalg.eigh(root @ K @ root)
    shapes, dofs = root @ vectors, [f"d{i}" for i in range(n)]
    ratio = 10.0 ** rng.uniform(-3, -1)
    C = M @ shapes @ np.diag(2 * ratio * np.sqrt(squares)) @ shapes.T @ M
    if rng.random() < 0.5:
        return ss.MatrixStructure(M=M, C=C, K=K, dofs=dofs), dict(M=M, C=C, K=K, modes=None, squares=squares, ratio=0.0)
    kept = max(2, int(0.7 * n))
    modal = ss.ModalStructure(
        omega=np.sqrt(squares[:kept]), mode_shapes=shapes[:, :kept], static_compliance=np.linalg.inv(K), dofs=dofs,
        damping_ratio=ratio,
    )  # fmt: skip
    return modal, dict(M=M, C=C, K=K, modes=shapes[:, :kept], squares=squares[:kept], ratio=ratio)


def contact_pair(rng, name, tangential, normal, k, size):
    """A contact whose spring, load and rubbing are of the sizes of the structure's stiffness ``k`` and motion ``size``."""
    opens = normal is not None
    gap = size * (rng.normal(-0.5, 0.7) if opens else -(10.0 ** rng.uniform(-1.5, 1)))
    law = dict(
        kt=k * 10.0 ** rng.uniform(-1.5, 1.5), mu=rng.uniform(0.1, 0.8), kn=k * 10.0 ** rng.uniform(-1.5, 1), gap=gap
    )
    kind = rng.choice(["none", "constant", "periodic", "both"], p=[0.3, 0.35, 0.15, 0.2])
    speed = rng.choice([-1, 1]) * size * np.sqrt(k) * 10.0 ** rng.uniform(-2, 1)
    rubbing = ss.RubbingMotion(
        velocity=speed if kind in ("constant", "both") else 0.0,
        cos={1: size * rng.normal()} if kind in ("periodic", "both") else {},
        sin={2: 0.3 * size * rng.normal()} if kind == "both" else {},
    )
    return ss.ContactPair(
        name=name, contact=ss.FrictionContact(**law), tangential=tangential, normal=normal, rubbing=rubbing
    )


def contacts_count(rng):
    """Mostly few, up to 20."""
    return int(min(20, 1 + rng.geometric(0.3) - 1 + (rng.integers(0, 17) if rng.random() < 0.05 else 0)))


def random_system(seed: int) -> RandomSystem:
    """The system of a seed, always the same."""
    rng = np.random.default_rng([2012, seed])
    count = contacts_count(rng)
    n = int(rng.integers(max(2, count), max(4, 2 * count) + 1)) + 1
    body, numbers = structure(rng, n)
    k, first = float(np.median(np.diag(numbers["K"]))), float(np.sqrt(numbers["squares"][0]))
    dofs = [f"d{i}" for i in range(n)]
    loads = [ss.Load(dof=dofs[i], sin=k * rng.normal(), cos=k * rng.normal()) for i in rng.choice(n, min(n, 2), False)]
    pairs = []
    for j in range(count):
        t, other = (dofs[i] for i in rng.choice(n, 2, replace=False))
        tangential = {t: 1.0} if rng.random() < 0.6 else {t: 1.0, dofs[int(rng.integers(n))]: -0.7}
        normal = {other: float(rng.choice([-1.0, 1.0]))} if rng.random() < 0.6 else None
        pairs.append(contact_pair(rng, f"c{j}", tangential, normal, k, 1.0))
    harmonics = range(int(rng.integers(4, 8))) if count < 9 else range(5)
    problem = ss.Problem(body, contacts=pairs, loads=loads, harmonics=harmonics, outputs=dofs)
    low, high = np.sort(first * 10.0 ** rng.uniform(-0.5, 0.7, 2))
    span = (float(low), float(max(high, 1.3 * low)))
    return RandomSystem(problem, span if rng.random() < 0.5 else span[::-1], **numbers)


def independent_residual(system: RandomSystem, branch: ss.Branch, point: int) -> float:
    """Of displacement = receptance times (loads less contact forces), over the sizes of the terms."""
    problem, d = system.problem, branch.dataset.isel(point=point)
    h, omega = problem.harmonics, float(d.omega)
    place = {name: i for i, name in enumerate(problem.structure.dofs)}
    T, N = (np.zeros((len(problem.contacts), len(place))) for _ in range(2))
    for j, pair in enumerate(problem.contacts):
        for row, given in ((T[j], pair.tangential), (N[j], pair.normal or {})):
            for name, cosine in given.items():
                row[place[name]] += cosine
    q = d.displacement.to_numpy()
    F = np.zeros_like(q)
    for j, pair in enumerate(problem.contacts):
        forces = ss.contact_forces(pair.contact, h, T[j] @ q, N[j] @ q, omega=omega, rubbing=pair.rubbing)
        F += np.outer(T[j], forces.Fx) + np.outer(N[j], forces.Fy)
    P = np.zeros_like(q)
    for load in problem.loads:
        at = 1 + 2 * (load.harmonic - 1)
        P[place[load.dof], at] += load.cos
        P[place[load.dof], at + 1] += load.sin
    G = P - F
    wrong = np.zeros_like(q)
    size = np.linalg.norm(q)
    wrong[:, 0] = q[:, 0] - np.real(system.receptance(0.0)) @ G[:, 0]
    for m in range(1, len(h.orders)):
        A, c, s = system.receptance(m * omega), 2 * m - 1, 2 * m
        z = q[:, c] - 1j * q[:, s] - A @ (G[:, c] - 1j * G[:, s])
        wrong[:, c], wrong[:, s] = z.real, z.imag
    return float(np.linalg.norm(wrong) / size)
