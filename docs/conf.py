"""The site: `make docs`. The pages are plain markdown that also reads on its own; what only the site needs is here."""

from __future__ import annotations

import re
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SOURCE = PROJECT["urls"]["Source"]

project = PROJECT["name"]
author = copyright = PROJECT["authors"][0]["name"]
version = release = PROJECT["version"]

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
if find_spec("sphinx-mathjax-offline"):  # equations without a request to anybody
    extensions += ["sphinx.ext.mathjax", "sphinx-mathjax-offline"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300

html_theme = "furo"
html_title = f"slipstick {version}"
html_theme_options = {"source_repository": SOURCE, "source_branch": "main", "source_directory": "docs/"}
html_static_path = ["_static"]
html_css_files = ["site.css"]
toc_object_entries_show_parents = "hide"

nitpicky = True
# no links are made to names of other projects, type aliases, and classes that a documented one only builds on
HIDDEN = (
    "Array|Listener|Event|Reason|SlipstickError|StepOptions|NewtonOptions|FrictionLaw|StateModel|ContactState"
    "|SectorShape|ResultTable|ContactChange|NodalEquation|ContactPoints|Joint"
)
ALIASES = rf"slipstick\..*\.({HIDDEN})"
nitpick_ignore_regex = [("py:.*", r"(?!slipstick\.).*"), ("py:.*", ALIASES)]
autodoc_typehints = "description"  # types stand beside each parameter; docstrings say shapes and units
autodoc_typehints_description_target = "documented"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
autodoc_member_order = "bysource"
autosummary_generate = True
templates_path = ["_templates"]
napoleon_google_docstring = False
napoleon_use_rtype = True
napoleon_use_ivar = True
napoleon_attr_annotations = False


SHOWN = {
    "slipstick.Case": "from_file, from_text, structure, problem, balance, warnings, curve, asks, run",
    "slipstick.ContactPair": "quantities, values, with_value",
    "slipstick.CyclicStructure": "phase_modes, natural_frequencies, travelling_wave, mistuned, with_aerodynamics, "
    "changed, values",
    "slipstick.FrictionContact": "changed",
    "slipstick.FrictionCurve": "at",
    "slipstick.MatrixStructure": "natural_frequencies, damping_ratios, values, changed, at_speed, by_modes",
    "slipstick.ModalStructure": "load, natural_frequencies, damping_ratios, reduction_error, valid_to, values, changed",
    "slipstick.PlanarFrictionContact": "changed",
    "slipstick.Problem": "orders, parameter, with_parameter",
    "slipstick.RubbingMotion": "names, component, with_component, coefficients, normal_coefficients",
    "slipstick.SampledLaw": "changed",
    "slipstick.models.IwanContact": "changed",
    "slipstick.models.StatorContact": "changed",
    "slipstick.models.StribeckContact": "changed, mu",
    "slipstick.structure.free.FreeStructure": "dofs, n_rigid, natural_frequencies, damping_ratios, values, changed",
    "slipstick.structure.tabulated.TabulatedStructure": "error, worst, covers, natural_frequencies, warnings, summary",
    "slipstick.fem.model.FiniteElementModel": "dofs, dof_positions, nodes_of, positions, fix, constrain, unit_names",
    "slipstick.units.Units": "of",
}
"""Members that users call, of classes whose further members serve the package. Other classes show
all of theirs."""


def related() -> dict[str, list[str]]:
    """What stands beside each name on the page of the Python interface: other names and pages."""
    found = {}
    for section in re.split(r"^## ", (ROOT / "docs/python.md").read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]:
        names = re.findall(r"^   (slipstick\.[\w.]+)$", section, flags=re.MULTILINE)
        pages = [f":doc:`/{page}`" for page in re.findall(r"\]\(([\w-]+)\.md\)", section)]
        for name in names:
            others = [f":py:obj:`~{other}`" for other in names if other != name]
            found[name] = pages + (others if len(others) <= 14 else [])
    return found


INHERITED = ("slipstick.Branch",)
"""Classes whose page shows what they inherit."""
PICTURED = {
    f"slipstick.plots.{path.stem}": f"an example of {path.stem}"
    for path in (ROOT / "docs/figures/gallery").glob("*.png")
}
"""Functions whose page shows the figure they draw, with the text in its place."""
autosummary_context = {"shown": SHOWN, "inherited": INHERITED, "related": related(), "pictured": PICTURED}

CITED = r"THEORY\.md \((\d+\.\d+)\)"


def navigation(text: str) -> str:
    """The lists of links of the first page, section by section, as tables of contents for the site."""
    parts = []
    for section in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        caption, _, body = section.partition("\n")
        pages = re.findall(r"^- \[(.+?)\]\(([\w-]+)\.(?:md|ipynb)\)", body, flags=re.MULTILINE)
        entries = "\n".join(f"{title} <{page}>" for title, page in pages)
        parts.append(f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{entries}\n```\n")
    return text + "\n" + "\n".join(parts)


def numbered(equation: re.Match[str]) -> str:
    """An equation with its own number, as a target of links."""
    anchor = f'<a id="eq-{equation[2]}"></a>'
    return f"{anchor}\n\n```{{math}}\n:nowrap: true\n\n\\begin{{equation}}\n{equation[1]}\n\\end{{equation}}\n```"


def for_the_site(app: Any, page: str, source: list[str]) -> None:
    """Links that leave this folder lead to the repository; the first page gets its tables of contents."""
    if page == "changelog":
        source[0] = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").replace("](docs/", "](")
    if page != "THEORY":
        source[0] = re.sub(CITED, r"<a href='THEORY.html#eq-\1'>(\1)</a>", source[0])
    source[0] = re.sub(r"\]\(\.\./([^)]+)\)", rf"]({SOURCE}/blob/main/\1)", source[0])
    source[0] = re.sub(r"^\$\$\n(.*?\\tag\{([\d.]+)\})\n\$\$$", numbered, source[0], flags=re.MULTILINE | re.DOTALL)
    if page == app.config.root_doc:
        source[0] = navigation(source[0])


def named_apart(lines: list[str]) -> list[str]:
    """Attributes that share a description, each with its own: Sphinx has one name for each field.

    >>> named_apart(["Attributes", "----------", "low, high", "    Its ends.", "", "Examples"])
    ['Attributes', '----------', 'low', '    Its ends.', 'high', '    Its ends.', '', 'Examples']
    """
    out, at = [], lines.index("Attributes") + 2 if "Attributes" in lines else len(lines)
    out += lines[:at]
    while at < len(lines):
        end = at + 1
        while end < len(lines) and lines[end].startswith(" "):
            end += 1
        shared = re.fullmatch(r"\w+(, \w+)+", lines[at])
        for name in lines[at].split(", ") if shared else [lines[at]]:
            out += [name, *lines[at + 1 : end]]
        at = end
    return out


def equations_linked(app: Any, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Links to THEORY.md, a name for each attribute, and "type: text" that napoleon does not read in a property."""
    lines[:] = [re.sub(CITED, r"`THEORY.md (\1) <THEORY.html#eq-\1>`__", line) for line in named_apart(lines)]
    if what in ("property", "attribute"):
        lines[:0] = ["..", ""]


def arrays_by_name(body: str) -> str:
    """A page whose types say "ndarray" without the brackets that follow; its tags stay.

    >>> arrays_by_name("<em>ndarray</em><em>[</em><em>Any</em><em>]</em> | None")
    '<em>ndarray</em><em></em><em></em><em></em> | None'
    """
    kept, depth, after = [], 0, False
    for part in re.split(r"(<[^>]+>)", body):
        if not part or part.startswith("<"):
            kept.append(part)
            continue
        end = 0
        if after or depth:
            for end, character in enumerate(part, 1):
                depth += (character == "[") - (character == "]")
                if not depth:
                    end -= character != "]"
                    break
        kept.append(part[end:])
        after = not depth and kept[-1].endswith("ndarray")
    return "".join(kept)


def types_in_short(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """On pages of the Python interface arrays are arrays: docstrings say their shapes and what they hold."""
    if page.startswith("api/"):
        context["body"] = arrays_by_name(context["body"])


def setup(app: Any) -> None:
    """Called by Sphinx."""
    app.connect("source-read", for_the_site)
    app.connect("autodoc-process-docstring", equations_linked, priority=400)
    app.connect("html-page-context", types_in_short)
