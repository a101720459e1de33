"""Receptances between a few directions: summed over modes, or solved for directly (THEORY.md (9.1))."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import copy
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import issparse

from slipstick.errors import InputError
from slipstick.structure.residuals import Residuals, WrittenResiduals
from slipstick.typing import AnyArray, Array, ComplexArray, IntArray

SMALL = 2**14
"""Entries of a matrix up to which products with many vectors cost as much one by one."""
_MOST_PRODUCTS = 2**25
"""Products of modes (256 MB) above which they are not stored but formed for each frequency."""

_SYMMETRIC = 1e-11
"""Difference of a symmetric matrix from its transpose, over its largest entry (measured: 5e-13)."""
_ROUNDING = 1e-14
"""Relative difference of loss factors that is rounding."""


def undamped(omega: Array, modes: Array, static: Array, second: Array | None = None) -> ModalReceptance:
    """Undamped receptance of modes (n_dofs, n_modes), exact static compliance and second-order residual."""
    return ModalReceptance(
        left=modes, right=modes, stiffness=omega**2, damping=np.zeros_like(omega), static=static,
        residual=static - (modes / omega**2) @ modes.T, second=second,
    )  # fmt: skip


MODE_QUANTITIES = ("omega", "damping_ratio")
"""Parameters of each mode."""


def mode_name(mode: int, quantity: str) -> str:
    """Name of a parameter of a mode, counted from 0 here and from 1 in the name."""
    return f"mode{mode + 1}.{quantity}"


def mode_place(name: str) -> tuple[int, str] | None:
    """Mode, counted from 0, and quantity of a parameter's name; None where it is no parameter of a mode."""
    owner, _, quantity = name.partition(".")
    number = owner.removeprefix("mode")
    if quantity not in MODE_QUANTITIES or number == owner or not number.isdecimal():
        return None
    return int(number) - 1, quantity


@dataclass(frozen=True, kw_only=True, slots=True)
class Factors:
    """``A_m = left diag(weight_m) right^T + sum_p part_weight_pm parts_p``: a receptance in factors, not written out.

    Attributes
    ----------
    left, right
        Real, (n_rows, n_modes) and (n_columns, n_modes).
    weight, slope
        Complex (k, n_modes): for each order, and their derivative.
    parts
        Real matrices (n_rows, n_columns), written out or not.
    part_weight, part_slope
        Complex (n_parts, k).
    columns, columns_slope
        Factors (n_columns, k) on the columns where they depend on the frequency, and their derivative by omega.
    coupling, coupling_weight
        Where modes are coupled along a parameter, also ``weight_m B diag(s) B^T coupling_weight_m weight_m`` in the
        derivative: real B (n_modes, r) and s (r,), and complex (k,).
    """

    left: Array
    right: Array
    weight: ComplexArray
    slope: ComplexArray
    parts: Residuals
    part_weight: ComplexArray
    part_slope: ComplexArray
    columns: Array | None = None
    columns_slope: Array | None = None
    coupling: tuple[Array, Array] | None = None
    coupling_weight: ComplexArray | None = None


