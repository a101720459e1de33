"""What the balance asks of a structure. Anything that answers this can be plugged in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from numpy.typing import ArrayLike

from slipstick.typing import Array, ComplexArray


@runtime_checkable
class Receptance(Protocol):
    """Displacement of ``n_rows`` directions by unit harmonic forces on ``n_columns`` directions (THEORY.md (9.1)).

    Time dependence ``exp(+i w t)``: a lag is a negative imaginary part. Nothing need be symmetric. One that has
    ``conjugates`` and ``factors`` as a ``ModalReceptance`` is asked for these where they serve.
    """

    static: Array
    """Exact static compliance, (n_rows, n_columns), real, length/force: harmonic 0."""

    def at(self, orders: ArrayLike, omega: float | Array) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at the harmonics ``orders`` (k,) of ``omega`` (rad/s) and its derivative by omega.

        Both (k, n_rows, n_columns) for one omega, (n, k, n_rows, n_columns) for omega (n,). The derivative is by the
        fundamental frequency: it has the order as a factor. Orders may differ in more than frequency (a phase from
        sector to sector), which is why they are asked for by number. Where they do, stability asks for
        ``of_order(0, frequency)`` too, (n_rows, n_columns): the receptance of order 0 away from rest.
        """


@dataclass(frozen=True, kw_only=True)
class TimeEquations:
    """``M q'' + C q' + K q = columns @ f``, ``x = rows @ q + feedthrough @ f``, for integration in time.

    M, C, K are (n, n) (dense), ``columns`` (n, n_columns), ``rows`` (n_rows, n), ``feedthrough`` (n_rows, n_columns):
    the static residual of a truncated modal model, zero for matrices.
    """

    M: Array
    C: Array
    K: Array
    rows: Array
    columns: Array
    feedthrough: Array


@runtime_checkable
class Structure(Protocol):
    """A linear structure with named degrees of freedom.

    A structure may have parameters that can be changed and followed by name, such as "loss_factor": ``values`` holds
    them by name, ``changed(**values)`` is a copy with others. Its receptances then have ``changed(**values)`` too, and
    ``by_parameter(name, orders, omega)``, their derivative, of the shape of ``at``; and where the static compliance
    depends on them ``static_by_parameter(name)``, its derivative.
    """

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Names of distributed loads that are not a single dof (may be empty)."""

    @property
    def natural_frequencies(self) -> Array:
        """Undamped natural frequencies known to the structure, ascending, rad/s."""

    def project(self, rows: Array, columns: Array, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between direction vectors.

        ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) hold direction cosines; each name in ``shapes``
        (load shapes) adds one more column at the end. A structure whose attribute ``sparse_directions`` is true may be
        handed scipy sparse arrays where there are many.
        """

    def time_equations(
        self, rows: Array, columns: Array, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Equations of motion in time for the same rows and columns.

        Hysteretic damping becomes viscous with the same value at each mode's own frequency, or at the one given as
        ``damping_at`` (rad/s): then vibration at that frequency is damped as it is in the receptance. A structure
        without a ``loss_factor`` is never asked for that.
        """
