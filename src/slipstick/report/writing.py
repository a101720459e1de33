"""Reports written to a file: our few files of the page, the plotting library and the content, in one without links."""

from __future__ import annotations

import os
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from hashlib import sha256
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick import __version__
from slipstick.errors import Fault, InputError
from slipstick.faults import one, text, whole
from slipstick.faults import path as path_of
from slipstick.replacing import Kind, writing
from slipstick.report.encoding import gathered, safe_json
from slipstick.results.solutions import Solutions
from slipstick.results.view import VIEWS

if TYPE_CHECKING:
    import xarray

    from slipstick.results.run_up import RunUp

MARK = '<meta name="generator" content="slipstick report">'
"""It marks a file as a report: no other file is replaced."""
MOST_WRITTEN = 12


def write_report(
    branches: Solutions | Iterable[Solutions] | Mapping[str, Solutions],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    contacts: int = MOST_WRITTEN,
    dofs: int = MOST_WRITTEN,
    tolerances: Mapping[str, float] | None = None,
) -> Path:
    """Write one self-contained page with a branch, or with several overlaid; the path.

    Parameters
    ----------
    branches
        A branch, a list of branches, or ``{label: branch}``.
    path
        The file; an earlier report there is replaced when the new one is complete.
    title
        Of the page; by default that of the first branch.
    contacts, dofs
        How many are kept: those that dissipate most, those that move most.
    tolerances
        Shares by name of parameter, ``{"damper.mu": 0.2}``: the band of amplitudes that they cause is drawn.

    Returns
    -------
    Path
        A page of a few megabytes at most for some hundred points and a dozen contacts.

    Raises
    ------
    InputError
        If the file cannot be written, or there is one that is no report; if there is nothing to report, or several
        results have other axes or units.
    """
    from slipstick.report.content import content_of

    target = path_of("report", path, "the path of a report such as report.html")
    title = text("report title", title)
    most: dict[str, Any] = {"contacts": whole("report contacts", contacts, 0), "dofs": whole("report dofs", dofs, 1)}
    most["tolerances"] = tolerances
    together = labelled(branches)
    most["beside"] = [branch.table for _, branch in together]
    results = [content_of(branch, label, **most) for label, branch in together]
    _check_together(results)
    title = (
        title
        or results[0]["title"]
        or ", ".join(filter(None, (result["label"] for result in results[:3])))
        or "Results"
    )
    content = {"title": title, "version": __version__, "written": f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"}
    _write(target, page(title, content | {"results": results}))
    return target


def write_study_report(
    study: xarray.Dataset,
    curves: xarray.Dataset | None,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    dofs: int = MOST_WRITTEN,
) -> Path:
    """Write one self-contained page with the cases of a study: the datasets in ``study.nc`` and ``curves.nc``, or None.

    Arguments and errors are otherwise those of ``write_report``.
    """
    from slipstick.report.study import study_content

    target = path_of("report", path, "the path of a report such as report.html")
    content = study_content(study, curves, dofs=whole("report dofs", dofs, 1))
    title = text("report title", title) or content["title"] or "Study"
    made = {"title": title, "version": __version__, "written": f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"}
    _write(target, study_page(title, content | made))
    return target


def write_run_up_report(
    run: RunUp,
    path: str | os.PathLike[str],
    *,
    steady: Solutions | None = None,
    title: str = "",
    dofs: int = MOST_WRITTEN,
) -> Path:
    """Write one self-contained page of a run-up: envelopes, spectra or sections, peaks, energy, contacts.

    ``steady`` is a curve in the same units, drawn with the envelopes; their peaks are compared with its peaks.
    Arguments and errors are otherwise those of ``write_report``.
    """
    from slipstick.report.plain import run_up_body

    target = path_of("report", path, "the path of a report such as report.html")
    title = text("report title", title) or str(run.dataset.attrs.get("title", "")) or "Run-up"
    most = whole("report dofs", dofs, 1)
    _write(target, plain_page(title, run_up_body(run, steady, title=title, dofs=most, foot=_plain_foot())))
    return target


def write_fit_report(fitted: xarray.Dataset, path: str | os.PathLike[str], *, title: str = "") -> Path:
    """Write one self-contained page of an identification, its ``dataset``: values with errors, correlations, the fit.

    Arguments and errors are otherwise those of ``write_report``.
    """
    from slipstick.report.plain import fit_body

    target = path_of("report", path, "the path of a report such as report.html")
    title = text("report title", title) or str(fitted.attrs.get("title", "")) or "Identification"
    _write(target, plain_page(title, fit_body(fitted, title=title, foot=_plain_foot())))
    return target


def _plain_foot() -> str:
    when = f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"
    said = f"Written by slipstick {__version__}, {when}. This file needs no network and no server."
    return f'<footer id="foot"><p>{said}</p></footer>'


def _check_together(results: Sequence[Mapping[str, Any]]) -> None:
    """InputError where results do not have the same axes: over what they are, of what, and in which units."""
    first = results[0]
    for other in results[1:]:
        for of, words in ((_over, "over"), (_motion, "with motion in"), (_force, "with forces in")):
            one, another = of(first), of(other)
            if one != another and one and another:  # results without contacts have no forces
                raise InputError(
                    Fault(
                        "report",
                        found=f"'{first['label']}' {words} {one} and '{other['label']}' {words} {another}",
                        expected="results with the same axes and units",
                        remedy="write a report of each",
                    )
                )


def _over(content: Mapping[str, Any]) -> str:
    """What results are, and over what, with its unit."""
    over = content["abscissae"][0]
    return f"{VIEWS[content['analysis']].words}{over['label']} [{over['units'] or '1'}]"


def _motion(content: Mapping[str, Any]) -> str:
    return str(content["dofs"]["units"])


def _force(content: Mapping[str, Any]) -> str:
    return str(content["contacts"]["force_units"])


def labelled(branches: object) -> list[tuple[str, Solutions]]:
    """Labels, each once, with their branches."""
    if isinstance(branches, Solutions):
        branches = [branches]
    if isinstance(branches, Mapping):
        pairs = [(str(label), branch) for label, branch in branches.items()]
    elif isinstance(branches, Iterable) and not isinstance(branches, str | bytes):
        pairs = [("", branch) for branch in branches]
    else:
        pairs = [("", branches)]
    if not pairs:
        raise InputError("report: no branch was given")
    checked = [(label, one("report, branch", branch, Solutions, "an ss.Branch")) for label, branch in pairs]
    titles = [label or str(branch.table.attrs.get("title", "")) or "results" for label, branch in checked]
    numbered = [f"{t} ({titles[: i + 1].count(t)})" if titles.count(t) > 1 else t for i, t in enumerate(titles)]
    return list(zip(numbered, (branch for _, branch in checked), strict=True))


def _write(path: Path, content: str) -> None:
    with writing(path, Kind("report", MARK.encode())) as temporary:
        temporary.write_text(content, encoding="utf-8")


STYLES = ("uplot/uPlot.min.css", "look.css", "panels.css", "disc.css", "interface.css", "inputs.css", "print.css")


STUDY_STYLES = ("look.css", "study.css", "inputs.css", "print.css")


PLAIN_STYLES = ("look.css", "plain.css", "print.css")


STUDY_SCRIPTS = ("decode.js", "charts.js", "save.js", "head.js", "inputs.js", "study.js")


_NAMES = "decode law model view charts save curves strip shape disc interface panels diagram tables head inputs main"
SCRIPTS = tuple(f"{name}.js" for name in _NAMES.split())
"""Our scripts in the order in which they are joined: one script, whose only global name is ``slipstick``."""


def part(name: str) -> str:
    """A file of the page."""
    return (files("slipstick.report") / "page" / name).read_text(encoding="utf-8")


@cache
def style(names: tuple[str, ...] = STYLES) -> str:
    """All styles, the library's first."""
    return "\n".join(part(name) for name in names)


@cache
def scripts() -> tuple[str, str]:
    """The library with its licence, and our own script."""
    licence = part("uplot/LICENSE").replace("*/", "* /")
    return f"/*\n{licence}\n*/\n{part('uplot/uPlot.iife.min.js')}", _script(SCRIPTS)


@cache
def _script(names: tuple[str, ...]) -> str:
    source = "\n".join(part(name) for name in names)
    return f'"use strict";\n(() => {{\n{source}\n}})();'


def page(title: str, content: object) -> str:
    """The whole page.

    Its policy forbids every request, and every script and style but the very ones it was written with.
    """
    library, script = scripts()
    return _filled("page.html", title, content, style(), {"library": library, "script": script})


def study_page(title: str, content: object) -> str:
    """The whole page of a study, under the same policy."""
    return _filled("study.html", title, content, style(STUDY_STYLES), {"script": _script(STUDY_SCRIPTS)})


def plain_page(title: str, body: str) -> str:
    """The whole page without scripts, which its policy forbids altogether."""
    look = style(PLAIN_STYLES)
    slots = {"title": escape(title), "policy": _policy([look], []), "style": look, "body": body}
    return _with_slots("plain.html", slots)


def _filled(template: str, title: str, content: object, look: str, parts: dict[str, str]) -> str:
    plain, numbers = gathered(content)
    slots = {
        "title": escape(title),
        "policy": _policy([look], list(parts.values())),
        "style": look,
        "content": safe_json(plain),
        "numbers": numbers,
        **parts,
    }
    return _with_slots(template, slots)


def _with_slots(template: str, slots: Mapping[str, str]) -> str:
    return re.sub(r"\{\{(\w+)\}\}", lambda slot: slots[slot[1]], part(template))


def _policy(styles: list[str], scripts: list[str]) -> str:
    return (
        f"default-src 'none'; script-src {_hashes(scripts)}; style-src {_hashes(styles)}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hashes(texts: list[str]) -> str:
    if not texts:
        return "'none'"
    return " ".join(f"'sha256-{b64encode(sha256(text.encode('utf-8')).digest()).decode('ascii')}'" for text in texts)
