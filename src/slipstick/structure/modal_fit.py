"""Real modes of measured receptances: frequencies, damping, mass-normalised shapes, and what other modes add.

``A_ij(w) = sum_r phi_ir phi_jr / (w_r^2 + 2 i zeta_r w_r w - w^2) + S_ij`` (D. J. Ewins, Modal Testing, 2000,
chapter 4). Poles that many orders of a common denominator agree on are the start; those that do not stand out of the
noise or have no physics are left out, and where more is left than noise a further mode is sought. Least squares in
units of the noise, which the table shows itself, make poles and shapes those of greatest likelihood.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.structure.measured import CLEAR, FLOOR, Poles, Receptances, checked, deviation, reciprocal
from slipstick.structure.modal import ModalStructure
from slipstick.structure.modal_least_squares import BELOW, BEYOND, MOST_DAMPING, LeastSquares, Shaped
from slipstick.typing import Array

_MOST_MODES = 60
_RANK_ONE = 0.1
"""What a residue may be off a product of one shape, and a fit off what was measured."""
_AWAY = 10.0
"""Half-power widths that a second mode at the frequency of another may move away from it."""
_KNOWN = 0.2
"""Relative standard deviation of a damping ratio from which a mode is not trusted."""
_NARROW = 0.1
"""Half-power widths below this share of the distance of lines are seen in no resonance."""
_FAINT = 0.02
"""Modes that add a smaller share of what is measured at their frequency are not told from what others add there."""
_FAINT_AND_BROAD = 0.2, 3.0
"""The same, where they are so many times more damped than the modes that stand out: what delays or damping leave."""
_DAMPED = 0.3
"""Damping ratio up to which a mode in the range is taken for one."""
TIME_LIMIT = 60.0
"""Seconds after which no further modes are sought."""
_JOINT = 1000
"""Unknowns up to which shapes and poles are found together."""
_WORTH = 0.7
"""What modes far below the range have to leave of the sum of squares."""
_FAR, _FAR_DAMPING = 0.1, 0.01
"""Where modes far below the range stand, as a share of its lowest frequency, and their damping ratio."""


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
    noise
        What the noise of the measurement is of ``error``; a fit cannot be better.
    omega_error, damping_error
        Standard deviations of natural frequencies and damping ratios, relative, (n_modes,); infinite where nothing
        tells them.
    reciprocity
        Of the measurement; nan where no receptance was measured both ways.
    warnings
        What is suspicious or approximated, one sentence each.

    Examples
    --------
    >>> import numpy as np
    >>> import xarray, slipstick as ss
    >>> omega = np.linspace(2.0, 15.0, 400)
    >>> receptance = 1.0 / (40.0 + 0.4j * omega - omega**2)
    >>> measured = xarray.Dataset({"receptance": (("omega", "output", "input"), receptance[:, None, None])},
    ...                           coords={"omega": omega, "output": ["x"], "input": ["x"]})
    >>> fit = ss.models.modal_analysis(measured)
    >>> fit.structure.omega.round(6), fit.structure.damping_ratio.round(6), fit.error < 1e-9
    (array([6.324555]), array([0.031623]), True)
    """

    structure: ModalStructure
    error: float
    worst: float
    noise: float
    omega_error: Array
    damping_error: Array
    reciprocity: float
    warnings: tuple[str, ...]

    def summary(self) -> str:
        """Modes and errors as a text."""
        s = self.structure
        modes = zip(s.omega, s.damping_ratio, self.omega_error, self.damping_error, strict=True)
        lines = [
            f"mode {r}: {w:.6g} rad/s to {100 * off:.1g} %, damping ratio {z:.3g} to {100 * unsure:.2g} %"
            for r, (w, z, off, unsure) in enumerate(modes, 1)
        ]
        both = "" if np.isnan(self.reciprocity) else f", reciprocity {100 * self.reciprocity:.2g} %"
        lines.append(
            f"error {100 * self.error:.2g} % (noise {100 * self.noise:.2g} %), of the worst receptance "
            f"{100 * self.worst:.2g} %{both}"
        )
        return "\n".join([*lines, *self.warnings])


