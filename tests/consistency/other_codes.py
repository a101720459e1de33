"""Examples that other codes publish, rebuilt from their parameters, with the numbers that those codes give.

Numbers of NLvib: version 1.3, commit 69598c5 (22 February 2024), its functions run with GNU Octave 7.3; where a fold or
a peak is told, with steps 5 to 20 times smaller than in the example. Numbers of tmdsimpy: commit 17d5fc3 (7 February
2025), its examples run. Numbers of pyHarm: pyHarm-os 1.2.2. Equations and parameters alone were taken over.

``python tests/consistency/other_codes.py`` writes the tables of docs/other-codes.md again.
"""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from sampled_balance import Sampled, jenkins, worst
from scipy.linalg import eigh
from scipy.optimize import brentq, minimize_scalar

import slipstick as ss

PAGE = Path(__file__).parents[2] / "docs" / "other-codes.md"
Array = np.ndarray


@dataclass(frozen=True)
class Row:
    """One number: what it is, by the other code (0: a distance from truth), here, and how near it has to be."""

    what: str
    other: float
    here: float
    within: float

    def holds(self) -> bool:
        return abs(self.here - self.other) <= self.within * (abs(self.other) or 1.0)

    def text(self, others: int = 0) -> str:
        """A line of the page, for so many other points of its kind too."""
        if others:
            return replace(self, what=f"{self.what} (and {others} more)").text()
        if not self.other:
            return f"| {self.what} | exact | below {self.within:.0e} | |"
        digits = int(np.clip(np.ceil(-np.log10(self.within)) + 1, 4, 10))
        return f"| {self.what} | {self.other:#.{digits}g} | {self.here:#.{digits}g} | {self.within:.0e} |"


