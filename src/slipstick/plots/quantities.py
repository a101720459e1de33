"""Data of figures: datasets by label, values of named dofs and contacts, labels with units."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import listed, shown
from slipstick.faults import names as texts
from slipstick.faults import text as one_text
from slipstick.results.schema import branch_parts
from slipstick.results.table import is_dataset
from slipstick.results.view import frequency_unit, label_of, names_of, place_of, unit_of
from slipstick.units import Units, after_number, unit_of_dof

if TYPE_CHECKING:
    import xarray

    from slipstick.results.solutions import Solutions

OneBranch: TypeAlias = "Solutions | xarray.Dataset"
"""A branch, or its dataset."""

Branches: TypeAlias = "OneBranch | Iterable[OneBranch] | Mapping[str, OneBranch]"
"""One, several, or several by label."""

NO_POINTS = "the branch has no points to draw"


def datasets(branches: Branches) -> list[tuple[str | None, xarray.Dataset]]:
    """Label and dataset of one branch, of a list, or of a table ``{label: branch}``; datasets are taken as they are."""
    labelled = _labelled(branches)
    if not all(dataset.sizes.get("point", 1) for _, dataset in labelled):
        raise InputError(NO_POINTS)
    return labelled


def _labelled(branches: Branches) -> list[tuple[str | None, xarray.Dataset]]:
    if _is_one(branches):
        return [(None, dataset_of(branches))]
    pairs: Iterable[tuple[str | None, OneBranch]]
    if isinstance(branches, Mapping):
        by_label = cast("Mapping[str, OneBranch]", branches)
        pairs = ((one_text("label", label), branch) for label, branch in by_label.items())
    else:
        pairs = ((None, branch) for branch in listed("nothing to draw", branches, "a branch, or several"))
    labelled = [(label, dataset_of(branch)) for label, branch in pairs]
    if not labelled:
        raise InputError(f"nothing to draw: found {shown(branches)}; expected a branch, or several")
    return labelled


def _is_one(branch: object) -> bool:
    return is_dataset(_inside(branch))


def _inside(branch: object) -> Any:
    """The dataset of a branch or another result; anything else as it is."""
    return getattr(branch, "dataset", branch)


def dataset_of(branch: object) -> xarray.Dataset:
    """The dataset of a branch, or the dataset itself; InputError for anything else."""
    if not _is_one(branch):
        raise InputError(f"nothing to draw: found {shown(branch)}; expected a branch, or several")
    dataset: xarray.Dataset = _inside(branch)
    if "omega" not in dataset:
        raise InputError("nothing to draw: the dataset is not that of a branch, it has no omega")
    return dataset


def chosen(dataset: xarray.Dataset, dim: str, wanted: str | Sequence[str] | None) -> list[str]:
    """Names along a dimension: one, several, or the first; InputError for one that is not there."""
    known = names_of(dataset, dim)
    names = known[:1] if wanted is None else list(texts(dim, wanted, f"the name of a {dim}"))
    for name in names:
        place_of(dataset, dim, name)
    if not names:
        raise InputError(f"there is no {dim} in the results to draw")
    return names


def quantity(dataset: xarray.Dataset, name: str, dofs: Iterable[str] = ()) -> str:
    """Label of a variable: its long name without remarks in brackets, and its unit.

    Of ``dofs`` alone; raises InputError where they are of different units, which do not share an axis.
    """
    return with_unit(re.sub(r" \([^)]*\)", "", label_of(dataset, name)), one_unit(unit_of(dataset, name), dofs))


def one_unit(label: str, dofs: Iterable[str]) -> str:
    """The unit that the motion of these dofs shares; InputError where they share none."""
    units = {dof: unit_of_dof(label, dof) for dof in dofs}
    if len(set(units.values())) > 1:
        told = ", ".join(f"{dof} in {unit}" for dof, unit in units.items())
        raise InputError(f"dofs of different units do not share an axis: {told}; draw them apart")
    return next(iter(units.values()), label)


def with_unit(text: str, unit: str) -> str:
    """A label with its unit in brackets."""
    return f"{text} [{unit}]" if unit not in ("", "1") else text


def motion_label(dataset: xarray.Dataset, dofs: Iterable[str] = ()) -> str:
    """Label of the motion of dofs: it says where it is relative to a support that moves."""
    relative, unit = str(dataset.attrs.get("coordinates_of_motion", "")), units_of(dataset).label("length")
    return with_unit(", ".join(part for part in ("Motion", relative) if part), one_unit(unit, dofs))


def units_of(dataset: xarray.Dataset) -> Units:
    """The names of the units of results."""
    return Units.of_results(dataset.attrs)


def title_of(labelled: Sequence[tuple[str | None, xarray.Dataset]]) -> str:
    """The title that all of them share."""
    titles = {str(dataset.attrs.get("title", "")) for _, dataset in labelled}
    return titles.pop() if len(titles) == 1 else ""


@dataclass(frozen=True, kw_only=True)
class Abscissa:
    """What a branch follows, in the unit it is drawn in."""

    name: str
    """Of the variable: ``omega``, or ``parameter`` where the frequency is constant."""
    label: str
    unit: str
    factor: float = 1.0

    def values(self, dataset: xarray.Dataset) -> np.ndarray:
        """Over the points."""
        return np.asarray(dataset[self.name].to_numpy() / self.factor)

    def text(self, dataset: xarray.Dataset, point: int) -> str:
        """At a point, "4.26 rad/s" or "damper.velocity = 10 mm/s"."""
        text = f"{self.values(dataset)[point]:.5g}{after_number(self.unit)}"
        return text if self.name == "omega" else f"{dataset.attrs['parameter']} = {text}"


def abscissa(dataset: xarray.Dataset, frequency: str | None = None) -> Abscissa:
    """What a branch follows; a frequency in the unit ``frequency``, else in that of its case's range.

    Raises InputError for an unknown unit, and for any where a parameter is followed.
    """
    parameter = str(dataset.attrs.get("parameter", ""))
    if parameter and "parameter" in dataset:
        if frequency is not None:
            raise InputError(f"frequency: the branch follows {parameter}; leave the unit of a frequency out")
        return Abscissa(name="parameter", label=quantity(dataset, "parameter"), unit=unit_of(dataset, "parameter"))
    return frequency_axis(dataset, frequency)


def frequency_axis(dataset: xarray.Dataset, frequency: str | None = None) -> Abscissa:
    """The frequency in the unit ``frequency``, else in that of its case's range; InputError for an unknown unit."""
    units = units_of(dataset)
    unit = frequency_unit(dataset) if frequency is None else frequency
    factor = units.frequency_factor(unit)
    label = with_unit(quantity(dataset, "omega").split(" [")[0], unit)
    return Abscissa(name="omega", label=label, unit=unit, factor=factor)


