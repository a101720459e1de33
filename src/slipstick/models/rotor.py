"""Rotors: the Jeffcott rotor, in the fixed or the rotating frame, and a shaft of beams with discs and bearings.

The shaft lies along z and turns about it in the positive sense; lateral motion is x, y, with tilts about these axes.
A disc that turns at speed W resists a change of its axis: ``Id rx'' + Ip W ry'`` is the moment about x,
``Id ry'' - Ip W rx'`` that about y [M. I. Friswell et al., Dynamics of Rotating Machines, 2010].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array

from slipstick.errors import Fault
from slipstick.faults import SMALLEST, Gathering, number, one, several, whole, wrong
from slipstick.fem.materials import Material
from slipstick.structure.matrices import DENSE_LIMIT, MatrixStructure
from slipstick.typing import Array, IntArray

TURN = np.array([[0.0, 1.0], [-1.0, 0.0]])
"""The skew-symmetric matrix in (x, y): of gyroscopic moments as it is, of forces that push forwards too."""


def jeffcott_rotor(
    *, mass: float = 1.0, stiffness: float = 1.0, damping: float = 0.0, internal_damping: float = 0.0,
    speed: float | None = None, engine_order: int | None = None, frame: str = "fixed",
) -> MatrixStructure:  # fmt: skip
    """A disc of point mass on a massless shaft, dofs "x" and "y".

    Parameters
    ----------
    mass, stiffness
        Of the disc, and of the shaft at it, the same in all directions; > 0.
    damping, internal_damping
        Viscous damping by what stands still and by what turns, >= 0, force/velocity.
    speed, engine_order
        Of rotation, as a ``MatrixStructure`` takes them; only internal damping and the rotating frame need one.
    frame
        "fixed"; or "rotating" with the shaft at a ``speed``: with Coriolis forces, the mass times the squared speed off
        the stiffness, and damping from outside that is a circulatory force. Loads and results are in that frame: a
        whirl of frequency w in the fixed frame has w - speed there.

    Raises
    ------
    InputError
        For values out of their range, or a speed that is missing.

    Examples
    --------
    >>> jeffcott_rotor(mass=2.0, stiffness=50.0).natural_frequencies
    array([5., 5.])
    >>> jeffcott_rotor(mass=2.0, stiffness=50.0, speed=3.0, frame="rotating").natural_frequencies.round(9)
    array([2., 8.])
    """
    checks = Gathering()
    m, k = (
        checks.take(number, n, v, "a number > 0", above=SMALLEST) for n, v in (("mass", mass), ("stiffness", stiffness))
    )
    given = (("damping", damping), ("internal_damping", internal_damping))
    c, ci = (checks.take(number, n, v, "a number >= 0", above=0.0) for n, v in given)
    if frame not in ("fixed", "rotating"):
        checks.faults.append(wrong("frame", frame, '"fixed" or "rotating"').faults[0])
    turning = frame == "rotating"
    if turning and (speed is None or engine_order is not None):
        checks.faults.append(
            Fault("speed", "the rotating frame turns at a fixed one", remedy="give speed, no engine_order")
        )
    w = None if speed is None else checks.take(number, "speed", speed)
    checks.end()
    assert m is not None
    assert k is not None
    assert c is not None
    assert ci is not None
    same = np.eye(2)
    plain: dict[str, Any] = {"M": m * same, "dofs": ["x", "y"]}
    if turning:
        assert w is not None
        return MatrixStructure(**plain, C=(c + ci) * same - 2.0 * m * w * TURN, K=(k - m * w * w) * same - c * w * TURN)
    damped: dict[str, Any] = {"C": (c + ci) * same} if c + ci else {}
    if not ci:
        return MatrixStructure(**plain, K=k * same, **damped)
    return MatrixStructure(**plain, K=k * same, **damped, circulatory=ci * TURN, speed=speed, engine_order=engine_order)


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """A cylindrical piece of shaft; pieces follow one another along z.

    ``length``, ``outer`` and ``inner`` diameter; ``elements`` it is divided into.
    """

    length: float
    outer: float
    inner: float = 0.0
    elements: int = 1

    def __post_init__(self) -> None:
        checks = Gathering()
        for name in ("length", "outer"):
            checks.take(number, ("shaft", name), getattr(self, name), "a length > 0", above=SMALLEST)
        inner = checks.take(number, ("shaft", "inner"), self.inner, "a length >= 0", above=0.0)
        checks.take(whole, ("shaft", "elements"), self.elements, 1)
        if not checks.faults and inner is not None and inner >= self.outer:
            checks.faults.append(
                Fault(("shaft", "inner"), found=f"{inner:g}", expected=f"less than outer, {self.outer:g}")
            )
        checks.end()

    @property
    def area(self) -> float:
        """Area of the section."""
        return float(0.25 * np.pi * (self.outer**2 - self.inner**2))

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter."""
        return float(np.pi / 64.0 * (self.outer**4 - self.inner**4))

    def shear_coefficient(self, poisson: float) -> float:
        """Shear coefficient of a hollow circle [G. R. Cowper, J. Appl. Mech. 33, 1966, 335]."""
        ratio = (self.inner / self.outer) ** 2
        round_, hollow = (1.0 + ratio) ** 2, ratio * (20.0 + 12.0 * poisson)
        return 6.0 * (1.0 + poisson) * round_ / ((7.0 + 6.0 * poisson) * round_ + hollow)