def quiet(make: Callable[[], ss.Branch]) -> ss.Branch:
    """Truncated on purpose, as the examples are."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)
        branch = make()
    assert branch.outcome.ok, branch.message
    return branch


def harmonic(branch: ss.Branch, dof: str, order: int = 1) -> Array:
    """Size of one harmonic at every point."""
    of = branch.dataset.displacement.sel(dof=dof)
    return np.hypot(of.sel(coefficient=f"c{order}"), of.sel(coefficient=f"s{order}")).values


def at(branch: ss.Branch, omega: float, values: Array, near: float) -> float:
    """The value, of those that the branch has at a requested frequency, next to another."""
    data = branch.dataset
    there = np.flatnonzero((data.kind.values != "interpolated") & (np.abs(data.omega.values - omega) < 1e-12 * omega))
    return float(values[there[np.argmin(np.abs(values[there] - near))]])


def folds(branch: ss.Branch) -> Array:
    data = branch.dataset
    return data.omega.values[data.kind.values == "turning point"]


def solved_points(branch: ss.Branch, every: int) -> Array:
    """Points that were solved for, folds apart: there the solution next to a point at its frequency is ill-posed."""
    kind = branch.dataset.kind.values
    return np.flatnonzero((kind != "interpolated") & (kind != "turning point"))[::every]


def cubic_spring(k3: float) -> ss.SampledLaw:
    return ss.SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": k3})


# NLvib 01


def duffing() -> ss.Problem:
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.05]], K=[[1.0]], dofs=["x"]),
        contacts=ss.ContactPair(name="spring", contact=cubic_spring(0.1), ports={"x": "x"}),
        loads=ss.Load(dof="x", cos=0.18),
        harmonics=range(8),
    )


def nlvib_01() -> Iterator[Row]:
    points = {  # frequency: first and third harmonic
        1.0778436254550987: (1.802118620793593, 0.016315642899098426),
        1.2632188742994428: (2.758513158234597, 0.042969945211996596),
        1.1510938594585913: (1.7919599324994413, 0.013775223248188972),
    }
    branch = quiet(lambda: ss.forced_response(duffing(), omega=(0.5, 1.6), at=list(points)))
    for name, other, here in zip(("upper", "lower"), (1.26960463, 1.11570012), folds(branch), strict=True):
        yield Row(f"frequency of the {name} fold", other, here, 3e-6)
    for omega, (first, third) in points.items():
        one = at(branch, omega, harmonic(branch, "x"), first)
        yield Row(f"harmonic 1 at {omega:.6f}", first, one, 1e-6)
        yield Row(f"harmonic 3 at {omega:.6f}", third, at(branch, omega, harmonic(branch, "x", 3), third), 3e-6)
    one = np.eye(1)
    truth = Sampled(
        M=one,
        C=0.05 * one,
        K=one,
        force=lambda x, v: 0.1 * x**3,
        load=load(1, 8, {(0, 1): 0.18}),
        orders=range(8),
        samples=64,
    )
    distance = worst(truth, branch.dataset, solved_points(branch, 1))
    yield Row("farthest solved point from the sampled balance", 0.0, distance, 1e-8)


# NLvib 02


def two_cubic_springs() -> ss.Problem:
    structure = ss.MatrixStructure(
        M=np.diag([1.0, 0.05]),
        C=[[0.015, -0.013], [-0.013, 0.013]],
        K=[[1.0453, -0.0453], [-0.0453, 0.0453]],
        dofs=["q1", "q2"],
    )
    ground = ss.ContactPair(name="ground", contact=cubic_spring(1.0), ports={"x": "q1"})
    between = ss.ContactPair(name="between", contact=cubic_spring(0.0042), ports={"x": {"q1": 1.0, "q2": -1.0}})
    return ss.Problem(structure, contacts=[ground, between], loads=ss.Load(dof="q1", cos=0.11), harmonics=range(8))


def nlvib_02() -> Iterator[Row]:
    peaks = {1.026997389363902: 0.418505269439858, 1.2104264955017008: 0.4090457946434794}
    branch = quiet(lambda: ss.forced_response(two_cubic_springs(), omega=(0.8, 1.4), at=list(peaks)))
    for name, other, here in zip(("upper", "lower"), (1.214626225, 1.206219457), folds(branch), strict=True):
        yield Row(f"frequency of the {name} fold", other, here, 1e-8)
    rms = np.sqrt((branch.dataset.displacement.sel(dof="q1").values ** 2).sum(axis=1) / 2.0)
    for omega, other in peaks.items():
        yield Row(f"largest rms near {omega:.4f}", other, at(branch, omega, rms, other), 1e-8)
    force = lambda x, v: np.stack(  # noqa: E731
        [
            x[..., 0, :] ** 3 + 0.0042 * (x[..., 0, :] - x[..., 1, :]) ** 3,
            -0.0042 * (x[..., 0, :] - x[..., 1, :]) ** 3,
        ],
        axis=-2,
    )
    s = two_cubic_springs().structure
    truth = Sampled(M=s.M, C=s.C, K=s.K, force=force, load=load(2, 8, {(0, 1): 0.11}), orders=range(8), samples=64)
    yield Row(
        "farthest solved point from the sampled balance",
        0.0,
        worst(truth, branch.dataset, solved_points(branch, 1)),
        1e-8,
    )


def load(dofs: int, orders: int, entries: dict[tuple[int, int], float]) -> Array:
    """Coefficients of a load, (dofs, L)."""
    p = np.zeros((dofs, 2 * orders - 1))
    for place, value in entries.items():
        p[place] = value
    return p


# NLvib 03


def stop() -> ss.Problem:
    """A frictionless stop; the tangential direction that a contact has is that of a mass by itself, which rests."""
    K = np.zeros((3, 3))
    K[:2, :2], K[2, 2] = [[1.0, -1.0], [-1.0, 2.0]], 1.0
    structure = ss.MatrixStructure(M=np.eye(3), C=0.03 * K, K=K, dofs=["q1", "q2", "rest"])
    contact = ss.FrictionContact(kt=1e-3, mu=0.0, kn=100.0, gap=1.0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ss.SlipstickWarning)  # no friction, which is meant
        pair = ss.ContactPair(name="stop", contact=contact, tangential="rest", normal="q1")
        return ss.Problem(structure, contacts=pair, loads=ss.Load(dof="q2", cos=0.1), harmonics=range(22))


def nlvib_03() -> Iterator[Row]:
    points = {  # first harmonic of q1 and q2
        0.6611120872515285: (0.8242807027658885, 0.46421010724073614),
        0.7311463323124531: (1.1117359358399947, 0.6949500670612714),
        0.7477686958494909: (1.2970429376318278, 0.932733185027638),
        0.7112491202415006: (1.1161250315993143, 0.8087381885807144),
        0.5826782201532196: (0.9992927689864047, 0.6614570495510199),
    }
    branch = quiet(lambda: ss.forced_response(stop(), omega=(0.5, 0.8), at=list(points), peaks_of=["q1", "q2"]))
    for omega, values in points.items():
        for dof, other in zip(("q1", "q2"), values, strict=True):
            here = at(branch, omega, harmonic(branch, dof), other)
            yield Row(f"harmonic 1 of {dof} at {omega:.6f}", other, here, 2e-4)
    yield Row("frequency of the upper fold, by shooting", 0.75562844, folds(branch).max(), 1e-5)
    force = lambda x, v: np.stack([100.0 * np.maximum(x[..., 0, :] - 1.0, 0.0), 0.0 * x[..., 1, :]], axis=-2)  # noqa: E731
    K = np.array([[1.0, -1.0], [-1.0, 2.0]])
    p = load(2, 22, {(1, 1): 0.1})
    truth = Sampled(M=np.eye(2), C=0.03 * K, K=K, force=force, load=p, orders=range(22), samples=8192)
    away = np.abs(branch.dataset.omega.values - folds(branch).max()) > 5e-3  # of the fold, which magnifies samples
    points_away = [p for p in solved_points(branch, 12) if away[p]]
    data = branch.dataset.sel(dof=["q1", "q2"])
    yield Row("farthest solved point from the sampled balance", 0.0, worst(truth, data, points_away), 1e-4)


# NLvib 05


def friction_mode(law: ss.SampledLaw | ss.FrictionContact) -> ss.Problem:
    where = {"tangential": "q1"} if isinstance(law, ss.FrictionContact) else {"ports": {"x": "q1"}}
    return ss.Problem(
        ss.MatrixStructure(
            M=np.diag([0.02, 1.0]), C=np.zeros((2, 2)), K=[[40.0, -40.0], [-40.0, 640.0]], dofs=["q1", "q2"]
        ),
        contacts=ss.ContactPair(name="friction", contact=law, **where),
        loads=[],
        harmonics=range(22),
    )


def smoothed(eps: float) -> ss.SampledLaw:
    """Dry friction of limit 5 smoothed over the velocity eps."""
    return ss.SampledLaw(
        force=lambda x, velocity, limit, eps: limit * np.tanh(velocity / eps),
        parameters={"limit": 5.0, "eps": eps},
        samples=4096,
    )


def damping_at(branch: ss.Branch, amplitude: float, dof: str) -> dict[str, float]:
    """Frequency and damping ratio of a mode at a size of harmonic 1, by a cubic through the four points about it."""
    a, data = np.log(harmonic(branch, dof) / amplitude), branch.dataset
    k = int(np.flatnonzero(np.diff(np.sign(a)))[0])
    near = slice(k - 1, k + 3)
    return {
        name: float(np.polyval(np.polyfit(a[near], data[name].values[near], 3), 0.0))
        for name in ("omega", "modal_damping")
    }


SMOOTHED = {  # size of harmonic 1 of q2: frequency, damping ratio; eps = 0.05
    0.29470290624524254: (24.23238414724026, 0.024835337433617054),
    0.5153641327014544: (24.180397573786966, 0.014318808382863295),
    1.9017556883282976: (24.157949012933976, 0.0038937038613170625),
}
SHARPER = {  # eps = 0.00625
    0.29646956936288366: (24.231139096211216, 0.024693231963336268),
    0.4807849675261939: (24.184096595868255, 0.01533969552399947),
    1.91218542503459: (24.157894929074107, 0.003872511756842259),
}


def nlvib_05() -> Iterator[Row]:
    """The same smoothed law, and dry friction itself behind a stiff contact, which both tend to."""

    def mode(law: ss.SampledLaw | ss.FrictionContact) -> ss.Branch:
        # from where it slides, towards where it sticks
        return quiet(lambda: ss.nonlinear_modes(friction_mode(law), amplitude=(3.0, 0.17), dof="q2"))

    branch = mode(smoothed(0.05))
    for size, (omega, damping) in SMOOTHED.items():
        found = damping_at(branch, size, "q2")
        yield Row(f"smoothed: frequency at {size:.4f}", omega, found["omega"], 2e-6)
        yield Row(f"smoothed: damping ratio at {size:.4f}", damping, found["modal_damping"], 2e-5)
    for kt, within in ((4e3, 2e-2), (4e4, 6e-3), (4e5, 2e-3)):
        branch = mode(ss.FrictionContact(kt=kt, mu=0.5, normal_load=10.0))
        for size, (_, damping) in SHARPER.items():
            found = damping_at(branch, size, "q2")
            yield Row(f"dry, kt = {kt:.0e}: damping ratio at {size:.4f}", damping, found["modal_damping"], within)


# NLvib 06


def curved_springs(level: float) -> ss.Problem:
    """Two linear springs on a mass that moves in a plane, their geometry to third order."""
    w1, w2 = 1.13**2, 2.0**2

    def force(q, velocity, w1, w2):
        x, y = q
        both = 0.5 * (w1 + w2) * (x * x + y * y)
        return (
            1.5 * w1 * x * x + w2 * x * y + 0.5 * w1 * y * y + both * x,
            0.5 * w2 * x * x + w1 * x * y + 1.5 * w2 * y * y + both * y,
        )

    law = ss.SampledLaw(force=force, parameters={"w1": w1, "w2": w2}, ports=("x", "y"))
    structure = ss.MatrixStructure(M=np.eye(2), C=np.diag([0.00226, 0.02]), K=np.diag([w1, w2]), dofs=["x", "y"])
    return ss.Problem(
        structure,
        contacts=ss.ContactPair(name="springs", contact=law, ports={"x": "x", "y": "y"}),
        loads=[ss.Load(dof="x", cos=level), ss.Load(dof="y", cos=level)],
        harmonics=range(8),
    )


def nlvib_06() -> Iterator[Row]:
    levels = {  # folds, and frequency and size of the largest first harmonic
        3e-4: ((), 1.1310111134, 0.0948373375),
        5e-4: ((), 1.1310574292, 0.1345604202),
        1e-3: ((1.1273426667, 1.1285468485), 1.1275246355, 0.2020248498),
        3e-3: ((1.0879265918, 1.1229918022), 1.0880576322, 0.3279894386),
    }
    for level, (turns, omega, size) in levels.items():
        branch = quiet(lambda: ss.forced_response(curved_springs(level), omega=(1.16, 1.08), at=omega))  # noqa: B023
        for other, here in zip(sorted(turns), sorted(folds(branch)), strict=True):
            yield Row(f"load {level:.4f}: fold", other, here, 3e-8)
        yield Row(
            f"load {level:.4f}: harmonic 1 at {omega:.6f}", size, at(branch, omega, harmonic(branch, "x"), size), 3e-7
        )


# tmdsimpy, two dofs with a cubic spring


def volvert() -> ss.Problem:
    """Volvert and Kerschen (2021), Journal of Sound and Vibration 511, 116355."""
    return ss.Problem(
        ss.MatrixStructure(
            M=np.eye(2), C=[[0.02, -0.01], [-0.01, 0.11]], K=[[2.0, -1.0], [-1.0, 2.0]], dofs=["x1", "x2"]
        ),
        contacts=ss.ContactPair(name="spring", contact=cubic_spring(1.0), ports={"x": "x1"}),
        loads=ss.Load(dof="x1", sin=1.5),
        harmonics=range(9),
    )


def tmdsimpy_duffing() -> Iterator[Row]:
    points = {
        0.6006717629890127: 0.9315275660918014,
        0.6454113667714142: 0.7044863136699597,
        0.8384099453097716: 1.036466782766176,
        1.2684030962292847: 1.6786616051170649,
        1.2814863408243669: 1.3771257253830251,
    }
    branch = quiet(lambda: ss.forced_response(volvert(), omega=(0.5, 1.4), at=list(points)))
    for i, other in enumerate((0.647165, 0.643574, 1.284113, 1.275534)):
        yield Row(f"fold {i + 1} along the curve", other, folds(branch)[i], 1e-6)
    for omega, other in points.items():
        yield Row(f"harmonic 1 at {omega:.6f}", other, at(branch, omega, harmonic(branch, "x1"), other), 1e-8)


# tmdsimpy, friction under a normal load that vibrates


def elastic_friction(level: float) -> ss.Problem:
    structure = ss.MatrixStructure(
        M=np.eye(2), C=np.diag([0.1 * np.sqrt(12.0), 2.0]), K=np.diag([12.0, 21.0]), dofs=["t", "n"]
    )
    contact = ss.FrictionContact(kt=5.0, kn=21.0, mu=0.85, gap=0.0)
    return ss.Problem(
        structure,
        contacts=ss.ContactPair(name="foot", contact=contact, tangential="t", normal="n"),
        loads=[ss.Load(dof="n", harmonic=0, cos=100.0), ss.Load(dof="t", cos=level), ss.Load(dof="n", cos=0.1 * level)],
        harmonics=range(9),
    )


def sampled_friction(level: float, samples: int = 4096) -> Sampled:
    def force(x: Array, v: Array) -> Array:
        normal = 21.0 * np.maximum(x[..., 1, :], 0.0)
        return np.stack([jenkins(x[..., 0, :], 5.0, 0.85 * normal), normal], axis=-2)

    p = load(2, 9, {(1, 0): 100.0, (0, 1): level, (1, 1): 0.1 * level})
    C, K = np.diag([0.1 * np.sqrt(12.0), 2.0]), np.diag([12.0, 21.0])
    return Sampled(M=np.eye(2), C=C, K=K, force=force, load=p, orders=range(9), samples=samples)


def tmdsimpy_friction() -> Iterator[Row]:
    levels = {
        1.0: {3.468136546959468: 0.19549892741266425, 4.120729387576479: 0.7004778252732047},
        25.0: {3.8777383517728374: 9.67351681516513, 4.031787732086851: 10.522618400640015},
        80.0: {3.0742209123666036: 11.628750521590483, 3.6216130929127672: 31.946620069412035},
        300.0: {1.1531798645953915: 25.29426081950436, 3.485669763038983: 205.0953598050209},
    }
    for level, points in levels.items():
        branch = quiet(lambda: ss.forced_response(elastic_friction(level), omega=(0.5, 6.0), at=list(points)))  # noqa: B023
        within = 1e-9 if level == 1.0 else 2e-4
        for omega, other in points.items():
            here = at(branch, omega, harmonic(branch, "t"), other)
            yield Row(f"load {level:.0f}: harmonic 1 at {omega:.6f}", other, here, within)
        if level > 25.0:  # what slips, whose mean traction is then unique
            slips = branch.dataset.slip_fraction.values[:, 0] > 0.0
            points_ = [p for p in solved_points(branch, 8) if slips[p]]
            distance = worst(sampled_friction(level), branch.dataset, points_)
            yield Row(f"load {level:.0f}: farthest solved point from the sampled balance", 0.0, distance, 1e-6)


# tmdsimpy, Iwan element


def iwan(level: float) -> ss.Problem:
    """A hundred sliders in parallel, the middle points of Segalman's density with chi = -0.5, beta = 0."""
    kt, limit, chi, n = 0.25, 0.2, -0.5, 100
    share = (chi + 1.0) / (chi + 2.0)
    largest = limit / kt / share
    d = largest / n
    phi = (np.arange(n) + 0.5) * d
    k = limit * (chi + 1.0) / largest ** (chi + 2.0) / share * phi**chi * d
    sliders = [
        ss.ContactPair(
            name=f"slider{i}", contact=ss.FrictionContact(kt=k[i], mu=1.0, normal_load=k[i] * phi[i]), tangential="x"
        )
        for i in range(n)
    ]
    return ss.Problem(
        ss.MatrixStructure(M=[[1.0]], C=[[0.01]], K=[[0.75]], dofs=["x"]),
        contacts=sliders,
        loads=ss.Load(dof="x", cos=level),
        harmonics=range(4),
    )