def fit_modes(
    measured: Receptances, modes: int | None = None, *, unit: str = "rad/s", time_limit: float = TIME_LIMIT
) -> ModalFit:
    """Modes of measured receptances; ``modes``: how many are kept, by default all that the measurement shows.

    Raises
    ------
    InputError
        Where no driving point was measured, no mode stands out of the noise, what was measured is no receptance, or a
        mode takes no energy up: its driving-point residue is negative.
    """
    if not measured.driving.any():
        remedy = "measure the response at a point that is excited, in its direction"
        raise InputError(Fault("receptances", "no driving point is among them", remedy=remedy))
    until, notes = monotonic() + time_limit, list(measured.warnings(unit))
    mean = reciprocal(measured)
    noise = deviation(mean.omega, mean.values)
    start = checked(mean)
    problem, poles, complete = _poles(LeastSquares(mean, noise), start, until)
    if not poles[0].size:
        raise InputError(_hopeless(problem, start))
    shaped = _shaped(problem, poles, until, notes, unit)
    if not complete or monotonic() > until:
        notes.append(
            f"the fit was stopped after {time_limit:.3g} s: further modes, or better ones, may be in the receptances"
        )
    shaped = _kept(problem, shaped, modes, notes)
    structure = _structure(mean, shaped, notes)
    notes += _doubts(problem, shaped, unit)
    eye = np.eye(len(mean.dofs))
    again = structure.project(eye, eye).at([1.0], mean.omega)[0][:, 0][:, mean.rows, mean.columns]
    weight = 1.0 / (np.abs(mean.values) + FLOOR * np.sqrt(np.mean(np.abs(mean.values) ** 2, axis=0)))
    wrong = np.sqrt(np.mean(np.abs((again - mean.values) * weight) ** 2, axis=0))
    hidden = np.sqrt(2.0 * np.mean((noise * weight) ** 2, axis=0))
    unfit = np.where(wrong > CLEAR * hidden, wrong, 0.0)
    if unfit.max() > _RANK_ONE:
        worst = mean.name(int(np.argmax(unfit)))
        notes.append(f"the modes fit {worst} to {100 * unfit.max():.0f} % only: more modes, or a smaller range")
    return ModalFit(
        structure=structure, error=float(np.sqrt(np.mean(wrong**2))), worst=float(wrong.max()),
        noise=float(np.sqrt(np.mean(np.minimum(hidden, wrong) ** 2))), omega_error=shaped.uncertain[0],
        damping_error=shaped.uncertain[1],
        reciprocity=measured.reciprocity, warnings=tuple(notes),
    )  # fmt: skip


def _hopeless(problem: LeastSquares, start: Poles) -> Fault:
    """Why there is no mode."""
    driving, n = problem.measured.driving, len(start[0])
    gains = problem.coefficients(start)[1]
    if (gains[:n].sum(axis=1) > problem.worth).any():
        seen = ", ".join(f"{w:.4g}" for w in start[0])
        return Fault(
            "receptances", f"show resonances at {seen} rad/s, none of which takes energy up at the driving points",
            expected="Im <= 0 there", remedy="check sign and direction of force and sensor, and what was measured",
        )  # fmt: skip
    values, noise = problem.measured.values[:, driving], problem.noise[:, driving]
    share = float(np.max(np.sqrt(2.0 * np.mean(noise**2, axis=0)) / np.abs(values).max(axis=0)))
    return Fault(
        "receptances", f"show no resonance above their noise ({100 * share:.2g} % of the largest at a driving point)",
        remedy="widen the range, or measure more averages, with more force, at finer lines",
    )  # fmt: skip


def _poles(problem: LeastSquares, poles: Poles, until: float) -> tuple[LeastSquares, Poles, bool]:
    """Poles of all modes that stand out of the noise, with this noise, and whether there was time for all."""
    for _ in range(_MOST_MODES):
        poles = _pruned(problem, problem.refined(_pruned(problem, poles)))
        problem = problem.reweighted(poles)
        poles = _merged(problem, _pruned(problem, problem.refined(poles)))
        if monotonic() > until:
            return problem, poles, False
        w, z = problem.missing(poles)
        kept = _pruned(problem, problem.refined((np.append(poles[0], w), np.append(poles[1], z)))) if w.size else poles
        if len(kept[0]) <= len(poles[0]) or problem.squares(poles) - problem.squares(kept) < problem.worth:
            break
        poles = kept
    return problem, poles, True


def _merged(problem: LeastSquares, poles: Poles) -> Poles:
    """With one pole instead of two within their half-power widths, where it does as well."""
    k = 1
    while k < len(poles[0]):
        wr, zr = poles
        if wr[k] - wr[k - 1] < zr[k] * wr[k] + zr[k - 1] * wr[k - 1]:
            gains = problem.coefficients(poles)[1]
            rest = np.arange(wr.size) != (k if gains[k].sum() < gains[k - 1].sum() else k - 1)
            fewer = problem.refined((wr[rest], zr[rest]))
            if problem.squares(fewer) - problem.squares(poles) < problem.worth:
                poles, k = fewer, 0
        k += 1
    return poles


