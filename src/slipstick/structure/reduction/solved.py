"""The computation behind a reduction whose residuals are applied by solutions: modes, and sizes of what they leave out.

Nothing here is as large as the square of the number of directions. What needs whole residuals, the error of the
reduction, takes some exact columns instead of all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy import sparse

from slipstick.errors import InputError
from slipstick.solve.linear.factorisation import Factorisation, SingularMatrixError, factorise, shifted
from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.solve.linear.modes import EigenError, Modes
from slipstick.structure.reduction.near_field import Neighbours, near_fields, neighbours, sampled
from slipstick.structure.reduction.request import Accuracy
from slipstick.structure.residuals import NearField
from slipstick.structure.truncation import ReceptanceSize, Truncation, band_error_of
from slipstick.typing import Array, IntArray, Sparse

_PRODUCTS = 1000
"""Products with a receptance that a curve takes, for the choice between both kinds."""

_COLUMNS = 11
"""Of each: the harmonics 0 to 5."""

ALWAYS_WRITTEN = 500
"""Directions up to which residuals are written out."""

MOST_WRITTEN_BYTES = 4e9
"""Memory that residuals written out may take."""


def cheaper_solved(n_keep: int, factors: int) -> bool:
    """Whether solutions cost less than matrices, over reduction and one curve, by operations.

    ``factors`` are the bytes of the factorised stiffness.
    """
    if n_keep <= ALWAYS_WRITTEN:
        return False
    if 16.0 * n_keep**2 > MOST_WRITTEN_BYTES:
        return True
    solution = 4.0 * factors / 12.0
    matrices = 2.0 * n_keep * solution + _PRODUCTS * _COLUMNS * 4.0 * n_keep**2
    return (2.0 * _COLUMNS * _PRODUCTS + 500.0) * solution < matrices


ANSWERS = {True: "yes", False: "no", None: "unknown"}
"""How the store says whether no mode is missing."""

_STORED = (
    "omega", "amplitudes", "load_static", "load_second", "sample", "sample_static", "sample_second", "residuals",
)  # fmt: skip
_SEEN = ("seen_modes", "seen_loads", "seen_second")


@dataclass(frozen=True, kw_only=True)
class SolvedData:
    """What is computed and stored: everything but names, damping and the full model. Loads come after the kept ones.

    Whole responses: those of the modes are still in them, but not in the near fields.
    """

    omega: Array
    amplitudes: Array
    """``[B, P]^T phi``, (n_keep + n_loads, n_modes)."""
    load_static: Array
    """``[B, P]^T K^-1 P``, (n_keep + n_loads, n_loads)."""
    load_second: Array
    sample: IntArray
    sample_static: Array
    """Columns of ``B^T K^-1 B``, (n_keep, n_sample)."""
    sample_second: Array
    near: NearField
    near_second: NearField
    residuals: Array
    solver: str
    complete: bool | None = None
    error_estimate: float | None = None
    seen_modes: Array | None = None
    """Modes at the rows seen, (n_seen, n_modes)."""
    seen_loads: Array | None = None
    """Static response to the loads there, (n_seen, n_loads)."""
    seen_second: Array | None = None
    """Second response to the loads at the last rows seen, those of strains, less its modal part."""
    seconds: Mapping[str, float] = field(default_factory=dict)
    factors: Factorisation | None = None
    """Of the stiffness, where they are at hand."""

    def second_columns(self) -> Array:
        """``sample_second`` less its modal part."""
        a = self.amplitudes[: len(self.sample_second)]
        return np.asarray(self.sample_second - (a / self.omega**4) @ a[self.sample].T)

    def arrays(self) -> dict[str, Any]:
        """For the store: the near fields have one pattern; factors are made again."""
        pattern = self.near.entries
        return {
            **{name: getattr(self, name) for name in _STORED},
            **{name: np.asarray(value, np.float32) for name in _SEEN if (value := getattr(self, name)) is not None},
            "near_indices": pattern.indices, "near_indptr": pattern.indptr,
            "near_entries": np.array([pattern.data, self.near_second.entries.data]),
            "near_share": np.array([self.near.share, self.near_second.share]),
            "solver": np.array(self.solver), "complete": np.array(ANSWERS[self.complete]),
            "error_estimate": np.array(np.nan if self.error_estimate is None else self.error_estimate),
        }  # fmt: skip

    @classmethod
    def of(
        cls, arrays: Mapping[str, Any], n_keep: int, n_loads: int, n_seen: int = 0, n_strains: int = 0
    ) -> SolvedData | None:
        """From the store; None where they do not fit, or a KeyError, TypeError or ValueError."""
        n, modes, s = n_keep + n_loads, arrays["omega"].size, len(arrays["sample"])
        sizes: dict[str, tuple[int, ...]] = {
            "omega": (modes,), "amplitudes": (n, modes), "load_static": (n, n_loads), "load_second": (n, n_loads),
            "sample": (s,), "sample_static": (n_keep, s), "sample_second": (n_keep, s), "residuals": (modes,),
        }  # fmt: skip
        sizes |= {"seen_modes": (n_seen, modes), "seen_loads": (n_seen, n_loads)} if n_seen else {}
        sizes |= {"seen_second": (n_strains, n_loads)} if n_strains else {}
        estimate, (near, near_second) = float(arrays["error_estimate"]), _stored_near(arrays)
        if near.entries.shape != (n_keep, n_keep) or any(arrays[name].shape != size for name, size in sizes.items()):
            return None
        return cls(
            **{name: arrays[name] for name in sizes}, near=near, near_second=near_second, solver=str(arrays["solver"]),
            complete={word: answer for answer, word in ANSWERS.items()}[str(arrays["complete"])],
            error_estimate=None if np.isnan(estimate) else estimate,
        )  # fmt: skip


def _stored_near(arrays: Mapping[str, Any]) -> list[NearField]:
    indices, indptr = arrays["near_indices"], arrays["near_indptr"]
    n = len(indptr) - 1
    found = []
    for entries, share in zip(arrays["near_entries"], arrays["near_share"], strict=True):
        matrix = sparse.csr_array((entries, indices, indptr), shape=(n, n))
        matrix.check_format(full_check=True)
        found.append(NearField(entries=matrix, share=float(share)))
    return found


class _Columns:
    """Exact columns of the full model: of some directions, and of all loads."""

    def __init__(
        self, iteration: BlockLanczos, M: Sparse, directions: Any, loads: Array, seen: Any, n_strains: int
    ) -> None:
        self.directions, self.n_keep, self.seen, self.n_strains = directions, directions.shape[1], seen, n_strains
        self.everything = sparse.csc_array(sparse.hstack([directions, sparse.csc_array(loads)]))
        self.sample = sampled(self.n_keep)
        static, second = self._both(iteration, M, self.everything[:, [*self.sample, *self._loads]])
        s = len(self.sample)
        self.static, self.second = static[: self.n_keep, :s], second[: self.n_keep, :s]
        self.load_static, self.load_second = static[:, s:], second[:, s:]

    @property
    def _loads(self) -> range:
        return range(self.n_keep, self.everything.shape[1])

    def _both(self, iteration: BlockLanczos, M: Sparse, forces: Any) -> tuple[Array, Array]:
        U = iteration.solve(forces.toarray())
        V, s = iteration.solve(np.asfortranarray(M @ U)), len(self.sample)
        if self.seen is not None:
            self.seen_loads = self.seen.T @ U[:, s:]
            self.seen_second = self.seen.tocsc()[:, self.seen.shape[1] - self.n_strains :].T @ V[:, s:]
        return self.everything.T @ U, self.everything.T @ V

    def seen_parts(self, omega: Array, shapes: Array, a: Array) -> dict[str, Any]:
        """Modes (n, n_modes) at the rows seen, and both responses to the loads there; ``a`` as of ``estimate``."""
        if self.seen is None:
            return {}
        modes = np.asarray(self.seen.T @ shapes)
        if not self.n_strains:
            return {"seen_modes": modes, "seen_loads": self.seen_loads}
        modal = (modes[-self.n_strains :] / omega**4) @ a[self.n_keep :].T
        return {"seen_modes": modes, "seen_loads": self.seen_loads, "seen_second": self.seen_second - modal}

    def size(self, omega: Array, a: Array) -> ReceptanceSize:
        """Of the receptance with modes ``a`` (n_keep + n_loads, n_modes), undamped."""
        kept, loads = a[: self.n_keep], a[self.n_keep :]
        residual = self.static - (kept / omega**2) @ kept[self.sample].T
        of_loads = self.load_static[: self.n_keep] - (kept / omega**2) @ loads.T
        return ReceptanceSize(omega, kept, residual, loads, of_loads, self.sample)

    def estimate(self, omega: Array, a: Array, top: float) -> float:
        """Largest relative error of the receptance up to ``top`` (rad/s), as the residuals tell it."""
        n, loads = self.n_keep, a[self.n_keep :]
        kept = a[:n]
        own = np.sum((kept / omega) ** 2, axis=1)
        own[self.sample] = self.static[self.sample, np.arange(len(self.sample))]
        left_out = Truncation(
            omega=omega, mode_shapes=kept, static_compliance=self.static,
            second_residual=self.second - (kept / omega**4) @ kept[self.sample].T, participation=loads,
            load_response=self.load_static[:n], second_load_response=self.load_second[:n] - (kept / omega**4) @ loads.T,
            sample=self.sample, own=own,
        )  # fmt: skip
        return float(left_out.error(top * np.linspace(0.02, 1.0, 50)).max())


def compute_solved(
    iteration: BlockLanczos,
    M: Sparse,
    directions: Any,
    loads: Array,
    want: Accuracy,
    limits: tuple[int, int, float],
    start: Callable[[str], None],
    seen: Any = None,
    n_strains: int = 0,
) -> SolvedData:
    """All of :class:`SolvedData`; ``start`` announces a stage.

    ``seen`` (n, n_seen) are rows seen besides, the last ``n_strains`` of them strains; ``limits`` are the most modes by
    default, at all, and how far they serve without a range, in first frequencies.
    """
    start("static solutions of some directions")
    columns = _Columns(iteration, M, directions, loads, seen, n_strains)
    start("modes")
    modes, error = _modes(iteration, columns, want, limits)
    a = np.asarray(columns.everything.T @ modes.shapes)
    omega, kept, solver = modes.omega, a[: columns.n_keep], iteration.solver
    iteration.basis = None  # type: ignore[assignment]
    residuals, complete = modes.residuals, modes.complete
    seen_parts = columns.seen_parts(omega, modes.shapes, a)
    del modes
    start("near field of what the modes leave out")

    def residual(x: Array) -> Array:
        U = iteration.solve(np.asfortranarray(directions @ x))
        modal, out = kept.T @ x, np.empty((2, *x.shape))
        out[0] = directions.T @ U - kept @ (modal / omega[:, None] ** 2)
        out[1] = directions.T @ iteration.solve(np.asfortranarray(M @ U)) - kept @ (modal / omega[:, None] ** 4)
        return out

    exact = np.array([
        both - (kept / omega**power) @ kept[columns.sample].T
        for both, power in ((columns.static, 2), (columns.second, 4))
    ])  # fmt: skip
    known: Neighbours = neighbours(iteration.K, directions)
    near, near_second = near_fields(residual, known, columns.sample, exact)
    return SolvedData(
        omega=omega, amplitudes=a, load_static=columns.load_static, load_second=columns.load_second,
        sample=columns.sample, sample_static=columns.static, sample_second=columns.second, near=near,
        near_second=near_second, residuals=residuals, solver=solver, complete=complete, error_estimate=error,
        **seen_parts,
    )  # fmt: skip


def _modes(
    iteration: BlockLanczos, columns: _Columns, want: Accuracy, limits: tuple[int, int, float]
) -> tuple[Modes, float | None]:
    """As many as are asked for, or as the accuracy needs; then the error over the range."""
    by_default, most, band = limits
    if want.modes is not None:
        return iteration.modes(min(want.modes, iteration.n)), None
    limit = min(by_default if want.highest is None else most, iteration.n)
    probe = None if want.highest is None else _Probe(iteration, columns, want.highest)
    n_modes = min(16 if probe is None else max(8, (probe.below or 0) + 4), limit)
    while True:
        omega, a = iteration.participations(n_modes, columns.everything)
        if probe is None:
            error = columns.estimate(omega, a, max(band * omega[0], want.reach))
            if error <= want.relative or n_modes >= limit:
                return iteration.modes(n_modes), None
        else:
            error = probe.error(omega, a)
            if error <= (1.0 if n_modes >= limit else 0.5) * want.relative or n_modes == iteration.n:
                return iteration.modes(n_modes), error
            if n_modes >= limit:
                raise EigenError(
                    f"{n_modes} modes leave a relative error of {error:.1e} up to {want.highest:g} rad/s where "
                    f"{want.relative:.1e} was asked; ask for less accuracy or a lower highest frequency"
                )
        n_modes = min(max(n_modes + 8, n_modes + n_modes // 4), limit)


class _Probe:
    """The full model at the highest frequency, at the same directions and loads."""

    def __init__(self, iteration: BlockLanczos, columns: _Columns, top: float) -> None:
        self._columns, self._top = columns, top
        try:
            factors = factorise(shifted(iteration.K, iteration.M, top**2), solver=iteration.solver)
        except SingularMatrixError as error:
            raise InputError(
                f"{top:g} rad/s is a natural frequency to working accuracy; choose one beside it"
            ) from error
        self.below = None if factors.inertia is None else factors.inertia.negative
        chosen = columns.everything[:, [*columns.sample, *columns._loads]]
        self._exact = np.asarray(columns.everything.T @ factors.solve(chosen.toarray()))

    def error(self, omega: Array, a: Array) -> float:
        """Largest relative error up to the highest frequency, see ``band_error``."""
        c, n, top = self._columns, self._columns.n_keep, self._top
        chosen = a[[*c.sample, *c._loads]]
        s = len(c.sample)
        static = np.hstack([np.vstack([c.static, c.load_static[:n, :].T[:, c.sample]]), c.load_static])
        second = np.hstack([np.vstack([c.second, c.load_second[:n, :].T[:, c.sample]]), c.load_second])
        residual, left_out = static - (a / omega**2) @ chosen.T, second - (a / omega**4) @ chosen.T
        reduced = (a / (omega**2 - top**2)) @ chosen.T + residual + top**2 * left_out
        forms = [self._form(form, s) for form in (self._exact - reduced, left_out)]
        return band_error_of(c.size(omega, a), omega, top=top, missing=forms[0], second=forms[1])

    def _form(self, form: Array, s: int) -> tuple[Array, Array]:
        """Norms between directions and from each load, and what can hide behind cancelling terms."""
        n, share = self._columns.n_keep, self._columns.n_keep / s
        norms = np.concatenate([[np.sqrt(share) * np.linalg.norm(form[:n, :s])], np.linalg.norm(form[:n, s:], axis=0)])
        trace = share * float(form[self._columns.sample, np.arange(s)].sum())
        own = np.maximum(np.diag(form[n:, s:]), 0.0)
        return norms, np.concatenate([[0.0], np.sqrt(own * max(trace, 0.0))])
