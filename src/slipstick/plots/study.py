"""Figures of studies: peak amplitudes over one or two parameters, and the curves behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import names as name_list
from slipstick.faults import shown, suggestion
from slipstick.plots.quantities import chosen, with_unit
from slipstick.plots.style import COLOURS, GREY, label_colour_bar, legend, log_scale, over_decades, show_lengths, styled
from slipstick.results.amplification import amplification_percentiles, deviations_of, histogram_edges, worst_of
from slipstick.results.percentiles import (
    FEWEST,
    PERCENTILES,
    WeibullMaxima,
    checked_percentiles,
    curve_percentiles,
    peak_percentiles,
)
from slipstick.results.schema import LARGEST
from slipstick.results.table import is_dataset
from slipstick.results.view import followed_of, largest_length
from slipstick.typing import DrawnAxes, Names
from slipstick.units import unit_of_dof

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

_FEW = 7
"""Up to so many curves have each a name, more a colour bar."""
_MOST = 100
"""No more curves are drawn into one figure."""
_COUNTS = 60
"""Numbers of samples at which percentiles are drawn."""


def study_map(
    study: xarray.Dataset, dof: str | None = None, *, over: Names = None, ax: Axes | None = None
) -> DrawnAxes:
    """Peak amplitude over the parameters of a study.

    Over one parameter it is a line, over two a map: of a grid with more the other parameters are at the values where
    the peak is smallest, which the title names; of samples each is a dot. Cases that did not complete are crosses.

    Parameters
    ----------
    study
        The dataset of a study, of ``ss.study`` or ``study.nc``.
    dof
        Name of the dof; by default the first.
    over
        Name of the parameter, or names of the two, that are drawn; by default the first.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        Of a map ``ax.collections[0]`` has the amplitudes, else ``ax.lines[0]``.

    Raises
    ------
    InputError
        If it is no study, or has no such dof or parameter.
    """
    data = _study(study)
    names = _over(data, over)
    peaks = data["peak_amplitude"].sel(dof=chosen(data, "dof", dof)[0])
    complete = data["outcome"] == "COMPLETED"
    fixed = {}
    if "case" not in peaks.dims:
        rest = [name for name in map(str, peaks.dims) if name not in names]
        if rest and bool(peaks.notnull().any()):
            lowest = peaks[peaks.argmin(...)]
            fixed = {name: float(lowest[name]) for name in rest}
            peaks, complete = peaks.sel(fixed), complete.sel(fixed)
    name = str(peaks["dof"].item())
    label = _labelled(data["peak_amplitude"], _amplitude_of(name, "Peak amplitude"), name)
    if len(names) > 1:
        axes = _map(data, names, peaks, complete, label, ax)
    else:
        axes = _line(data, names[0], peaks, complete, label, ax)
    if fixed:
        axes.set_title(", ".join(f"{n} = {v:.6g}" for n, v in fixed.items()), fontsize="small", parse_math=False)
    return axes


def _line(
    data: xarray.Dataset, name: str, peaks: xarray.DataArray, complete: xarray.DataArray, label: str, ax: Axes | None
) -> DrawnAxes:
    ax = styled(ax, _labelled(data[name], name), label)
    show_lengths(ax.yaxis, largest=largest_length(data, "peak_amplitude"))
    x, y, good = data[name].to_numpy(), peaks.to_numpy(), complete.to_numpy()
    if peaks.ndim != 1:
        return ax
    ax.plot(x, y, marker="o", markersize=3.0, linestyle="none" if "case" in peaks.dims else "-")
    if not good.all():
        ax.plot(x[~good], y[~good], linestyle="none", marker="x", color="black", label="did not complete")
        legend(ax)
    if over_decades([np.abs(x)]) and np.all(x > 0):
        log_scale(ax, "x")
    return ax


def _map(
    data: xarray.Dataset,
    names: tuple[str, ...],
    peaks: xarray.DataArray,
    complete: xarray.DataArray,
    label: str,
    ax: Axes | None,
) -> DrawnAxes:
    from matplotlib.colors import LogNorm, Normalize

    ax = styled(ax, _labelled(data[names[0]], names[0]), _labelled(data[names[1]], names[1]))
    ax.grid(False)
    if "case" in peaks.dims:
        x, y, z = data[names[0]].to_numpy(), data[names[1]].to_numpy(), peaks.to_numpy()
        bad = ~complete.to_numpy()
    else:
        z = peaks.transpose(names[1], names[0]).to_numpy()
        x, y = np.meshgrid(data[names[0]].to_numpy(), data[names[1]].to_numpy())
        bad = ~complete.transpose(names[1], names[0]).to_numpy()
    norm = LogNorm() if over_decades([z]) else Normalize()
    if z.ndim == 2:
        drawn: Any = ax.pcolormesh(_edges(x[0]), _edges(y[:, 0]), z, norm=norm, cmap="cividis")
    else:
        drawn = ax.scatter(x, y, c=z, norm=norm, cmap="cividis")
    for axis, values in (("x", x), ("y", y)):
        if over_decades([np.abs(values)]) and np.all(values > 0):
            log_scale(ax, axis)
    if bad.any():
        ax.plot(x[bad], y[bad], linestyle="none", marker="x", color="black", label="did not complete")
        legend(ax)
    figure: Any = ax.get_figure()
    label_colour_bar(figure.colorbar(drawn, ax=ax), label, largest_length(data, "peak_amplitude"))
    return ax


def _edges(values: np.ndarray) -> np.ndarray:
    """Edges (n + 1,) of cells around values, half way between; on a logarithmic scale half way there."""
    log = over_decades([np.abs(values)]) and bool(np.all(values > 0))
    at = np.log(values) if log else values
    if at.size == 1:
        inner = np.array([at[0] - 0.5, at[0] + 0.5])
    else:
        middle = 0.5 * (at[1:] + at[:-1])
        inner = np.concatenate([[2 * at[0] - middle[0]], middle, [2 * at[-1] - middle[-1]]])
    return np.exp(inner) if log else inner


def study_curves(
    curves: xarray.Dataset,
    study: xarray.Dataset,
    dof: str | None = None,
    *,
    over: str | None = None,
    ax: Axes | None = None,
) -> DrawnAxes:
    """The curves of a study, coloured by one of its parameters; of hundreds some, as the title says.

    Parameters
    ----------
    curves
        The dataset in ``curves.nc``.
    study
        The dataset in ``study.nc``.
    dof
        Name of the dof; by default the first.
    over
        Name of the parameter; by default the first.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        One line for each curve drawn.

    Raises
    ------
    InputError
        If these are no study and its curves, or there is no such dof or parameter.
    """
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    data, name = _study(study), _over(_study(study), over)[0]
    if not is_dataset(curves, "case", "amplitude", "branch_part"):
        raise InputError(f"nothing to draw: found {shown(curves)}; expected the dataset in curves.nc")
    followed = followed_of(curves)
    one = chosen(curves, "dof", dof)[0]
    x_label, y_label = (
        _labelled(curves[followed], _name_of(curves[followed])),
        _labelled(curves["amplitude"], _amplitude_of(one), one),
    )
    ax = styled(ax, x_label, y_label)
    show_lengths(ax.yaxis, largest=largest_length(data, "peak_amplitude"))
    number, value = _flat(data, name)
    by_case = dict(zip(number.tolist(), value.tolist(), strict=True))
    norm = LogNorm() if over_decades([np.abs(value)]) and np.all(value > 0) else Normalize()
    norm.autoscale(value)
    cividis = colormaps["cividis"]
    case, x = curves["case"].to_numpy(), curves[followed].to_numpy()
    y, part = curves["amplitude"].sel(dof=one).to_numpy(), curves["branch_part"].to_numpy()
    present = np.unique(case)
    drawn = _evenly(present, by_case)
    for shown_case in drawn:
        span = slice(*np.searchsorted(case, [shown_case, shown_case + 1]))
        broken = np.where(np.diff(part[span], prepend=part[span][:1]) != 0, np.nan, y[span])
        text = f"{by_case[shown_case]:.6g}" if present.size <= _FEW else None
        ax.plot(x[span], broken, color=cividis(norm(by_case[shown_case])), linewidth=1.1, linestyle="-", label=text)
    if len(drawn) < present.size:
        ax.set_title(f"{len(drawn)} of {present.size} curves", fontsize="small")
    if present.size <= _FEW:
        legend(ax)
        named = ax.get_legend()
        if named is not None:
            named.set_title(_labelled(data[name], name))
    else:
        figure: Any = ax.get_figure()
        figure.colorbar(ScalarMappable(norm, "cividis"), ax=ax).set_label(_labelled(data[name], name), parse_math=False)
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    return ax


def percentile_band(
    curves: xarray.Dataset,
    study: xarray.Dataset,
    dof: str | None = None,
    *,
    percentiles: Sequence[float] = PERCENTILES,
    ax: Axes | None = None,
) -> DrawnAxes:
    """How sure a curve is whose parameters are samples: percentiles of the amplitude as bands, of the peaks as a cross.

    Parameters
    ----------
    curves
        The dataset in ``curves.nc``.
    study
        The dataset in ``study.nc``.
    dof
        Name of the dof; by default the first.
    percentiles
        In percent: bands from the lowest to the highest, the second to the last but one, and so on; of an odd number
        the middle one is a line.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        ``ax.collections`` are the bands, the widest first.

    Raises
    ------
    InputError
        If it is no study of samples with its curves, has no such dof, or a percentile is not between 0 and 100.
    """
    asked = sorted(checked_percentiles(percentiles))
    found = curve_percentiles(curves, _study(study), asked)
    one = chosen(found, "dof", dof)[0]
    followed = followed_of(found)
    ax = styled(
        ax, _labelled(curves[followed], _name_of(curves[followed])),
        _labelled(curves["amplitude"], _amplitude_of(one), one),
    )  # fmt: skip
    show_lengths(ax.yaxis, largest=largest_length(study, "peak_amplitude"))
    x, sizes = found[followed].to_numpy(), found["amplitude"].sel(dof=one).to_numpy()
    peaks = peak_percentiles(study, asked)
    at, high = (peaks[name].sel(dof=one).to_numpy() for name in (f"peak_{followed}", "peak_amplitude"))
    for k in range(len(asked) // 2):
        label = f"{asked[k]:g} % to {asked[-1 - k]:g} %"
        ax.fill_between(x, sizes[k], sizes[-1 - k], color=COLOURS[0], alpha=0.25, linewidth=0.0, label=label)
    if len(asked) % 2:
        ax.plot(x, sizes[len(asked) // 2], color=COLOURS[0], linestyle="-", label=f"{asked[len(asked) // 2]:g} %")
    if np.isfinite([*at, *high]).all():
        (x0, y0), (xerr, yerr) = zip(*map(_middle_and_reach, (at, high)), strict=True)
        ax.errorbar(x0, y0, xerr=xerr, yerr=yerr, color=COLOURS[1], capsize=3.0, linewidth=1.2, label="peaks")
    legend(ax)
    ax.axhline(0.0, color=GREY, linewidth=0.6, zorder=0)
    return ax


def _middle_and_reach(values: np.ndarray) -> tuple[float, np.ndarray]:
    """The middle of percentiles, and how far it is to the lowest and the highest, (2, 1)."""
    middle = float(np.median(values))
    return middle, np.array([[middle - values[0]], [values[-1] - middle]])


def percentile_convergence(
    samples: xarray.Dataset, percentiles: Sequence[float] = (50.0, 95.0, 99.0), *, ax: Axes | None = None
) -> DrawnAxes:
    """Percentiles of the amplification over the number of samples: whether more of them would change anything.

    Each is that of the first n samples of a mistuning study, failed ones left out; dashed, from 8 samples on, that of
    the Weibull distribution of maxima fitted to them.

    Parameters
    ----------
    samples
        The dataset of a study with ``method = "mistuning"``, or what
        ``slipstick.studies.mistuning.mistuning_study`` returns.
    percentiles
        In percent, between 0 and 100.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        Two lines for each percentile: of the samples, and of the distribution.

    Raises
    ------
    InputError
        If it is no such dataset, all its samples failed, or a percentile is not between 0 and 100.
    """
    values, asked = _amplifications(samples), checked_percentiles(percentiles)
    ax = styled(ax, "Number of samples", "Amplification")
    counts = np.unique(np.geomspace(1, values.size, _COUNTS).astype(int))
    fits = [n for n in counts.tolist() if n >= FEWEST and np.ptp(values[:n]) > 0.0]
    fitted = [WeibullMaxima.fitted(values[:n]) for n in fits]
    for percent in asked:
        line, *_ = ax.plot(counts, [np.percentile(values[:n], percent) for n in counts], label=f"{percent:g} %")
        ax.plot(fits, [fit.percentile(percent) for fit in fitted], linestyle="--", color=line.get_color())
    if fits:
        ax.plot([], [], linestyle="--", color=GREY, label="of the Weibull fit")
    if values.size > 1:
        log_scale(ax, "x")
    legend(ax)
    return ax


def amplification_histogram(samples: xarray.Dataset, *, ax: Axes | None = None) -> DrawnAxes:
    """How many discs of a mistuning study have which amplification, and where the percentiles are.

    Parameters
    ----------
    samples
        The dataset of a study with ``method = "mistuning"``.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        ``ax.patches`` are the bins; a line for each percentile: 50, 95 and 99 %.

    Raises
    ------
    InputError
        If it is no such dataset, or no disc has an amplification.
    """
    values = _amplifications(samples)
    found = amplification_percentiles(samples)
    ax = styled(ax, "Amplification", "Discs")
    ax.hist(values, bins=histogram_edges(values).tolist(), color=COLOURS[0], alpha=0.6)
    for percent, value, colour in zip(
        found["percentile"].to_numpy(), found["amplification"].to_numpy(), COLOURS[1:], strict=False
    ):
        ax.axvline(value, color=colour, label=f"{percent:g} %: {value:.4g}")
    legend(ax)
    return ax


def worst_disc(study: xarray.Dataset, *, ax: Axes | None = None) -> DrawnAxes:
    """Deviations of the blades of the disc with the largest amplitude in a mistuning study.

    Parameters
    ----------
    study
        The dataset of ``ss.study`` with ``method="mistuning"``, or ``study.nc``.
    ax
        Axes to draw into; by default those of a new figure.

    Returns
    -------
    Axes
        ``ax.patches`` are the blades in their order; the title names the disc, and the output that moves most.

    Raises
    ------
    InputError
        If it is no such dataset, or no disc has an amplification.
    """
    from matplotlib.ticker import MaxNLocator

    data = _study(study)
    _amplifications(data)
    one = worst_of(data)
    deviations, worst = deviations_of(one), str(one["worst"].item())
    ax = styled(ax, f"Blade (0 to {len(deviations) - 1})", "Deviation of stiffness")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    bars = ax.bar(np.arange(len(deviations)), deviations, color=COLOURS[0], alpha=0.7)
    sector = worst.rpartition("@")[2]
    if sector.isdecimal() and int(sector) < len(deviations):
        bars.patches[int(sector)].set(color=COLOURS[1], label=f"the blade of {worst}")
        legend(ax)
    ax.axhline(0.0, color=GREY, linewidth=0.6)
    text = f"disc {int(one['case'])}, {worst}: amplification {float(one['amplification']):.4g}"
    ax.set_title(text, fontsize="small", parse_math=False)
    return ax


def _amplifications(data: xarray.Dataset) -> np.ndarray:
    """Known amplifications of a mistuning study. Raises InputError for another dataset, and where there are none."""
    if not is_dataset(data, "amplification"):
        raise InputError(f"nothing to draw: found {shown(data)}; expected the dataset of a mistuning study")
    values = data["amplification"].to_numpy()
    if not np.isfinite(values).any():
        raise InputError("nothing to draw: all samples failed")
    return values[np.isfinite(values)]


def _evenly(cases: np.ndarray, values: Mapping[int, float]) -> list[int]:
    """The cases, at most ``_MOST``, in the order of their values and evenly among them."""
    order = sorted(cases.tolist(), key=lambda case: values[case])
    return [order[i] for i in np.unique(np.linspace(0, len(order) - 1, min(_MOST, len(order))).astype(int))]


def _flat(data: xarray.Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Number of every case, and its value of a parameter."""
    number = data["case"]
    value = data[name].broadcast_like(number).transpose(*number.dims)
    return number.to_numpy().ravel(), value.to_numpy().ravel()


