"""Which cases a study has: the values of its parameters, case by case."""

from __future__ import annotations

import warnings
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.balance.contacts import PER_AREA
from slipstick.balance.loads import phase_warnings
from slipstick.balance.parameters import FACTORS, product_warnings
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import MOST_ITEMS, Gathering, number, shown, suggestion, table, text, whole
from slipstick.structure.disc import MISTUNING, Disc
from slipstick.studies.parameter_values import Distribution, Range, is_distribution, parameter_values, sampled
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem


STUDY = ("study",)
"""Path of faults in a study."""
_EXPECTED = 'a table of parameters such as "damper.velocity" = [0, 1, 10]'
MISTUNED = "mistuning"
METHODS = ("grid", "list", "random", "latin-hypercube", "sobol", "saltelli", MISTUNED)
SAMPLED = METHODS[2:6]
EVENLY = METHODS[4:6]
"""Those of Sobol's sequence, which fills the ranges evenly for powers of two."""
_EACH = 200
"""Up to so many values of a parameter are tried one by one before anything is computed; of more, the two ends."""


@dataclass(frozen=True, kw_only=True)
class StudyPlan:
    """The cases of a study, in order.

    Attributes
    ----------
    names
        The parameters, in the order in which they are set.
    values
        Their values, (n_cases, n_names).
    axes
        Of a grid, the values along each parameter: cases are its points, the last parameter fastest. Else empty.
    method, seed
        How the values were chosen.
    spread
        Of discs with random blades, the standard deviation of their deviations; the last case is the tuned disc.
    distributions
        Of samples, what each parameter was drawn from, in words.
    warnings
        What is suspicious.
    """

    names: tuple[str, ...]
    values: Array
    axes: tuple[Array, ...]
    method: str
    seed: int
    spread: float | None = None
    distributions: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.values)

    @property
    def tuned(self) -> int | None:
        """Of discs with random blades, the case of the tuned disc, which amplitudes are related to."""
        return None if self.spread is None else len(self) - 1

    @property
    def size(self) -> int:
        """The number of cases along the parameters: all but the tuned disc."""
        return len(self) if self.tuned is None else self.tuned

    @property
    def order(self) -> tuple[int, ...]:
        """The cases in the order in which they are computed: the tuned disc first."""
        return (*(() if self.tuned is None else (self.tuned,)), *range(self.size))

    @property
    def dims(self) -> tuple[str, ...]:
        """Dimensions of the results."""
        return self.names if self.axes else ("case",)

    @property
    def shape(self) -> tuple[int, ...]:
        """Their lengths."""
        return tuple(axis.size for axis in self.axes) if self.axes else (self.size,)

    def problem(self, base: Problem, case: int) -> Problem:
        """The problem of one case; raises InputError where its values are not allowed together."""
        factor = {} if self.spread is None else {MISTUNING: 1.0}
        return base.at_parameters({**factor, **dict(zip(self.names, self.values[case].tolist(), strict=True))})


def make_plan(
    problem: Problem,
    parameters: object,
    *,
    method: object = "grid",
    samples: object = None,
    seed: object = 0,
    spread: object = None,
) -> StudyPlan:
    """The cases of a study.

    Raises
    ------
    InputError
        For an unknown parameter or method, values that are no numbers or not allowed, and parameters that set the same
        thing: all faults at once.
    """
    gathering = Gathering()
    arguments = _checked_arguments(gathering, problem, parameters, method, samples, seed, spread)
    gathering.end()
    if arguments.method == MISTUNED:
        return _mistuned(problem, arguments.size, arguments.seed, arguments.spread)
    order = sorted(arguments.parts, key=lambda name: _is_derived(problem, name))
    plan = _plan(order, arguments.parts, arguments.method, arguments.size, arguments.seed)
    drawn = {name for name in plan.names if isinstance(arguments.parts[name], Distribution)}
    warned = [*plan.warnings, *_allowed(problem, plan, drawn), *product_warnings(problem, plan.names)]
    for name, values in zip(plan.names, plan.values.T, strict=True):
        load = problem.parameter_target(name).load
        if load is not None and name.endswith("phase"):
            warned += phase_warnings(load.target, max(values.tolist(), key=abs))
    return replace(plan, warnings=tuple(warned))


def study_faults(
    parameters: object, *, method: object = "grid", samples: object = None, seed: object = 0, spread: object = None
) -> list[Fault]:
    """What is wrong with a study whose problem is not known."""
    gathering = Gathering()
    _checked_arguments(gathering, None, parameters, method, samples, seed, spread)
    return gathering.faults


class _Arguments(NamedTuple):
    """Checked arguments of a study, valid only without faults."""

    parts: dict[str, Any]
    """Values or ranges by parameter."""
    method: str
    size: int
    seed: int
    spread: float


