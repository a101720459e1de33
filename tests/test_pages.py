"""The pages of the documentation: complete, linked, and what the code cites of them is there."""

from __future__ import annotations

import inspect
import re
import runpy
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

import slipstick as ss

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.glob("*.md"))
URLS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
THEORY = (DOCS / "THEORY.md").read_text(encoding="utf-8")
CITED = re.compile(r"THEORY\.md\s+(?:(?:sections?\s+)(\d+)(?:(?:,| and| to) (\d+))*|(\(\d+\.\d+\)(?:, \(\d+\.\d+\))*))")


def text(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def anchors(page: Path) -> set[str]:
    """Those that GitHub and the site make of headings."""
    titles = re.findall(r"^#+ (.+)$", text(page), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=lambda p: p.name)
def test_links_lead_somewhere(page: Path) -> None:
    here = URLS["Source"] + "/blob/main/"
    raw = here.replace("github.com", "raw.githubusercontent.com").replace("/blob/", "/")
    prose = re.sub(r"```.*?```", "", text(page), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)|^\[[^\]]+\]: (\S+)", prose, flags=re.MULTILINE):
        target = "".join(target)
        for start in (here, raw):
            target = target.replace(start, "" if page.parent == ROOT else "../")
        if target.startswith("http"):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path) if path else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


NAMED = re.compile(r"`((?:\w+/)*\w+\.(?:py|md)|(?:\w+/)+\w*)`")
"""Files and folders in the text of a page."""
WALKED = re.compile(r"^ +((?:\w+/)*\w+\.py)(?:, (\w+\.py))?(?=  |$)", re.MULTILINE)
"""The same in the lines of a walk, one below the other."""


@pytest.mark.parametrize("page", [DOCS / "architecture.md", ROOT / "CONTRIBUTING.md"], ids=lambda p: p.name)
def test_files_and_folders_that_a_page_names_are_there(page: Path) -> None:
    """From the source, the tests or the root; in the row of a room from that room, in a walk beside the line before."""
    source = ROOT / "src" / "slipstick"
    lost, beside = [], source
    for line in text(page).splitlines():
        room = re.match(r"\| `(\w+)`", line)
        places = [source, source / room[1]] if room else [source, ROOT / "tests", ROOT, beside]
        names = [name for found in WALKED.findall(line) for name in found if name] or NAMED.findall(line)
        for name in names:
            there = next((place / name for place in places if (place / name).exists()), None)
            if there is not None and "/" in name:
                beside = there.parent
            if there is None and name.split("/")[0] not in ("build", "dist"):
                lost.append(name)
    assert lost == []


def test_every_room_is_in_the_architecture() -> None:
    rooms = {path.name for path in (ROOT / "src" / "slipstick").iterdir() if (path / "__init__.py").exists()}
    rows = re.findall(r"^\| (.+?) \|", text(DOCS / "architecture.md"), flags=re.MULTILINE)
    assert rooms <= set(re.findall(r"`(\w+)`", " ".join(rows)))


def test_every_page_is_in_the_navigation() -> None:
    linked = set(re.findall(r"^- \[.+?\]\(([\w-]+\.(?:md|ipynb))\)", text(DOCS / "index.md"), flags=re.MULTILINE))
    assert linked == {p.name for p in (*PAGES, *DOCS.glob("*.ipynb"))} - {"index.md"}


LISTED = re.findall(r"^   (slipstick\.[\w.]+)$", text(DOCS / "python.md"), flags=re.MULTILINE)
"""Names on the page of the Python interface, each of which has a page of its own on the site."""


def test_every_public_name_is_in_the_reference() -> None:
    rooms = {"": ss, "models.": ss.models, "plots.": ss.plots, "runs.": ss.runs}
    public = [f"slipstick.{at}{name}" for at, room in rooms.items() for name in room.__all__]
    assert sorted(set(public) - set(LISTED)) == []
    assert len(LISTED) == len(set(LISTED))
    for path in LISTED:
        module, _, name = path.rpartition(".")
        assert hasattr(import_module(module), name), path


def test_every_page_of_the_reference_has_an_example() -> None:
    """A piece of code that runs and imports what it uses, or the figure that is drawn."""
    for path in LISTED:
        module, _, name = path.rpartition(".")
        thing = getattr(import_module(module), name)
        own = [member for member in vars(thing) if member[0] != "_"] if inspect.isclass(thing) else []
        members = [getattr(thing, member) for member in own]
        drawn = module == "slipstick.plots" and (DOCS / f"figures/gallery/{name}.png").is_file()
        examples = [example for one in (thing, *members) if ">>>" in (example := inspect.getdoc(one) or "")]
        assert drawn or examples, path
        for example in examples:
            code = "\n".join(re.findall(r"^(?:>>>|\.\.\.) ?(.*)", example, flags=re.MULTILINE))
            for short, whole in (("np", "numpy as np"), ("ss", "slipstick as ss"), ("Path", "import Path")):
                assert whole in code or not re.search(rf"\b{short}[.(]", code), f"{path}: {whole}"