@dataclass(frozen=True, kw_only=True)
class Disc:
    """A rigid disc at a ``node`` (from 0): ``mass``, and moments of inertia about its axis and about a diameter."""

    node: int
    mass: float
    polar: float
    diametral: float

    def __post_init__(self) -> None:
        checks = Gathering()
        checks.take(whole, ("disc", "node"), self.node)
        for name in ("mass", "polar", "diametral"):
            checks.take(number, ("disc", name), getattr(self, name), "a number >= 0", above=0.0)
        checks.end()

    @classmethod
    def of(cls, *, node: int, material: Material, width: float, outer: float, inner: float) -> Disc:
        """A cylindrical one of a width between two diameters.

        >>> steel = Material(young=2e11, poisson=0.3, density=7810.0)
        >>> disc = Disc.of(node=2, material=steel, width=0.07, outer=0.28, inner=0.05)
        >>> round(disc.mass, 6), round(disc.polar, 6), round(disc.diametral, 6)
        (32.589728, 0.329564, 0.178089)
        """
        mass = material.density * 0.25 * np.pi * width * (outer**2 - inner**2)
        polar = mass * (outer**2 + inner**2) / 8.0
        return cls(
            node=node, mass=float(mass), polar=float(polar), diametral=float(0.5 * polar + mass * width**2 / 12.0)
        )


@dataclass(frozen=True, kw_only=True)
class Bearing:
    """Between a ``node`` (from 0) and ground: ``kxx x + kxy y + cxx x' + cxy y'`` along x, alike along y.

    Examples
    --------
    >>> stiffness, damping = Bearing(node=0, kxx=2e6, kyy=1e6, cxx=50.0).matrices()
    >>> stiffness.tolist(), damping.tolist()
    ([[2000000.0, 0.0], [0.0, 1000000.0]], [[50.0, 0.0], [0.0, 50.0]])
    """

    node: int
    kxx: float
    kyy: float | None = None
    kxy: float = 0.0
    kyx: float = 0.0
    cxx: float = 0.0
    cyy: float | None = None
    cxy: float = 0.0
    cyx: float = 0.0

    def __post_init__(self) -> None:
        checks = Gathering()
        checks.take(whole, ("bearing", "node"), self.node)
        for name in ("kxx", "kyy", "kxy", "kyx", "cxx", "cyy", "cxy", "cyx"):
            value = getattr(self, name)
            _ = None if value is None and name in ("kyy", "cyy") else checks.take(number, ("bearing", name), value)
        checks.end()

    def matrices(self) -> tuple[Array, Array]:
        """Stiffness and damping (2, 2) in x, y; what is not given along y is as along x."""
        kyy, cyy = self.kxx if self.kyy is None else self.kyy, self.cxx if self.cyy is None else self.cyy
        return np.array([[self.kxx, self.kxy], [self.kyx, kyy]]), np.array([[self.cxx, self.cxy], [self.cyx, cyy]])