def held_text(dataset: xarray.Dataset) -> str:
    """The frequency at which a parameter was followed, "at 5 rad/s"; nothing where the frequency itself was."""
    omega = dataset["omega"].to_numpy()
    followed = abscissa(dataset).name == "parameter" and omega.size > 0 and float(np.ptp(omega)) == 0.0
    return f"at {frequency_axis(dataset).text(dataset, 0)}" if followed else ""


def abscissa_text(dataset: xarray.Dataset, point: int, frequency: str | None = None) -> str:
    """The followed quantity at a point, with its unit: "4.26 rad/s".

    Parameters
    ----------
    dataset
        Dataset of a branch.
    point
        Number of the point.
    frequency
        "Hz", "kHz", "rpm" or "rad/s": the unit of a frequency axis, by default the one the range of the case is written
        in.

    Returns
    -------
    str
        The value with its unit; a followed parameter with its name too.

    Raises
    ------
    InputError
        For an unknown unit, and for any unit where a parameter is followed.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    >>> branch = ss.steady_response(problem, omega=[7.0, 8.0])
    >>> ss.plots.abscissa_text(branch.dataset, 1), ss.plots.abscissa_text(branch.dataset, 1, "Hz")
    ('8 rad/s', '1.2732 Hz')
    """
    return abscissa(dataset, frequency).text(dataset, point)


def parted(dataset: xarray.Dataset, *series: np.ndarray) -> Iterator[np.ndarray]:
    """Series (point,) with a nan between the parts of a branch: no line is drawn from one to the other."""
    at = np.flatnonzero(np.diff(branch_parts(dataset))) + 1
    yield from (np.insert(values.astype(float), at, np.nan) for values in series)
