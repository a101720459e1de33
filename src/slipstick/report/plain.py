"""Pages of run-ups and fits, without scripts: outcome, figures, numbers, case."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from io import BytesIO
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import InputError
from slipstick.plots.characters import drawn_in_known_characters
from slipstick.plots.shown import for_files
from slipstick.report.content import frequency_of, provenance
from slipstick.report.inputs import inputs_of_case
from slipstick.results.run_up import RunUp, time_unit
from slipstick.results.view import names_of, ranked, value_text, view_of
from slipstick.units import Units, after_number, energy_unit

if TYPE_CHECKING:
    import xarray

    from slipstick.results.solutions import Solutions

MOST_DRAWN = 4
"""Dofs with figures of their own in the page of a run-up; tables list more."""
_LAST = 256
"""Periods in a section."""
_CORRELATED = 0.9
_FIT = "circles are measured, lines with dots are fitted"
_FIT_IN_TIME = "points are measured, the line is fitted"


@for_files()
def run_up_body(run: RunUp, steady: Solutions | None, *, title: str, dofs: int, foot: str) -> str:
    """The page of a run-up: envelopes over the steady curve, spectra, sections, peaks with lag, contacts, energy."""
    data = run.dataset
    if not data.sizes["period"]:
        raise InputError("nothing to report: no period is integrated")
    if steady is not None:
        _check_steady(data, steady)
    names = names_of(data, "dof")
    order = ranked(data, "dof", "amplitude")
    kept = [names[d] for d in np.sort(order[:dofs])]
    drawn = [names[d] for d in order[:MOST_DRAWN] if names[d] in kept]
    return "\n".join(
        [
            *_head(data.attrs, title, _facts_of_run_up(data)),
            "<main>",
            _section("Motion", _figures(_run_up_figures(run, drawn, steady)), _motions(run, kept, steady)),
            _section("Contacts", _contacts(data)) if data.sizes.get("contact") else "",
            _section("Balance of energy", _energy(data)),
            *_inputs(data.attrs),
            "</main>",
            foot,
        ]
    )


def _check_steady(data: Any, steady: Solutions) -> None:
    """InputError for a curve that envelopes cannot be compared with."""
    if steady.table.attrs.get("parameter") or view_of(steady.table).name != "response":
        raise InputError("report: the steady curve of a run-up is a response over a range of frequencies; leave it out")
    known, other = (Units.of_results(attrs).attributes for attrs in (data.attrs, steady.table.attrs))
    if known != other:
        raise InputError(f"report: the run-up is in {known} and the curve in {other}; give one with the same units")


@for_files()
def fit_body(fitted: xarray.Dataset, *, title: str, foot: str) -> str:
    """The page of an identification: values with errors, what cannot be separated, correlations, and the fit."""
    from slipstick.plots.fits import fit

    needed = {"parameter", "units", "value", "standard_error", "correlation", "singular_value", "measured", "fitted"}
    if not needed <= set(fitted.variables) or not {"converged", "message", "misfit", "noise"} <= set(fitted.attrs):
        raise InputError("report: these are not the results of a fit as ss.identify gives them; compute them again")
    names = [str(name) for name in fitted["parameter"].to_numpy()]
    attrs = {
        **fitted.attrs,
        "outcome": "COMPLETED" if int(fitted.attrs["converged"]) else "FAILED",
        "outcome_text": str(fitted.attrs["message"]),
        "warnings": str(fitted.attrs.get("warnings", fitted.attrs.get("indistinct", ""))),
    }
    return "\n".join(
        [
            *_head(attrs, title, _facts_of_fit(fitted)),
            "<main>",
            _section("Parameters", _values(fitted, names)),
            _section("Measured and fitted", _figures([(_FIT_IN_TIME if "time" in fitted.dims else _FIT, fit(fitted))])),
            _section("Correlations of the errors", _correlations(fitted, names)) if len(names) > 1 else "",
            _section("What the measurement separates", _singular(fitted)),
            *_inputs(fitted.attrs),
            "</main>",
            foot,
        ]
    )


def _head(attrs: Any, title: str, facts: Iterable[str]) -> Iterator[str]:
    told = provenance(attrs)
    good = told["outcome"]["ok"]
    yield f'<header id="head"><p class="brand">slipstick</p><h1>{escape(title)}</h1>'
    yield f'<p class="author">{escape(told["author"])}</p>' if told["author"] else ""
    yield f'<p class="remarks">{escape(told["remarks"].strip())}</p>' if told["remarks"] else ""
    yield '<section class="outcome" aria-label="Outcome">'
    mark, look = ("✓", "good") if good else ("!", "early")
    yield f'<p class="verdict {look}"><strong>{mark}</strong> {escape(told["outcome"]["text"])}</p>'
    facts = [*facts, told["case_file"]]
    yield f'<p class="facts">{escape(" · ".join(filter(None, facts)))}</p>'
    for sentence in told["warnings"]:
        yield f'<p class="warning"><strong>Warning: </strong>{escape(sentence)}</p>'
    about = "".join(
        f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in told["about"] if name not in _SAID
    )
    yield f'<div class="folds"><details><summary>Provenance</summary><dl>{about}</dl></details>'
    if told["case"]:
        yield f'<details><summary>Case file</summary><pre tabindex="0">{escape(told["case"])}</pre></details>'
    yield "</div></section></header>"


_SAID = {
    "indistinct", "warnings", "refused", "weights", "message", "converged", "run up", "start", "stop", "rate",
    "periods",
}  # fmt: skip
"""Attributes that are shown elsewhere on these pages."""


def _section(title: str, *parts: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{''.join(parts)}</section>"


def _inputs(attrs: Any) -> Iterator[str]:
    """What the case gave, in tables."""
    parts = [
        f"<div><h3>{escape(table['title'])}</h3>{_table(table['head'], table['rows'], look='words')}</div>"
        for table in inputs_of_case(str(attrs.get("case", "")))
    ]
    if parts:
        yield _section("Inputs", '<div class="given">', *parts, "</div>")


def _figures(figures: Iterable[tuple[str, Any]]) -> str:
    """Axes with their captions, as pictures in the page."""
    return f'<div class="figures">{"".join(_figure(caption, ax) for caption, ax in figures)}</div>'


def _figure(caption: str, ax: Any) -> str:
    stream, figure = BytesIO(), ax.get_figure(root=True)
    with drawn_in_known_characters(figure):
        figure.savefig(stream, format="png", dpi=150)
    source = b64encode(stream.getvalue()).decode("ascii")
    text = escape(caption)
    return (
        f'<figure class="card"><img src="data:image/png;base64,{source}" alt="{text}">'
        f"<figcaption>{text}</figcaption></figure>"
    )


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], look: str = "") -> str:
    top = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    body = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows)
    card = f'<div class="{" ".join(filter(None, ("card scroll rows", look)))}" tabindex="0">'
    return f"{card}<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>"


def _speed(data: Any) -> Any:
    """Speeds as texts, in the unit that results are drawn in."""
    frequency = frequency_of(data)
    unit = frequency["unit"]
    return lambda omega: f"{float(omega) * frequency['factors'][unit]:.6g} {unit}"


def _facts_of_run_up(data: Any) -> Iterator[str]:
    speed, attrs, unit = _speed(data), data.attrs, time_unit(data)
    if attrs["rate"]:
        yield f"{speed(attrs['start'])} to {speed(attrs['stop'])}"
        yield f"rate {float(attrs['rate']):.4g} rad/{unit}^2"
    else:
        yield f"at {speed(attrs['start'])}"
    yield f"{data.sizes['period']} of {int(attrs['periods'])} periods"
    yield f"{float(data['time'][-1]):.6g} {unit}"


def _run_up_figures(run: RunUp, drawn: Sequence[str], steady: Solutions | None) -> Iterator[tuple[str, Any]]:
    from slipstick.plots import passing

    swept = bool(run.dataset.attrs["rate"])
    sampled = run.dataset.sizes.get("sample", 0) >= 16
    for dof in drawn:
        known = steady if steady is not None and dof in map(str, steady.table["dof"].to_numpy()) else None
        over = "speed" if swept else "time"
        beside = ", beside the steady curve" if known is not None else ""
        yield f"half range of {dof} over {over}{beside}", passing.run_up(run, dof, branch=known)
        if not swept:
            last = min(_LAST, run.dataset.sizes["period"])
            ends = f"Poincare section of {dof}: the ends of the last {last} periods"
            yield ends, passing.section(run, dof, last=last)
        if sampled:
            yield f"amplitudes of {dof} versus frequency and time", passing.spectrogram(run, dof)


def _motions(run: RunUp, kept: Sequence[str], steady: Solutions | None) -> str:
    """Peaks, with their lag behind those of the steady curve; at one speed what motion it is."""
    data = run.dataset
    speed = _speed(data)
    if not data.attrs["rate"]:
        return _table(["dof", "largest half range", "the last", "motion", "second frequency"], map(_kind(run), kept))
    head, rows = ["dof", "largest half range", "at"], []
    if steady is not None:
        head += ["steady", "at", "shift", "ratio"]
    for dof in kept:
        peak = run.peak(dof)
        row = [dof, f"{value_text(data, 'amplitude', peak.amplitude, dof)}", speed(peak.omega)]
        if steady is not None:
            row += _lag(run, steady, dof)
        rows.append(row)
    return _table(head, rows)


def _lag(run: RunUp, steady: Solutions, dof: str) -> list[str]:
    speed = _speed(run.dataset)
    try:
        lag = run.lag(steady, dof)
    except InputError:  # the curve has no such dof, or no peak of it
        return ["-"] * 4
    steady_size = value_text(run.dataset, "amplitude", lag.steady_amplitude, dof)
    return [steady_size, speed(lag.steady_omega), speed(lag.shift), f"{lag.ratio:.4f}"]


def _kind(run: RunUp) -> Any:
    speed, sizes = _speed(run.dataset), run.dataset["amplitude"]

    def row(dof: str) -> list[str]:
        size = sizes.sel(dof=dof).to_numpy()
        said = [dof, *(value_text(run.dataset, "amplitude", float(own), dof) for own in (size.max(), size[-1]))]
        try:
            motion = run.motion(dof)
        except InputError as error:
            return [*said, str(error), "-"]
        kind = f"{motion.kind}, every {motion.periods} periods" if motion.periods > 1 else motion.kind
        return [*said, kind, speed(motion.second_omega) if np.isfinite(motion.second_omega) else "-"]

    return row


def _contacts(data: Any) -> str:
    """Dissipated energy, and the shares of the whole time in each state."""
    length = np.diff(data["time"].to_numpy(), prepend=0.0)
    powers = data["dissipated_power"]
    energy = np.nansum(powers.to_numpy() * length[:, None], axis=0)
    changed = data["change_contact"].to_numpy().astype(str)
    shares = [np.average(data[f"{state}_fraction"].to_numpy(), axis=0, weights=length) for state in _STATES]
    unit = energy_unit(str(powers.attrs.get("units", "")).partition("/")[0])
    rows = [
        [str(name), f"{energy[c]:.6g}", *(_share(share[c]) for share in shares), str(int(np.sum(changed == str(name))))]
        for c, name in enumerate(data["contact"].to_numpy())
    ]
    return _table(["contact", f"dissipated energy [{unit}]", *_STATES, "changes of state"], rows)


_STATES = ("stick", "slip", "separation")


def _share(value: float) -> str:
    return f"{100.0 * value:.2f} %" if np.isfinite(value) else "-"


def _energy(data: Any) -> str:
    error = data["energy_error"].to_numpy()
    return (
        f"<p>Of the energy stored at the start and turned over since, {float(error[-1]):.2g} is missing at the end, "
        f"at most {float(error.max()):.2g} on the way. The work of loads and rubbing, what damping and friction "
        "dissipate and what is stored are computed independently.</p>"
    )


def _facts_of_fit(fitted: Any) -> Iterator[str]:
    attrs = fitted.attrs
    yield f"misfit {float(attrs['misfit']):.3g} of what was measured"
    yield f"noise {float(attrs['noise']):.3g}"
    if attrs.get("weights"):
        yield str(attrs["weights"])
    if "reduced_chi_square" in attrs:
        yield f"reduced chi square {float(attrs['reduced_chi_square']):.3g}"
    if "degrees_of_freedom" in attrs:
        yield f"{int(attrs['degrees_of_freedom'])} degrees of freedom"
    if int(attrs.get("several", 0)):
        several = int(attrs["several"])
        yield f"{several} points with more than one motion: the one nearest to what was measured was taken"


def _values(fitted: Any, names: Sequence[str]) -> str:
    from slipstick.analysis.identification.noise import error_text

    units = fitted["units"].to_numpy()
    rows, bound = [], np.isnan(fitted["standard_error"].to_numpy())
    if "at_bound" in fitted:
        bound = fitted["at_bound"].to_numpy()
    for k, name in enumerate(names):
        value, error = (float(fitted[key][k]) for key in ("value", "standard_error"))
        said = error_text(error, at_bound=bool(bound[k])).removeprefix("+- ")
        share = f"{100.0 * error / abs(value):.2g} %" if np.isfinite(error) and value else "-"
        unit = str(units[k])
        rows.append([name, f"{value:.8g}{after_number('' if unit == '1' else unit)}", said, share])
    return _table(["parameter", "value", "standard error", "of the value"], rows)


def _correlations(fitted: Any, names: Sequence[str]) -> str:
    values = fitted["correlation"].to_numpy()
    rows = [[name, *(_number(v) for v in row)] for name, row in zip(names, values, strict=True)]
    strong = [
        f"{names[i]} and {names[j]} ({values[i, j]:.3f})"
        for i, j in combinations(range(len(names)), 2)
        if abs(values[i, j]) > _CORRELATED
    ]
    said = f"<p>Strongly correlated: {escape(', '.join(strong))}.</p>" if strong else ""
    return _table(["", *names], rows) + said


def _number(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "-"


def _singular(fitted: Any) -> str:
    values = fitted["singular_value"].to_numpy()
    listed = ", ".join(f"{value:.4g}" for value in values)
    indistinct = str(fitted.attrs.get("indistinct", "")).splitlines()
    good = "" if fitted.attrs.get("refused") else "<p>The measurement determines all parameters.</p>"
    said = "".join(f"<p>{escape(sentence)}</p>" for sentence in indistinct) or good
    return f'{said}<p class="soft">Singular values of the Jacobian by relative changes: {listed}.</p>'