class Receptance(ABC):
    """Displacement of ``n_rows`` directions by unit harmonic forces on ``n_columns`` directions (THEORY.md (9.1)).

    Time dependence ``exp(+i w t)``: a lag is a negative imaginary part. Nothing need be symmetric. A kind gives
    ``static`` and ``at``; all else has a default, made of these or an error.

    Attributes
    ----------
    static
        Exact static compliance, (n_rows, n_columns), real, length/force: harmonic 0.
    highest
        Highest frequency of the receptance, rad/s.
    summed
        Whether it is a sum over real modes, which ``factors`` gives.
    waves
        Disturbances with a phase from sector to sector, of a travelling wave; None: it is no wave.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> receptance = structure.project([[1.0]], [[1.0]])
    >>> at_6, slope = receptance.at([1], 6.0)
    >>> receptance.static, at_6.round(6), slope.round(6)
    (array([[0.025]]), array([[[0.183824-0.110294j]]]), array([[[0.243296-0.495242j]]]))
    """

    static: Array
    highest: float = np.inf
    summed: bool = False
    waves: Waves | None = None

    @abstractmethod
    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at the harmonics ``orders`` (k,), above 0, of ``omega`` (rad/s) and its derivative by omega.

        Both (k, n_rows, n_columns) for one omega, (n, k, n_rows, n_columns) for omega (n,). The derivative is by the
        fundamental frequency: it has the order as a factor. Orders may differ in more than frequency (a phase from
        sector to sector), so they are given by number.
        """

    def of_order(self, order: int, frequency: ArrayLike, wave_number: int = 0) -> ComplexArray | None:
        """Receptance of a harmonic at another frequency than its own, (..., n_rows, n_columns); None: not known.

        Stability uses order 0 where orders differ in more than frequency.
        """
        return None

    def conjugates(self, orders: Array, omega: float) -> ComplexArray:
        """``at`` one frequency as a balance sums it: conjugates (2, n_columns, n_rows, 1 + k), order 0 first."""
        out = np.zeros((2, *self.static.shape[::-1], orders.size + 1), dtype=complex)
        out[0, :, :, 0] = self.static.T
        if orders.size:
            for conjugate, value in zip(out, self.at(orders, omega), strict=True):
                np.conjugate(value.transpose(2, 1, 0), out=conjugate[:, :, 1:])
        return out

    def conjugates_of(self, orders: Array, omega: Array, out: ComplexArray) -> None:
        """``conjugates`` at frequencies (n,), into ``out`` (n, 2, n_columns, n_rows, 1 + k)."""
        out[:, 0, :, :, 0], out[:, 1, :, :, 0] = self.static.T, 0.0
        if orders.size:
            for i, one in enumerate(self.at(orders, omega)):
                np.conjugate(one.transpose(0, 3, 2, 1), out=out[:, i, :, :, 1:])

    def answer(self, orders: Array, omega: Array, forces: Array) -> Array:
        """``A F`` at orders (k,) of frequencies (n,): pairs (c, s) (n, n_rows, 2 k) of those (n, n_columns, 2 k)."""
        out = np.empty((len(forces), self.static.shape[0], 2 * orders.size))
        if orders.size:
            A, _ = self.at(orders, omega)
            hat = (forces[:, :, 0::2] - 1j * forces[:, :, 1::2]).transpose(0, 2, 1)
            answer = (A @ hat[..., None])[..., 0].transpose(0, 2, 1)
            out[..., 0::2], out[..., 1::2] = answer.real, -answer.imag
        return out

    def factors(self, orders: ArrayLike, omega: ArrayLike, along: Mapping[str, float] | None = None) -> Factors:
        """Factors of the sum over modes; only of a receptance that is ``summed``."""
        raise NotImplementedError(f"a {type(self).__name__} is no sum over modes")

    def changed(self, **values: float) -> Receptance:
        """A copy with other values of the structure's parameters; InputError where it has none."""
        raise InputError(self._not_followed(values))

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter of the structure, of the shape of ``at``; InputError where it has none."""
        raise InputError(self._not_followed([name]))

    def static_by_parameter(self, name: str) -> Array:
        """Derivative of ``static`` by a parameter, (n_rows, n_columns)."""
        return np.zeros(self.static.shape)

    def adjusted(self, values: Mapping[str, float]) -> Receptance:
        """A copy with other values of the structure's parameters; itself for no values."""
        return self.changed(**values) if values else self

    def adjusted_runs(self, structures: Iterable[Mapping[str, float]]) -> Iterator[tuple[Receptance, slice]]:
        """``adjusted`` once for points, one after the other, that have the same values, and which these are."""
        first = 0
        for values, same in groupby(structures):
            at = slice(first, first + sum(1 for _ in same))
            yield self.adjusted(values), at
            first = at.stop

    def conjugates_of_each(
        self, orders: Array, omega: Array, structures: Iterable[Mapping[str, float]]
    ) -> ComplexArray:
        """``conjugates`` at frequencies (n,), each with its structure: (n, 2, n_columns, n_rows, 1 + k)."""
        out = np.empty((omega.size, 2, *self.static.shape[::-1], orders.size + 1), dtype=complex)
        for adjusted, at in self.adjusted_runs(structures):
            adjusted.conjugates_of(orders, omega[at], out[at])
        return out

    def written(self) -> Receptance:
        """The same with all entries as matrices, where residuals are applied by solutions."""
        return self

    def nearly(self) -> Receptance:
        """An approximation without solutions, where residuals are applied by them."""
        return self

    def turning_with(self, omega: float) -> Receptance:
        """The receptance at the speed of rotation that is tied to a fundamental frequency."""
        return self

    def _not_followed(self, names: Iterable[str]) -> str:
        return (
            f"{', '.join(names)} cannot be followed: a {type(self).__name__} does not know its parameters; "
            "change the structure instead, one problem for each value"
        )


