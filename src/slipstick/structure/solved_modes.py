"""A structure of modes whose residuals are applied by solutions with the full model, not written out.

For thousands of directions, whose residuals would fill memory and take a solution for each direction. Products with
both residuals take two solutions, of all harmonics together (``structure/residuals.py``).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.structure.checks import any_directions
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.receptance import ModalReceptance, Receptance
from slipstick.structure.residuals import SOLVED, FullModel, NearField, Residuals, SolvedResiduals, SolvedStatic
from slipstick.structure.skin import Skin, SolvedFields
from slipstick.structure.strains import Strains
from slipstick.structure.truncation import Truncation, load_arrays
from slipstick.typing import Array, ComplexArray, IntArray, Reals

FEW = 64
"""Directions or rows up to which receptances are written out: it takes two solutions for each."""

MOST_WRITTEN = 2**24
"""Entries of a receptance (134 MB) up to which it is written out where all are needed."""


class SolvedModes(ModalStructure):
    """Mass-normalised modes at some dofs of a full model, which solves for what they leave out.

    The receptance is that of a :class:`ModalStructure`, to rounding. ``static_compliance`` and ``second_residual`` are
    written out at first use, of a few thousand dofs at most.

    Parameters
    ----------
    omega, mode_shapes, dofs, loss_factor, damping_ratio, load_shapes, damping, skin, strains
        As of a ``ModalStructure``; static responses of the last two may be solved for with the full model.
    full
        The full model, its ``directions`` those of the dofs.
    near, near_second
        Near fields of both residuals, for bounds and entries of single contacts.
    sample
        Dofs (n_sample,) whose columns ``sample_static``, ``sample_second`` (n_dofs, n_sample) of the static compliance
        and the second-order residual are known: a sample for estimates of the error of the reduction.
    reference
        Frequencies (n_modes,) of the modes when the model was reduced; None: ``omega``.
    """

    residuals = "solved"
    """Kind of the residuals in results."""

    def __init__(
        self,
        *,
        omega: Reals,
        mode_shapes: Reals,
        dofs: Iterable[str],
        full: FullModel,
        near: NearField,
        near_second: NearField,
        sample: IntArray,
        sample_static: Array,
        sample_second: Array,
        reference: Array | None = None,
        loss_factor: Reals = 0.0,
        damping_ratio: Reals = 0.0,
        load_shapes: Mapping[str, LoadShape] | None = None,
        damping: float = 1.0,
        skin: Skin | None = None,
        strains: Strains | None = None,
    ) -> None:
        self.full, self.near, self.near_second = full, near, near_second
        self.n_full = full.K.shape[0]
        super().__init__(
            omega=omega, mode_shapes=mode_shapes, dofs=dofs, loss_factor=loss_factor, damping_ratio=damping_ratio,
            load_shapes=load_shapes, damping=damping, skin=skin, strains=strains,
        )  # fmt: skip
        self.sample, self.sample_static, self.sample_second = np.asarray(sample), sample_static, sample_second
        self.reference = self.omega if reference is None else np.asarray(reference, dtype=float)

    def _take_compliance(self, compliance: Array | None, second: Array | None) -> None:
        """Static compliance and residuals come from the full model."""
        self._knows_residual = True

    def _follow_modes(self, more: Array) -> None:
        """The residuals stay."""

    @property
    def arguments(self) -> dict[str, Any]:
        """What an equal structure is made from."""
        names = (
            "omega", "mode_shapes", "dofs", "full", "near", "near_second", "sample", "sample_static", "sample_second",
            "reference", "loss_factor", "damping",
        )  # fmt: skip
        numbers = {name: getattr(self, name) for name in names}
        seen = {name: part for name in ("skin", "strains") if (part := getattr(self, name)) is not None}
        return {**numbers, "damping_ratio": self._viscous, "load_shapes": self.shapes, **seen}

    def left_out(self, rows: Any, modes: Array, forces: Array, *, second: bool = False) -> SolvedFields:
        """Residuals at rows of the full model under fields of forces on the dofs, by solutions.

        Parameters
        ----------
        rows
            Directions of the full model, sparse (n_full, n_rows); ``modes`` (n_rows, n_modes) are the modes there.
        forces
            Orthonormal (n_dofs, k): one solution for each, or two with the ``second``-order residual.
        """
        k, onto = forces.shape[1], sparse.csr_array(self.full.directions)
        out, participation = np.zeros((1 + second, rows.shape[1], k)), self.mode_shapes.T @ forces
        for part in (slice(begin, begin + SOLVED) for begin in range(0, k, SOLVED)):
            loads = onto @ forces[:, part]
            both = self.full.solutions(loads, np.full(loads.shape[1], second))
            for residual, moved, power in zip(out, both, (2, 4), strict=False):
                residual[:, part] = rows.T @ moved - modes @ (participation[:, part] / self.reference[:, None] ** power)
        return SolvedFields(forces, *out)

    @property
    def static_compliance(self) -> Array:  # type: ignore[override]
        """Exact rows of ``K^-1`` at the dofs (n_dofs, n_dofs), written out; InputError where they are too many."""
        return self._all()[2]

    @property
    def second_residual(self) -> Array | None:  # type: ignore[override]
        """The second-order residual, likewise."""
        return self._all()[3]

    def _all(self) -> tuple[Array, Array, Array, Array | None]:
        unit = sparse.eye_array(len(self._dofs), format="csc")
        return self.modal_parts(unit, unit, ())

    @cached_property
    def _truncation(self) -> Truncation:
        own = self.near.own + np.sum((self.mode_shapes / self.omega) ** 2, axis=1)
        return Truncation(
            omega=self.omega, mode_shapes=self.mode_shapes, static_compliance=self.sample_static,
            second_residual=self.sample_second, sample=self.sample, own=own,
            **load_arrays([shape.arrays() for shape in self.shapes.values()]),
        )  # fmt: skip

    def own_compliance(self, along: Any) -> tuple[Array, Array]:
        """Static compliances of directions along themselves: total, and of the modes left out, by the near field."""
        columns = any_directions("directions", along, len(self._dofs))
        left_out = np.asarray((columns * (self.near.entries @ columns)).sum(axis=0)).ravel()
        return left_out + np.sum(((columns.T @ self.mode_shapes) / self.omega) ** 2, axis=1), left_out

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between directions, see ``ModalStructure``: written out between few, else applied by solutions."""
        if min(np.shape(rows)[1], np.shape(columns)[1]) <= FEW:
            return super().project(rows, columns, shapes)
        residuals, left, right = self._residuals(rows, columns, shapes)
        return SolvedModesReceptance(
            residuals, left=left, right=right, stiffness=self.omega**2 * (1.0 + 1j * self.loss_factor),
            damping=2.0 * self._viscous * self.omega, factor=self.damping,
        )  # fmt: skip

    def modal_parts(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str]
    ) -> tuple[Array, Array, Array, Array | None]:
        """Modes at the rows, participations of the columns, static and second compliance, written out."""
        residuals, left, right = self._residuals(rows, columns, shapes)
        residual, second = written(residuals)
        return left, right, residual + (left / self.omega**2) @ right.T, second

    def _residuals(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str]
    ) -> tuple[SolvedResiduals, Array, Array]:
        """The residuals, the modes at the rows, and the participations of the columns."""
        right, n = self._participations(columns, shapes), len(self._dofs)
        r, c = any_directions("rows", rows, n), any_directions("columns", columns, n)
        chosen = [self.shapes[name] for name in shapes]
        left, participation = r.T @ self.mode_shapes, right[c.shape[1] :]
        static = [np.asarray(s.static_response) for s in chosen]
        second = [np.zeros(n) if s.second_response is None else np.asarray(s.second_response) for s in chosen]
        loads = np.array([r.T @ np.column_stack([np.zeros((n, 0)), *both]) for both in (static, second)])
        if chosen:
            loads[0] -= (left / self.omega**2) @ participation.T
        residuals = SolvedResiduals(
            self.full, r, c, omega=self.reference, left=left, right=right, loads=loads,
            near=(self.near, self.near_second),
        )  # fmt: skip
        return residuals, left, right

    def __repr__(self) -> str:
        return f"SolvedModes({self.omega.size} modes, {len(self._dofs)} dofs of {self.full.K.shape[0]})"