def tmdsimpy_iwan() -> Iterator[Row]:
    levels = {  # frequency: first and third harmonic
        3.3: {
            0.25: (4.555383300733205, 0.19434649846406582),
            0.29: (4.777343258681808, 0.714661236371127),
            0.30: (4.86215001255028, 0.9755958181214951),
            0.31: (4.836084520245623, 0.49780100053450993),
        },
        38.0: {
            0.25: (55.18552693199945, 0.4343393406078161),
            0.29: (57.09521633177285, 6.859912212039438),
            0.30: (57.519719474352584, 1.3476307978233648),
        },
    }
    for level, points in levels.items():
        branch = quiet(lambda: ss.forced_response(iwan(level), omega=(0.24, 0.32), at=list(points)))  # noqa: B023
        for omega, (first, third) in points.items():
            one, three = (at(branch, omega, harmonic(branch, "x", m), v) for m, v in ((1, first), (3, third)))
            yield Row(f"load {level:.1f}: harmonic 1 at {omega:.2f}", first, one, 1e-6)
            yield Row(f"load {level:.1f}: harmonic 3 at {omega:.2f}", third, three, 4e-5)


# pyHarm, ring damper under a bladed disc

SECTORS, RING_STIFFNESS, RING_MASS = 24, 1e7, 2e-3


