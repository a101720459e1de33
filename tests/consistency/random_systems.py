"""Random systems, each with the numbers for a residual of its own: what the continuation is tried on.

1 to 20 contacts, with and without normal directions (so with separation), rubbing constant, periodic, both or none,
structures by matrices and by modes with static compliance, light and moderate damping; or contacts that slide in the
plane, most of them. The residual is written with numpy here from the matrices or modes and ``contact_forces``, in the
plane from a march in time; of the balance nothing is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from helpers.planar_march import marched

import slipstick as ss
from slipstick.contact.law import Motion


@dataclass(frozen=True, kw_only=True)
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

    def dynamic_stiffness(self, w):
        """Forces of all dofs for unit motions, (n, n), complex."""
        if self.modes is None:
            return self.K - w * w * self.M + 1j * w * self.C
        rest = np.linalg.inv(self.K) - self.modes @ np.diag(1 / self.squares) @ self.modes.T
        dynamic = 1 / (self.squares - w * w + 2j * self.ratio * np.sqrt(self.squares) * w)
        return np.linalg.inv(rest + self.modes @ np.diag(dynamic) @ self.modes.T)


def random_structure(rng, n):
    """A full random structure, by matrices or by most of its modes, and the numbers of it."""
    M = np.diag(rng.uniform(0.5, 2.0, n))
    B = rng.normal(size=(n, n)) / np.sqrt(n)
    K = 10.0 ** rng.uniform(1, 4) * (B @ B.T + 0.05 * np.eye(n))
    root = np.diag(np.diag(M) ** -0.5)
    squares, vectors = np.linalg.eigh(root @ K @ root)
    shapes, dofs = root @ vectors, [f"d{i}" for i in range(n)]
    ratio = 10.0 ** rng.uniform(-2.5, -1)
    C = M @ shapes @ np.diag(2 * ratio * np.sqrt(squares)) @ shapes.T @ M
    numbers = {"M": M, "C": C, "K": K, "modes": None, "squares": squares, "ratio": ratio}
    if rng.random() < 0.5:
        return ss.MatrixStructure(M=M, C=C, K=K, dofs=dofs), numbers
    kept = max(2, int(0.7 * n))
    modal = ss.ModalStructure(
        omega=np.sqrt(squares[:kept]), mode_shapes=shapes[:, :kept], static_compliance=np.linalg.inv(K), dofs=dofs,
        damping_ratio=ratio,
    )  # fmt: skip
    return modal, numbers | {"modes": shapes[:, :kept], "squares": squares[:kept]}


def random_pair(rng, name, dofs, k):
    """A contact whose springs, load and rubbing suit a structure of stiffness ``k`` and motions of about 1."""
    along, across = rng.choice(dofs, 2, replace=False)
    tangential = {str(along): 1.0} if rng.random() < 0.6 else {str(along): 1.0, str(rng.choice(dofs)): -0.7}
    normal = {str(across): float(rng.choice([-1.0, 1.0]))} if rng.random() < 0.6 else None
    gap = rng.normal(-0.5, 0.7) if normal else -(10.0 ** rng.uniform(-1.5, 1))
    kt, kn = k * 10.0 ** rng.uniform(-1.5, 1.5), k * 10.0 ** rng.uniform(-1.5, 1)
    kind = rng.choice(["none", "constant", "periodic", "both"], p=[0.3, 0.35, 0.15, 0.2])
    speed = rng.choice([-1, 1]) * np.sqrt(k) * 10.0 ** rng.uniform(-2, 1)
    rubbing = ss.RubbingMotion(
        velocity=speed if kind in ("constant", "both") else 0.0,
        cos={1: rng.normal()} if kind in ("periodic", "both") else {},
        sin={2: 0.3 * rng.normal()} if kind == "both" else {},
    )
    law = ss.FrictionContact(kt=kt, mu=rng.uniform(0.1, 0.8), kn=kn, gap=gap)
    return ss.ContactPair(name=name, contact=law, tangential=tangential, normal=normal, rubbing=rubbing)


def in_the_plane(rng, pair, dofs):
    """The pair with a second direction, along which it rubs too."""
    (along, *_), across = pair.tangential, pair.normal or {}
    second = str(rng.choice([dof for dof in dofs if dof not in (along, *across)]))
    law, v = pair.contact.values, pair.rubbing
    contact = ss.PlanarFrictionContact(kt=law["kt"], mu=law["mu"], kn=law["kn"], gap=law["gap"])
    turn = rng.normal(size=3)
    rubbing = ss.RubbingMotion(
        velocity=(v.velocity, turn[0] * v.velocity),
        cos={m: (c, turn[1] * c) for m, c in v.cos.items()},
        sin={m: (c, turn[2] * c) for m, c in v.sin.items()},
    )
    return ss.ContactPair(
        name=pair.name, contact=contact, tangential=(along, second), normal=pair.normal, rubbing=rubbing
    )


def random_system(seed: int, *, planar: bool = False) -> RandomSystem:
    """The system of a seed, always the same; one in thirty has many contacts. ``planar``: four in five slide in two
    directions."""
    rng = np.random.default_rng([2012, seed, 25] if planar else [2012, seed])
    count = int(rng.integers(6, 21)) if seed % 30 == 29 else int(min(20, rng.geometric(0.4)))
    n = int(rng.integers(count, 2 * count + 1)) + 2
    structure, numbers = random_structure(rng, n)
    k, first = float(np.median(np.diag(numbers["K"]))), float(np.sqrt(numbers["squares"][0]))
    loaded = rng.choice(n, 2, replace=False)
    loads = [ss.Load(dof=f"d{i}", sin=0.5 * k * rng.normal(), cos=0.5 * k * rng.normal()) for i in loaded]
    pairs = [random_pair(rng, f"c{j}", structure.dofs, k) for j in range(count)]
    if planar:
        pairs = [in_the_plane(rng, pair, structure.dofs) if rng.random() < 0.8 else pair for pair in pairs]
    harmonics = range(4) if count > 5 else range(int(rng.integers(4, 7)))
    problem = ss.Problem(structure, contacts=pairs, loads=loads, harmonics=harmonics, outputs=structure.dofs)
    low, high = np.sort(first * 10.0 ** rng.uniform(-0.4, 0.4, 2))
    span = (float(low), float(max(high, 1.3 * low)))
    return RandomSystem(problem=problem, span=span if rng.random() < 0.5 else span[::-1], **numbers)


def directions(system: RandomSystem):
    """Direction cosines of the contacts on the dofs: tangential, second (or nothing) and normal, (n_contacts, n)."""
    place = {name: i for i, name in enumerate(system.problem.structure.dofs)}
    T, S, N = (np.zeros((len(system.problem.contacts), len(place))) for _ in range(3))
    for j, pair in enumerate(system.problem.contacts):
        for row, port in ((T[j], "tangential"), (S[j], "second"), (N[j], "normal")):
            for name, cosine in (pair.direction(port) or {}).items():
                row[place[name]] += cosine
    return T, S, N


MOST_STEPS = 10_000
"""Of a march over a period, usually 500 in half a second."""


def planar_forces(pair: ss.ContactPair, h: ss.Harmonics, Q: np.ndarray, omega: float) -> np.ndarray:
    """Forces (3, L) along two directions and the normal one: friction marched in time, the normal force of the
    one-directional element. Where a contact never slips, its mean friction is one of many: the law's own."""
    law, rubbing = pair.contact, pair.rubbing
    values = {name: np.atleast_1d(float(value)) for name, value in law.values.items()}
    v = np.array([rubbing.velocity, rubbing.second_velocity]) / omega
    X = Q.copy()
    for i, (cos, sin) in enumerate(((rubbing.cos, rubbing.sin), (rubbing.second_cos, rubbing.second_sin))):
        for m, value in cos.items():
            X[i, 2 * m - 1] += value
        for m, value in sin.items():
            X[i, 2 * m] += value
    straight = ss.FrictionContact(**{name: float(value[0]) for name, value in values.items()})
    normal = ss.contact_forces(straight, h, X[0], X[2], omega=omega).Fy
    orders = np.arange(1, len(h.orders))
    numbers = np.array([[*v, *(values[name][0] for name in ("kt", "mu", "kn", "gap"))]])
    F, gap = marched(orders, X[None], numbers, most=MOST_STEPS)
    found = law.respond(Motion(h, 1.0, tuple(x[None] for x in X), np.array([*v, 0.0])[:, None]), values)
    if found.detail.stuck_all_period[0]:
        F[0, :, 0] = [found.force[i][0, 0] for i in (0, 1)]
    elif gap[0] > 1e-9 * np.abs(F).max():
        raise ValueError(f"the march of {pair.name} does not settle: {gap[0]:g}")
    return np.vstack([F[0], normal])