def _pruned(problem: LeastSquares, poles: Poles) -> Poles:
    """Without poles that do not stand out of the noise, or that no passive structure has in this range."""
    driving = problem.measured.driving
    line = float(np.median(np.diff(problem.measured.omega)))
    while n := len(poles[0]):
        wr, zr = poles
        c, gains, _ = problem.coefficients(poles)
        gain = gains[:n].sum(axis=1)
        taken = np.sum(np.sign(c[:n, driving]) * gains[:n, driving], axis=1)
        inside = (wr >= problem.low) & (wr <= problem.high)
        prominence = problem.prominence(poles, c[:n])
        usual = float(np.median(zr[inside & (prominence > 0.5)])) if (inside & (prominence > 0.5)).any() else np.inf
        bad = (gain < problem.worth) | (taken <= 0.0) | (prominence < _FAINT)
        bad |= (zr > 0.98 * MOST_DAMPING) | (wr < 1.02 * BELOW * problem.low)
        bad |= inside & (prominence < _FAINT_AND_BROAD[0]) & (zr > _FAINT_AND_BROAD[1] * usual)
        bad |= inside & ((zr * wr < _NARROW * line) | (zr > _DAMPED)) | (wr > 0.98 * BEYOND * problem.high)
        if not bad.any():
            break
        rest = np.arange(n) != int(np.argmin(np.where(bad, gain, np.inf)))
        poles = wr[rest], zr[rest]
    return poles


def _shaped(problem: LeastSquares, poles: Poles, until: float, notes: list[str], unit: str) -> Shaped:
    """Shapes of all modes, of double ones too, and modes that stand for what lies below the range."""
    measured, n = problem.measured, len(poles[0])
    c, gains, squares = problem.coefficients(poles)
    above, below = (bool(gains[k].sum() > problem.worth) for k in (n, n + 1))
    below &= bool(np.all(c[n + 1][measured.driving] < 0.0))
    residues = c[:n] * poles[0][:, None] ** 2
    shapes = np.column_stack([_shape(measured, residue, w) for w, residue in zip(poles[0], residues, strict=True)])

    def fitted(poles: Poles, shapes: Array, held: int) -> Shaped:
        if measured.rows.size > len(measured.dofs) and shapes.size + 2 * shapes.shape[1] <= _JOINT:
            return problem.shaped(poles, shapes, held, above)
        own = problem.uncertain((poles[0][held:], poles[1][held:]))
        return Shaped(
            poles=poles, shapes=shapes, above=c[n] if above else np.zeros(len(c[n])), held=held,
            squares=squares + (0.0 if held else float(gains[n + 1].sum())),
            uncertain=np.hstack([np.full((2, held), np.inf), own]),
        )  # fmt: skip

    held, found = 0, fitted(poles, shapes, 0)
    if below:
        far = _roots(_whole(measured, -c[n + 1] * problem.low**2))
        held = far.shape[1]
        w = np.append(np.full(held, _FAR * problem.low), poles[0])
        z = np.append(np.full(held, _FAR_DAMPING), poles[1])
        more = fitted((w, z), np.hstack([far, shapes]), held)
        if held and more.squares < _WORTH * found.squares:
            found, poles, shapes = more, (w, z), np.hstack([far, shapes])
        else:
            held = 0
    if measured.rows.size <= len(measured.dofs):  # any residues are products
        return found
    doubled = {
        r: second for r in range(held, held + n)
        if problem.low < poles[0][r] < problem.high
        and (second := _second(measured, residues[r - held], gains[r - held], shapes[:, r])) is not None
    }  # fmt: skip
    if doubled and shapes.size + 2 * shapes.shape[1] <= _JOINT and monotonic() < until:
        found, doubled = _with_doubles(problem, found, doubled, above)
    notes += [
        f"the residues of the mode at {poles[0][r]:.6g} {unit} are no products of one shape: two close modes, a "
        "complex one, or directions that do not belong together"
        for r in doubled
    ]
    order = np.argsort(found.poles[0])
    return replace(
        found, poles=(found.poles[0][order], found.poles[1][order]), shapes=found.shapes[:, order],
        uncertain=found.uncertain[:, order],
    )  # fmt: skip


