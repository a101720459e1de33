"""Structure given by modes and its exact static compliance (THEORY.md (10.1))."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import one, shown
from slipstick.html import dofs_words
from slipstick.structure.checks import (
    REAL_MODES,
    any_directions,
    array_faults,
    checked_names,
    known_shapes,
    named_shapes,
    number_faults,
    real,
    symmetry_faults,
)
from slipstick.structure.dynamic import checked_values
from slipstick.structure.matrix_checks import fed_modes, semidefinite_to
from slipstick.structure.npz import array_shapes, read_any, read_arrays
from slipstick.structure.protocol import Structure, TimeEquations
from slipstick.structure.receptance import MODE_QUANTITIES, ModalReceptance, Receptance, mode_name, mode_place
from slipstick.structure.skin import Skin, with_more
from slipstick.structure.strains import Strains
from slipstick.structure.truncation import Truncation, load_arrays
from slipstick.typing import Array, Reals
from slipstick.units import Units

_COMPLIANCES = ("static_compliance", "second_residual")
"""Arrays that may be left out."""

RESIDUAL_ROUNDING = 1e-4
"""Negative residual that rounding of exported modes explains, relative to the total."""

_NEEDED = {"omega": 1, "mode_shapes": 2, "static_compliance": 2}
_DAMPING = ("loss_factor", "damping_ratio")
_LOAD = ("load_participation", "static_load_response", "second_load_response")


@dataclass(frozen=True, kw_only=True)
class LoadShape:
    """A distributed load of unit amplitude.

    Parameters
    ----------
    participation
        Modal forces ``phi_r^T load``, (n_modes,).
    static_response
        Exact static displacement of the dofs, ``K^-1 load``, (n_dofs,).
    second_response
        ``K^-1 M K^-1 load - sum_r phi_r (phi_r^T load) / w_r^4`` at the dofs, (n_dofs,), or None.
    """

    participation: Reals
    static_response: Reals
    second_response: Reals | None = None

    def arrays(self) -> dict[str, Any]:
        """The arrays given, by name."""
        named = {name: getattr(self, name) for name in ("participation", "static_response", "second_response")}
        return {name: value for name, value in named.items() if value is not None}

    def real(self) -> LoadShape:
        """The same with float arrays."""
        return LoadShape(**{name: real(value) for name, value in self.arrays().items()})


class ModalStructure(Structure):
    """Mass-normalised modes at some dofs with the exact static compliance there.

    ``A(w) = sum_r phi_r phi_r^T / (w_r^2 (1 + i eta_r) + 2 i zeta_r w_r w - w^2)
    + [static_compliance - sum_r phi_r phi_r^T / w_r^2] / e + w^2 second_residual / e^2``

    with ``e = 1 + i eta`` where one loss factor holds for all modes (the modes left out have it too: this is the
    expansion of ``(K (1 + i eta) - w^2 M)^-1``), else ``e = 1`` (THEORY.md section 10).

    Parameters
    ----------
    omega
        Natural frequencies (n_modes,), rad/s, positive.
    mode_shapes
        Mass-normalised modes at the dofs (n_dofs, n_modes).
    static_compliance
        Exact rows of ``K^-1`` at the dofs (n_dofs, n_dofs), length/force, symmetric. None: that of the modes.
    dofs
        A name for each degree of freedom.
    loss_factor
        Hysteretic loss factor, >= 0.
    damping_ratio
        Viscous damping ratio, scalar or (n_modes,). A mode of negative damping, such as flutter, feeds energy in: a
        problem with it warns.
    second_residual
        ``K^-1 M K^-1 - sum_r phi_r phi_r^T / w_r^4`` at the dofs (n_dofs, n_dofs), or None. Like the residual in the
        static compliance it is a sum over the modes left out and has no negative eigenvalue.
    load_shapes
        Distributed loads by name.
    damping
        Factor on the viscous damping ratios, >= 0: the parameter "damping".
    skin
        Surface mesh of the body with its motion, for deflected shapes; None: not known.
    strains
        Strains at chosen elements, for ``branch.stress``; None: not known.

    Raises
    ------
    InputError
        With one sentence for each fault of the arrays and names.

    Examples
    --------
    >>> s = ModalStructure(omega=[10.0], mode_shapes=[[1.0]], static_compliance=[[0.02]], dofs=["tip"],
    ...                    load_shapes={"pressure": LoadShape(participation=[2.0], static_response=[0.03])})
    >>> s.project([[1.0]], [[1.0]], ["pressure"]).static
    array([[0.02, 0.03]])
    """

    sparse_directions = True
    """Whether ``project`` takes sparse matrices of directions too."""

    self_excited = ""
    """Modes of a symmetric stiffness do not grow by it."""

    n_full: int | None = None
    """Dofs of the full model that it solves with, None where it does not."""

    units: Units | None = None
    """Those of its numbers, of an imported model; a problem takes them, or refuses others. None: they are not known."""

    def __init__(
        self,
        *,
        omega: Reals,
        mode_shapes: Reals,
        dofs: Iterable[str],
        static_compliance: Reals | None = None,
        loss_factor: Reals = 0.0,
        damping_ratio: Reals = 0.0,
        second_residual: Reals | None = None,
        load_shapes: Mapping[str, LoadShape] | None = None,
        damping: float = 1.0,
        skin: Skin | None = None,
        strains: Strains | None = None,
    ) -> None:
        self._dofs, faults = checked_names(dofs)
        arguments = {
            "omega": omega,
            "mode_shapes": mode_shapes,
            "static_compliance": static_compliance,
            "loss_factor": loss_factor,
            "damping_ratio": damping_ratio,
            "second_residual": second_residual,
            "damping": damping,
        }
        shapes = named_shapes(load_shapes, faults)
        faults += modal_faults(arguments, shapes, len(self._dofs) or None)
        if faults:
            raise InputError(faults)
        self.omega, self.mode_shapes = real(omega), real(mode_shapes)
        self.loss_factor, self._viscous = real(loss_factor), real(damping_ratio)
        self.damping = float(real(damping))
        self.shapes = {name: shape.real() for name, shape in shapes.items()}
        self.skin = None if skin is None else one("skin", skin, Skin, "a structure.skin.Skin, or None")
        self.strains = None if strains is None else one("strains", strains, Strains, "a structure.strains.Strains")
        for part in (self.skin, self.strains):
            if part is not None:
                faults += part.faults(self.omega.size, len(self._dofs), tuple(self.shapes), self.n_full)
        if faults:
            raise InputError(faults)
        self._take_compliance(*(None if part is None else real(part) for part in (static_compliance, second_residual)))
        self.loss_factor = np.broadcast_to(self.loss_factor, self.omega.shape)
        self._viscous = np.broadcast_to(self._viscous, self.omega.shape)

    def _take_compliance(self, compliance: Array | None, second: Array | None) -> None:
        """Set static compliance and second-order residual."""
        self.second_residual = second
        self._modal_compliance = (self.mode_shapes / self.omega**2) @ self.mode_shapes.T
        self._knows_residual = compliance is not None
        self.static_compliance = self._modal_compliance if compliance is None else compliance
        self._check_residual()

    def _check_residual(self) -> None:
        """InputError where the modes left out would have negative compliance."""
        whole, modal = np.diag(self.static_compliance), np.diag(self._modal_compliance)
        worst = int(np.argmin(whole - modal))
        if whole[worst] - modal[worst] < -RESIDUAL_ROUNDING * modal[worst]:
            less = f"{whole[worst]:g} at dof {self._dofs[worst]!r} is less than the {modal[worst]:g} of the modes alone"
            remedy = "check that the modes are mass-normalised and that all arrays have the same units"
            raise InputError(Fault("static_compliance", less, remedy=remedy))
        second = self.second_residual
        faults = residual_faults("static_compliance", self.static_compliance - self._modal_compliance, whole)
        if second is not None:
            modal_second = np.sum((self.mode_shapes / self.omega**2) ** 2, axis=1)
            faults += residual_faults("second_residual", second, np.abs(np.diag(second)) + modal_second)
        if faults:
            raise InputError(faults)

    @cached_property
    def _truncation(self) -> Truncation:
        return Truncation(
            omega=self.omega,
            mode_shapes=self.mode_shapes,
            static_compliance=self.static_compliance,
            second_residual=self.second_residual,
            kind=self._kind,
            **load_arrays([shape.arrays() for shape in self.shapes.values()]),
        )

    @property
    def _kind(self) -> str:
        if not self._knows_residual:
            return "estimate" if self.omega.size == len(self._dofs) else "unknown"
        return "bound" if self.second_residual is None else "estimate"

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Errors by the modes left out, the same at every harmonic."""
        del order
        return (self._truncation,)

    def reduction_error(self, frequency: ArrayLike, relative_to: ArrayLike | None = None) -> Array:
        """Relative error of the receptance by the modes left out, at frequencies (rad/s), undamped, same shape.

        Relative to the receptance there, or at the frequencies ``relative_to``.

        The worst between dofs and from load shapes, estimated from the residuals (``slipstick.structure.truncation``):
        a bound below the last mode, mostly 1 to 5 times the error; without ``second_residual`` it can be far above it,
        without ``static_compliance`` it is zero, because nothing is known of what is left out.
        """
        zero = np.zeros(np.shape(frequency))
        return np.asarray(np.max([zero, *(each.error(frequency, relative_to) for each in self.truncations(1))], axis=0))

    @property
    def error_kind(self) -> str:
        """What :meth:`reduction_error` is: an "estimate", with static compliance alone a "bound", else "unknown".

        Modes as many as dofs that are all there is have nothing left out: an "estimate".
        """
        return next((each.kind for each in self.truncations(1)), "estimate")

    @property
    def last_mode(self) -> float:
        """Highest natural frequency kept, rad/s."""
        return float(self.omega.max())

    @cached_property
    def valid_to(self) -> float:
        """Frequency (rad/s) up to which the receptance is right to one percent, as far as the structure knows."""
        return min((each.valid_to for each in self.truncations(1)), default=float("inf"))

    @classmethod
    def from_arrays(
        cls,
        arrays: Mapping[str, Reals],
        *,
        dofs: Iterable[str] | None = None,
        loss_factor: Reals | None = None,
        damping_ratio: Reals | None = None,
        load: str = "pressure",
    ) -> ModalStructure:
        """A structure from named arrays, as stored in an npz file.

        Needed: ``omega``, ``mode_shapes``; known: ``static_compliance``, ``second_residual``, ``dofs``,
        ``loss_factor``, ``damping_ratio``, and of one load shape (called ``load``) ``load_participation``,
        ``static_load_response``, ``second_load_response``. Others are left alone. A damping given as an argument takes
        the place of the arrays' own. Without names the dofs are called ``n1x, n1y, n1z, n2x, ...``, three for each
        node.
        """
        missing = [name for name in ("omega", "mode_shapes") if name not in arrays]
        if missing:
            present = ", ".join(sorted(arrays)) or "nothing"
            raise InputError(
                [Fault("modal arrays", f"{name!r} is missing", remedy=f"found {present}") for name in missing]
            )
        shapes = {}
        if "load_participation" in arrays:
            if "static_load_response" not in arrays:
                raise InputError(Fault("modal arrays", "'static_load_response' is missing beside 'load_participation'"))
            shapes[load] = LoadShape(
                participation=arrays["load_participation"],
                static_response=arrays["static_load_response"],
                second_response=arrays.get("second_load_response"),
            )
        return cls(
            omega=arrays["omega"],
            mode_shapes=arrays["mode_shapes"],
            static_compliance=arrays.get("static_compliance"),
            second_residual=arrays.get("second_residual"),
            dofs=modal_dofs(arrays) if dofs is None else dofs,
            loss_factor=arrays.get("loss_factor", 0.0) if loss_factor is None else loss_factor,
            damping_ratio=arrays.get("damping_ratio", 0.0) if damping_ratio is None else damping_ratio,
            load_shapes=shapes,
        )

    @classmethod
    def load(
        cls,
        path: str | Path,
        *,
        dofs: Iterable[str] | None = None,
        modes: int | None = None,
        loss_factor: Reals | None = None,
        damping_ratio: Reals | None = None,
        load: str = "pressure",
    ) -> ModalStructure:
        """:meth:`from_arrays` of an .npz file (never unpickled), which needs ``static_compliance`` too.

        With ``modes`` the first ones alone are taken, and the residuals hold what the others leave.

        Raises
        ------
        InputError
            If the file cannot be read, or its arrays or names do not fit together.
        """
        arrays = modal_arrays(Path(path))
        names = None if dofs is None else tuple(dofs)
        faults = list(size_faults(arrays["mode_shapes"].shape, modes, names))
        if faults:
            raise InputError(faults)
        arrays = arrays if modes is None else first_modes(arrays, modes)
        return cls.from_arrays(arrays, dofs=names, loss_factor=loss_factor, damping_ratio=damping_ratio, load=load)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self._dofs

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal structure."""
        names = ("omega", "mode_shapes", "dofs", "loss_factor", "second_residual", "damping", "skin")
        compliance = self.static_compliance if self._knows_residual else None
        numbers = {name: getattr(self, name) for name in names} | {"damping_ratio": self._viscous}
        strains = {} if self.strains is None else {"strains": self.strains}
        return {**numbers, "static_compliance": compliance, "load_shapes": self.shapes, **strains}

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Names of the distributed loads."""
        return tuple(self.shapes)

    @property
    def natural_frequencies(self) -> Array:
        """Natural frequencies of the modes kept, rad/s, ascending."""
        return np.sort(self.omega)

    @property
    def damping_ratios(self) -> Array:
        """Damping ratio of each of the ``natural_frequencies``: viscous, with half the loss factor."""
        return np.asarray((self.damping_ratio + 0.5 * self.loss_factor)[np.argsort(self.omega)])

    @property
    def energy_fed(self) -> str:
        """Modes to which damping feeds energy, in words; empty where there are none."""
        return fed_modes(self.natural_frequencies, self.damping_ratios)

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between directions ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) and loads."""
        return self._receptance(*self.modal_parts(rows, columns, shapes))

    def _receptance(self, left: Array, right: Array, static: Array, second: Array | None) -> Receptance:
        return ModalReceptance(
            left=left,
            right=right,
            stiffness=self.omega**2 * (1.0 + 1j * self.loss_factor),
            damping=2.0 * self._viscous * self.omega,
            factor=self.damping,
            static=static,
            residual=static - (left / self.omega**2) @ right.T,
            second=second,
        )

    def receptance_to(
        self,
        left: Array,
        static: Array,
        columns: ArrayLike,
        shapes: Sequence[str] = (),
        second: Array | None = None,
    ) -> Receptance:
        """Receptance at rows that are no dofs: modes ``left`` (n_rows, n_modes), exact ``static`` (n_rows, n_columns).

        ``second`` is their second-order residual, where that is known.
        """
        return self._receptance(left, self._participations(columns, shapes), static, second)

    def _participations(self, columns: ArrayLike, shapes: Sequence[str]) -> Array:
        """Modal forces by directions (n_dofs, n_columns) and load shapes, (n_columns + n_shapes, n_modes)."""
        known_shapes(shapes, self.shapes)
        c = any_directions("columns", columns, len(self._dofs))
        loads = (np.asarray(self.shapes[name].participation, dtype=float) for name in shapes)
        return np.vstack([c.T @ self.mode_shapes, *loads])

    @property
    def values(self) -> dict[str, float]:
        """Named parameters: ``loss_factor`` (the mean of the modes'), and ``damping``, a factor on viscous damping."""
        loss = {"loss_factor": float(np.mean(self.loss_factor))}
        return loss | ({"damping": self.damping} if np.any(self._viscous) else {})

    @property
    def further_values(self) -> dict[str, float]:
        """Parameters of each mode: "mode1.omega" (rad/s), "mode1.damping_ratio" (the viscous one, before ``damping``).

        Modes are counted from 1 in the order in which they were given.
        """
        by_mode = zip(self.omega.tolist(), self._viscous.tolist(), strict=True)
        return {
            mode_name(r, quantity): value
            for r, both in enumerate(by_mode)
            for quantity, value in zip(MODE_QUANTITIES, both, strict=True)
        }

    def changed(self, **values: float) -> ModalStructure:
        """A copy with another ``loss_factor`` of all modes, another factor ``damping``, or other modes.

        Where a natural frequency changes, the other modes and the residuals stay. InputError below 0.
        """
        new, checked = copy(self), checked_values(self.every_value, values)
        if "loss_factor" in checked:
            new.loss_factor = np.full(self.omega.shape, checked["loss_factor"])
        new.damping = checked.get("damping", self.damping)
        of_modes = {place: value for name, value in checked.items() if (place := mode_place(name)) is not None}
        return new._with_modes(of_modes) if of_modes else new

    def _with_modes(self, values: Mapping[tuple[int, str], float]) -> ModalStructure:
        new = copy(self)
        new.omega, new._viscous = self.omega.copy(), self._viscous.copy()
        for (r, quantity), value in values.items():
            (new.omega if quantity == "omega" else new._viscous)[r] = value
        if np.any(new.omega <= 0.0):
            worst = int(np.argmin(new.omega))
            raise InputError(Fault(mode_name(worst, "omega"), f"{new.omega[worst]:g}", expected="a frequency > 0"))
        more = 1.0 / new.omega**2 - 1.0 / self.omega**2
        new._follow_modes(more)
        new.shapes = {
            name: replace(
                shape,
                static_response=np.asarray(shape.static_response)
                + self.mode_shapes @ (more * np.asarray(shape.participation)),
            )
            for name, shape in self.shapes.items()
        }
        participation = {name: np.asarray(shape.participation) for name, shape in self.shapes.items()}
        new.skin = with_more(self.skin, more, self.mode_shapes, participation)
        new.strains = with_more(self.strains, more, self.mode_shapes, participation)
        for remembered in ("_truncation", "valid_to"):
            new.__dict__.pop(remembered, None)
        return new

    def _follow_modes(self, more: Array) -> None:
        """Update the static compliance for modes whose compliance grows by ``more`` (n_modes,) times their squares."""
        self._modal_compliance = (self.mode_shapes / self.omega**2) @ self.mode_shapes.T
        self.static_compliance = self.static_compliance + (self.mode_shapes * more) @ self.mode_shapes.T

    def own_compliance(self, along: Any) -> tuple[Array, Array]:
        """Static compliances of directions (n_dofs, k) along themselves: total, and of the modes left out, (k,).

        Directions may be sparse.
        """
        columns = any_directions("directions", along, len(self._dofs))
        whole = np.asarray((columns * (self.static_compliance @ columns)).sum(axis=0)).ravel()
        return whole, whole - np.sum(((columns.T @ self.mode_shapes) / self.omega) ** 2, axis=1)

    @property
    def damping_ratio(self) -> Array:
        """Viscous damping ratios (n_modes,), the factor ``damping`` included."""
        return self.damping * self._viscous

    def modal_parts(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str]
    ) -> tuple[Array, Array, Array, Array | None]:
        """Modes at the rows, participations of the columns, static compliance and second-order residual."""
        right, n = self._participations(columns, shapes), len(self._dofs)
        r, c = any_directions("rows", rows, n), any_directions("columns", columns, n)
        chosen = [self.shapes[s] for s in shapes]
        left = r.T @ self.mode_shapes
        responses = [np.asarray(s.static_response, dtype=float) for s in chosen]
        static = r.T @ np.column_stack([self.static_compliance @ c, *responses])
        if self.second_residual is None and all(s.second_response is None for s in chosen):
            return left, right, static, None
        zero = np.zeros(n)
        of_columns = np.zeros(c.shape) if self.second_residual is None else self.second_residual @ c
        responses = [zero if s.second_response is None else np.asarray(s.second_response) for s in chosen]
        return left, right, static, r.T @ np.column_stack([of_columns, *responses])

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Modal equations in time; the static residual is a feedthrough, the second-order one is left out.

        A loss factor ``eta_r`` becomes a viscous damping ratio ``eta_r / 2``, equal at the mode's own frequency, or
        one that is equal at ``damping_at`` (rad/s).
        """
        lost = self.loss_factor * self.omega * (1.0 if damping_at is None else self.omega / damping_at)
        left, right, static, _ = self.modal_parts(rows, columns, shapes)
        return TimeEquations(
            M=np.eye(self.omega.size),
            C=np.diag(2.0 * self.damping_ratio * self.omega + lost),
            K=np.diag(self.omega**2),
            rows=left,
            columns=np.ascontiguousarray(right.T),
            feedthrough=static - (left / self.omega**2) @ right.T,
        )

    def __repr__(self) -> str:
        return f"ModalStructure({self.omega.size} modes, {dofs_words(len(self._dofs))})"


def modal_number_faults(arguments: Mapping[str, Any], load_shapes: Mapping[str, LoadShape]) -> list[Fault]:
    """Faults of modal arrays that are not real numbers; None is no fault."""
    faults = []
    for name, value in arguments.items():
        faults += [] if value is None else number_faults(name, value, REAL_MODES.get(name, ""))
    for name, shape in load_shapes.items():
        if not hasattr(shape, "arrays"):
            faults.append(Fault(("load shape", name), found=shown(shape), expected="a structure.modal.LoadShape"))
            continue
        for part, value in shape.arrays().items():
            faults += number_faults(("load shape", name, part), value)
    return faults


def modal_faults(arguments: Mapping[str, Any], load_shapes: Mapping[str, LoadShape], n: int | None) -> list[Fault]:
    """Faults of all modal arrays together, at ``n`` dofs (None: not known).

    Arrays of the wrong shape, or that are no numbers, do not count for the numbers of modes and dofs.
    """
    faults = modal_number_faults(arguments, load_shapes)
    wrong = {fault.where for fault in faults}
    there = {name: v for name, v in arguments.items() if v is not None or name not in _COMPLIANCES}
    known = {name: real(v) for name, v in there.items() if (name,) not in wrong}
    shapes: tuple[int, ...] = known["mode_shapes"].shape if "mode_shapes" in known else ()
    omega = known.pop("omega", None)
    if omega is not None and (omega.ndim != 1 or omega.size == 0):
        faults.append(Fault("omega", found=f"shape {omega.shape}", expected="(n_modes,), at least one mode"))
        omega = None
    if n is None and len(shapes) == 2:
        n = shapes[0]
    modes = omega.size if omega is not None else shapes[1] if len(shapes) == 2 else None
    if omega is not None:
        faults += array_faults("omega", omega, omega.shape, positive=True)
    for name, value in known.items():
        faults += _array_faults(name, value, n, modes)
    for name, shape in load_shapes.items():
        if hasattr(shape, "arrays"):
            for part, value in shape.arrays().items():
                where = ("load shape", name, part)
                size = modes if part == "participation" else n
                faults += [] if where in wrong or size is None else array_faults(where, real(value), (size,))
    return faults


def _array_faults(name: str, value: Any, n: int | None, modes: int | None) -> list[Fault]:
    """Faults of one of the arrays with the sizes that are known."""
    if name == "mode_shapes":
        rows, columns = value.shape if value.ndim == 2 else (None, None)
        return array_faults(name, value, (n or rows or 1, modes or columns or 1))
    if name in _COMPLIANCES:
        square = (n or len(np.atleast_1d(value)),) * 2
        return array_faults(name, value, square) or symmetry_faults(name, value, tolerance=1e-5)
    size = () if name == "damping" or value.ndim == 0 else value.shape if modes is None else (modes,)
    return array_faults(name, value, size, non_negative=name != "damping_ratio")


def residual_faults(name: str, residual: Array, whole: Array) -> list[Fault]:
    """Faults of a residual (n, n) of the modes left out: a sum of squares, so it has no negative eigenvalue.

    Tolerances are relative to ``whole`` (n,), the total compliances.
    """
    lowest = semidefinite_to(residual, whole, RESIDUAL_ROUNDING)
    if lowest is None:
        return []
    return [
        Fault(
            name,
            f"the compliance left to the modes not given has a negative eigenvalue ({lowest:.2g} of the whole), but "
            "modes only add compliance",
            remedy="check the order of dofs and modes, and that all arrays belong together",
        )
    ]


def modal_arrays(path: Path) -> dict[str, Any]:
    """The arrays of a file that ``ModalStructure.from_arrays`` uses.

    Raises
    ------
    InputError
        One sentence for each array that is missing, not real and finite, or does not fit the mode shapes.
    """
    arrays: dict[str, Any] = dict(read_arrays(path, _NEEDED, (*_LOAD, *_DAMPING, "second_residual")))
    faults = list(_shape_faults(path.name, arrays))
    if faults:
        raise InputError(faults)
    if "dofs" in array_shapes(path):
        arrays["dofs"] = read_any(path)["dofs"]
    return arrays


def first_modes(arrays: Mapping[str, Any], modes: int) -> dict[str, Any]:
    """The arrays of the first modes; the dropped ones add to the second-order residuals."""
    if modes == arrays["omega"].size:
        return dict(arrays)
    shapes = arrays["mode_shapes"][:, modes:]
    dropped, root = shapes / arrays["omega"][modes:] ** 4, shapes / arrays["omega"][modes:] ** 2
    kept = {**arrays, "omega": arrays["omega"][:modes], "mode_shapes": arrays["mode_shapes"][:, :modes]}
    kept |= {name: arrays[name][:modes] for name in _DAMPING if name in arrays and arrays[name].ndim == 1}
    kept["second_residual"] = arrays.get("second_residual", 0.0) + root @ root.T
    if "load_participation" in arrays:
        participation = arrays["load_participation"]
        kept["load_participation"] = participation[:modes]
        kept["second_load_response"] = arrays.get("second_load_response", 0.0) + dropped @ participation[modes:]
    return kept


def modal_dofs(arrays: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the rows of the mode shapes: the file's own, else three directions a node.

    >>> modal_dofs({"mode_shapes": np.eye(6)})
    ('n1x', 'n1y', 'n1z', 'n2x', 'n2y', 'n2z')
    """
    if "dofs" in arrays:
        return tuple(str(name) for name in np.asarray(arrays["dofs"]).ravel())
    rows = np.asarray(arrays["mode_shapes"]).shape[0]
    if rows % 3:
        raise InputError(
            Fault(
                "dofs",
                IS_MISSING,
                remedy=f"{rows} rows of mode_shapes are not whole nodes of x, y, z: give their names",
            )
        )
    return tuple(f"n{row // 3 + 1}{'xyz'[row % 3]}" for row in range(rows))