def _checked_arguments(
    gathering: Gathering, problem: Problem | None, parameters: Any, method: Any, samples: Any, seed: Any, spread: Any
) -> _Arguments:
    """The arguments, checked, also against the problem where there is one."""
    method = gathering.take(_method, method)
    mistuned, drawn = method == MISTUNED, method in (*SAMPLED, MISTUNED)
    absent = mistuned and parameters is None
    values = {} if absent else gathering.take(table, STUDY, parameters, _EXPECTED) or {}
    seed = gathering.take(whole, (*STUDY, "seed"), seed, 0)
    if mistuned:
        gathering.faults += [
            Fault(
                (*STUDY, name), f'it is given, but method = "{MISTUNED}" varies the blades alone', remedy="leave it out"
            )
            for name in values
        ]
        if problem is not None:
            gathering.take(disc_of, problem)
        values = {}
    elif not values and not gathering.faults:
        gathering.faults.append(Fault(STUDY, "no parameter is given", remedy=f"give {_EXPECTED}"))
    if problem is not None:
        known = [name for name in values if gathering.take(_is_known, problem, name)]
        if known:
            gathering.take(_distinct, problem, known)
    where = (*STUDY, "samples")
    if drawn and samples is None:
        gathering.faults.append(Fault(where, IS_MISSING, remedy=f'method = "{method}" needs it, such as samples = 64'))
    elif method is not None and not drawn and samples is not None:
        said = f'it is given, but method = "{method}" counts the values of its parameters'
        gathering.faults.append(Fault(where, said, remedy="leave it out"))
    count = gathering.take(whole, where, samples, 1, MOST_ITEMS) if drawn and samples is not None else 1
    where, deviation = (*STUDY, "spread"), 0.0
    if mistuned and spread is None:
        gathering.faults.append(
            Fault(where, IS_MISSING, remedy=f'method = "{MISTUNED}" needs it, such as spread = 0.01')
        )
    elif mistuned:
        deviation = gathering.take(lambda: number(where, spread, "a number > 0, such as 0.01", above=1e-300)) or 0.0
    elif method is not None and spread is not None:
        said = f'it is given, but it is that of blades with method = "{MISTUNED}"'
        gathering.faults.append(Fault(where, said, remedy="leave it out"))
    read = sampled if method in SAMPLED else _listed_values
    parts = {name: gathering.take(read, (*STUDY, name), value) for name, value in values.items()}
    return _Arguments(parts, str(method), count or 1, int(seed or 0), deviation)


def _listed_values(where: tuple[str, ...], value: object) -> Array:
    if is_distribution(value):
        methods = ", ".join(f'"{name}"' for name in SAMPLED)
        raise InputError(Fault(where, "a distribution is sampled", remedy=f"give samples and a method: {methods}"))
    return parameter_values(where, value)


def _plan(names: Sequence[str], parts: Mapping[str, Any], method: str, samples: int, seed: int) -> StudyPlan:
    axes: list[Any] = [parts[name] for name in names]
    common: dict[str, Any] = {"names": tuple(names), "method": method, "seed": seed}
    if method in SAMPLED:
        return StudyPlan(
            values=_samples(axes, method, samples, seed), axes=(), warnings=_uneven(method, samples),
            distributions=tuple(map(str, axes)), **common,
        )  # fmt: skip
    if method == "list":
        if len({values.size for values in axes}) > 1:
            listed = ", ".join(f"{values.size} of {name}" for name, values in zip(names, axes, strict=True))
            raise InputError(Fault(STUDY, found=listed, expected='as many of each with method = "list"'))
        return StudyPlan(values=np.stack(axes, axis=1), axes=(), **common)
    for name, values in zip(names, axes, strict=True):
        repeated = [value for i, value in enumerate(values.tolist()) if value in values[:i]]
        if repeated:
            raise InputError(Fault((*STUDY, name), found=f"{repeated[0]:g} twice", expected="every value once"))
    if prod(values.size for values in axes) > MOST_ITEMS:
        count = prod(values.size for values in axes)
        raise InputError(Fault(STUDY, found=f"{count} cases", expected=f"at most {MOST_ITEMS}"))
    grid = np.meshgrid(*axes, indexing="ij")
    return StudyPlan(values=np.stack([axis.ravel() for axis in grid], axis=1), axes=tuple(axes), **common)


def disc_of(problem: Any) -> Disc:
    """The disc of a problem; raises InputError where it has none whose blades may differ."""
    structure = getattr(problem, "structure", None)
    if not isinstance(structure, Disc) or structure.blade is None:
        expected = (
            "the problem of a disc, sector.mistuned(blade=...).problem(...), in a case file mistuning in [structure]"
        )
        raise InputError(Fault("problem", found=shown(structure), expected=expected))
    return structure


def _mistuned(problem: Problem, samples: int, seed: int, spread: float) -> StudyPlan:
    """Discs whose blades differ at random, each with a seed of its own, and the tuned one after them."""
    sectors = disc_of(problem).sectors
    seeds = np.random.SeedSequence(seed).spawn(samples)
    deviations = [np.random.default_rng(own).normal(0.0, spread, sectors) for own in seeds]
    return StudyPlan(
        names=tuple(f"stiffness@{s}" for s in range(sectors)), values=np.array([*deviations, np.zeros(sectors)]),
        axes=(), method=MISTUNED, seed=seed, spread=spread, distributions=(f"norm(0, {spread:.9g})",) * sectors,
    )  # fmt: skip


