"""Style of the figures: sizes, colours that colour-blind readers distinguish, titles and legends that fit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from cycler import cycler

from slipstick.faults import wrong
from slipstick.plots.characters import drawn_in_known_characters
from slipstick.plots.shown import by_pyplot
from slipstick.replacing import ANY, Kind, writing
from slipstick.typing import DrawnAxes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#000000")
"""Okabe and Ito's palette."""
DASHES = ("-", "-.", (0, (1, 1)), (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2, 2, 2)), (0, (1, 3)))
"""Each is used with all colours before the next one. Plain dashes are for unstable motion alone."""
STATE_COLOURS = {"stick": "#0072B2", "slip": "#E69F00", "slip+": "#E69F00", "slip-": "#D55E00", "separation": "#BBBBBB"}
GREY = "#666666"
PEAK = "peak"
"""Name of the markers of peaks, the last one of a legend."""

_TITLE_LINES = 2
_LETTERS_PER_INCH = 12.0
_LONGEST_NAME = 36
_MOST_INSIDE = 7
"""Most entries of a legend inside the axes."""
_MOST_NAMED = 20
"""Most entries of a legend; the last one then gives their number."""
_MARKER = 5.0
"""Radius of the largest markers, points."""
DECADES = 100.0
"""From this ratio of the largest to the smallest value a scale is logarithmic."""


