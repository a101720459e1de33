"""Reading results for display: their analysis, abscissa, names, labels, units and values, and their notebook table.

Pages, figures and the terminal all use these functions, on tables and datasets alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import shown, suggestion
from slipstick.html import MOST_SHOWN, html_table
from slipstick.results.measures import phase_of
from slipstick.results.peaks import ROUNDING, located_peaks
from slipstick.results.schema import ANALYSIS, CYCLES, SELF_EXCITED, branch_parts
from slipstick.results.stability import SPECIAL_KINDS, STATE_CHANGE
from slipstick.typing import Array, IntArray
from slipstick.units import MIXED, Units, after_number, is_rotation, length_shown, power_unit, unit_of_dof

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions


class View(NamedTuple):
    """How the results of an analysis are read.

    Attributes
    ----------
    name
        Its name on a page.
    over
        Possible abscissae, the default first.
    marked
        Kinds of points that are listed.
    first
        The quantity to begin with.
    companions
        Quantities drawn with the chosen one: the rest of the result.
    peaks
        Whether the points are those of a response, whose peaks are listed.
    sparse
        Whether points are far from each other, and the line through them is smooth.
    words
        Before what they are drawn over, where results are told apart.
    """

    name: str
    over: tuple[str, ...]
    marked: tuple[str, ...]
    first: str = "amplitude"
    companions: tuple[str, ...] = ()
    peaks: bool = False
    sparse: bool = False
    words: str = ""


_BIFURCATIONS = tuple(kind for kind in SPECIAL_KINDS if kind != STATE_CHANGE)
_RESPONSE = View("response", ("omega",), _BIFURCATIONS, peaks=True)
_PARAMETER = View("parameter", ("parameter",), _BIFURCATIONS, peaks=True)
_TRACK = View(
    "track", ("parameter", "omega"), ("optimum", "turning point", "tie", "corner", "requested"), companions=("omega",),
    sparse=True, words="peaks ",
)  # fmt: skip
VIEWS: Mapping[str, View] = {
    "response": _RESPONSE,
    "linear": _RESPONSE,
    "parameter": _PARAMETER,
    "track": _TRACK,
    "optimal": _TRACK,
    "modes": View(
        "modes", ("modal_amplitude", "omega", "load_factor"), ("requested", "turning point"), first="omega",
        companions=("modal_damping",), sparse=True, words="a nonlinear mode ",
    ),
    "cycles": View(
        "cycles", ("parameter", "omega"), (*_BIFURCATIONS, "requested"), companions=("omega",),
        words="self-excited vibration ",
    ),
    "wear": View(
        "wear", ("parameter",), ("start", "requested", "worn out", "separation", "end"),
        companions=("worn_depth", "normal_load"),
    ),
}  # fmt: skip
"""Views of the analyses whose results are points of motion; those of any other are of a response, or over a
parameter."""


def view_of(data: Any) -> View:
    """The view of a table or dataset."""
    return VIEWS.get(analysis_of(data), _PARAMETER if "parameter" in data else _RESPONSE)


def analysis_of(data: Any) -> str:
    """The analysis that made a table or dataset, such as "response", "track" or "study"; empty where it is unknown.

    Older files do not name it: it is then inferred from their variables.
    """
    return str(data.attrs.get(ANALYSIS, "")) or _inferred_analysis(data)


def analysis_of_journal(about: Mapping[str, Any]) -> str:
    """The analysis named in the header of a journal; empty for an older one of a ``[response]``."""
    return str(about.get(ANALYSIS, "")) or next((name for name in ("study", "run_up") if name in about), "")


def _inferred_analysis(data: Any) -> str:
    attributes = data.attrs
    if "study_parameters" in attributes:
        return "study" if "peak_amplitude" in data else "curves"
    if "section_displacement" in data:
        return "run_up"
    if "standard_error" in data:
        return "identify"
    if not ("omega" in data and "displacement" in data):
        return ""
    if "modal_damping" in data:
        return "modes"
    if attributes.get("vibration") == SELF_EXCITED:
        return "cycles"
    if attributes.get("parameter") == CYCLES and CYCLES in data:
        return "wear"
    if attributes.get("peak_of"):
        return "track"
    return "parameter" if "parameter" in data else "response"


def names_of(data: Any, dim: str) -> list[str]:
    """Names along a dimension such as "dof"; none where there is no such dimension."""
    return [str(name) for name in data[dim].to_numpy()] if dim in data else []


def place_of(data: Any, dim: str, name: str | None = None) -> int:
    """Place of a name along a dimension; the first without a name. InputError where there is none."""
    known = names_of(data, dim)
    if name is None and known:
        return 0
    if not isinstance(name, str) or name not in known:
        raise InputError(f"there is no {dim} {shown(name)} in the results; {suggestion(name, known)}")
    return known.index(name)


def label_of(data: Any, name: str) -> str:
    """What a variable is called on axes: its long name."""
    label = str(data[name].attrs.get("long_name", name.replace("_", " ")))
    return label if name == "parameter" else label[:1].upper() + label[1:]  # a parameter has the user's own name


def unit_of(data: Any, name: str, dof: str = "") -> str:
    """The unit of a variable, of one dof where that is given; empty for a mere number."""
    label = str(data[name].attrs.get("units", ""))
    unit = power_unit(unit_of_dof(label, dof) if dof else label)
    return "" if unit == "1" else unit


def after(data: Any, name: str, dof: str = "") -> str:
    """The unit of a variable in the form that follows a number."""
    return after_number(unit_of(data, name, dof))


def unit_shown(data: Any, name: str, dof: str = "", beside: Iterable[Any] = ()) -> tuple[float, str]:
    """The unit that a variable is shown in, of one dof where that is given: factor to it and name.

    Pages, figures and the terminal ask here. A length in metres gets the prefix that fits the largest one: motion that
    of the largest amplitude, anything else that of its own values. Results shown ``beside`` each other share it.
    """
    unit = unit_of(data, name, dof)
    if unit.partition(MIXED)[0] != "m":
        return 1.0, unit
    return length_shown(unit, max(largest_length(own, name) for own in (data, *beside)))


def largest_length(data: Any, name: str) -> float:
    """The length whose size decides the unit of a variable of results in metres; 0 where there is none."""
    moving = name in data and ("dof" in data[name].dims or name.startswith("contact_"))
    by = "amplitude" if moving and "amplitude" in data else name
    if by not in data or unit_of(data, by).partition(MIXED)[0] != "m":
        return 0.0
    values = np.abs(data[by].to_numpy())
    if "dof" in data[by].dims:
        straight = [place for place, dof in enumerate(names_of(data, "dof")) if not is_rotation(dof)]
        values = np.take(values, straight, data[by].dims.index("dof"))
    return _finite(values)


def value_text(data: Any, name: str, value: float, dof: str = "", digits: int = 6) -> str:
    """A value of a variable with the unit it is shown in, "0.791846 mm"; the number alone where that has no name."""
    factor, unit = unit_shown(data, name, dof)
    return f"{value * factor:.{digits}g}{after_number(unit)}"


def frequency_unit(data: Any) -> str:
    """The unit that frequencies are shown in: that of the range of the case, else the one of the results."""
    units, unit = Units.of_results(data.attrs), str(data.attrs.get("frequency_unit", ""))
    return unit if unit in units.frequencies else units.angular


def followed_of(data: Any) -> str:
    """Name of the variable that was followed: "omega" or "parameter"."""
    return "parameter" if "parameter" in data else "omega"


def followed_text(data: Any, value: float) -> str:
    """A value of what was followed: "4.26 rad/s (0.678 Hz)", or "10 mm/s" of a parameter."""
    if followed_of(data) == "parameter":
        return value_text(data, "parameter", value)
    return Units.of_results(data.attrs).frequency_text(float(value), frequency_unit(data))


def at_text(data: Any, value: float) -> str:
    """Where something is on a curve: "4.26 rad/s (0.678 Hz)", or "damper.velocity = 10 mm/s"."""
    named = f"{data.attrs['parameter']} = " if followed_of(data) == "parameter" and "parameter" in data.attrs else ""
    return named + followed_text(data, value)


def orders_of(data: Any) -> list[int]:
    """Orders of the harmonics that results hold, 0 among them."""
    return [0, *(int(label[1:]) for label in names_of(data, "coefficient")[1::2])]


def ranked(data: Any, dim: str, name: str) -> IntArray:
    """Places along a dimension, first those where a variable is largest; of dofs rotations last.

    Numbers of two units are not compared.
    """
    names, axis = names_of(data, dim), data[name].dims.index(dim)
    sizes = np.nan_to_num(np.abs(np.moveaxis(data[name].to_numpy(), axis, 0)))
    turned = [dim == "dof" and is_rotation(label) for label in names]
    return np.lexsort((-sizes.reshape(len(names), -1).max(axis=1, initial=0.0), turned))


def requested_dofs(data: Any) -> list[int]:
    """Places of the dofs tracked or optimised, else of those whose peaks or largest amplitudes were sought."""
    names = names_of(data, "dof")
    wanted = [str(data.attrs.get(key, "")).splitlines() for key in ("peak_of", "mode_of", "peaks_of", "largest_of")]
    wanted[2:] = [[*wanted[2], *wanted[3]]]
    chosen = [names.index(name) for name in next(filter(None, wanted), []) if name in names]
    if not chosen and "peak_dof" in data:
        chosen = sorted({int(d) for d in data["peak_dof"].to_numpy() if d >= 0})
    return chosen


def first_dof(data: Any) -> str:
    """The dof that pages and figures begin with: of those asked for the one that moves most."""
    order, asked = ranked(data, "dof", "amplitude").tolist(), requested_dofs(data)
    return names_of(data, "dof")[next((place for place in order if place in asked), order[0])]


class ListedPeak(NamedTuple):
    """A located peak: its point, dof, value of what was followed, amplitude."""

    point: int
    dof: str
    at: float
    amplitude: float


def listed_peaks(data: Any) -> list[ListedPeak]:
    """The located peaks of all dofs, the highest first; those of rotations after those of lengths."""
    of, names = data["peak_dof"].to_numpy(), names_of(data, "dof")
    at, size = data[followed_of(data)].to_numpy(), data["amplitude"].to_numpy()
    peaks = [ListedPeak(i, names[of[i]], float(at[i]), float(size[i, of[i]])) for i in located_peaks(data).tolist()]
    return sorted(peaks, key=lambda peak: (is_rotation(peak.dof), -peak.amplitude))


def values_of(data: Any, name: str, dim: str, label: str) -> Array:
    """A variable (n_points,) of a named dof or contact, zero where it is rounding.

    InputError where the results do not hold it.
    """
    return values_at(data, name, dim, [names_of(data, dim).index(label)])[:, 0]


def values_at(data: Any, name: str, dim: str, places: Sequence[int] | IntArray) -> Array:
    """The same of several by their places, (n_points, n)."""
    if name not in data:
        raise InputError(f"there is no {name.replace('_', ' ')} in these results")
    column = data[name]
    values = np.take(column.to_numpy(), places, column.dims.index(dim))
    return np.where(np.abs(values) <= ROUNDING * _sizes(data, name, dim)[places], 0.0, values)


def phases_at(data: Any, places: Sequence[int] | IntArray, harmonic: int) -> Array:
    """Phases (n_points, n) of the harmonic of that place, deg, without jumps; nan where the harmonic is rounding."""
    X, least, parts = data["displacement"].to_numpy(), ROUNDING * _largest(data, "displacement"), branch_parts(data)
    return np.stack([phase_of(X[:, d], harmonic, parts, float(least[d])) for d in places], axis=1)


def _sizes(data: Any, name: str, dim: str) -> Array:
    """What values of each dof or contact are measured by: the largest motion of its unit, or the largest power."""
    if name in ("amplitude", "mean"):
        return np.max([_largest(data, other) for other in ("amplitude", "mean") if other in data], axis=0)
    size, parts = 0.0, ("omega", "friction_force", "contact_tangential")
    if name == "dissipated_power" and all(part in data for part in parts):
        size = float(np.prod([_finite(np.abs(data[part].to_numpy())) for part in parts]))
    return np.full(data.sizes[dim], size)


def _largest(data: Any, name: str) -> Array:
    """The largest value of a variable, for each dof among those of its unit."""
    axis, values = data[name].dims.index("dof"), np.abs(data[name].to_numpy())
    sizes = np.nanmax(values, axis=tuple(k for k in range(values.ndim) if k != axis), initial=0.0)
    turned = np.array([is_rotation(dof) for dof in names_of(data, "dof")])
    return np.where(turned, _finite(sizes[turned]), _finite(sizes[~turned]))


def _finite(values: Array) -> float:
    """The largest of some; 0 where that is no number."""
    size = float(np.nanmax(values, initial=0.0))
    return size if np.isfinite(size) else 0.0


def branch_html(branch: Solutions) -> str:
    """Table of a branch for a notebook: outcome, points, peaks and warnings."""
    title = str(branch.dataset.attrs.get("title", ""))
    return html_table(f"Branch{': ' if title else ''}{title}", _rows(branch))


def _rows(branch: Solutions) -> Iterator[tuple[str, Any]]:
    yield "outcome", branch.message
    data = branch.dataset
    if not len(branch):
        return
    where = data[branch.followed].to_numpy()
    name = str(data.attrs.get("parameter", "")) or "omega"
    yield "points", f"{len(branch)}, {name} from {followed_text(data, where[0])} to {followed_text(data, where[-1])}"
    for dof in names_of(data, "dof")[:MOST_SHOWN]:
        peaks = sorted(branch.peaks(dof), key=lambda peak: -peak[1])[:3]
        texts = [f"{value_text(data, 'amplitude', a, dof)} at {at_text(data, at)}" for at, a in peaks]
        largest = float(data["amplitude"].sel(dof=dof).max())
        yield f"peaks of {dof}", "; ".join(texts) or f"none; largest {value_text(data, 'amplitude', largest, dof)}"
    if data.attrs.get("coordinates_of_motion"):
        yield "motion", data.attrs["coordinates_of_motion"]
    if branch.warnings:
        yield "warnings", "\n".join(branch.warnings)