class Waves(ABC):
    """Disturbances of a travelling wave, with other phases from sector to sector."""

    wave_numbers: int
    static: Array

    @abstractmethod
    def phase_number(self, order: int) -> int:
        """``d`` of a harmonic of the wave, whose phase from sector to sector is ``2 pi d / wave_numbers``."""

    @abstractmethod
    def natural(self, d: int) -> Array:
        """Natural frequencies for the phase ``2 pi d / wave_numbers``, rad/s."""

    @abstractmethod
    def growing(self, d: int) -> ComplexArray:
        """Growing poles of the sector without contacts, of positive frequency, with that phase."""

    @abstractmethod
    def vibration(self, d: int, stiffness: Array) -> tuple[ComplexArray, ComplexArray]:
        """Poles of positive frequency, rad/s, with springs at the ports, and their motion (n_rows, n_poles)."""

    @abstractmethod
    def of_order(self, order: int, frequency: ArrayLike, wave_number: int = 0) -> ComplexArray:
        """Receptance of a harmonic at any frequencies (...), rad/s, (..., n_rows, n_columns)."""


class SummedReceptance(Receptance):
    """A receptance that is a sum over real modes; subclasses give its factors."""

    summed = True
    _left: Array
    _right: Array

    @abstractmethod
    def factors(self, orders: ArrayLike, omega: ArrayLike, along: Mapping[str, float] | None = None) -> Factors:
        """Factors of the sum: for order 0, which is static, and ``orders`` (k,) of every omega.

        Slopes are derivatives by omega, or ``along`` a direction in the parameters at fixed omega.
        """

    @cached_property
    def _many(self) -> bool:
        """Whether there are too many products to be stored."""
        return self.static.size * self._left.shape[1] > _MOST_PRODUCTS

    @cached_property
    def _products(self) -> Array:
        """``right_r left_r`` (n_columns n_rows, n_modes), made at the first evaluation."""
        return (self._right[:, None, :] * self._left[None, :, :]).reshape(-1, self._left.shape[1])

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        shape, factors = _shape(orders, omega, self.static.shape), self.factors(orders, omega)
        value = self._summed(factors.weight, factors.parts, factors.part_weight)
        slope = self._summed(factors.slope, factors.parts, factors.part_slope)
        return value.reshape(shape), slope.reshape(shape)

    def _summed(self, weight: ComplexArray, parts: Any, part_weight: ComplexArray) -> ComplexArray:
        """``left diag(weight) right^T`` plus the parts, for all but the first weights, (any, n_rows, n_columns)."""
        if self._many:
            total = np.array([(self._left * each) @ self._right.T for each in weight[1:]])
        else:  # real products times pairs of real and imaginary parts: half the work
            pairs = np.ascontiguousarray(weight[1:].T).view(float)
            shape = (len(weight) - 1, *self.static.shape[::-1])
            total = (self._products @ pairs).view(complex).T.reshape(shape).swapaxes(1, 2)
        for part, each in zip(parts.matrices, part_weight, strict=True):
            total = total + each[1:, None, None] * part
        return np.asarray(total, dtype=complex)

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter, of the shape of ``at``."""
        factors = self.factors(orders, omega, {name: 1.0})
        value = self._summed(factors.slope, factors.parts, factors.part_slope)
        return value.reshape(_shape(orders, omega, self.static.shape))


class ModalReceptance(SummedReceptance):
    """``A(w) = sum_r left_r right_r / (stiffness_r + i w factor damping_r - w^2) + residual / e + w^2 second / e^2``.

    ``e = 1 + i eta`` where one loss factor holds for all modes, else 1.

    Parameters
    ----------
    left, right
        Modes at the rows (n_rows, n_modes) and participations of the columns (n_columns, n_modes), mass-normalised.
    stiffness
        ``w_r^2 (1 + i eta_r)``, (n_modes,), complex.
    damping
        Modal viscous damping ``2 zeta_r w_r``, (n_modes,).
    static
        Exact static compliance (n_rows, n_columns).
    residual, second
        Compliance of the modes left out (n_rows, n_columns) and the coefficient of its growth with ``w^2``, both
        undamped, or None.
    factor
        On the viscous damping.
    """

    def __init__(
        self,
        *,
        left: Array,
        right: Array,
        stiffness: ArrayLike,
        damping: ArrayLike,
        static: Array,
        residual: Array | None = None,
        second: Array | None = None,
        factor: float = 1.0,
    ) -> None:
        self.static = static
        self._shape = static.shape
        self._e: complex | None = None
        self._viscous = 1j * np.asarray(damping, dtype=float)
        self._factor = float(factor)
        self._damping = self._factor * self._viscous
        self._left, self._right = left, right
        self._left_out = residual, second
        self._elastic = slice(left.shape[1])
        self._set_stiffness(np.asarray(stiffness, dtype=complex))

    def with_rigid(self, left: Array, right: Array) -> ModalReceptance:
        """With rigid-body modes at the rows (n_rows, n_rigid) and columns (n_columns, n_rigid), of no stiffness.

        They do not take part in the static compliance: ``static`` is that of the elastic modes.
        """
        new, none = copy(self), np.zeros(left.shape[1])
        new._left, new._right = np.hstack([self._left, left]), np.hstack([self._right, right])
        new._stiffness, new._viscous = np.append(self._stiffness, none), np.append(self._viscous, none)
        new._damping = new._factor * new._viscous
        for name in ("_products", "_different_products", "_many", "_at_rest"):
            new.__dict__.pop(name, None)
        return new

    def _set_stiffness(self, stiffness: AnyArray) -> None:
        """Set the stiffness of the modes, and the factor ``e`` of the residuals by their loss factor."""
        self._stiffness, self._e = stiffness, None
        left_out = [(power, matrix) for power, matrix in enumerate(self._left_out) if matrix is not None]
        if left_out:
            elastic = stiffness[self._elastic]
            loss = elastic.imag / elastic.real
            if np.all(np.abs(loss - loss[0]) <= _ROUNDING * abs(loss[0])):
                self._e = 1.0 + 1j * float(loss[0])
        for name in ("_rest", "_at_rest"):
            self.__dict__.pop(name, None)

    @cached_property
    def _at_rest(self) -> ComplexArray:
        """Weights of the modes at rest, (n_modes,)."""
        out = np.zeros_like(self._stiffness)
        out[self._elastic] = 1.0 / self._stiffness[self._elastic].real
        return out

    @cached_property
    def _rest(self) -> ComplexArray:
        """Both residuals with the loss factor of the modes left out, for sums over all entries."""
        rest = np.zeros((2, *self._shape), dtype=complex)
        for power, matrix in enumerate(self._left_out):
            if matrix is not None:
                rest[power] = matrix / (self._e or 1.0) ** (power + 1)
        return rest

    def conjugates(self, orders: Array, omega: float) -> ComplexArray:
        """See ``Receptance.conjugates``; by a compiled sum."""
        out = np.empty((2, *self._shape[::-1], orders.size + 1), dtype=complex)
        arguments = self._stiffness, self._damping, self._rest, orders, omega * orders, out
        if not self._many:
            _modal_sums()(self._static, *self._different_products, 0, *arguments)
        else:
            places = np.arange(len(self._right))[:, None]
            for row, shapes in enumerate(self._left):
                _modal_sums()(self._static, shapes * self._right, places, row, *arguments)
        return out

    @cached_property
    def _different_products(self) -> tuple[Array, IntArray]:
        """The products without those that are the same both ways, of symmetric ones, and the place of each there."""
        rows, columns = self._shape
        places = np.arange(columns * rows).reshape(columns, rows)
        if not np.array_equal(self._left, self._right[:rows]):
            return self._products, places
        upper = np.triu_indices(rows, 1)
        different = np.ones((columns, rows), dtype=bool)
        different[upper] = False
        places = (np.cumsum(different) - 1).reshape(columns, rows)
        places[upper] = places[upper[::-1]]
        return self._products[different.ravel()], places

    @cached_property
    def _static(self) -> Array:
        """``static`` as compiled code takes it."""
        return np.require(self.static, float, ["C", "W"])

    @cached_property
    def _symmetric(self) -> bool:
        """Whether the residuals are symmetric between the rows, to rounding."""
        n = self._shape[0]
        parts = [matrix[:, :n] for matrix in self._left_out if matrix is not None]
        return self._shape[1] >= n and all(
            np.abs(part - part.T).max(initial=0.0) <= _SYMMETRIC * np.abs(part).max(initial=0.0) for part in parts
        )

    @property
    def _parts(self) -> Residuals:
        """Residuals, for products with them."""
        return WrittenResiduals([part for part in self._left_out if part is not None], symmetric=self._symmetric)

    def conjugates_of(self, orders: Array, omega: Array, out: ComplexArray) -> None:
        """``conjugates`` at frequencies (n,), see ``Receptance``: bit for bit those of single frequencies."""
        if self._many:
            for one, w in zip(out, omega, strict=True):
                one[:] = self.conjugates(orders, float(w))
            return
        from slipstick.structure.kernel.modal_sums import modal_sums_of_many

        sums = self._static, *self._different_products, self._stiffness, self._damping, self._rest
        modal_sums_of_many(*sums, orders, np.ascontiguousarray(omega), out)

    def answer(self, orders: Array, omega: Array, forces: Array) -> Array:
        """``A F`` at orders (k,) of frequencies (n,): pairs (c, s) (n, n_rows, 2 k) of those (n, n_columns, 2 k)."""
        w = np.multiply.outer(omega, orders)[:, None]
        # c + i s turns the other way round: conjugates
        weight = np.conj(1.0 / (self._stiffness[:, None] + w * (self._damping[:, None] - w)))
        out = np.asarray(self._left @ ((self._right.T @ forces).view(complex) * weight).view(float))
        e = 1.0 if self._e is None else self._e.conjugate()
        for power, matrix in enumerate(self._left_out):
            if matrix is not None:
                out += (mapped(matrix, forces).view(complex) * (w ** (2 * power) / e ** (power + 1))).view(float)
        return out

    def changed(self, **values: float) -> ModalReceptance:
        """A copy with another ``loss_factor``, the same for all modes, factor ``damping`` on the viscous damping, or
        frequency and viscous damping of single modes (``mode_name``)."""
        if not self._many:
            self._different_products  # noqa: B018  made once, for all copies
        new = copy(self)
        of_modes = {place: value for name, value in values.items() if (place := mode_place(name)) is not None}
        if of_modes:
            new._set_modes(of_modes)
        if "damping" in values:
            new._factor = values["damping"]
        new._damping = new._factor * new._viscous
        if "loss_factor" in values:
            new._set_stiffness(new._stiffness.real * (1.0 + 1j * values["loss_factor"]))
        return new

    def _set_modes(self, values: Mapping[tuple[int, str], float]) -> None:
        """Set frequency and viscous damping of modes; the static compliance changes, the residuals stay."""
        stiffness, viscous, elastic = self._stiffness.copy(), self._viscous.copy(), self._elastic
        old, loss = np.sqrt(stiffness[elastic].real), stiffness[elastic].imag / stiffness[elastic].real
        omega, ratio = old.copy(), viscous[elastic].imag / (2.0 * old)
        for (r, quantity), value in values.items():
            (omega if quantity == "omega" else ratio)[r] = value
        self.static = self._static_with(omega, old)
        self.__dict__.pop("_static", None)
        stiffness[elastic], viscous[elastic] = omega**2 * (1.0 + 1j * loss), 2j * ratio * omega
        self._viscous = viscous
        self._set_stiffness(stiffness)

    def _static_with(self, omega: Array, old: Array) -> Array:
        """Static compliance with other frequencies of the modes."""
        left, right = self._left[:, self._elastic], self._right[:, self._elastic]
        return self.static + (left * (1.0 / omega**2 - 1.0 / old**2)) @ right.T

    def static_by_parameter(self, name: str) -> Array:
        """Derivative of ``static`` by a parameter, (n_rows, n_columns)."""
        place = mode_place(name)
        if place is None or place[1] != "omega":
            return np.zeros(self._shape)
        r = place[0]
        return np.outer(self._left[:, r], self._right[:, r]) * (-2.0 * self._stiffness[r].real ** -1.5)

    def factors(self, orders: ArrayLike, omega: ArrayLike, along: Mapping[str, float] | None = None) -> Factors:
        """Factors of the sum, or of its derivatives by ``loss_factor`` (of all modes), ``damping`` and modes."""
        m, w, _ = _places(orders, omega, self._shape)
        m = np.resize(m, len(w))
        D = 1.0 / (self._stiffness + w * (self._damping - w))
        e = 1.0 if self._e is None else self._e
        left_out = [(matrix, p) for p, matrix in enumerate(self._left_out) if matrix is not None]
        shape = len(left_out), m.size
        powers = np.array([w[:, 0] ** (2 * p) / e ** (p + 1) for _, p in left_out]).reshape(shape)
        still = np.zeros(D.shape[1])
        if along is None:
            slope = D * D * (2.0 * w - self._damping) * m[:, None]
            part_slope = np.array([2 * p * w[:, 0] * m / e ** (p + 1) for _, p in left_out]).reshape(shape)
        else:
            loss, viscous = along.get("loss_factor", 0.0), along.get("damping", 0.0)
            slope = -D * D * (1j * loss * self._stiffness.real + viscous * w * self._viscous)
            still = self._by_modes(along, w, D, slope)
            by_loss = 0.0 if self._e is None else -1j * loss / e
            part_slope = powers * by_loss * np.array([[p + 1] for _, p in left_out]).reshape(-1, 1)
        static = np.array([[0.0 if p else 1.0] for _, p in left_out]).reshape(-1, 1)
        return Factors(
            left=self._left,
            right=self._right,
            weight=np.vstack([self._at_rest, D]),
            slope=np.vstack([still, slope]),
            parts=self._parts,
            part_weight=np.hstack([static, powers]),
            part_slope=np.hstack([0.0 * static, part_slope]),
        )

    def _by_modes(self, along: Mapping[str, float], w: Array, D: ComplexArray, slope: ComplexArray) -> Array:
        """Add derivatives by parameters of single modes to ``slope`` (k, n_modes); those of order 0, (n_modes,)."""
        still = np.zeros(D.shape[1])
        for name, rate in along.items():
            place = mode_place(name)
            if place is None:
                continue
            r, quantity = place
            own = np.sqrt(self._stiffness[r].real)
            if quantity == "omega":
                still[r] -= 2.0 * rate / own**3
                change = 2.0 * self._stiffness[r] / own + w[:, 0] * self._damping[r] / own
            else:
                change = 2j * self._factor * own * w[:, 0]
            slope[:, r] -= rate * change * D[:, r] ** 2
        return still


class PoleReceptance(Receptance):
    """``A(w) = sum_k left_k right_k / (i w - pole_k)`` over the 2 n poles of a viscously damped structure.

    Parameters
    ----------
    left, right
        Complex modes at the rows (n_rows, n_poles) and columns (n_columns, n_poles), normalised so that
        ``mode^T (2 pole M + C) mode = 1``.
    poles
        (n_poles,), complex.
    static
        Exact static compliance (n_rows, n_columns).
    solved
        The same receptance by solutions, for parameters and derivatives by them; None: it has no parameters.
    """

    def __init__(
        self, *, left: ComplexArray, right: ComplexArray, poles: ComplexArray, static: Array, solved: Any = None
    ) -> None:
        self.static, self._solved = static, solved
        self._poles, self._left, self._right = poles, left, right

    @cached_property
    def _products(self) -> ComplexArray:
        """``left_k right_k`` (n_poles, n_rows n_columns), made at the first evaluation."""
        products = self._left[:, None, :] * self._right[None, :, :]
        return np.ascontiguousarray(products.reshape(-1, products.shape[2]).T)

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        places, w, shape = _places(orders, omega, self.static.shape)
        both = np.empty((2, w.size, self._poles.size), dtype=complex)
        np.divide(1.0, 1j * w - self._poles, out=both[0])
        np.multiply(both[0], -1j * both[0], out=both[1])
        summed: ComplexArray = both.reshape(2 * w.size, -1) @ self._products
        value, slope = summed.reshape(2, *shape)
        return _by_omega(value, slope, places)

    def changed(self, **values: float) -> SolvedReceptance:
        """A copy with other parameters, by solutions at each frequency: new poles would cost more."""
        solved: SolvedReceptance = self._solved.changed(**values)
        return solved

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter of the structure, of the shape of ``at``."""
        return np.asarray(self._solved.by_parameter(name, orders, omega), dtype=complex)


