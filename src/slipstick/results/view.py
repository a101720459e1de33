"""Which analysis made results, and what they are drawn over and beside: every reader of results asks here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from slipstick.results.schema import ANALYSIS, CYCLES, SELF_EXCITED
from slipstick.results.stability import SPECIAL_KINDS, STATE_CHANGE


class View(NamedTuple):
    """How the results of an analysis are read.

    Attributes
    ----------
    name
        What a page calls it.
    over
        What they can be drawn over, the first to begin with.
    marked
        Kinds of points that are listed.
    first
        The quantity to begin with.
    companion
        The quantity drawn beside the one that is chosen: the other half of the result. Empty for none.
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
    companion: str = ""
    peaks: bool = False
    sparse: bool = False
    words: str = ""


_BIFURCATIONS = tuple(kind for kind in SPECIAL_KINDS if kind != STATE_CHANGE)
_RESPONSE = View("response", ("omega",), _BIFURCATIONS, peaks=True)
_PARAMETER = View("parameter", ("parameter",), _BIFURCATIONS, peaks=True)
_TRACK = View(
    "track", ("parameter", "omega"), ("optimum", "turning point", "tie", "corner", "requested"), companion="omega",
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
        companion="modal_damping", sparse=True, words="a nonlinear mode ",
    ),
    "cycles": View(
        "cycles", ("parameter", "omega"), (*_BIFURCATIONS, "requested"), companion="omega",
        words="self-excited vibration ",
    ),
    "wear": View(
        "wear", ("parameter",), ("start", "requested", "worn out", "separation", "end"), companion="worn_depth"
    ),
}  # fmt: skip
"""Views of the analyses whose results are points of motion; those of any other are of a response, or over a
parameter."""


def view_of(data: Any) -> View:
    """The view of a table or dataset."""
    return VIEWS.get(analysis_of(data), _PARAMETER if "parameter" in data else _RESPONSE)


def analysis_of(data: Any) -> str:
    """The analysis that made a table or dataset, such as "response", "track" or "study"; empty where nothing tells.

    Of files written before they said so it is told by what they hold.
    """
    return str(data.attrs.get(ANALYSIS, "")) or _told_by(data)


def analysis_of_journal(about: Mapping[str, Any]) -> str:
    """The same of what a journal says about itself; empty for a ``[response]`` written before they said so."""
    return str(about.get(ANALYSIS, "")) or next((name for name in ("study", "run_up") if name in about), "")


def _told_by(data: Any) -> str:
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