def test_members_shown_in_the_reference_are_there() -> None:
    shown = runpy.run_path(str(DOCS / "conf.py"))["SHOWN"]
    for path, members in shown.items():
        module, _, name = path.rpartition(".")
        thing = getattr(import_module(module), name)
        assert path in LISTED
        assert [member for member in members.split(", ") if not hasattr(thing, member)] == [], path


def test_every_verb_is_on_the_page_of_the_command_line() -> None:
    import typer

    from slipstick.cli.main import app

    verbs = {name for name, verb in typer.main.get_command(app).commands.items() if not verb.hidden}
    named = re.findall(r"^\| `slipstick ([\w-]+)", text(DOCS / "command-line.md"), flags=re.MULTILINE)
    assert set(named) == verbs


def test_every_outcome_and_strategy_is_explained() -> None:
    from slipstick.balance import start
    from slipstick.contact.friction_law import FrictionLaw

    page = text(DOCS / "non-convergence.md")
    assert re.findall(r"^\| `([A-Z_]+)`", page, flags=re.MULTILINE) == list(ss.Outcome.__members__)
    source = text(Path(start.__file__))
    found = [*re.findall(r'yield \(?\s*f?"([^"{]+)', source), "friction ramp", "normal load ramp"]
    assert {"guess given", "load ramp", "Newton homotopy", "time integration"} <= set(found)
    for name in found:
        assert f"| {name.split(',')[0]}" in page, name
    for state in FrictionLaw.linear_states:
        assert state in page


def test_what_docstrings_cite_is_in_the_theory() -> None:
    equations = set(re.findall(r"\\tag\{([\d.]+)\}", THEORY))
    sections = set(re.findall(r"^## (\d+) ", THEORY, flags=re.MULTILINE))
    assert {e.partition(".")[0] for e in equations} == sections
    cited = 0
    for file in (ROOT / "src").rglob("*.py"):
        for mention in re.findall(r"THEORY\.md[^\n]{0,60}(?:\n[^\n]{0,40})?", text(file)):
            if mention.startswith(("THEORY.md:", "THEORY.md)")):
                continue
            found = CITED.match(mention.replace("\n", " "))
            assert found, f"{file.name}: {mention!r} names no section or equation"
            numbers = re.findall(r"\d+(?:\.\d+)?", found[0])
            cited += len(numbers)
            assert set(numbers) <= (equations if found[3] else sections), f"{file.name}: {found[0]}"
    assert cited > 40


def test_numbers_of_equations_ascend() -> None:
    numbers = [tuple(map(int, n.split("."))) for n in re.findall(r"\\tag\{([\d.]+)\}", THEORY)]
    assert numbers == sorted(set(numbers))
    for section, number in numbers:
        assert number == 1 or (section, number - 1) in numbers


def test_one_home_everywhere() -> None:
    """Addresses are said in pyproject.toml; the others follow it."""
    assert URLS["Issues"].startswith(URLS["Source"])
    assert URLS["Changelog"].startswith(URLS["Source"])
    for name in ("README.md", "CITATION.cff", "paper/paper.md"):
        assert URLS["Source"] in text(ROOT / name), name


def test_the_case_of_the_readme_is_the_example() -> None:
    (shown,) = re.findall(r"```toml\n(.*?)```", text(ROOT / "README.md"), flags=re.DOTALL)
    assert tomllib.loads(shown) == tomllib.loads(text(ROOT / "examples/oscillator/oscillator.toml"))


def test_one_version_everywhere() -> None:
    project = tomllib.loads(text(ROOT / "pyproject.toml"))["project"]
    assert ss.__version__ == project["version"]
    assert re.search(r"^version: (\S+)$", text(ROOT / "CITATION.cff"), flags=re.MULTILINE)[1] == project["version"]
    status = re.search(
        r"^\*\*Status:\*\* version (\S+), .+ Python (\S+) or later\. (\S+)\.", text(ROOT / "README.md"), re.MULTILINE
    )
    assert status.groups() == (project["version"], project["requires-python"].removeprefix(">="), project["license"])


def test_every_example_is_in_the_gallery() -> None:
    from slipstick.cli.examples import examples

    gallery = "".join(text(DOCS / name) for name in ("examples.md", "blade.md"))
    for name, example in examples().items():
        assert f"`{name}`" in gallery or f"examples/{name}.py" in gallery or f"`{example.path.name}`" in gallery, name


def test_every_figure_is_in_the_gallery() -> None:
    shown = re.findall(r"\(figures/gallery/(\w+)\.png\)", text(DOCS / "gallery.md"))
    assert sorted(shown) == sorted(set(ss.plots.__all__) - {"abscissa_text", "save_figure"})