class SolvedReceptance(Receptance):
    """``A(w) = rows^T Z(w)^-1 columns``, with one factorisation of ``Z(w)`` (symmetric or not) for each frequency.

    The derivative needs no further one: ``dA/dw = -(Z^-T rows)^T (dZ/dw) (Z^-1 columns)``.

    Parameters
    ----------
    stiffness
        ``stiffness(w)`` returns ``Z(w)`` and ``dZ/dw``, (n_dofs, n_dofs), dense or scipy sparse; such as a
        ``DynamicStiffness``, which knows parameters too, and ``at(order, omega)`` where a speed is tied to ``omega``.
    rows, columns
        Directions (n_dofs, n_rows) and (n_dofs, n_columns).
    static
        Exact static compliance (n_rows, n_columns).
    """

    def __init__(
        self, *, stiffness: Callable[[float], tuple[Any, Any]], rows: Array, columns: Array, static: Array
    ) -> None:
        self.static = static
        self._stiffness, self._rows, self._columns = stiffness, rows, columns

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        places, w, shape = _places(orders, omega, self.static.shape)
        value = np.empty((w.size, *self.static.shape), dtype=complex)
        slope = np.empty_like(value)
        for i, (order, fundamental) in enumerate(_each(places, omega)):
            Z, dZ = self._of(order, fundamental)
            solve = _solver(Z)
            motion = solve(self._columns, False)
            value[i] = self._rows.T @ motion
            slope[i] = -solve(self._rows, True).T @ (dZ @ motion)
        return value.reshape(shape), slope.reshape(shape)

    def _of(self, order: float, omega: float) -> tuple[Any, Any]:
        """``Z`` in a harmonic of a fundamental frequency, and its derivative by that."""
        if hasattr(self._stiffness, "at"):
            found: tuple[Any, Any] = self._stiffness.at(order, omega)
            return found
        Z, dZ = self._stiffness(order * omega)
        return Z, order * dZ

    def turning_with(self, omega: float) -> SolvedReceptance:
        """The receptance at the speed of rotation that is tied to a fundamental frequency, fixed at all others."""
        stiffness: Any = self._stiffness
        if not getattr(stiffness, "engine_order", None):
            return self
        fixed = stiffness.changed(speed=omega / stiffness.engine_order, engine_order=None)
        return SolvedReceptance(stiffness=fixed, rows=self._rows, columns=self._columns, static=self.static)

    def changed(self, **values: float) -> SolvedReceptance:
        """A copy with other values of the parameters of the stiffness."""
        stiffness: Any = self._stiffness
        return SolvedReceptance(
            stiffness=stiffness.changed(**values), rows=self._rows, columns=self._columns, static=self.static
        )

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter of the stiffness, shape as ``at``: ``-(Z^-T rows)^T (dZ/dp) Z^-1 columns``."""
        places, w, shape = _places(orders, omega, self.static.shape)
        stiffness: Any = self._stiffness
        value = np.empty((w.size, *self.static.shape), dtype=complex)
        for i, (order, fundamental) in enumerate(_each(places, omega)):
            solve, rate = _solver(self._of(order, fundamental)[0]), stiffness.rate(name, order * fundamental)
            value[i] = -solve(self._rows, True).T @ (rate @ solve(self._columns, False))
        return value.reshape(shape)


@cache
def _modal_sums() -> Callable[..., None]:
    """The compiled sum, loaded at the first evaluation."""
    from slipstick.structure.kernel.modal_sums import modal_sums

    sums: Callable[..., None] = modal_sums
    return sums


def _shape(orders: ArrayLike, omega: ArrayLike, one: tuple[int, ...]) -> tuple[int, ...]:
    """Shape of values at all orders of all omegas."""
    return (*np.shape(omega), *np.shape(orders), *one)


def _places(orders: ArrayLike, omega: ArrayLike, shape: tuple[int, ...]) -> tuple[Array, Array, tuple[int, ...]]:
    """Orders (k,), the frequencies ``orders * omega`` as a column, and the shape of values there."""
    m = np.asarray(orders, dtype=float)
    w = np.multiply.outer(omega, m)
    return m, w.reshape(-1, 1), (*w.shape, *shape)


def mapped(matrix: Any, columns: Array) -> Array:
    """``matrix @ c`` of each of the columns (n, n_columns, k).

    A large matrix multiplies all of them together, so it is read once. A small one multiplies one after another, so
    that results do not depend on the others, to the last bit.
    """
    if not isinstance(matrix, np.ndarray) or matrix.size > SMALL:
        n, _, k = columns.shape
        joined = matrix @ columns.transpose(1, 0, 2).reshape(columns.shape[1], n * k)
        return np.ascontiguousarray(joined.reshape(-1, n, k).transpose(1, 0, 2))
    return np.asarray(matrix @ columns)


def _each(orders: Array, omega: ArrayLike) -> Iterator[tuple[float, float]]:
    """Order and fundamental frequency of each evaluation."""
    return ((m, w) for w in np.ravel(np.asarray(omega, dtype=float)).tolist() for m in np.ravel(orders).tolist())


def _by_omega(value: ComplexArray, slope: ComplexArray, orders: Array) -> tuple[ComplexArray, ComplexArray]:
    """Value and slope, whose derivative by each order's own frequency becomes that by omega."""
    slope *= orders[:, None, None]
    return value, slope


def _solver(Z: Any) -> Callable[[Array, bool], ComplexArray]:
    """``solve(right, transposed)`` with one factorisation of a dense or sparse matrix."""
    if issparse(Z):
        from scipy.sparse.linalg import splu

        factors = splu(Z.tocsc())
        return lambda right, transposed: factors.solve(right.astype(complex), trans="T" if transposed else "N")
    from scipy.linalg import lu_factor, lu_solve

    lu = lu_factor(Z)
    return lambda right, transposed: lu_solve(lu, right, trans=int(transposed))