class SolvedModesReceptance(ModalReceptance):
    """A ``ModalReceptance`` whose residuals are applied by solutions."""

    def __init__(
        self, residuals: SolvedResiduals, *, left: Array, right: Array, stiffness: ComplexArray, damping: Array,
        factor: float,
    ) -> None:  # fmt: skip
        self._residuals = residuals
        nothing: Any = residuals  # there are two, and no matrices
        super().__init__(
            left=left, right=right, stiffness=stiffness, damping=damping, factor=factor, residual=nothing,
            second=nothing, static=SolvedStatic(residuals, left, right, np.sqrt(stiffness.real)),  # type: ignore[arg-type]
        )  # fmt: skip

    @property
    def _parts(self) -> Residuals:
        return self._residuals

    def nearly(self) -> SolvedModesReceptance:
        """An approximation without solutions, see ``SolvedResiduals.nearly``."""
        residuals = self._residuals.nearly()
        if residuals is self._residuals:
            return self
        near = copy(self)
        near._residuals = residuals
        return near

    def _static_with(self, omega: Array, old: Array) -> Any:
        return SolvedStatic(self._residuals, self._left, self._right, omega)

    @cached_property
    def _entries(self) -> tuple[Array, Array]:
        return written(self._residuals)

    def written(self) -> ModalReceptance:
        """The same with all entries; InputError where they are too many."""
        residual, second = self._entries
        return ModalReceptance(
            left=self._left, right=self._right, stiffness=self._stiffness, damping=self._viscous.imag,
            factor=self._factor, residual=residual, second=second,
            static=residual + (self._left / self._stiffness.real) @ self._right.T,
        )  # fmt: skip

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, written out."""
        return self.written().at(orders, omega)

    def conjugates(self, orders: Array, omega: float) -> ComplexArray:
        """As of a modal receptance, written out."""
        return self.written().conjugates(orders, omega)

    def conjugates_of(self, orders: Array, omega: Array, out: ComplexArray) -> None:
        """As of a modal receptance, written out."""
        self.written().conjugates_of(orders, omega, out)

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter, written out."""
        return self.written().by_parameter(name, orders, omega)

    def static_by_parameter(self, name: str) -> Array:
        """Derivative of the static compliance by a parameter, written out."""
        return self.written().static_by_parameter(name)

    def answer(self, orders: Array, omega: Array, forces: Array) -> Array:
        """``A F``, see ``ModalReceptance``: all frequencies in one pair of solutions."""
        factors = [self.factors(orders, float(w)) for w in omega]
        G = np.concatenate(list(np.ascontiguousarray(forces).view(complex)), axis=1)
        weight = np.concatenate([f.weight[1:] for f in factors]).conj().T
        part_weight = np.concatenate([f.part_weight[:, 1:] for f in factors], axis=1).conj()
        modal = (self._right.T @ G.view(float)).view(complex) * weight
        out = (self._left @ modal.view(float)).view(complex) + self._residuals.times(G, part_weight)
        return np.stack(np.split(out, omega.size, axis=1)).view(float)


def written(residuals: SolvedResiduals) -> tuple[Array, Array]:
    """Both residuals with all entries; InputError where they are too many."""
    rows, columns = residuals.shape
    if rows * columns > MOST_WRITTEN and min(rows, columns) > FEW:
        found = f"{rows} by {columns} directions of a structure whose residuals are solved for"
        raise InputError(
            Fault(
                "structure",
                found=found,
                expected=f"at most {MOST_WRITTEN} entries where all of them are needed",
                remedy='analyses of single entries (stability, nonlinear modes, options={"jacobian": "dense"}) need '
                'fewer contacts, or residuals="written" where that fits into memory',
            )
        )
    return residuals.written()