def beam_rotor(
    shaft: Sequence[Shaft], *, material: Material, discs: Sequence[Disc] = (), bearings: Sequence[Bearing] = (),
    speed: float | None = None, engine_order: int | None = None, shear: bool = True, loss_factor: float = 0.0,
    rayleigh: tuple[float, float] = (0.0, 0.0), internal_damping: float = 0.0,
) -> MatrixStructure:  # fmt: skip
    """A shaft of Timoshenko beams with rigid discs on bearings, turning; dofs "n0x", "n0y", "n0rx", "n0ry", "n1x", ...

    Bending alone, with rotary inertia and gyroscopic moments of shaft and discs; consistent mass.

    Parameters
    ----------
    shaft
        Pieces of shaft from z = 0 on; nodes are counted over all their elements.
    material
        Of the shaft.
    discs, bearings
        At nodes.
    speed, engine_order
        Of rotation: a fixed one in rad/s, or omega over it, as a ``MatrixStructure`` takes them.
    shear
        Whether shear deforms the shaft; without, its beams are those of Euler, Bernoulli and Rayleigh.
    loss_factor
        Hysteretic, of everything.
    rayleigh
        (alpha, beta): damping ``alpha M + beta K`` of the shaft without discs and bearings, by what stands still.
    internal_damping
        A time: damping ``internal_damping K`` by the material of the shaft, which turns with it. Its circulatory forces
        need a fixed speed, and let whirl grow at speeds high enough.

    Raises
    ------
    InputError
        For values out of range, nodes that are not there, and a rotor that is not held.

    Examples
    --------
    >>> steel = Material(young=211e9, poisson=0.3, density=7810.0)
    >>> rotor = beam_rotor([Shaft(length=1.5, outer=0.05, elements=6)], material=steel,
    ...                    bearings=[Bearing(node=0, kxx=1e6), Bearing(node=6, kxx=1e6)], speed=100.0)
    >>> rotor.natural_frequencies[:2].round(2)
    array([210.07, 210.11])
    """
    checks = Gathering()
    pieces = checks.take(several, "shaft", shaft, Shaft, "an ss.models.Shaft") or ()
    given_discs = checks.take(several, "discs", discs, Disc, "an ss.models.Disc") or ()
    given_bearings = checks.take(several, "bearings", bearings, Bearing, "an ss.models.Bearing") or ()
    checks.take(one, "material", material, Material, "an ss.Material")
    ci = checks.take(number, "internal_damping", internal_damping, "a time >= 0", above=0.0)
    count = 1 + sum(piece.elements for piece in pieces if piece is not None)
    placed: dict[str, Sequence[Disc | Bearing]] = {"discs": given_discs, "bearings": given_bearings}
    for name, things in placed.items():
        for i, thing in enumerate(things):
            if thing.node >= count:
                checks.faults.append(Fault((name, i, "node"), found=str(thing.node), expected=f"at most {count - 1}"))
    if not pieces:
        checks.faults.append(Fault("shaft", "there is none", remedy="give one ss.models.Shaft or more"))
    if speed is None and engine_order is None:
        checks.faults.append(Fault("speed", "is not given", remedy="give speed, or engine_order; 0.0 at rest"))
    if ci and engine_order is not None:
        checks.faults.append(Fault("internal_damping", "is given with an engine order", remedy="give a fixed speed"))
    checks.end()
    lengths = [(piece, piece.length / piece.elements) for piece in pieces for _ in range(piece.elements)]
    size = 4 * count
    M, K, G = (_Sum(size) for _ in range(3))
    for k, (piece, length) in enumerate(lengths):
        places = np.arange(4 * k, 4 * k + 8)
        for total, own in zip((M, K, G), beam_element(piece, length, material, shear=shear), strict=True):
            total.add(places, own)
    shaft_mass, shaft_stiffness = M.matrix(), K.matrix()
    C = _Sum(size)
    for disc in given_discs:
        tilts = 4 * disc.node + np.array([2, 3])
        M.add(tilts - 2, disc.mass * np.eye(2))
        M.add(tilts, disc.diametral * np.eye(2))
        G.add(tilts, disc.polar * TURN)
    for bearing in given_bearings:
        stiffness, damping = bearing.matrices()
        K.add(4 * bearing.node + np.arange(2), stiffness)
        C.add(4 * bearing.node + np.arange(2), damping)
    alpha, beta = rayleigh
    damping = C.matrix() + alpha * shaft_mass + (beta + (ci or 0.0)) * shaft_stiffness
    turned = csc_array(np.kron(np.eye(2 * count), TURN)) if size <= DENSE_LIMIT else _turn(2 * count)
    # K = Re, Im of a stiffness in x + i y and in the tilts: for internal damping it is turned by a right angle
    circulatory = (ci or 0.0) * (shaft_stiffness @ turned)
    matrices = {"M": M.matrix(), "C": damping, "K": K.matrix(), "gyroscopic": G.matrix()}
    if ci:
        matrices["circulatory"] = 0.5 * (circulatory - circulatory.T)
    if size <= DENSE_LIMIT:
        matrices = {name: matrix.toarray() for name, matrix in matrices.items()}
    return MatrixStructure(
        **matrices, dofs=[f"n{k}{way}" for k in range(count) for way in ("x", "y", "rx", "ry")],
        speed=speed, engine_order=engine_order, loss_factor=loss_factor,
    )  # fmt: skip