def ring_matrices() -> tuple[Array, Array, Array, float]:
    """M, C, K of (disc, blade, tip) of each sector and then the ring, and the first frequency with one diameter."""
    turn = np.roll(np.eye(SECTORS), 1, axis=1)
    around = 2.0 * np.eye(SECTORS) - turn - turn.T
    sector = np.array([[1.6e6, -1e6, 0.0], [-1e6, 3e6, -2e6], [0.0, -2e6, 2e6]])
    M = np.kron(np.eye(SECTORS), np.diag([1.2, 0.35, 0.25]))
    K = np.kron(np.eye(SECTORS), sector) + np.kron(around, np.diag([5e7, 0.0, 0.0]))
    squares, modes = eigh(K, M)
    frequencies = np.sqrt(squares)
    C = M @ modes @ np.diag(2e-3 * frequencies) @ modes.T @ M
    ring = RING_STIFFNESS * (around + 1e-3 * np.eye(SECTORS))

    def beside(disc: Array, damper: Array) -> Array:
        return np.block([[disc, np.zeros((disc.shape[0], SECTORS))], [np.zeros((SECTORS, disc.shape[0])), damper]])

    none = np.zeros((SECTORS, SECTORS))
    return beside(M, RING_MASS * np.eye(SECTORS)), beside(C, none), beside(K, ring), float(frequencies[1])


