"""Schema of results: declares every variable, dimension and attribute for all writers and readers.

A branch in memory, the journal of a run, the results file of the command line and that of ``Branch.save`` are made from
the same ``Layout`` and the same attributes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise
from math import prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.balance.parameters import parameter_units
from slipstick.balance.reduction import reduction_attributes
from slipstick.contact.friction_law import FrictionLaw, is_friction
from slipstick.errors import InputError, Outcome
from slipstick.results.stability import PARTS, SPECIAL_KINDS, STABILITY_METHODS, is_wave, ranks
from slipstick.results.table import ResultColumn, ResultTable
from slipstick.state.registry import STATE_VARIABLES
from slipstick.typing import AnyArray, Array
from slipstick.units import ANGULAR, MIXED, Units, unit_of_dof

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.contact.law import Law, Variable

VariableParts = tuple[tuple[str, ...], AnyArray, dict[str, str]]
"""Dimensions, values, and ``units`` with ``long_name``."""

NEAR_PEAK, NEAR_FOLD = "near peak", "near turning point"
"""Kinds of solutions next to a peak or a turning point that could not be located."""

POINT_KINDS = (
    "start", "regular", "peak", "turning point", "requested", "end", *SPECIAL_KINDS, "optimum", "tie", "corner",
    NEAR_PEAK, NEAR_FOLD, "worn out", "separation", "interpolated",
)  # fmt: skip

CYCLES = "cycles"
"""Name of the followed parameter of wear."""

ANALYSIS = "analysis"
"""Attribute of results and of journals: the analysis that made them, as requests name it."""

REQUESTED = "requested"
"""Attribute of the values at which points are wanted."""

RELATIVE = "relative to the moving support"
"""Suffix of the names of motions where the support moves."""

SELF_EXCITED = "self-excited"
"""Value of the attribute "vibration" of limit cycles."""

MISSING = -1
"""Value of a missing integer; a missing real number is nan, a missing text is empty."""


class Declared(NamedTuple):
    """Declaration of a variable."""

    dims: tuple[str, ...]
    """Dimensions after ``point``."""
    units: str
    """Dimension in words, such as "force length/time", which ``layout_of`` puts the names of units into."""
    long_name: str
    whole: bool = False
    """Whether it holds whole numbers."""
    texts: tuple[str, ...] = ()
    """The texts it may hold instead of numbers."""


_DIMENSIONS = ("point", "dof", "coefficient", "contact", "bound", "rank", "part")

VARIABLES: dict[str, Declared] = {
    "omega": Declared((), ANGULAR, "fundamental frequency"),
    "excitation_frequency": Declared((), ANGULAR, "excitation frequency"),
    "parameter": Declared((), "1", "followed parameter"),
    "displacement": Declared(("dof", "coefficient"), "length", "displacement coefficients"),
    "amplitude": Declared(("dof",), "length", "amplitude (0-to-peak, without the mean)"),
    "mean": Declared(("dof",), "length", "mean"),
    "dissipated_power": Declared(("contact",), "force length/time", "dissipated power"),
    **{state.name: Declared(("contact",), state.units, state.long_name) for state in STATE_VARIABLES},
    "rubbing_velocity": Declared(("contact",), "length/time", "constant rubbing velocity"),
    "rubbing_motion": Declared(("contact", "coefficient"), "length", "periodic rubbing motion coefficients"),
    "normal_motion": Declared(
        ("contact", "coefficient"), "length", "normal motion coefficients of the opposing surface, positive to close"
    ),
    "truncation": Declared(
        (), "1", "estimate of what the harmonics left out would add, relative to the largest amplitude"
    ),
    "harmonics_in_use": Declared((), "1", "number of harmonics in use, 0 included; the others are zero", whole=True),
    "residual": Declared(
        (), "1",
        "residual of the balance over the sizes of its terms: of the motion and of the contact springs' part in it",
    ),
    "newton_iterations": Declared((), "1", "Newton corrections", whole=True),
    "kind": Declared((), "1", "kind of point: " + ", ".join(POINT_KINDS), texts=POINT_KINDS),
    "branch_part": Declared(
        (), "1", "part of the branch: 1, or 2 where it was also followed from the other end of the range; steady "
        "sliding beside limit cycles is 2; of a tracked peak one more where another is followed on", whole=True,
    ),
    "peak_dof": Declared((), "1", "index of the dof whose amplitude peaks here, -1 for none", whole=True),
}  # fmt: skip
"""Every variable that does not depend on the contact laws (``Law.variables``) and a user's own contact states."""

