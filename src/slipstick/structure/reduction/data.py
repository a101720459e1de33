"""Data of a reduction: modes, static solutions at a few directions, and residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse

from slipstick.solve.linear.factorisation import Factorisation
from slipstick.structure.residuals import NearField
from slipstick.structure.truncation import ReceptanceSize, Truncation, band_error
from slipstick.typing import AnyArray, Array, IntArray, Sparse

_STORED = ("omega", "amplitudes", "static", "second", "residuals")
_SEEN = ("seen_modes", "seen_static", "seen_second")
"""Arrays of the store by the names of fields; the latter at recovery rows, in single precision."""

_ANSWERS = {True: "yes", False: "no", None: "unknown"}


class Columns(NamedTuple):
    """Directions of a full model: kept ones (n, n_keep), loads (n, n_loads), recovery rows (n, n_seen).

    The last ``n_strains`` recovery rows are strains. They keep the second-order residual too, because modes left out
    matter more in strains than in displacements.
    """

    directions: Sparse
    loads: Array
    seen: Sparse | None = None
    n_strains: int = 0

    @property
    def all(self) -> Any:
        """Directions and then loads, sparse by columns, (n, n_keep + n_loads)."""
        return sparse.csc_array(sparse.hstack([self.directions, sparse.csc_array(self.loads)]))

    def of(self, arrays: Mapping[str, AnyArray]) -> ReducedData | None:
        """Stored data of these directions; None where the arrays do not fit."""
        n_seen = 0 if self.seen is None else self.seen.shape[1]
        return ReducedData.of(arrays, self.directions.shape[1], self.loads.shape[1], n_seen, self.n_strains)


@dataclass(frozen=True, kw_only=True)
class ReducedData:
    """All but names, damping and the full model. Loads are the columns after the kept ones.

    Where residuals are solved for, no array is as large as the square of the number of directions. The columns below
    are then those of a ``sample`` of directions and of the loads, at recovery rows those of the loads alone.
    """

    omega: Array
    amplitudes: AnyArray
    """``[B, P]^H phi``, (n_keep + n_loads, n_modes)."""
    static: AnyArray
    """``[B, P]^H K^-1 [B, P]``, (n_keep + n_loads, n_columns)."""
    second: AnyArray
    """``[B, P]^H K^-1 M K^-1 [B, P]``, its modal part included."""
    residuals: Array
    solver: str
    complete: bool | None = None
    error_estimate: float | None = None
    seen_modes: AnyArray | None = None
    """Modes at the recovery rows, (n_seen, n_modes)."""
    seen_static: AnyArray | None = None
    """``K^-1 [B, P]`` at the recovery rows."""
    seen_second: AnyArray | None = None
    """``K^-1 M K^-1 [B, P]`` at the rows of strains, less its modal part."""
    sample: IntArray | None = None
    """Directions that have columns; None: all."""
    near: tuple[NearField, NearField] | None = None
    """Near fields of both residuals, where these are solved for."""
    seconds: Mapping[str, float] = field(default_factory=dict)
    factors: Factorisation | None = None
    """Factors of the stiffness, where residuals are solved for and the factors exist."""

    def arrays(self) -> dict[str, Any]:
        """Arrays for the store; both near fields have one pattern, factors are not stored."""
        made = {
            **{name: getattr(self, name) for name in _STORED},
            **{name: np.asarray(value, np.float32) for name in _SEEN if (value := getattr(self, name)) is not None},
            "solver": np.array(self.solver),
            "complete": np.array(_ANSWERS[self.complete]),
            "error_estimate": np.array(np.nan if self.error_estimate is None else self.error_estimate),
        }
        if self.sample is not None and self.near is not None:
            pattern = self.near[0].entries
            made |= {"sample": self.sample, "near_indices": pattern.indices, "near_indptr": pattern.indptr}
            made |= {"near_entries": np.array([field.entries.data for field in self.near])}
            made |= {"near_share": np.array([field.share for field in self.near])}
        return made

    @classmethod
    def of(
        cls, arrays: Mapping[str, Any], n_keep: int, n_loads: int, n_seen: int = 0, n_strains: int = 0
    ) -> ReducedData | None:
        """Data from the arrays of the store; None, KeyError, TypeError or ValueError where they do not fit."""
        sample, near, n, known = arrays.get("sample"), None, n_keep + n_loads, n_loads
        columns = n if sample is None else len(sample) + n_loads
        if sample is None:
            known = n
        else:
            near = _stored_near(arrays, n_keep)
        modes, estimate = arrays["omega"].size, float(arrays["error_estimate"])
        sizes: dict[str, tuple[int, ...]] = {
            "omega": (modes,), "amplitudes": (n, modes), "static": (n, columns), "second": (n, columns),
            "residuals": (modes,),
        }  # fmt: skip
        sizes |= {"seen_modes": (n_seen, modes), "seen_static": (n_seen, known)} if n_seen else {}
        sizes |= {"seen_second": (n_strains, known)} if n_strains else {}
        if any(arrays[name].shape != size for name, size in sizes.items()):
            return None
        return cls(
            **{name: arrays[name] for name in sizes},
            sample=sample,
            near=near,
            solver=str(arrays["solver"]),
            complete={word: answer for answer, word in _ANSWERS.items()}[str(arrays["complete"])],
            error_estimate=None if np.isnan(estimate) else estimate,
        )

    @property
    def chosen(self) -> slice | IntArray:
        """Directions and loads that have columns."""
        if self.sample is None:
            return slice(None)
        n, loads = len(self.amplitudes), self.static.shape[1] - len(self.sample)
        return np.concatenate([self.sample, np.arange(n - loads, n)])

    def left_over(self, whole: AnyArray, power: int) -> AnyArray:
        """Columns less their modal part ``sum_r a_r a_r^H / w_r^power``."""
        a = self.amplitudes
        return np.asarray(whole - (a / self.omega**power) @ a[self.chosen].conj().T)

    @property
    def second_residual(self) -> AnyArray:
        """``second`` less its modal part; of all columns symmetric or Hermitian."""
        left = self.left_over(self.second, 4)
        return left if self.sample is not None else np.asarray(0.5 * (left + left.conj().T))

    def band_error(self, n_keep: int, top: float, exact: AnyArray) -> float:
        """Largest relative error of the receptance up to ``top`` (rad/s), where the full model has ``exact``."""
        a, w2 = self.amplitudes, self.omega**2
        kept, loads, s = a[:n_keep], a[n_keep:], self._sampled(n_keep)
        residual, second = self.left_over(self.static, 2), self.second_residual
        size = ReceptanceSize(self.omega, kept, residual[:n_keep, :s], loads.conj(), residual[:n_keep, s:], self.sample)
        reduced = (a / (w2 - top**2)) @ a[self.chosen].conj().T + residual + top**2 * second
        return band_error(
            size, self.omega, n_keep, top=top, missing=exact - reduced, second=second, sample=self.sample
        )  # fmt: skip

    def left_out(self, n_keep: int) -> Truncation:
        """Errors by the modes left out, from the residuals."""
        a, second, own, s = self.amplitudes, self.second_residual, None, self._sampled(n_keep)
        static, second, kept = self.static[:n_keep], second[:n_keep], a[:n_keep]
        if self.sample is not None:
            own = np.sum((kept / self.omega) ** 2, axis=1)
            own[self.sample] = static[self.sample, np.arange(s)]
        return Truncation(
            omega=self.omega, mode_shapes=kept, static_compliance=static[:, :s], second_residual=second[:, :s],
            participation=a[n_keep:].conj(), load_response=static[:, s:], second_load_response=second[:, s:],
            sample=self.sample, own=own,
        )  # fmt: skip

    def estimate(self, n_keep: int, top: float) -> float:
        """Largest relative error of the receptance up to ``top`` (rad/s)."""
        return float(self.left_out(n_keep).error(top * np.linspace(0.02, 1.0, 50)).max())

    def _sampled(self, n_keep: int) -> int:
        """Number of columns that belong to directions."""
        return n_keep if self.sample is None else len(self.sample)


def _stored_near(arrays: Mapping[str, Any], n: int) -> tuple[NearField, NearField]:
    pair = [
        sparse.csr_array((entries, arrays["near_indices"], arrays["near_indptr"]), shape=(n, n))
        for entries in arrays["near_entries"]
    ]
    for matrix in pair:
        matrix.check_format(full_check=True)
    first, second = (
        NearField(entries=entries, share=float(share))
        for entries, share in zip(pair, arrays["near_share"], strict=True)
    )
    return first, second