def friction_ring() -> ss.Problem:
    """Normal loads as by the ring's weight on a radius of 0.1 at half the frequency of the mode."""
    M, C, K, omega = ring_matrices()
    names = [f"{part}{n}" for n in range(SECTORS) for part in ("disc", "blade", "tip")]
    contact = ss.FrictionContact(kt=10.0 * RING_STIFFNESS, mu=0.1, normal_load=RING_MASS * 0.1 * (0.5 * omega) ** 2)
    return ss.Problem(
        ss.MatrixStructure(M=M, C=C, K=K, dofs=[*names, *(f"ring{n}" for n in range(SECTORS))]),
        contacts=[
            ss.ContactPair(name=f"ring{n}", contact=contact, tangential={f"ring{n}": 1.0, f"disc{n}": -1.0})
            for n in range(SECTORS)
        ],
        loads=[ss.Load(dof=f"tip{n}", amplitude=1.0, phase=2.0 * np.pi * n / SECTORS) for n in range(SECTORS)],
        harmonics=[0, 1],
    )


def travelling_wave() -> Callable[[float], float]:
    """The tip's amplitude over the frequency, by one sector and the describing function of a Masing loop."""
    M, C, K, omega = ring_matrices()
    limit, kt = 0.1 * RING_MASS * 0.1 * (0.5 * omega) ** 2, 10.0 * RING_STIFFNESS
    phase = np.exp(2j * np.pi * np.arange(SECTORS) / SECTORS) / np.sqrt(SECTORS)
    wave = np.zeros((4 * SECTORS, 4), dtype=complex)
    for part in range(3):
        wave[part : 3 * SECTORS : 3, part] = phase
    wave[3 * SECTORS :, 3] = phase
    m, c, k = (wave.conj().T @ matrix @ wave for matrix in (M, C, K))
    relative = np.array([-1.0, 0.0, 0.0, 1.0])

    def stiffness(a: float) -> complex:
        if kt * a <= limit:
            return kt
        angle = np.arccos(1.0 - 2.0 * limit / (kt * a))
        stored = kt / np.pi * (angle - 0.5 * np.sin(2.0 * angle))
        return stored + 4j * limit / (np.pi * a) * (1.0 - limit / (kt * a))

    def motion(a: float, omega: float) -> Array:
        dynamic = k + 1j * omega * c - omega**2 * m + stiffness(a) * np.outer(relative, relative)
        return np.linalg.solve(dynamic, [0.0, 0.0, 1.0, 0.0])

    def tip(omega: float) -> float:
        def excess(a: float) -> float:
            return abs(relative @ motion(a, omega)) - a

        return abs(motion(brentq(excess, 1e-12, 1e-3, xtol=1e-20, rtol=1e-14), omega)[2])

    return tip


