"""What the balance asks of a structure: its base class tells what is not known of one."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.structure.receptance import Receptance
from slipstick.typing import Array
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.structure.skin import Skin
    from slipstick.structure.strains import Strains
    from slipstick.structure.truncation import Truncation


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


class Around(NamedTuple):
    """How a structure goes round a disc."""

    sectors: int
    engine_order: int
    whole: bool
    """Whether every sector has dofs of its own, ``tip@0`` to ``tip@23``."""


class Structure(ABC):
    """A linear structure with named degrees of freedom; a structure of one's own derives from it.

    It needs ``dofs``, ``natural_frequencies`` and ``project``. The rest may be left out: what a structure does not tell
    is reported as unknown.

    A structure may have parameters that can be changed and followed by name, such as "loss_factor": ``values`` holds
    them by name, ``changed(**values)`` is a copy with others. Its receptances then have ``changed(**values)`` too, and
    ``by_parameter(name, orders, omega)``, their derivative, of the shape of ``at``; and where the static compliance
    depends on them ``static_by_parameter(name)``, its derivative.

    Attributes
    ----------
    dofs
        Names of the degrees of freedom.
    natural_frequencies
        Undamped natural frequencies known to the structure, ascending, rad/s.
    load_shapes
        Names of distributed loads that are not a single dof.
    damping_ratios
        Damping ratio of each of the natural frequencies, (n,); None: not known.
    energy_fed
        Where damping feeds energy in, in words; empty: nowhere; None: not known.
    self_excited
        What grows by circulatory or negative stiffness without contacts, in words; empty: nothing; None: not known.
    residuals
        How what modes leave out is applied, "solved" for instance; empty where there is nothing to tell.
    loss_factor
        Hysteretic loss factor, of all or of each mode; 0 where there is none.
    sparse_directions
        Whether ``project`` takes scipy sparse arrays of directions where there are many.
    covers
        Lowest and highest frequency that is answered, rad/s.
    M
        Mass matrix of the dofs, for supports that move; None: a load shape "base x" stands for it.
    units
        Names of its units, of a model that is imported; None: not known.
    skin, strains
        The surface and the elements that are seen besides; None: not known.
    around
        How it goes round a disc; None: it is not of a disc.
    tied
        Whether a speed of rotation is tied to the frequency of the response.
    held
        Whether it has a static compliance; else its contacts have to hold it.
    n_rigid
        Number of rigid-body motions along which forces have to be in balance.
    couples
        Whether damping or the gas couple its modes.
    """

    if TYPE_CHECKING:  # attributes or properties, as a structure likes

        @property
        def dofs(self) -> tuple[str, ...]: ...  # noqa: D102
        @property
        def natural_frequencies(self) -> Array: ...  # noqa: D102
        @property
        def load_shapes(self) -> tuple[str, ...]: ...  # noqa: D102
        @property
        def values(self) -> Mapping[str, float]: ...  # noqa: D102
        @property
        def further_values(self) -> Mapping[str, float]: ...  # noqa: D102
        @property
        def damping_ratios(self) -> Array | None: ...  # noqa: D102
        @property
        def energy_fed(self) -> str | None: ...  # noqa: D102
        @property
        def self_excited(self) -> str | None: ...  # noqa: D102
        @property
        def residuals(self) -> str: ...  # noqa: D102
        @property
        def covers(self) -> tuple[float, float]: ...  # noqa: D102

        @property
        def units(self) -> Units | None: ...  # noqa: D102
        @property
        def around(self) -> Around | None: ...  # noqa: D102
        @property
        def tied(self) -> bool: ...  # noqa: D102
        @property
        def held(self) -> bool: ...  # noqa: D102
        @property
        def n_rigid(self) -> int: ...  # noqa: D102
        @property
        def couples(self) -> bool: ...  # noqa: D102

        sparse_directions: bool
        loss_factor: Any
        M: Any
        skin: Skin | None
        strains: Strains | None
    else:
        load_shapes = ()
        values = further_values = MappingProxyType({})
        damping_ratios = energy_fed = self_excited = None
        loss_factor = 0.0
        sparse_directions, residuals, covers = False, "", (0.0, inf)
        M = units = skin = strains = around = None
        tied, held, n_rigid, couples = False, True, 0, False

    @abstractmethod
    def project(self, rows: Array, columns: Array, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between direction vectors.

        ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) hold direction cosines; each name in ``shapes``
        (load shapes) adds one more column at the end.
        """

    def time_equations(
        self, rows: Array, columns: Array, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Equations of motion in time for the same rows and columns; InputError where they are not known.

        Hysteretic damping becomes viscous with the same value at each mode's own frequency, or at the one given as
        ``damping_at`` (rad/s): then vibration at that frequency is damped as it is in the receptance. A structure
        without a ``loss_factor`` is never asked for that.
        """
        del rows, columns, shapes, damping_at
        raise InputError(Fault("structure", f"a {type(self).__name__} does not tell its equations in time"))

    @property
    def every_value(self) -> Mapping[str, float]:
        """Named parameters with those that are asked for by name alone, as many as it has modes."""
        return {**self.values, **self.further_values}

    def changed(self, **values: float) -> Self:
        """A copy with other values of named parameters; InputError where it has none."""
        raise InputError(f"a {type(self).__name__} has no parameters; {', '.join(values)} cannot be changed")

    def turning_with(self, omega: float) -> Self:
        """As it is at a fundamental frequency, rad/s: at the speed of rotation that is tied to it."""
        del omega
        return self

    def resonances(self, orders: Array) -> Array | None:
        """Frequencies at which harmonics meet a natural frequency, ascending; None: not known."""
        natural = np.asarray(self.natural_frequencies, dtype=float)
        return np.unique(np.divide.outer(natural[natural > 0.0], orders)) if natural.size else None

    def unbalanced(self, columns: Array) -> Array:
        """What forces along columns (n_dofs, k) push along the rigid-body motions, (n_rigid, k); 0 in balance."""
        return np.zeros((0, columns.shape[1]))

    def truncations(self, order: int) -> tuple[Truncation, ...] | None:
        """What modes leave out of the motion that a harmonic has; empty: nothing; None: not known.

        Of a wave that of one phase from sector to sector, of a whole disc that of all.
        """
        del order
        return None

    def own_compliance(self, along: Any) -> tuple[Array, Array] | None:
        """Static compliances of directions (n_dofs, k) over themselves: whole, and of what modes leave out, (k,) each.

        None: it has no modes, or does not tell.
        """
        del along
        return None
