"""Solutions along a branch: one labelled table, how it ended, and the problem. Analyses make it, all readers take it.

What users do with them next is in ``slipstick.branch``.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from slipstick.errors import InputError, Outcome
from slipstick.faults import in_radians, number, one, text, warn, whole, wrong
from slipstick.results.peaks import peak_points
from slipstick.results.schema import LARGEST
from slipstick.results.table import ResultTable, is_dataset
from slipstick.results.view import analysis_of, followed_of, names_of, orders_of, place_of
from slipstick.state.wear import WearModel
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Frequency
from slipstick.units import Units

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.balance import Balance
    from slipstick.balance.problem import Problem


_ROUNDING = 1e-9
_READING_ERROR = 1e-5
"""Relative error of an end of the range that was copied from a figure or a message."""


class Solutions:
    """Solutions along a branch: the arguments, the attributes and their meaning are those of ``ss.Branch``.

    Parameters
    ----------
    dataset, outcome, problem, message, without
        As of ``ss.Branch``.
    """

    excited: Problem | None = None
    """Of a nonlinear mode the problem with its loads, whose parameters move it; None where it is unknown."""

    def __init__(
        self, dataset: object, outcome: Outcome, problem: Problem | None = None, message: str = "", without: str = ""
    ) -> None:
        if not is_dataset(dataset):
            raise wrong("branch, dataset", dataset, "an xarray.Dataset")
        self.outcome = one("branch, outcome", outcome, Outcome, "an ss.Outcome")
        message, without = text("branch, message", message), text("branch, without", without)
        self._source, self.problem, self._message = dataset, problem, message
        self.subharmonics: tuple[Solutions, ...] = ()
        self.without = "" if problem is not None else without or "it was made from a dataset alone"

    def __getstate__(self) -> dict[str, Any]:
        kept = {k: v for k, v in vars(self).items() if k not in ("dataset", "balance")}
        return {**kept, "_source": self.dataset}

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """All numbers with their labels."""
        source: Any = self._source
        return source.to_dataset() if isinstance(source, ResultTable) else source

    @cached_property
    def balance(self) -> Balance:
        """The equations of its problem, built once; InputError where there is no problem."""
        from slipstick.balance.balance import Balance

        return Balance(self._known_problem)

    @property
    def table(self) -> ResultTable:
        """The same numbers without xarray; those of the dataset where it was made already and may have been changed."""
        source: Any = vars(self).get("dataset", self._source)
        return source if isinstance(source, ResultTable) else ResultTable.of(source)

    @property
    def message(self) -> str:
        """How it ended: the text of the outcome and, where it stopped early, at which point, contact, temperature."""
        return self._message or str(self.table.attrs.get("outcome_text", "")) or self.outcome.text

    @property
    def warnings(self) -> tuple[str, ...]:
        """What could be computed but is suspicious, one sentence each."""
        return tuple(str(self.table.attrs.get("warnings", "")).splitlines())

    @classmethod
    def from_dataset(
        cls, dataset: xarray.Dataset | ResultTable, problem: Problem | None = None, without: str = ""
    ) -> Self:
        """From a stored dataset; the outcome is read from its attributes. ``without``: why there is no problem."""
        name = str(dataset.attrs.get("outcome", ""))
        outcome = Outcome[name] if name in Outcome.__members__ else Outcome.INTERRUPTED
        return cls(dataset, outcome, problem, without=without)

    def __len__(self) -> int:
        return int(self.table.sizes.get("point", 0))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self)} points, {self.outcome.words})"

    @property
    def harmonics(self) -> Harmonics:
        """The set of harmonics."""
        return Harmonics(orders_of(self.table))

    @property
    def followed(self) -> str:
        """Name of the variable that was followed: ``omega`` or ``parameter``."""
        return followed_of(self.table)

    def sought(self, what: str) -> NDArray[np.bool_]:
        """Which dofs (n_dofs,) are named by an attribute: "peaks_of", whose peaks were all located, or "largest_of",
        of which the largest amplitude alone is among the points; none where the results do not say."""
        names = str(self.table.attrs.get(what, "")).split("\n")
        return np.array([name in names for name in names_of(self.table, "dof")])

    def peaks(self, dof: str | None = None) -> list[tuple[float, float]]:
        """Local maxima of a dof's amplitude along the branch: (omega or parameter, amplitude).

        ``dof`` is by default the first one, "largest" the largest of all outputs where these were sought. They were
        located by the solver; those of a linear response are the largest among the frequencies it was computed at.
        Maxima that stand out by less than a thousandth of their height are left out; among the points they are of kind
        "peak" as well.

        Warns
        -----
        SlipstickWarning
            Where the peaks of the dof were not sought: ``peaks_of`` asks for them.
        """
        of_largest = self.table.attrs.get("peaks_of") == LARGEST and LARGEST not in self.table["dof"].to_numpy()
        if of_largest and dof in (None, LARGEST):
            found = self.table["peak_dof"].to_numpy()
            at = peak_points(self.table)
            followed, size = self.table[self.followed].to_numpy(), self.table["amplitude"].to_numpy()
            return [(float(followed[i]), float(size[i, found[i]])) for i in at]
        d = place_of(self.table, "dof", dof)
        if "peaks_of" in self.table.attrs and not self.sought("peaks_of")[d]:
            name = str(self.table["dof"].to_numpy()[d])
            warn([f"the peaks of '{name}' were not sought; name it in peaks_of to have them located"])
        where, size = self.table[self.followed].to_numpy(), self.table["amplitude"].to_numpy()[:, d]
        at = peak_points(self.table, d) if "peak_dof" in self.table else _largest_nearby(where, size)
        return [(float(w), float(a)) for w, a in zip(where[at], size[at], strict=True)]

    def at(self, value: Frequency) -> int:
        """Number of the first point at a requested frequency or parameter, else of the nearest one.

        A frequency is in rad/s, or a text such as "50 Hz". InputError for a value outside the points.
        """
        if self.followed == "omega":
            value = in_radians("value", value, Units.of_results(self.dataset.attrs))
        value = number("value", value)
        if not len(self):
            raise InputError(f"the branch has no points; its outcome is: {self.message}")
        if not self.reaches(value):
            name = self.followed if self.followed == "omega" else str(self.table.attrs.get("parameter", self.followed))
            low, high = self.span
            raise wrong("value", value, f"{name} from {low:.6g} to {high:.6g}, where the branch has points")
        return int(np.nanargmin(np.abs(self.table[self.followed].to_numpy() - value)))

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest frequency or parameter among the points; zeros where there are none."""
        followed = self.table[self.followed].to_numpy()
        return (float(np.nanmin(followed)), float(np.nanmax(followed))) if followed.size else (0.0, 0.0)

    def reaches(self, value: float) -> bool:
        """Whether a frequency or parameter lies among the points, but for the digits it is read with."""
        low, high = self.span
        return low - _READING_ERROR * abs(low) <= value <= high + _READING_ERROR * abs(high)

    def guess(self, point: int) -> Array:
        """The unknowns at a point, (n_ports, L), to begin a branch there: ``forced_response(..., guess=...)``.

        Raises InputError where there is no problem.
        """
        from slipstick.results.record import unknowns

        self.point(point)
        return unknowns(self.table, self.problem_at(point), point)

    def problem_at(self, point: int) -> Problem:
        """The problem with the followed parameter as it is at a point; InputError where it is not known.

        Of wear over cycles the contacts have the gaps that they have there, and wear no further.
        """
        problem, name = self._known_problem, str(self.table.attrs.get("parameter", ""))
        if analysis_of(self.table) == "wear":
            return _worn(problem, self.table["worn_depth"].to_numpy()[point])
        if name:
            problem = problem.at_parameter(name, float(self.table["parameter"].to_numpy()[point]))
        return problem

    @property
    def _known_problem(self) -> Problem:
        if self.problem is None:
            raise InputError(f"the problem of this branch is not known: {self.without}")
        return self.problem

    def point(self, point: int) -> xarray.Dataset:
        """A point with its contacts; InputError where there is none."""
        if not len(self):
            raise InputError(f"the branch has no points; its outcome is: {self.message}")
        point = whole("point", point, -len(self), len(self) - 1)
        if "contact" not in self.dataset.dims:
            raise InputError("these results are of a linear response, which holds no contact forces")
        return self.dataset.isel(point=point)

    def dof_index(self, name: str | None = None) -> int:
        """Place of a dof among those in the results; the first without a name. InputError where there is none."""
        return place_of(self.table, "dof", name)


def _worn(problem: Problem, depth: Array) -> Problem:
    """A problem with gaps opened by depths (n_contacts,), and contacts that do not wear."""
    contacts, first = list(problem.contacts), 0
    for p, pair in enumerate(problem.contacts):
        for k in range(len(pair.elements)):
            if depth[first] > 0.0:  # not nan, of laws that do not wear
                gap = float(contacts[p].values("gap")[k]) + float(depth[first])
                contacts[p] = contacts[p].with_value("gap", gap, k)
            first += 1
    states = [model for model in problem.states if not isinstance(model, WearModel)]
    return replace(problem, contacts=contacts, states=states, told=None)


def _largest_nearby(where: Array, size: Array) -> NDArray[np.intp]:
    """Indices of values above those at the neighbouring places, by more than rounding."""
    order = np.argsort(where, kind="stable")
    a = size[order]
    least = _ROUNDING * np.max(a, initial=0.0)
    return order[1:-1][(a[1:-1] > a[:-2] + least) & (a[1:-1] >= a[2:])]