STABILITY: dict[str, Declared] = {
    "multiplier": Declared(("rank", "part"), "1", "Floquet multipliers, the largest first"),
    "multiplier_max": Declared((), "1", "largest magnitude of a Floquet multiplier"),
    "unstable_multipliers": Declared((), "1", "multipliers beyond the unit circle, -1 for not known", whole=True),
    "stable": Declared((), "1", "whether the motion is stable: 1, 0, or -1 for not known", whole=True),
    "stability_method": Declared(
        (), "1", "PW: exact pieces, count: by the argument principle, or eigenvalues: of steady sliding",
        texts=STABILITY_METHODS,
    ),
    "hill_pw_difference": Declared(
        (), "1", "distance of the largest multipliers of exact pieces and of the harmonic form, at points of note"
    ),
    "neutral_contacts": Declared((), "1", "contacts stuck all period, left out of the multipliers", whole=True),
}  # fmt: skip
"""Variables of a branch that was followed with stability."""

OF_WAVES: dict[str, Declared] = {
    "wave_number": Declared(
        (), "1", "wave number of the disturbance of a travelling wave that grows fastest, -1 where none is known",
        whole=True,
    ),
}  # fmt: skip
"""The same for travelling waves."""

MOTION_UNITS = "motion_units"
"""Attribute of the dofs: the unit of the motion of each, one a line; only where some are rotations."""

LARGEST = "largest"
"""In place of names of dofs: the largest amplitude of all outputs, whichever that is."""

ENDING = ("outcome", "outcome_text", "warnings")
"""Attributes that the end of a run changes."""