def _study(study: xarray.Dataset) -> xarray.Dataset:
    if not is_dataset(study, "peak_amplitude") or "study_parameters" not in study.attrs:
        raise InputError(f"nothing to draw: found {shown(study)}; expected the dataset that ss.study returns")
    return study


def _over(data: xarray.Dataset, parameters: Names) -> tuple[str, ...]:
    """The one or two parameters that are drawn."""
    known = str(data.attrs["study_parameters"]).splitlines()
    if parameters is None:
        return tuple(known[:2])
    names = name_list("over", parameters, "the name of a parameter")
    for name in names:
        if name not in known:
            raise InputError(f"there is no parameter {shown(name)} in the study; {suggestion(name, known)}")
    if not 1 <= len(names) <= 2:
        raise InputError(f"study, over: found {len(names)} parameters; expected one or two of {', '.join(known)}")
    return names


def _name_of(followed: xarray.DataArray) -> str:
    """The followed quantity in a label: a parameter by its name as it is."""
    name = str(followed.attrs["long_name"])
    return name.capitalize() if followed.name == "omega" else name


def _amplitude_of(dof: str, which: str = "Amplitude") -> str:
    """The amplitude of a dof in a label."""
    return "Largest amplitude of all outputs" if dof == LARGEST else f"{which} of {dof}"


def _labelled(variable: xarray.DataArray, text: str, dof: str | None = None) -> str:
    label = str(variable.attrs.get("units", "1"))
    return with_unit(text, label if dof is None else unit_of_dof(label, dof))