def _samples(marginals: Sequence[Range | Distribution], method: str, count: int, seed: int) -> Array:
    """Values (n, n_parameters) of independent parameters."""
    unit = _unit_samples(len(marginals), method, count, seed)
    # 0 and 1 themselves are quantiles at the end of a tail, which may be infinite
    unit = np.clip(unit, 2.0**-53, 1.0 - 2.0**-53) if any(isinstance(m, Distribution) for m in marginals) else unit
    return np.stack([m.quantile(column) for column, m in zip(unit.T, marginals, strict=True)], axis=1)


def _unit_samples(size: int, method: str, count: int, seed: int) -> Array:
    """Samples (n, size) in the unit cube.

    Those of "saltelli" are what Sobol indices are estimated from [Saltelli et al., Comput. Phys. Commun. 181 (2010)
    259-270]: of every point of a Sobol sequence of twice the dimension its first half A, A with each coordinate in
    turn from its second half B, and B.
    """
    from scipy.stats import qmc

    generator = np.random.default_rng(seed)
    if method == "random":
        return generator.random((count, size))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a number of samples that is no power of two: told in our words
        if method == "latin-hypercube":
            return np.asarray(qmc.LatinHypercube(d=size, rng=generator).random(count))
        if method == "sobol":
            return np.asarray(qmc.Sobol(d=size, rng=generator).random(count))
        A, B = np.split(qmc.Sobol(d=2 * size, rng=generator).random(count), 2, axis=1)
    rows = np.repeat(A[:, None], size + 2, axis=1)
    rows[:, 1 + np.arange(size), np.arange(size)] = B
    rows[:, -1] = B
    return rows.reshape(-1, size)


def _uneven(method: str, count: int) -> tuple[str, ...]:
    if method not in EVENLY or count & (count - 1) == 0:
        return ()
    near = 1 << count.bit_length()
    return (f"study: {count} Sobol samples do not fill the ranges evenly; a power of two does, such as {near}",)


def _method(value: object) -> str:
    where = (*STUDY, "method")
    method = text(where, value, f"one of {', '.join(METHODS)}")
    if method not in METHODS:
        raise InputError(Fault(where, found=shown(method), remedy=suggestion(method, METHODS)))
    return method


def _is_known(problem: Problem, name: str) -> bool:
    try:
        problem.parameter_target(name)
    except InputError as error:
        raise InputError([fault.inside(*STUDY) for fault in error.faults]) from None
    if "/" in name:
        said = "a name with a slash cannot be a coordinate of results"
        raise InputError(Fault((*STUDY, name), said, remedy="rename the contact"))
    return True


def _sets(problem: Problem, name: str) -> set[Any]:
    """What a parameter sets: (quantity, contact), or what else its name stands for."""
    target = problem.parameter_target(name)
    if not target.members:
        return {(target.quantity, target.load) if target.load is not None else target.quantity}
    return {(_underlying(problem, member, target.quantity), member) for member in target.members}


def _underlying(problem: Problem, member: tuple[int, int], quantity: str) -> str:
    quantity = quantity.removesuffix(PER_AREA)
    for batch, inputs in zip(problem.batches, problem.inputs.batches, strict=True):
        if member in batch.members:
            underlying = batch.law.stands_for(quantity, inputs.values)
            return underlying[0] if underlying is not None else quantity
    return quantity


def _is_derived(problem: Problem, name: str) -> bool:
    """Whether a parameter stands for another one times a factor, which must be set first (a normal load: kn)."""
    target = problem.parameter_target(name)
    return any(_underlying(problem, member, target.quantity) != target.quantity for member in target.members)


def _distinct(problem: Problem, names: Sequence[str]) -> None:
    for i, name in enumerate(names):
        for other in names[:i]:
            if name not in FACTORS and _sets(problem, name) & _sets(problem, other):
                said = f"'{other}' and '{name}' set the same thing"
                raise InputError(Fault(STUDY, said, remedy="keep one of them"))


def _allowed(problem: Problem, plan: StudyPlan, spread: Container[str]) -> list[str]:
    """Warnings of values that a parameter cannot have, in the tails of a distribution (``spread``): such a case fails.

    Raises
    ------
    InputError
        For such values elsewhere.
    """
    faults: list[Fault] = []
    said = []
    for name, column in zip(plan.names, plan.values.T, strict=True):
        values = np.unique(column)
        tried = (values if values.size <= _EACH else values[[0, values.size // 2, -1]]).tolist()
        refused = {value: list(_refusals(problem, name, value)) for value in tried}
        refused = {value: found for value, found in refused.items() if found}
        if refused and name in spread and len(refused) < len(tried):
            first, found = next(iter(refused.items()))
            said.append(f"study, {name}: its distribution reaches {first:g}, which is not allowed; {found[0]}")
            continue
        for value, found in refused.items():
            faults += [Fault((*STUDY, name), f"{value:g} is not allowed", remedy=str(fault)) for fault in found]
    if faults:
        raise InputError(faults)
    return said


def _refusals(problem: Problem, name: str, value: float) -> Iterator[Fault]:
    try:
        problem.at_parameter(name, value)
    except InputError as error:
        yield from error.faults