DIMENSIONS = {
    "point": "number along the branch",
    "dof": "degree of freedom",
    "coefficient": "harmonic coefficient",
    "contact": "contact",
    "bound": "lower and upper bound",
    "rank": "number of the multiplier, by magnitude",
    "part": "real and imaginary part",
}


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What each point of a branch holds."""

    labels: Mapping[str, tuple[str, ...]]
    """Names along the dimensions other than ``point``, such as ``{"dof": ("x",)}``."""
    variables: Mapping[str, Declared]
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of one variable at one point."""
        return tuple(len(self.labels[dim]) for dim in self.variables[name].dims)

    @property
    def size(self) -> int:
        """Numbers a point."""
        return sum(prod(self.shape(name)) for name in self.variables)

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Columns of each variable in a row."""
        ends = np.cumsum([0, *(prod(self.shape(name)) for name in self.variables)]).tolist()
        return {name: slice(*span) for name, span in zip(self.variables, pairwise(ends), strict=True)}

    def pack(self, point: Mapping[str, Any]) -> Array:
        """One point as a flat row; variables left out are nan. Raises InputError for a wrong shape or text."""
        parts = []
        for name, declared in self.variables.items():
            number = point.get(name, np.nan)
            value = np.asarray(_code(name, number, declared.texts) if declared.texts else number, dtype="<f8")
            if value.shape != self.shape(name) and value.ndim:
                raise InputError(f"results: '{name}' has shape {value.shape}; expected {self.shape(name)}")
            parts.append(np.broadcast_to(value, self.shape(name)).ravel())
        return np.concatenate(parts) if parts else np.zeros(0)

    def pack_all(self, points: Mapping[str, AnyArray]) -> Array:
        """Numbers of many points, (n_points, ...) by name, as flat rows (n_points, size); no texts among them."""
        parts = [np.asarray(points[name], dtype="<f8") for name in self.variables]
        count = len(parts[0])
        return np.concatenate([part.reshape(count, prod(part.shape[1:])) for part in parts], axis=1)

    def unpack(self, rows: Array) -> dict[str, AnyArray]:
        """Variables (n_points, ...) from rows (n_points, size)."""
        return {name: self.unpack_one(name, rows[:, columns]) for name, columns in self.columns.items()}

    def unpack_one(self, name: str, numbers: Array) -> AnyArray:
        """One variable (n_points, ...) from its columns of the rows."""
        return self._of_type(name, numbers.reshape(len(numbers), *self.shape(name)))

    def _of_type(self, name: str, values: AnyArray) -> AnyArray:
        """Integers and texts from the numbers of the journal; values already of their type are returned as they are."""
        declared = self.variables[name]
        if values.dtype.kind != "f" or not (declared.whole or declared.texts):
            return values
        known = np.isfinite(values) & (np.abs(values) < np.iinfo(np.int32).max)
        codes = np.where(known, values, MISSING).astype(np.int32)
        if not declared.texts:
            return codes
        return np.array([*declared.texts, ""])[np.clip(codes, MISSING, len(declared.texts) - 1)]

    @property
    def _units_of_dofs(self) -> dict[str, str]:
        """The unit of the motion of each dof, one a line, where some are rotations."""
        mixed = next((own.units for own in self.variables.values() if MIXED in own.units), "")
        return {MOTION_UNITS: "\n".join(unit_of_dof(mixed, dof) for dof in self.labels["dof"])} if mixed else {}

    def tables(self, values: Mapping[str, AnyArray], first: int = 0) -> Iterator[tuple[str, VariableParts]]:
        """Coordinates, then variables, by name, from values (n_points, ...) of the points from ``first`` on."""
        count = len(next(iter(values.values()), ()))
        yield "point", (("point",), np.arange(first, first + count), _meaning("1", DIMENSIONS["point"]))
        for dim, names in self.labels.items():
            meaning = _meaning("1", DIMENSIONS.get(dim, dim)) | (self._units_of_dofs if dim == "dof" else {})
            yield dim, ((dim,), np.array(names, dtype=np.str_), meaning)
        for name, declared in self.variables.items():
            meaning = _meaning(declared.units, declared.long_name)
            yield name, (("point", *declared.dims), self._of_type(name, values[name]), meaning)


def _meaning(units: str, long_name: str) -> dict[str, str]:
    return {"units": units, "long_name": long_name}


def _code(name: str, text: Any, known: Sequence[str]) -> float:
    if isinstance(text, float):
        return text
    if not str(text):
        return float(MISSING)
    if str(text) in known:
        return float(known.index(str(text)))
    raise InputError(f"results: '{name}' is {text}; expected one of {', '.join(known)}")


def layout_of(
    problem: Problem, *, parameter: str = "", stability: bool = False, only: Sequence[str] | None = None
) -> Layout:
    """Layout of the points of a branch of a problem; ``only`` some variables for a linear response."""
    chosen = {name: _of_problem(problem, VARIABLES[name]) for name in only or ()}
    variables = dict(_declared(problem, parameter)) if only is None else chosen
    variables |= STABILITY if stability else {}
    variables |= OF_WAVES if stability and is_wave(problem) else {}
    labels = {
        "dof": tuple(problem.outputs or ()),
        "coefficient": problem.harmonics.labels,
        "contact": problem.elements,
        "bound": ("lower", "upper"),
        "rank": ranks(problem) if stability else (),
        "part": PARTS,
    }
    used = {dim for declared in variables.values() for dim in declared.dims}
    labelled = {
        name: declared._replace(units=unit_in(problem.units, declared, labels["dof"]))
        for name, declared in variables.items()
    }
    return Layout(labels={dim: names for dim, names in labels.items() if dim in used}, variables=labelled)


def unit_in(units: Units, declared: Declared, dofs: Sequence[str]) -> str:
    """The unit of a variable; of the motion of dofs "m or rad" where some are rotations."""
    return units.of_dofs(dofs, declared.units) if "dof" in declared.dims else units.label(declared.units)


def _declared(problem: Problem, parameter: str) -> Iterator[tuple[str, Declared]]:
    """Variables of every branch, those of the ports, those of the laws."""
    for name, declared in VARIABLES.items():
        if name != "parameter":
            yield name, _of_problem(problem, declared)
        elif parameter:
            yield name, Declared((), parameter_units(problem, parameter), parameter)
    for batch in problem.batches:
        for port, force in zip(batch.law.ports, batch.law.force_names, strict=True):
            dims = ("contact", "coefficient")
            yield f"contact_{port}", Declared(dims, "length", f"{port} relative motion coefficients")
            yield f"{force}_force", Declared(dims, "force", f"{force} force coefficients")
        for name, variable in law_variables(batch.law).items():
            yield name, Declared(("contact", *variable.dims), variable.units, variable.long_name)
    for name, state in zip(state_names(problem), problem.contact_states, strict=True):
        if name not in VARIABLES:
            yield name, Declared(("contact",), state.variable.units, state.variable.long_name)


def state_names(problem: Problem) -> list[str]:
    """What results call the values of each contact state; "state_" comes before a name that means something else."""
    laws = {name for batch in problem.batches for name in law_variables(batch.law)}
    taken = {*VARIABLES, *STABILITY, *_DIMENSIONS, *laws} - {state.name for state in STATE_VARIABLES}
    return [
        f"state_{state.variable.name}" if state.variable.name in taken else state.variable.name
        for state in problem.contact_states
    ]


def law_variables(law: Law) -> dict[str, Variable]:
    """Variables of a law by name; "law_" comes before one that every branch or friction contact may have, or a
    dimension."""
    variables, taken = law.variables, {*VARIABLES, *STABILITY, *_DIMENSIONS}
    if not is_friction(law):
        taken |= {name for name, its in FrictionLaw.variables.items() if variables.get(name) != its}
    return {f"law_{name}" if name in taken else name: variables[name] for name in variables}


def _of_problem(problem: Problem, declared: Declared) -> Declared:
    """Motion is relative to the support where one moves, and says so."""
    if "dof" not in declared.dims or not problem.relative:
        return declared
    return declared._replace(long_name=f"{declared.long_name}, {RELATIVE}")


def branch_parts(data: Any) -> AnyArray:
    """Part of the branch that each point of a dataset belongs to."""
    if "branch_part" in data and tuple(data["branch_part"].dims) == ("point",):
        parts: AnyArray = data["branch_part"].to_numpy()
        return parts
    return np.ones(int(data.sizes.get("point", 0)), dtype=np.int32)


def make_table(layout: Layout, values: Mapping[str, AnyArray], attributes: Mapping[str, Any]) -> ResultTable:
    """The table of a branch from the values of its points, (n_points, ...) each."""
    return ResultTable({name: ResultColumn(*parts) for name, parts in layout.tables(values)}, dict(attributes))


def requested_attribute(values: Sequence[float]) -> dict[str, str]:
    """Values of the followed quantity at which points are wanted, as an attribute; none where there are none."""
    return {REQUESTED: " ".join(repr(float(value)) for value in values)} if values else {}


def attributes_of(
    problem: Problem, outcome: Outcome, message: str, warnings: Sequence[str] = (), *, analysis: str,
    parameter: str = "", **more: Any,
) -> dict[str, Any]:  # fmt: skip
    """Attributes of results: analysis, title, case, outcome, warnings, settings, versions, then the work (``more``).

    ``case`` and ``case_file`` are empty for a problem made in Python; ``frequency_unit`` is the one to draw in.
    """
    return {
        "Conventions": "CF-1.11",
        ANALYSIS: analysis,
        "title": problem.title,
        **problem.units.attributes,
        "frequency_unit": problem.units.angular,
        "case": "",
        "case_file": "",
        "harmonics": " ".join(str(m) for m in problem.harmonics.orders),
        "parameter": parameter,
        **({"coordinates_of_motion": RELATIVE} if problem.relative else {}),
        **reduction_attributes(problem),
        "warnings": "\n".join(warnings),
        "outcome": outcome.name,
        "outcome_text": message or outcome.text,
        **versions(),
        **more,
    }


@cache
def versions() -> dict[str, str]:
    """Versions of what computes the numbers."""
    import platform
    from importlib.metadata import version

    packages = {f"{name}_version": version(name) for name in ("slipstick", "numpy", "scipy", "numba")}
    return {**packages, "python_version": platform.python_version()}
