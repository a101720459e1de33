"""Base class of structures: the members that the balance uses, with defaults for those that are not known."""

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


TEMPERATURE, DISPLACEMENT = "temperature", "displacement"
"""Load shapes of temperature fields and of supports that move are called by these words, before their own names."""

CENTRIFUGAL = "centrifugal"
"""Load shape of the forces of rotation at one radian per time."""


class Around(NamedTuple):
    """Cyclic symmetry of a structure on a disc."""

    sectors: int
    engine_order: int
    whole: bool
    """Whether every sector has dofs of its own, ``tip@0`` to ``tip@23``."""


class Structure(ABC):
    """A linear structure with named degrees of freedom; a structure of one's own derives from it.

    It needs ``dofs``, ``natural_frequencies`` and ``project``. The rest may be left out and is then reported as
    unknown.

    A structure may have parameters that can be changed and followed by name, such as "loss_factor": ``values`` holds
    them by name, ``changed(**values)`` is a copy with others. Its receptances then have ``changed(**values)`` too, and
    ``by_parameter(name, orders, omega)``, their derivative, of the shape of ``at``; and where the static compliance
    depends on them ``static_by_parameter(name)``, its derivative.

    Attributes
    ----------
    dofs
        Names of the degrees of freedom.
    natural_frequencies
        Undamped natural frequencies, ascending, rad/s; those that are known.
    load_shapes
        Names of distributed loads that are not a single dof.
    damping_ratios
        Damping ratio of each of the natural frequencies, (n,); None: not known.
    energy_fed
        Modes to which damping feeds energy, in words; empty: none; None: not known.
    self_excited
        Modes that grow by circulatory or negative stiffness without contacts, in words; empty: none; None: not known.
    residuals
        Kind of the residuals of the modes left out, such as "solved"; empty where there is only one.
    loss_factor
        Hysteretic loss factor, of all or of each mode; 0 where there is none.
    sparse_directions
        Whether ``project`` takes scipy sparse arrays of directions where there are many.
    covers
        Lowest and highest frequency of the receptance, rad/s.
    M
        Mass matrix of the dofs, for supports that move; None: a load shape "base x" stands for it.
    units
        Names of its units, of an imported model; None: not known.
    skin, strains
        Surface mesh, and strains at elements, with their motion; None: not known.
    around
        Its cyclic symmetry; None: it is not of a disc.
    tied
        Whether a speed of rotation is tied to the frequency of the response.
    held
        Whether it has a static compliance; else contacts have to constrain it.
    n_rigid
        Number of rigid-body motions; forces have to be in equilibrium along them.
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
        without a ``loss_factor`` never receives it.
        """
        del rows, columns, shapes, damping_at
        raise InputError(Fault("structure", f"a {type(self).__name__} does not tell its equations in time"))

    @property
    def every_value(self) -> Mapping[str, float]:
        """All named parameters, those of single modes included."""
        return {**self.values, **self.further_values}

    def changed(self, **values: float) -> Self:
        """A copy with other values of named parameters; InputError where it has none."""
        raise InputError(f"a {type(self).__name__} has no parameters; {', '.join(values)} cannot be changed")

    def turning_with(self, omega: float) -> Self:
        """The structure at the speed of rotation that is tied to a fundamental frequency, rad/s."""
        del omega
        return self

    def resonances(self, orders: Array) -> Array | None:
        """Frequencies at which harmonics meet a natural frequency, ascending; None: not known."""
        natural = np.asarray(self.natural_frequencies, dtype=float)
        return np.unique(np.divide.outer(natural[natural > 0.0], orders)) if natural.size else None

    def unbalanced(self, columns: Array) -> Array:
        """Resultants of forces along columns (n_dofs, k) on the rigid-body motions, (n_rigid, k); 0 in equilibrium."""
        return np.zeros((0, columns.shape[1]))

    def truncations(self, order: int) -> tuple[Truncation, ...] | None:
        """Errors by the modes left out of a harmonic; empty: none are left out; None: not known.

        One for the phase of a travelling wave from sector to sector, or one for each phase of a whole disc.
        """
        del order
        return None

    def own_compliance(self, along: Any) -> tuple[Array, Array] | None:
        """Static compliances of directions (n_dofs, k) along themselves: total, and of the modes left out, (k,) each.

        None: it has no modes, or they are not known.
        """
        del along
        return None