def new_figure(width: float = 6.4, height: float = 4.0) -> Figure:
    """A figure of pyplot, which notebooks and ``plt.show()`` show; inside ``for_files`` one without pyplot."""
    if by_pyplot():
        from matplotlib import pyplot

        return pyplot.figure(figsize=(width, height), layout="constrained")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def styled(ax: Axes | None, x_label: str, y_label: str, *, height: float = 4.0) -> DrawnAxes:
    """The axes, or new ones, with labels, a light grid and the palette."""
    from matplotlib.ticker import AutoLocator, ScalarFormatter

    from slipstick.plots.ticks import METRES, Lengths, Roomy

    if ax is not None and not hasattr(ax, "set_xlabel"):
        raise wrong("ax", ax, "matplotlib Axes to draw into, or None")
    ax = new_figure(height=height).add_subplot() if ax is None else ax
    if not ax.lines:
        count = len(COLOURS) * len(DASHES)
        pairs = cycler(color=[COLOURS[i % len(COLOURS)] for i in range(count)])
        ax.set_prop_cycle(pairs + cycler(linestyle=[DASHES[i // len(COLOURS)] for i in range(count)]))
        for axis in (ax.xaxis, ax.yaxis):
            if isinstance(numbers := axis.get_major_formatter(), ScalarFormatter):
                numbers.set_powerlimits((-3, 5))
    for axis, label in ((ax.xaxis, x_label), (ax.yaxis, y_label)):
        numbers = axis.get_major_formatter()
        if isinstance(numbers, Lengths) and label in numbers.texts:  # of axes that are drawn: in millimetres, say
            label = numbers.label
        axis.set_label_text(label, parse_math=False)
        if label.endswith(METRES) and isinstance(numbers, (ScalarFormatter, Lengths)):
            axis.set_major_formatter(Lengths(label, getattr(numbers, "largest", 0.0)))
        elif isinstance(numbers, Lengths):
            axis.set_major_formatter(ScalarFormatter())
    if isinstance(ax.xaxis.get_major_locator(), AutoLocator):
        ax.xaxis.set_major_locator(Roomy())
    ax.grid(True, color="#DDDDDD", linewidth=0.6)
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return cast("DrawnAxes", ax)


def show_lengths(*axes: Any, largest: float) -> None:
    """Show lengths in metres, on these axes of figures, in the unit of the ``largest`` one of the results."""
    from slipstick.plots.ticks import show_lengths

    for axis in axes:
        show_lengths(axis, largest)


def label_colour_bar(bar: Any, label: str, largest: float = 0.0) -> None:
    """Name a colour bar; lengths in metres are shown in the unit of the ``largest``, by default of those it shows."""
    from slipstick.plots.ticks import METRES, Lengths

    if label.endswith(METRES):
        bar.formatter = Lengths(label, largest)
    else:
        bar.formatter.set_powerlimits((-3, 5))
    bar.ax.yaxis.set_label_text(label, parse_math=False)


def titled(figure: Figure | None, *texts: str) -> None:
    """Title of a whole figure, in as many lines as it needs: the first text, the others in brackets."""
    assert figure is not None
    head, *rest = texts
    about = ", ".join(text for text in rest if text)
    text = (f"{head} ({about})" if about else head) if head else about
    width = int(_LETTERS_PER_INCH * figure.get_figwidth())
    pieces = [text] if len(text) <= width or not head else [head, f"({about})" if about else ""]
    lines = [line for piece in pieces for line in wrap(piece, width, max_lines=_TITLE_LINES, placeholder=" ...")]
    if lines:
        figure.suptitle("\n".join(lines), parse_math=False, fontsize="medium")


def short(names: Sequence[str], most: int = _LONGEST_NAME) -> list[str]:
    """Names that fit: without their middle, or where they would then be alike, the part in which they differ.

    >>> short(["a", "a contact of the shroud of blade 17, upper edge"], 24)
    ['a', 'a contact of ...pper edge']
    >>> short([f"a contact of the shroud of blade {i}, upper edge" for i in (1, 2)], 24)
    ['... blade 1, upper ed...', '... blade 2, upper ed...']
    """
    longest = [max(map(len, n.split("\n"))) for n in names]
    cut = [
        n if size <= most else f"{n[: most // 2 + 1]}...{n[len(n) - most // 2 + 3 :]}"
        for n, size in zip(names, longest, strict=True)
    ]
    if len(set(cut)) == len(set(names)):
        return cut
    differs = next(k for k in range(max(map(len, names))) if len({n[k : k + 1] for n in names}) > 1)
    start = max(0, differs - most // 3 + 1)
    return [f"...{n[start : start + most - 6]}..." if len(n) > most else n for n in names]


def legend(ax: Axes, *, least: int = 1) -> None:
    """Add a legend of ``least`` names or more, each once, markers last; outside the axes if long or over data."""
    entries = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    entries = {name: handle for name, handle in entries.items() if name and not name.startswith("_")}
    if PEAK in entries:
        entries[PEAK] = entries.pop(PEAK)
    if len(entries) < max(least, 1):
        return
    many, names = len(entries) > _MOST_INSIDE, short(list(entries))
    if len(entries) > _MOST_NAMED:
        names = [*names[: _MOST_NAMED - 1], f"... ({len(names)} in all)"]
    look: dict[str, Any] = {"frameon": True, "framealpha": 0.85, "edgecolor": "none", "fontsize": "small"}
    made = ax.legend(list(entries.values())[: len(names)], names, loc="upper right", **look)
    for text in made.get_texts():
        text.set_parse_math(False)
    if many or not _placed_inside(made, ax):
        made.set_loc("center left")
        made.set_bbox_to_anchor((1.0, 0.5))


_PLACES = (
    *("upper right", "upper left", "lower left", "lower right"),
    *("center right", "center left", "upper center", "lower center"),
)


def _placed_inside(made: Legend, ax: Axes) -> bool:
    """Place a legend where it hides no data; False if there is no such place and it can be outside the axes."""
    from matplotlib.collections import PolyCollection

    figure = ax.get_figure(root=True)
    if figure is None or figure.get_layout_engine() is None:
        made.set_loc("best")
        return True
    with drawn_in_known_characters(figure, tell=False):
        figure.draw_without_rendering()
    curves = [line.get_transform().transform_path(line.get_path()) for line in ax.lines]
    filled = [drawn for drawn in ax.collections if isinstance(drawn, PolyCollection)]
    areas = [drawn.get_transform().transform_path(path) for drawn in filled for path in drawn.get_paths()]
    areas += [bar.get_transform().transform_path(bar.get_path()) for bar in ax.patches]
    dots = [drawn for drawn in ax.collections if drawn not in filled]
    marks = [drawn.get_offset_transform().transform(drawn.get_offsets()) for drawn in dots]
    for place in _PLACES:
        made.set_loc(cast("Any", place))
        box = made.get_window_extent().padded(_MARKER * figure.dpi / 72.0)
        hidden = any(curve.intersects_bbox(box, filled=False) for curve in curves)
        hidden = hidden or any(area.intersects_bbox(box, filled=True) for area in areas)
        if not hidden and not any(map(box.count_contains, marks)):
            return True
    return False


def log_scale(ax: Axes, name: str, **options: Any) -> None:
    """Give the axis "x" or "y" a logarithmic scale, with ticks whose texts do not touch."""
    from slipstick.plots import ticks

    ticks.log_scale(ax, name, **options)


def over_decades(values: Iterable[np.ndarray]) -> bool:
    """Whether positive values span two decades or more."""
    known = np.concatenate([np.zeros(0), *(np.asarray(v, dtype=float).ravel() for v in values)])
    known = known[np.isfinite(known) & (known > 0.0)]
    return bool(known.size) and bool(known.max() >= DECADES * known.min())


_KINDS = {".png": Kind("PNG", b"\x89PNG"), ".svg": Kind("SVG", b"<svg"), ".pdf": Kind("PDF", b"%PDF")}
"""By the ending of the file."""


def save_figure(ax: Axes, stem: str | Path, *, formats: Iterable[str] = ("png", "svg")) -> list[Path]:
    """Write the figure of some axes as ``stem.png`` and ``stem.svg``; the files written. They replace earlier figures.

    Parameters
    ----------
    ax
        Axes of the figure.
    stem
        Path of the files without their endings.
    formats
        Endings of the files, formats of matplotlib.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    InputError
        For an ending that matplotlib does not write, and where there is another file that is no figure.

    Warns
    -----
    SlipstickWarning
        Where no font of this machine has a character of the texts.

    Examples
    --------
    >>> from pathlib import Path
    >>> import tempfile, slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0), harmonics=range(6))
    >>> branch = ss.forced_response(problem, (4.0, 14.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = ss.plots.save_figure(branch.plot.response("x"), Path(folder) / "tip", formats=["png"])
    >>> [file.name for file in written]
    ['tip.png']
    """
    figure = ax.get_figure(root=True)
    assert figure is not None
    formats, known = tuple(formats), figure.canvas.get_supported_filetypes()
    for ending in set(formats) - set(known):
        raise wrong((f"{stem}.{ending}",), ending, f"a format of figures: {', '.join(known)}")
    stem = Path(stem)
    paths = [stem.with_name(f"{stem.name}.{ending}") for ending in formats]
    for path in paths:
        metadata = {"Date": None} if path.suffix == ".svg" else {}
        with writing(path, _KINDS.get(path.suffix, ANY)) as temporary, drawn_in_known_characters(figure):
            figure.savefig(temporary, format=path.suffix.removeprefix("."), dpi=150, metadata=metadata)
    return paths
