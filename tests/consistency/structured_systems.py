"""Random systems with structured partners: what people type and what symmetry makes, each in several equal forms.

Equal contacts, commensurate frequencies, mirror symmetry, pure harmonics, round phases. A system is plain numbers, so
that the same system can be written in other units, at another start of the period, with all signs reversed, with its
contacts and dofs in another order, and with a contact as two of half the stiffness and half the load.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

import slipstick as ss

KINDS = ("plain", "equal", "commensurate", "symmetric", "pure", "round")


@dataclass(frozen=True, kw_only=True)
class Contact:
    """One friction contact; directions over the dofs (n,), rubbing by harmonic as cosine and sine."""

    kt: float
    mu: float
    kn: float
    gap: float
    tangential: np.ndarray
    normal: np.ndarray | None
    velocity: float
    motion: dict[int, tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class System:
    """Matrices (n, n), loads as (dof, harmonic, cosine, sine), contacts, and the range of frequencies."""

    M: np.ndarray
    C: np.ndarray
    K: np.ndarray
    names: tuple[str, ...]
    loads: tuple[tuple[int, int, float, float], ...]
    contacts: tuple[Contact, ...]
    orders: tuple[int, ...]
    span: tuple[float, float]

    @property
    def problem(self) -> ss.Problem:
        """The problem, with all dofs as outputs."""
        pairs = [
            ss.ContactPair(
                name=f"c{j}",
                contact=ss.FrictionContact(kt=c.kt, mu=c.mu, kn=c.kn, gap=c.gap),
                tangential=self._named(c.tangential),
                normal=None if c.normal is None else self._named(c.normal),
                rubbing=ss.RubbingMotion(
                    velocity=c.velocity,
                    cos={m: a for m, (a, _) in c.motion.items()},
                    sin={m: b for m, (_, b) in c.motion.items()},
                ),
            )
            for j, c in enumerate(self.contacts)
        ]
        loads = [ss.Load(dof=self.names[d], harmonic=m, cos=a, sin=b) for d, m, a, b in self.loads]
        structure = ss.MatrixStructure(M=self.M, C=self.C, K=self.K, dofs=list(self.names))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # few harmonics will do
            return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=self.orders, outputs=sorted(self.names))

    def _named(self, direction):
        return {self.names[i]: float(direction[i]) for i in np.flatnonzero(direction)}


def system(seed: int) -> System:
    """The system of a seed, always the same."""
    rng = np.random.default_rng([2026, seed])
    kind = KINDS[seed % len(KINDS)]
    n = int(rng.integers(2, 5))
    M, C, K, first = _structure(rng, n, kind)
    k = float(np.median(np.diag(K)))
    orders = tuple(range(int(rng.integers(3, 6))))
    order = 1
    if kind == "pure":
        order = int(rng.choice([1, 2, 3]))
        orders = tuple(order * m for m in ((0, 1, 2, 3), (0, 1, 3, 5), (0, 1, 3))[int(rng.integers(3))])
    level = 0.5 * k
    loads = []
    for i in rng.choice(n, int(rng.integers(1, 3)), replace=False):
        a, b = rng.normal(size=2)
        if kind in ("commensurate", "symmetric", "round"):
            phase = np.pi * rng.integers(0, 12) / rng.choice([1, 2, 3, 4])
            a, b = np.round([np.cos(phase), np.sin(phase)], 15)
        loads.append((int(i), order, level * float(a), level * float(b)))
    if kind == "symmetric":
        d, m, a, b = loads[0]
        loads = [(d, m, a, b), *([(n - 1 - d, m, a, b)] if n - 1 - d != d else [])]
    contacts = [_contact(rng, n, k, kind, orders) for _ in range(int(rng.choice([1, 1, 2, 3])))]
    if kind == "equal":
        contacts = [replace(c, kt=contacts[0].kt, mu=contacts[0].mu, kn=contacts[0].kn, gap=contacts[0].gap)
                    for c in contacts]  # fmt: skip
        contacts = [contacts[0], *contacts]
    if kind == "symmetric":
        contacts = [contacts[0], replace(contacts[0], tangential=contacts[0].tangential[::-1],
                    normal=None if contacts[0].normal is None else contacts[0].normal[::-1])]  # fmt: skip
    low = first / order * 10.0 ** rng.uniform(-0.35, -0.05)
    span = (float(low), float(low * 10.0 ** rng.uniform(0.15, 0.5)))
    return System(
        M=M, C=C, K=K, names=tuple(f"d{i}" for i in range(n)), loads=tuple(loads), contacts=tuple(contacts),
        orders=orders, span=span if rng.random() < 0.5 else span[::-1],
    )  # fmt: skip


def _structure(rng, n, kind):
    """Matrices and the lowest frequency."""
    ratio = 10.0 ** rng.uniform(-2.5, -1)
    M = np.diag(rng.uniform(0.5, 2.0, n))
    if kind == "commensurate":
        M = np.eye(n)
        Q, _ = np.linalg.qr(rng.normal(size=(n, n)))
        squares = 10.0 * rng.choice([1, 2, 3, 4, 5], n, replace=False).astype(float) ** 2
        K = Q @ np.diag(squares) @ Q.T
    elif kind == "symmetric":
        M = np.eye(n)
        K = 10.0 ** rng.integers(1, 4) * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    else:
        B = rng.normal(size=(n, n)) / np.sqrt(n)
        K = 10.0 ** rng.uniform(1, 4) * (B @ B.T + 0.05 * np.eye(n))
    root = np.diag(np.diag(M) ** -0.5)
    squares, vectors = np.linalg.eigh(root @ K @ root)
    shapes = root @ vectors
    C = M @ shapes @ np.diag(2 * ratio * np.sqrt(squares)) @ shapes.T @ M
    return M, C, K, float(np.sqrt(squares[0]))


def _contact(rng, n, k, kind, orders):
    tidy = kind in ("commensurate", "symmetric", "round")
    along, across = rng.choice(n, 2, replace=False)
    tangential, normal = np.zeros(n), None
    tangential[along] = 1.0
    if rng.random() < 0.3:
        tangential[across] = -1.0
    if rng.random() < 0.4:
        normal = np.zeros(n)
        normal[across] = float(rng.choice([-1.0, 1.0]))
    gap = rng.normal(-0.5, 0.5) if normal is not None else -(10.0 ** rng.uniform(-1.5, 0.5))
    kt, kn, mu = k * 10.0 ** rng.uniform(-1.5, 1), k * 10.0 ** rng.uniform(-1.5, 0.5), rng.uniform(0.1, 0.8)
    if tidy:
        kt, kn, mu = (
            float(k * rng.choice([0.1, 0.5, 1, 2])),
            float(k * rng.choice([0.1, 1])),
            float(rng.choice([0.3, 0.5])),
        )
        gap = float(rng.choice([-1.0, -0.5, -0.1, -2.0]))
    velocity, motion = 0.0, {}
    what = rng.choice(["none", "constant", "periodic", "both"], p=[0.5, 0.25, 0.15, 0.1])
    if what in ("constant", "both"):
        velocity = float(rng.choice([-1, 1]) * np.sqrt(k) * (1.0 if tidy else 10.0 ** rng.uniform(-2, 0.7)))
    if what in ("periodic", "both"):
        motion = {orders[1]: (1.0, 0.0) if tidy else (float(rng.normal()), float(rng.normal()))}
    return Contact(kt=float(kt), mu=float(mu), kn=float(kn), gap=float(gap), tangential=tangential, normal=normal,
                   velocity=velocity, motion=motion)  # fmt: skip


def in_units(s: System, length: float, force: float, time: float) -> System:
    """Numbers of the same system where the units are ``1/length`` and so on as large."""
    k = force / length
    contacts = [
        replace(c, kt=c.kt * k, kn=c.kn * k, gap=c.gap * length, velocity=c.velocity * length / time,
                motion={m: (a * length, b * length) for m, (a, b) in c.motion.items()})
        for c in s.contacts
    ]  # fmt: skip
    return replace(
        s, M=s.M * k * time**2, C=s.C * k * time, K=s.K * k, contacts=tuple(contacts),
        loads=tuple((d, m, a * force, b * force) for d, m, a, b in s.loads),
        span=(s.span[0] / time, s.span[1] / time),
    )  # fmt: skip


def shifted(s: System, by: float) -> System:
    """Seen from another start of the period."""

    def turned(m, a, b):
        return a * np.cos(m * by) + b * np.sin(m * by), b * np.cos(m * by) - a * np.sin(m * by)

    contacts = [replace(c, motion={m: turned(m, *ab) for m, ab in c.motion.items()}) for c in s.contacts]
    return replace(s, contacts=tuple(contacts), loads=tuple((d, m, *turned(m, a, b)) for d, m, a, b in s.loads))


def mirrored(s: System) -> System:
    """All coordinates of the other sign."""
    contacts = [
        replace(c, tangential=-c.tangential, normal=None if c.normal is None else -c.normal) for c in s.contacts
    ]
    return replace(s, contacts=tuple(contacts), loads=tuple((d, m, -a, -b) for d, m, a, b in s.loads))


def reordered(s: System, rng: np.random.Generator) -> System:
    """Dofs, loads and contacts in another order."""
    p = rng.permutation(len(s.names))
    at = np.argsort(p)
    contacts = [
        replace(c, tangential=c.tangential[p], normal=None if c.normal is None else c.normal[p]) for c in s.contacts
    ]
    loads = [(int(at[d]), *rest) for d, *rest in s.loads]
    return replace(
        s, M=s.M[np.ix_(p, p)], C=s.C[np.ix_(p, p)], K=s.K[np.ix_(p, p)], names=tuple(s.names[i] for i in p),
        contacts=tuple(contacts[i] for i in rng.permutation(len(contacts))),
        loads=tuple(loads[i] for i in rng.permutation(len(loads))),
    )  # fmt: skip


def halved(s: System, which: int) -> System:
    """One contact as two of half the stiffnesses, and so of half the load."""
    c = s.contacts[which]
    half = replace(c, kt=0.5 * c.kt, kn=0.5 * c.kn)
    return replace(s, contacts=(*s.contacts[:which], half, half, *s.contacts[which + 1 :]))