def _with_doubles(
    problem: LeastSquares, found: Shaped, doubled: dict[int, Array], above: bool
) -> tuple[Shaped, dict[int, Array]]:
    """With second modes of these shapes at the frequencies of others, where they fit; and the others."""
    first, n = np.array(list(doubled)), len(found.poles[0])
    w, z = (np.append(part, part[first]) for part in found.poles)
    both = problem.shaped((w, z), np.column_stack([found.shapes, *doubled.values()]), found.held, above)
    ratio = both.poles[1][n:] / both.poles[1][first]
    away = np.abs(both.poles[0][n:] - both.poles[0][first]) / (both.poles[1] * both.poles[0])[first]
    size = np.linalg.norm(both.shapes[:, n:], axis=0) / np.linalg.norm(both.shapes[:, first], axis=0)
    good = (ratio > 0.2) & (ratio < 5.0) & (away < _AWAY) & (size > _RANK_ONE)
    if found.squares - both.squares < good.sum() * problem.worth or not good.any():
        return found, doubled
    if not good.all():
        kept = np.append(np.full(n, True), good)
        both = problem.shaped((both.poles[0][kept], both.poles[1][kept]), both.shapes[:, kept], found.held, above)
    return both, {r: second for (r, second), fits in zip(doubled.items(), good, strict=True) if not fits}


def _second(measured: Receptances, residues: Array, gains: Array, shape: Array) -> Array | None:
    """A second shape at the same frequency, where residues (n_pairs,) are clearly no products of one."""
    rest = residues - shape[measured.rows] * shape[measured.columns]
    sure = np.abs(rest) * np.sqrt(gains) > 4.0 * np.abs(residues)
    if np.linalg.norm(rest[sure]) < _RANK_ONE * np.linalg.norm(residues):
        return None
    try:
        return _shape(measured, rest, np.inf)
    except InputError:
        return None


def _roots(matrix: Array) -> Array:
    """Columns whose products add up to a matrix without negative eigenvalues."""
    values, vectors = np.linalg.eigh(matrix)
    large = values > 1e-2 * max(float(values[-1]), 1e-300)
    return np.asarray(vectors[:, large] * np.sqrt(values[large]))


def _kept(problem: LeastSquares, found: Shaped, modes: int | None, notes: list[str]) -> Shaped:
    """The strongest modes, those in the range first; the others become compliance."""
    wr, zr = found.poles
    if modes is None or modes == wr.size:
        return found
    if modes > wr.size:
        notes.append(f"{modes} modes were asked for, {wr.size} stand out of the noise")
        return found
    inside = (wr >= problem.low) & (wr <= problem.high)
    w = np.clip(wr, problem.low, problem.high)
    seen = np.sum(found.shapes**2, axis=0) / np.abs(wr**2 + 2j * zr * wr * w - w**2)
    kept = np.sort(np.lexsort((-seen, ~inside))[:modes])
    rest = np.setdiff1d(np.flatnonzero(wr > problem.high), kept)
    products = found.shapes[problem.measured.rows][:, rest] * found.shapes[problem.measured.columns][:, rest]
    return replace(
        found, poles=(wr[kept], zr[kept]), shapes=found.shapes[:, kept], uncertain=found.uncertain[:, kept],
        above=found.above + products @ wr[rest] ** -2.0,
    )  # fmt: skip


def _doubts(problem: LeastSquares, found: Shaped, unit: str) -> Iterator[str]:
    """Which modes are not to be trusted."""
    below = found.poles[0] < problem.low
    if below.any():
        those = ", ".join(f"{w:.4g}" for w in found.poles[0][below])
        yield (
            f"modes at {those} {unit} stand for what lies below the range: the compliance at rest, which harmonic 0 "
            "needs, was not measured"
        )
    for w, (_, unsure) in zip(found.poles[0], found.uncertain.T, strict=True):
        if w >= problem.low and unsure > _KNOWN:
            where = "" if w <= problem.high else "lies above the range and "
            known = "not known" if np.isinf(unsure) else f"known to {100 * unsure:.0f} % only"
            yield f"the mode at {w:.5g} {unit} {where}is not to be trusted: its damping ratio is {known}"


def _shape(measured: Receptances, residues: Array, omega: float, unit: str = "rad/s") -> Array:
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


def _structure(measured: Receptances, found: Shaped, notes: list[str]) -> ModalStructure:
    shapes, (wr, zr) = found.shapes, found.poles
    static, count = None, int(measured.driving.sum())
    if found.above.any():
        if count < len(measured.dofs):
            notes.append(
                f"{count} of {len(measured.dofs)} points are driving points: what the modes left out add at the others "
                "is estimated from these"
            )
        static = (shapes / wr**2) @ shapes.T + _whole(measured, found.above)
    return ModalStructure(omega=wr, mode_shapes=shapes, static_compliance=static, dofs=measured.dofs, damping_ratio=zr)