class _Sum:
    """A sparse matrix in the making."""

    def __init__(self, size: int) -> None:
        self._size, self._rows, self._columns, self._values = size, [], [], []  # type: ignore[var-annotated]

    def add(self, places: IntArray, block: Array) -> None:
        """A block at rows and columns ``places``."""
        rows, columns = np.meshgrid(places, places, indexing="ij")
        self._rows.append(rows.ravel())
        self._columns.append(columns.ravel())
        self._values.append(block.ravel())

    def matrix(self) -> csc_array:
        """The sum of the blocks added by now."""
        if not self._values:
            return csc_array((self._size, self._size))
        places = np.concatenate(self._rows), np.concatenate(self._columns)
        return coo_array((np.concatenate(self._values), places), shape=(self._size, self._size)).tocsc()


def _turn(pairs: int) -> csc_array:
    from scipy.sparse import block_diag

    return csc_array(block_diag([TURN] * pairs))


_X, _Y = np.array([0, 3, 4, 7]), np.array([1, 2, 5, 6])
"""Places of motion in the planes x-z and y-z: displacement and tilt at both ends."""

_TILT_Y = np.array([1.0, -1.0, 1.0, -1.0])
"""A tilt about x moves the further end towards -y."""


def beam_element(piece: Shaft, length: float, material: Material, *, shear: bool) -> tuple[Array, Array, Array]:
    """Mass, stiffness and gyroscopic matrix (8, 8) of a beam element, dofs x, y, rx, ry of both ends.

    With the shape functions that solve the static equations of the Timoshenko beam [J. S. Przemieniecki, Theory of
    Matrix Structural Analysis, 1968], integrated exactly.
    """
    E, G, rho = material.young, material.shear_modulus, material.density
    A, second = piece.area, piece.second_moment
    phi = 12.0 * E * second / (piece.shear_coefficient(material.poisson) * G * A * length**2) if shear else 0.0
    at, weight = np.polynomial.legendre.leggauss(4)
    s, weight = 0.5 * (1.0 + at), 0.5 * length * weight
    w, tilt = _shapes(s, phi, length)
    L, over = length, E * second / ((1.0 + phi) * length**3)
    plane = over * np.array(
        [
            [12.0, 6.0 * L, -12.0, 6.0 * L],
            [6.0 * L, (4.0 + phi) * L**2, -6.0 * L, (2.0 - phi) * L**2],
            [-12.0, -6.0 * L, 12.0, -6.0 * L],
            [6.0 * L, (2.0 - phi) * L**2, -6.0 * L, (4.0 + phi) * L**2],
        ]
    )
    translation, rotation = (rho * of * (shape * weight) @ shape.T for of, shape in ((A, w), (second, tilt)))
    M, K, gyroscopic = np.zeros((3, 8, 8))
    for matrix, own in ((M, translation + rotation), (K, plane)):
        matrix[np.ix_(_X, _X)] = own
        matrix[np.ix_(_Y, _Y)] = own * np.outer(_TILT_Y, _TILT_Y)
    # H of the axis (ry, -rx): the moment about x from ry', its polar moment twice the diametral one
    tilts_x, tilts_y = tilt, -tilt * _TILT_Y[:, None]
    coupling = 2.0 * rho * second * (tilts_y * weight) @ tilts_x.T
    gyroscopic[np.ix_(_Y, _X)] += coupling
    gyroscopic[np.ix_(_X, _Y)] -= coupling.T
    return M, K, gyroscopic


def _shapes(s: Array, phi: float, L: float) -> tuple[Array, Array]:
    """Deflection and tilt (4, k) for unit displacement and tilt of both ends, at ``s`` = z / L."""
    one = 1.0 / (1.0 + phi)
    w = one * np.array(
        [
            1.0 - 3.0 * s**2 + 2.0 * s**3 + phi * (1.0 - s),
            L * (s - 2.0 * s**2 + s**3 + 0.5 * phi * (s - s**2)),
            3.0 * s**2 - 2.0 * s**3 + phi * s,
            L * (-(s**2) + s**3 - 0.5 * phi * (s - s**2)),
        ]
    )
    tilt = one * np.array(
        [
            6.0 / L * (-s + s**2),
            1.0 - 4.0 * s + 3.0 * s**2 + phi * (1.0 - s),
            6.0 / L * (s - s**2),
            -2.0 * s + 3.0 * s**2 + phi * s,
        ]
    )
    return w, tilt