def pyharm_ring() -> Iterator[Row]:
    pyharm = {1079.3: 6.637865488058117e-05, 1081.4: 6.692979773953183e-05, 1082.6: 6.675922221158015e-05}
    omega = ring_matrices()[3]
    tip = travelling_wave()
    span = (0.95 * omega, 1.1 * omega)
    branch = quiet(lambda: ss.forced_response(friction_ring(), omega=span, at=list(pyharm), peaks_of=["tip0"]))
    sizes, data = harmonic(branch, "tip0"), branch.dataset
    for place, other in pyharm.items():
        yield Row(f"amplitude at {place:.1f}", other, at(branch, place, sizes, other), 2e-3)
    exact = np.array([tip(w) for w in data.omega.values])
    solved = data.kind.values != "interpolated"
    yield Row(
        "farthest solved point from the closed form",
        0.0,
        float(np.abs(sizes - exact)[solved].max() / exact.max()),
        1e-8,
    )
    top = data.omega.values[np.argmax(exact)]
    best = minimize_scalar(lambda w: -tip(w), bounds=(top - 2.0, top + 2.0), method="bounded", options={"xatol": 1e-7})
    ((place, size),) = branch.peaks("tip0")
    yield Row("frequency of the peak, closed form", best.x, place, 1e-7)
    yield Row("amplitude of the peak, closed form", -best.fun, size, 1e-9)
    around = np.array([harmonic(branch, f"tip{n}") for n in range(SECTORS)])
    yield Row("largest difference between blades", 0.0, float(np.ptp(around, axis=0)[solved].max() / exact.max()), 1e-8)