def size_faults(shape: tuple[int, int], modes: int | None, dofs: Sequence[str] | None) -> Iterator[Fault]:
    """Faults of mode shapes (n_dofs, n_modes) with fewer modes, or another number of rows than names."""
    rows, available = shape
    if modes is not None and not 1 <= modes <= available:
        yield Fault("modes", found=str(modes), expected=f"1 to {available}, the modes in the file")
    if dofs is not None and len(dofs) != rows:
        yield Fault("dofs", found=f"{len(dofs)} names", expected=f"{rows}, one for each row of mode_shapes")


def _shape_faults(file: str, arrays: Mapping[str, Any]) -> Iterator[Fault]:
    n_dofs, n_modes = arrays["mode_shapes"].shape
    expected = {
        "omega": (n_modes,),
        "static_compliance": (n_dofs, n_dofs),
        "second_residual": (n_dofs, n_dofs),
        "load_participation": (n_modes,),
        "static_load_response": (n_dofs,),
        "second_load_response": (n_dofs,),
        **{name: (n_modes,) for name in _DAMPING if name in arrays and arrays[name].ndim},
    }
    for name, shape in expected.items():
        if name in arrays and arrays[name].shape != shape:
            yield (
                Fault(
                    file,
                    f"'{name}' has shape {arrays[name].shape}",
                    expected=f"{shape} to agree with mode_shapes {(n_dofs, n_modes)}",
                )
            )