def independent_residual(system: RandomSystem, branch: ss.Branch, point: int) -> float:
    """Of the equilibrium of forces ``Z x + F - P`` of all dofs and harmonics, over the largest of its terms."""
    problem, d = system.problem, branch.dataset.isel(point=point)
    h, omega = problem.harmonics, float(d.omega)
    T, S, N = directions(system)
    q = d.displacement.to_numpy()
    G = np.zeros_like(q)
    for t, s, n, pair in zip(T, S, N, problem.contacts, strict=True):
        if isinstance(pair.contact, ss.PlanarFrictionContact):
            G += np.stack([t, s, n], axis=1) @ planar_forces(pair, h, np.stack([t @ q, s @ q, n @ q]), omega)
            continue
        forces = ss.contact_forces(pair.contact, h, t @ q, n @ q, omega=omega, rubbing=pair.rubbing)
        G += np.outer(t, forces.Fx) + np.outer(n, forces.Fy)
    for load in problem.loads:
        row = problem.structure.dofs.index(load.dof)
        G[row, 1] -= load.cos
        G[row, 2] -= load.sin
    wrong, size = [system.K @ q[:, 0] + G[:, 0]], [np.abs(system.K) @ np.abs(q[:, 0]), np.abs(G)]
    for m in range(1, len(h.orders)):
        Z, c, s = system.dynamic_stiffness(m * omega), 2 * m - 1, 2 * m
        wrong.append(Z @ (q[:, c] - 1j * q[:, s]) + G[:, c] - 1j * G[:, s])
        size.append(np.abs(Z) @ np.abs(q[:, c] - 1j * q[:, s]))
    return float(np.abs(wrong).max() / max(np.abs(term).max() for term in size))