# Jeffcott rotor on its stator

DAMPING, SHAFT, CLEARANCE = 0.05, 0.04, 1.05


def jeffcott(mu: float) -> ss.Problem:
    """Lengths over the eccentricity, time by the stator's stiffness; the rotor turns from x to y and is held back."""

    def force(q, velocity, clearance, mu):
        x, y = q
        r = np.sqrt(x * x + y * y)
        touches = r.real > clearance
        share = np.where(touches, 1.0 - clearance / np.where(touches, r, 1.0), 0.0)
        return share * (x - mu * y), share * (y + mu * x)

    law = ss.SampledLaw(force=force, parameters={"clearance": CLEARANCE, "mu": mu}, ports=("x", "y"))
    eye = np.eye(2)
    return ss.Problem(
        ss.MatrixStructure(M=eye, C=2.0 * DAMPING * eye, K=SHAFT * eye, dofs=["x", "y"]),
        contacts=ss.ContactPair(name="stator", contact=law, ports={"x": "x", "y": "y"}),
        loads=[  # unbalance: a load that grows with the square of the frequency
            ss.Load(base={"x": 1.0}, motion="displacement", cos=1.0),
            ss.Load(base={"y": 1.0}, motion="displacement", sin=1.0),
        ],
        harmonics=range(4),
    )


def whirl(omega: float, mu: float) -> list[float]:
    """All radii of circular whirl: ``(beta - W^2 + 2 i zeta W) R + (1 + i mu)(R - R0) = W^2 e^(-i phi)`` in contact."""
    free = omega**2 / abs(SHAFT - omega**2 + 2j * DAMPING * omega)
    real, imaginary = SHAFT - omega**2 + 1.0, 2.0 * DAMPING * omega + mu
    radii = np.roots(
        [
            real**2 + imaginary**2,
            -2.0 * CLEARANCE * (real + mu * imaginary),
            CLEARANCE**2 * (1.0 + mu**2) - omega**4,
        ]
    )
    touching = [float(r.real) for r in radii if abs(r.imag) < 1e-12 and r.real >= CLEARANCE]
    return touching + ([free] if free < CLEARANCE else [])


def last_contact(mu: float, near: float) -> float:
    """The frequency where two radii in contact meet."""

    def discriminant(omega: float) -> float:
        real, imaginary = SHAFT - omega**2 + 1.0, 2.0 * DAMPING * omega + mu
        size = real**2 + imaginary**2
        return (CLEARANCE * (real + mu * imaginary)) ** 2 - size * (CLEARANCE**2 * (1.0 + mu**2) - omega**4)

    return float(brentq(discriminant, near - 1e-3, near + 1e-3, xtol=1e-15))


