"""What the balance asks of a structure. Anything that answers this can be plugged in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from slipstick.structure.receptance import Receptance
from slipstick.typing import Array


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
