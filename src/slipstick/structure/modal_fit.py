"""Real modes of measured receptances: frequencies, damping, mass-normalised shapes, and what other modes add.

``A_ij(w) = sum_r phi_ir phi_jr / (w_r^2 + 2 i zeta_r w_r w - w^2) + S_ij`` (D. J. Ewins, Modal Testing, 2000,
chapter 4). Frequencies and damping are sought by nonlinear least squares, residues are linear in it (variable
projection, G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10, 1973); last all is fitted with shapes instead of residues.
``S`` is left out where it is noise: at harmonics above the range, where the modes are small, it would stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import Fault, InputError
from slipstick.structure.modal import ModalStructure
from slipstick.typing import Array, ComplexArray, IntArray

_PROMINENT = 0.05
"""Decades by which a peak of the sum of all receptances stands out."""
_WORTH = 0.7
"""A further mode is kept where it leaves less than this share of the error."""
_MOST_MODES = 60
_BEYOND = 1.5
"""A mode may lie so many times above the highest frequency: it is seen by what it adds below."""
FLOOR = 0.02
"""Errors are judged relative to the receptance, and to this share of its size where that is small."""
_RECIPROCAL = 0.05
_ACTIVE = 0.02
_RANK_ONE = 0.1
"""What is suspicious: of reciprocity, of power that comes out of a driving point, of a residue that is no product."""


@dataclass(frozen=True, kw_only=True)
class Receptances:
    """Receptances (n, n_pairs), length/force, at frequencies (n,), rad/s, of pairs of dofs.

    ``rows`` and ``columns`` (n_pairs,) number the dof that moves and the one that is forced.
    """

    dofs: tuple[str, ...]
    omega: Array
    values: ComplexArray
    rows: IntArray
    columns: IntArray

    @property
    def driving(self) -> NDArray[np.bool_]:
        """Which pairs are driving points, (n_pairs,)."""
        return np.asarray(self.rows == self.columns)

    def name(self, pair: int) -> str:
        """Of a pair, in words."""
        return f"'{self.dofs[self.rows[pair]]}' by a force on '{self.dofs[self.columns[pair]]}'"

    @property
    def reciprocity(self) -> float:
        """Largest difference of receptances measured both ways, relative to their size; nan where none was."""
        worst = [
            np.linalg.norm(self.values[:, k] - self.values[:, j]) / np.linalg.norm(self.values[:, k])
            for k, j in self._both_ways()
        ]
        return float(max(worst, default=np.nan))

    def _both_ways(self) -> Iterator[tuple[int, int]]:
        place = {(int(i), int(j)): k for k, (i, j) in enumerate(zip(self.rows, self.columns, strict=True))}
        yield from ((k, place[j, i]) for (i, j), k in place.items() if i < j and (j, i) in place)

    def warnings(self, unit: str) -> Iterator[str]:
        """What is suspicious in what was measured."""
        for k, j in self._both_ways():
            off = float(np.linalg.norm(self.values[:, k] - self.values[:, j]) / np.linalg.norm(self.values[:, k]))
            if off > _RECIPROCAL:
                yield (
                    f"reciprocity: {self.name(k)} and the other way round differ by {100 * off:.2g} %; "
                    "their mean is taken"
                )
        for k in np.flatnonzero(self.driving).tolist():
            active = self.values[:, k].imag > _ACTIVE * np.abs(self.values[:, k])
            if active.any():
                low, high = self.omega[active][[0, -1]]
                yield (
                    f"passivity: at '{self.dofs[self.rows[k]]}' power comes out of the driving point at "
                    f"{int(active.sum())} of {active.size} frequencies, from {low:.5g} to {high:.5g} {unit} (Im > 0): "
                    "check sign and direction of force and sensor"
                )


@dataclass(frozen=True, kw_only=True)
class ModalFit:
    """Modes fitted to receptances.

    Attributes
    ----------
    structure
        With these modes and what the others add, at all measured dofs.
    error
        Root mean square of the relative error of the fitted receptances.
    worst
        The same of the worst measured pair.
    reciprocity
        Of the measurement; nan where no receptance was measured both ways.
    warnings
        What is suspicious or approximated, one sentence each.
    """

    structure: ModalStructure
    error: float
    worst: float
    reciprocity: float
    warnings: tuple[str, ...]

    def summary(self) -> str:
        """Modes and errors as a text."""
        s = self.structure
        lines = [f"mode {r + 1}: {w:.6g} rad/s, damping ratio {z:.3g}" for r, (w, z) in enumerate(
            zip(s.omega, s.damping_ratio, strict=True)
        )]  # fmt: skip
        both = "" if np.isnan(self.reciprocity) else f", reciprocity {100 * self.reciprocity:.2g} %"
        lines.append(f"error {100 * self.error:.2g} %, of the worst receptance {100 * self.worst:.2g} %{both}")
        return "\n".join([*lines, *self.warnings])


def fit_modes(measured: Receptances, modes: int | None = None, *, unit: str = "rad/s") -> ModalFit:
    """Modes of measured receptances; ``modes``: how many, by default as many as the measurement shows.

    Raises
    ------
    InputError
        Where no driving point was measured, no mode is seen, or a mode takes no energy up: its driving-point residue or
        its damping is negative.
    """
    if not measured.driving.any():
        remedy = "measure the response at a point that is excited, in its direction"
        raise InputError(Fault("receptances", "no driving point is among them", remedy=remedy))
    notes = list(measured.warnings(unit))
    mean = reciprocal(measured)
    weight = 1.0 / (np.abs(mean.values) + FLOOR * np.sqrt(np.mean(np.abs(mean.values) ** 2, axis=0)))
    projection = _Projection(mean, weight)
    poles = _poles(projection, modes)
    bare = _Projection(mean, weight, residual=False)
    lean = bare.refined(poles)
    if bare.error(lean) * _WORTH < projection.error(poles):
        projection, poles = bare, lean
    residues, S = projection.linear(poles)
    shapes = np.column_stack([
        _shape(mean, residues[r], w, notes, unit) for r, w in enumerate(poles[0])
    ])  # fmt: skip
    poles, shapes, S = projection.with_shapes(poles, shapes)
    structure = _structure(mean, poles, shapes, None if S is None else _whole(mean, S), notes)
    eye = np.eye(len(mean.dofs))
    again = structure.project(eye, eye).at([1.0], mean.omega)[0][:, 0][:, mean.rows, mean.columns]
    wrong = np.sqrt(np.mean(np.abs((again - mean.values) * weight) ** 2, axis=0))
    if wrong.max() > _RANK_ONE:
        worst = mean.name(int(np.argmax(wrong)))
        notes.append(f"the modes fit {worst} to {100 * wrong.max():.0f} % only: more modes, or a smaller range")
    return ModalFit(
        structure=structure, error=float(np.sqrt(np.mean(wrong**2))), worst=float(wrong.max()),
        reciprocity=measured.reciprocity, warnings=tuple(notes),
    )  # fmt: skip


def reciprocal(measured: Receptances) -> Receptances:
    """With the mean of what was measured both ways, each pair once."""
    groups: dict[tuple[int, int], list[int]] = {}
    for k, (i, j) in enumerate(zip(measured.rows.tolist(), measured.columns.tolist(), strict=True)):
        groups.setdefault((min(i, j), max(i, j)), []).append(k)
    rows, columns = np.array(list(groups)).T
    values = np.column_stack([measured.values[:, places].mean(axis=1) for places in groups.values()])
    return Receptances(dofs=measured.dofs, omega=measured.omega, values=values, rows=rows, columns=columns)


Poles = tuple[Array, Array]
"""Natural frequencies and damping ratios, (n_modes,) each."""


class _Projection:
    """What is left of the receptances when everything linear fits best."""

    def __init__(self, measured: Receptances, weight: Array, *, residual: bool = True) -> None:
        self.measured, self.weight, self.residual = measured, weight, residual
        self.scale = float(measured.omega.max())
        self.range = float(measured.omega.min()), self.scale

    def _columns(self, poles: Poles) -> ComplexArray:
        w, (wr, zr) = self.measured.omega[:, None], poles
        D = wr**2 / (wr**2 + 2j * zr * wr * w - w**2)
        return np.asarray(np.hstack([D, np.ones_like(w)]) if self.residual else D, dtype=complex)

    def _solutions(self, poles: Poles) -> Iterator[tuple[Array, Array]]:
        """Coefficients of each pair, and what is left (2 n,)."""
        X = self._columns(poles)
        for values, weight in zip(self.measured.values.T, self.weight.T, strict=True):
            weighted = X * weight[:, None]
            A, b = np.vstack([weighted.real, weighted.imag]), values * weight
            b = np.concatenate([b.real, b.imag])
            c = np.linalg.lstsq(A, b, rcond=None)[0]
            yield c, A @ c - b

    def left(self, poles: Poles) -> Array:
        """All that is left, (n_pairs 2 n,)."""
        return np.concatenate([rest for _, rest in self._solutions(poles)])

    def error(self, poles: Poles) -> float:
        """Root mean square of the relative errors."""
        return float(np.sqrt(2.0 * np.mean(self.left(poles) ** 2)))

    def linear(self, poles: Poles) -> tuple[Array, Array | None]:
        """Residues (n_modes, n_pairs), and the compliance of other modes (n_pairs,)."""
        found = np.array([c for c, _ in self._solutions(poles)]).T
        n = len(poles[0])
        return found[:n] * poles[0][:, None] ** 2, found[n] if self.residual else None

    def refined(self, poles: Poles) -> Poles:
        """Frequencies and damping at which the least is left."""
        from scipy.optimize import least_squares

        wr, zr = poles
        n, unit = len(wr), self.scale
        low = np.concatenate([np.full(n, 0.8 * self.range[0] / unit), np.full(n, -0.5)])
        high = np.concatenate([np.full(n, _BEYOND), np.full(n, 1.5)])
        start = np.clip(np.concatenate([wr / unit, zr]), low + 1e-9, high - 1e-9)
        found = least_squares(
            lambda z: self.left((z[:n] * unit, z[n:])), start, bounds=(low, high), x_scale=np.concatenate([
                np.maximum(np.abs(zr), 1e-3) * wr / unit, np.maximum(np.abs(zr), 1e-3)
            ]), max_nfev=60,
        ).x  # fmt: skip
        order = np.argsort(found[:n])
        return found[:n][order] * unit, found[n:][order]

    def with_shapes(self, poles: Poles, shapes: Array) -> tuple[Poles, Array, Array | None]:
        """Poles, shapes (n_dofs, n_modes) and the compliance of other modes (n_pairs,) at which the least is left."""
        from scipy.optimize import least_squares

        measured, weight, n = self.measured, self.weight, len(poles[0])
        w, size = measured.omega[:, None], np.maximum(np.abs(shapes).max(axis=0), 1e-300)
        squared = np.sum(weight**2, axis=0)

        def parts(z: Array) -> tuple[ComplexArray, Array]:
            wr, zr, phi = self.scale * z[:n], z[n : 2 * n], z[2 * n :].reshape(shapes.shape) * size
            D = 1.0 / (wr**2 + 2j * zr * wr * w - w**2)
            wrong = D @ (phi[measured.rows] * phi[measured.columns]).T - measured.values
            S = -np.sum(weight**2 * wrong.real, axis=0) / squared * self.residual
            return np.asarray((wrong + S) * weight), S

        def left(z: Array) -> Array:
            wrong = parts(z)[0]
            return np.concatenate([wrong.real.ravel(), wrong.imag.ravel()])

        start = np.concatenate([poles[0] / self.scale, poles[1], (shapes / size).ravel()])
        unit = np.concatenate([np.maximum(np.abs(poles[1]), 1e-3) * poles[0] / self.scale,
                               np.maximum(np.abs(poles[1]), 1e-3), np.ones(shapes.size)])  # fmt: skip
        found = least_squares(left, start, x_scale=unit, max_nfev=40, xtol=1e-13, ftol=1e-13, gtol=1e-13).x
        S = parts(found)[1] if self.residual else None
        return (found[:n] * self.scale, found[n : 2 * n]), found[2 * n :].reshape(shapes.shape) * size, S

    def without(self, poles: Poles) -> Array:
        """Size of what is left at each frequency, (n,)."""
        left = self.left(poles).reshape(self.measured.values.shape[1], 2, -1)
        return np.asarray(np.sqrt(np.sum(left**2, axis=(0, 1))))


def _poles(projection: _Projection, modes: int | None) -> Poles:
    """As many as are asked for, or as leave clearly less."""
    w = projection.measured.omega
    size = np.sqrt(np.sum(np.abs(projection.measured.values) ** 2, axis=1))
    peaks = resonances(w, size)
    if modes is not None:
        peaks = sorted(peaks, key=lambda peak: -peak[2])[:modes]
    if not peaks and modes is None:
        raise InputError(Fault("receptances", "show no resonance", remedy="widen the range, or say how many modes"))
    poles = np.array([peak[0] for peak in peaks]), np.array([peak[1] for peak in peaks])
    if peaks:
        poles = projection.refined(poles)
    error = projection.error(poles)
    while len(poles[0]) < (_MOST_MODES if modes is None else modes):
        more = _with_one_more(projection, poles)
        other = projection.error(more)
        if modes is None and not (other < _WORTH * error and _plausible(projection, more)):
            break
        poles, error = more, other
    return poles


def _with_one_more(projection: _Projection, poles: Poles) -> Poles:
    """With a mode where most is left."""
    w, damping = projection.measured.omega, float(np.median(np.abs(poles[1]))) if len(poles[1]) else 0.01
    k = int(np.argmax(projection.without(poles)))
    at = float(w[k]) if k < 0.98 * len(w) else 1.05 * float(w[-1])
    return projection.refined((np.append(poles[0], at), np.append(poles[1], max(damping, 1e-4))))


def _plausible(projection: _Projection, poles: Poles) -> bool:
    low, high = projection.range
    within = (poles[0] > low) & (poles[0] < 0.99 * _BEYOND * high)
    return bool(np.all(within & (poles[1] > 0.0) & (poles[1] < 0.5)))


def resonances(w: Array, size: Array) -> list[tuple[float, float, float]]:
    """Frequency, damping ratio by the half-power width, and prominence of the resonances seen."""
    from scipy.signal import find_peaks

    places, about = find_peaks(np.log10(size), prominence=_PROMINENT)
    out = []
    for k, prominence in zip(places.tolist(), about["prominences"].tolist(), strict=True):
        below = size < size[k] / np.sqrt(2.0)
        left = k - int(np.argmax(below[k::-1])) if below[:k].any() else 0
        right = k + int(np.argmax(below[k:])) if below[k:].any() else len(w) - 1
        width = float(w[right] - w[left]) / (2.0 * float(w[k]))
        out.append((float(w[k]), float(np.clip(width, 1e-4, 0.2)), prominence))
    return out


def _shape(measured: Receptances, residues: Array, omega: float, notes: list[str], unit: str) -> Array:
    """Mass-normalised shape (n_dofs,) whose products the residues (n_pairs,) of a mode are."""
    n, driving = len(measured.dofs), measured.driving
    R, known = np.zeros((n, n)), np.zeros((n, n), dtype=bool)
    for i, j, residue in zip(measured.rows, measured.columns, residues, strict=True):
        R[i, j] = R[j, i] = residue
        known[i, j] = known[j, i] = True
    points = measured.rows[driving]
    own = R[points, points]
    first = int(points[int(np.argmax(own))])
    if own.max() <= 0.0:
        raise InputError(
            Fault(
                ("receptances", f"mode at {omega:.6g} {unit}"),
                f"its residue at the driving point '{measured.dofs[first]}' is negative: energy would come out of it",
                remedy="check the sign and direction of force and sensor, or seek fewer modes",
            )
        )  # fmt: skip
    phi = np.where(known[:, first], R[:, first] / np.sqrt(R[first, first]), np.nan)
    if not known[:, first].all():  # points that this force did not reach: by the others
        for _ in range(n):
            for i in np.flatnonzero(np.isnan(phi)):
                others = known[i] & np.isfinite(phi) & (np.arange(n) != i)
                if others.any():
                    phi[i] = float(R[i, others] @ phi[others] / (phi[others] @ phi[others]))
    if np.isnan(phi).any():
        lost = measured.dofs[int(np.flatnonzero(np.isnan(phi))[0])]
        remedy = "measure it with a force that others were measured with too"
        raise InputError(Fault("receptances", f"'{lost}' is not connected to a driving point", remedy=remedy))
    for _ in range(20):  # all residues together: alternating least squares
        for i in range(n):
            others = known[i] & (np.arange(n) != i)
            if others.any() and not (known[i, i] and i == first and others.sum() == 0):
                top = R[i, others] @ phi[others] + (R[i, i] * phi[i] if known[i, i] else 0.0)
                bottom = phi[others] @ phi[others] + (phi[i] ** 2 if known[i, i] else 0.0)
                phi[i] = top / bottom
    products = np.outer(phi, phi)
    off = np.linalg.norm((R - products)[known]) / np.linalg.norm(R[known])
    if off > _RANK_ONE and measured.omega[0] < omega < measured.omega[-1]:
        notes.append(
            f"the residues of the mode at {omega:.6g} {unit} are no products of one shape ({100 * off:.0f} % off): two "
            "close modes, a complex one, or directions that do not belong together"
        )
    return phi


def _whole(measured: Receptances, part: Array) -> Array:
    """A symmetric matrix (n_dofs, n_dofs) without negative eigenvalues from its measured entries (n_pairs,)."""
    n = len(measured.dofs)
    matrix, known = np.zeros((n, n)), np.zeros((n, n), dtype=bool)
    for i, j, value in zip(measured.rows, measured.columns, part, strict=True):
        matrix[i, j] = matrix[j, i] = value
        known[i, j] = known[j, i] = True
    points = [i for i in range(n) if known[i, i] and matrix[i, i] > 0.0]
    for i, j in zip(*np.nonzero(~known), strict=True):  # of lowest rank, from the strongest driving point
        ways = [k for k in points if known[i, k] and known[k, j]]
        if ways:
            k = max(ways, key=lambda k: matrix[k, k])
            matrix[i, j] = matrix[i, k] * matrix[k, j] / matrix[k, k]
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)


def _structure(
    measured: Receptances, poles: Poles, shapes: Array, left_out: Array | None, notes: list[str]
) -> ModalStructure:
    wr, zr = poles
    fed = zr <= 0.0
    if fed.any():
        at = f"mode at {wr[fed][0]:.6g} rad/s"
        raise InputError(
            Fault(
                ("receptances", at), f"its damping ratio is {zr[fed][0]:.3g}: the receptances turn the wrong way round",
                expected="lags, A(w) of exp(+i w t) with Im <= 0 at driving points",
                remedy="give complex conjugates, or the right quantity (displacement, velocity, acceleration)",
            )
        )  # fmt: skip
    count = int(measured.driving.sum())
    if left_out is not None and count < len(measured.dofs):
        notes.append(
            f"{count} of {len(measured.dofs)} points are driving points: what the modes left out add at the others is "
            "estimated from these"
        )
    static = None if left_out is None else (shapes / wr**2) @ shapes.T + left_out
    return ModalStructure(omega=wr, mode_shapes=shapes, static_compliance=static, dofs=measured.dofs, damping_ratio=zr)