def jeffcott_rub() -> Iterator[Row]:
    def clearance(omega: float) -> float:
        return omega**2 / abs(SHAFT - omega**2 + 2j * DAMPING * omega) - CLEARANCE

    touch = float(brentq(clearance, 0.7, 1.0, xtol=1e-15))
    pyharm = {1.0000190009928387: 5.6817692309283085, 1.005637472021533: 2.210633910054174}
    for mu in (0.0, 0.1, 0.2):
        branch = quiet(lambda: ss.forced_response(jeffcott(mu), omega=(0.1, 1.4), at=[] if mu else list(pyharm)))  # noqa: B023
        data, radius = branch.dataset, harmonic(branch, "x")
        for omega, other in {} if mu else pyharm.items():
            yield Row(f"mu = 0.0: radius at {omega:.6f}, pyHarm", other, at(branch, omega, radius, other), 1e-9)
        turns = sorted(folds(branch))
        yield Row(f"mu = {mu}: fold where the contact opens", touch, turns[0], 2e-10)
        yield Row(f"mu = {mu}: fold where the whirl breaks off", last_contact(mu, turns[1]), turns[1], 1e-9)
        solved = solved_points(branch, 1)
        far = [min(abs(radius[p] - r) for r in whirl(data.omega.values[p], mu)) for p in solved]
        yield Row(f"mu = {mu}: farthest solved point from the closed form", 0.0, max(far) / radius.max(), 1e-6)
        slice_ = np.linspace(0.5, turns[1], 200_001)[:-1]
        highest = max((max(whirl(w, mu)), w) for w in slice_[::40])
        fine = np.linspace(highest[1] - 2e-4, min(highest[1] + 2e-4, slice_[-1]), 20001)
        exact = max(max(whirl(w, mu)) for w in fine)
        yield Row(f"mu = {mu}: largest radius", exact, max(size for _, size in branch.peaks("x")), 1e-8)


CASES: dict[str, Callable[[], Iterator[Row]]] = {
    "NLvib 01": nlvib_01,
    "NLvib 02": nlvib_02,
    "NLvib 03": nlvib_03,
    "NLvib 05": nlvib_05,
    "NLvib 06": nlvib_06,
    "tmdsimpy: cubic spring": tmdsimpy_duffing,
    "tmdsimpy: friction": tmdsimpy_friction,
    "tmdsimpy: Iwan": tmdsimpy_iwan,
    "pyHarm: ring damper": pyharm_ring,
    "Jeffcott rotor": jeffcott_rub,
}
QUICK = ("NLvib 02", "NLvib 06", "tmdsimpy: Iwan", "Jeffcott rotor")
"""Cases of a few seconds, in the fast suite too."""


def table(rows: list[Row]) -> str:
    head = "| what | other | here | within |\n|---|---|---|---|\n"
    return head + "".join(f"{first.text(others)}\n" for first, others in on_page(rows))


def on_page(rows: list[Row]) -> list[tuple[Row, int]]:
    """The first of the rows that tell one thing at several points, and how many more there are."""
    kinds: dict[tuple[str, float], list[Row]] = {}
    for row in rows:
        kinds.setdefault((re.sub(r"( at |mu = |load )[\d.]+", "", row.what), row.within), []).append(row)
    return [(first, len(more)) for first, *more in kinds.values()]


def tables_of(page: str) -> dict[str, str]:
    """Tables of the page by the case that the line before them names."""
    return dict(re.findall(r"<!-- case (.+?) -->\n((?:\|.*\n)+)", page))


def filled(page: str, tables: dict[str, str]) -> str:
    return re.sub(
        r"<!-- case (.+?) -->\n(?:\|.*\n)*",
        lambda found: f"<!-- case {found[1]} -->\n" + tables.get(found[1], tables_of(page).get(found[1], "")),
        page,
    )


if __name__ == "__main__":
    chosen = sys.argv[1:] or list(CASES)
    made = {}
    for name in chosen:
        rows = list(CASES[name]())
        for row in rows:
            print("ok  " if row.holds() else "FAIL", name, row.what, row.other, row.here, row.within, flush=True)
        made[name] = table(rows)
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), made), encoding="utf-8")
