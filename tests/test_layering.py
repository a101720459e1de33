"""The rooms of the package, who may import whom, and how large files and functions may grow."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

import slipstick

ROOT = Path(slipstick.__file__).parent
TESTS = Path(__file__).parent
WHOLE = ("consistency", "convergence", "hostile")
"""Folders with tests of whole problems."""
ORDER = (
    ("errors",),
    ("faults", "html", "interrupts", "replacing", "typing"),
    ("trig", "solve", "units"),
    ("contact", "structure"),
    ("thermal", "fem"),
    ("balance",),
    ("results",),
    ("analysis",),
    ("models", "io", "plots"),
    ("importers", "report"),
    ("studies",),
    ("verify",),
    ("app",),
    ("__main__",),
)
LEVEL = {room: level for level, rooms in enumerate(ORDER) for room in rooms}
FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")

LAZY = "results/verbs.py"
"""Conveniences of results that come from later rooms; nothing else imports to the right, not even in a function."""

FILE_LINES = 400
FUNCTION_LINES = 60
PARAMETERS = 8
FACADE = {
    "analysis/response.py": {"forced_response", "parameter_response"},
    "studies/study.py": {"study"},
    "analysis/transient.py": {"transient", "integrate"},
    "app/cli.py": {"study", "import_", "run"},
    "balance/loads.py": {"__init__"},
    "importers/import_model.py": {"import_model"},
    "models/blade.py": {"reduced_blade"},
    "models/reduced_body.py": {"reduced_body", "_wanted"},
    "models/surface_contacts.py": {"surface_contacts"},
    "solve/continuation/follow.py": {"continuation"},
    "solve/continuation/path.py": {"__init__"},
    "structure/modal.py": {"__init__"},
    "structure/reduction/reduce.py": {"reduce", "reduce_model"},
    "structure/reduction/request.py": {"checked_request"},
    "results/measures.py": {"friction_force"},
    "importers/ansys/materials.py": {"_property"},
}
"""Functions with more parameters than that: what users call with keywords, and what takes these keywords over."""

BOTH_WAYS = {("results.branch", "results.verbs"), ("verify", "verify.table")}
"""Pairs of files that know each other: a branch and its conveniences; the table and the rows that fill it."""

UNTESTED = {
    "__main__.py": "starts the command line",
    "typing.py": "names of types",
    "contact/kernel/tuples.py": "names of fields and codes",
    "solve/linear/jacobian.py": "a protocol",
    "structure/protocol.py": "protocols",
}
"""Files without logic of their own, which need no tests of their own."""

BY_OTHERS = {
    "app": "verbs and tables are tested by what they print: cases, the command line, hostile input",
    "verify": "each row of the table is a test",
    "solve/continuation": "test_path.py: the parts of a step, by the branches they follow",
    "balance/factored.py": "test_contact_jacobian.py, against the dense Jacobian",
    "balance/preconditioner.py": "test_contact_jacobian.py, by the products it saves",
    "solve/newton/result.py": "test_iteration.py, which makes them",
    "solve/newton/system.py": "test_iteration.py",
    "solve/linear/lanczos.py": "test_eigen.py, by the modes it finds",
    "solve/linear/pardiso.py": "test_factorisation.py, where it is installed",
    "structure/reduction/compute.py": "test_reduce.py, which calls it",
    "structure/reduction/request.py": "test_reduce.py, by what it refuses",
    "balance/notebook.py": "test_html.py, as every table that a notebook shows",
    "results/notebook.py": "test_html.py",
    "io/notes.py": "app/verbs/test_resume.py, by runs that go on",
    "importers/abaqus/content.py": "test_input_file.py, which fills it",
    "importers/nastran/lumps.py": "nastran/test_couplings.py, beside what ties points",
}
"""Files, or folders, that are tested through another one, and where."""

COMPILED_LINES = 160  # a compiled loop cannot call out as freely


def room_of(path: Path) -> str:
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imported_rooms(tree: ast.Module, path: Path, lazily: bool) -> Iterator[tuple[int, str]]:
    """Rooms imported when the module loads, or (lazily) inside its functions; type-checking blocks do not run."""
    package = ("slipstick", *path.relative_to(ROOT).parts[:-1])
    for node in _walk(tree, lazily):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            names = [f"{module}.{alias.name}" for alias in node.names] if module == "slipstick" else [module]
        for name in names:
            head, *rest = name.split(".")
            if head == "slipstick" and rest and rest[0] in LEVEL:
                yield node.lineno, rest[0]


def _walk(node: ast.AST, lazily: bool, inside: bool = False) -> Iterator[ast.AST]:
    """Statements; expressions hold no imports."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, (ast.stmt, ast.excepthandler, ast.match_case)):
            continue
        if isinstance(child, ast.If) and "TYPE_CHECKING" in ast.unparse(child.test):
            continue
        within = inside or isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef))
        if inside == lazily:
            yield child
        yield from _walk(child, lazily, within)


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    body = function.body[1:] if ast.get_docstring(function) and len(function.body) > 1 else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1


def is_compiled(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return any("jit" in ast.unparse(decorator) for decorator in function.decorator_list)


@dataclass(frozen=True, kw_only=True)
class File:
    """What the tests ask of a file, so that it is parsed once; trees of all files would weigh on every test after."""

    lines: int
    rooms: dict[bool, list[tuple[int, str]]]
    """Rooms imported with the line, at once (False) and lazily (True)."""
    modules: set[str]
    packages: set[str]
    public: set[str]
    wide: set[str]
    """Functions with more parameters than ``PARAMETERS``."""
    long: list[str]
    """Functions that are too long, and how long."""


@cache
def read(path: Path) -> File:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    functions = [node for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))]
    return File(
        lines=text.count("\n"),
        rooms={lazily: list(imported_rooms(tree, path, lazily)) for lazily in (False, True)},
        modules=set(imported_modules(tree)),
        packages=set(_external(tree)),
        public=set(public_names(tree)),
        wide={function.name for function in functions if parameters(function) > PARAMETERS},
        long=[f"{function.name}: {body_lines(function)} lines" for function in functions if is_long(function)],
    )


def is_long(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    return body_lines(function) > (COMPILED_LINES if is_compiled(function) else FUNCTION_LINES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_module(path: Path) -> None:
    file, room, name = read(path), room_of(path), path.relative_to(ROOT).as_posix()
    assert room in LEVEL, f"{path}: the room '{room}' has no place in the order"
    wrong = [
        f"line {line}: {room} imports {other}"
        for lazily, rooms in file.rooms.items()
        for line, other in rooms
        if not (lazily and name == LAZY)
        if other != room and LEVEL[other] >= LEVEL[room]
    ]
    assert not wrong, f"{name}: {wrong}"
    assert file.lines <= FILE_LINES, f"{name} has {file.lines} lines"
    assert not file.long, f"{name}: {file.long}"
    wide = file.wide - FACADE.get(name, set())
    assert not wide, f"{name}: more than {PARAMETERS} parameters: {sorted(wide)}"


def parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    own = [a.arg for a in (*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs)]
    return len([name for name in own if name not in ("self", "cls")])


def test_no_two_files_import_each_other() -> None:
    known = {module_of(path): path for path in FILES}
    uses = {name: read(path).modules & known.keys() for name, path in known.items()}
    pairs = {(a, b) for a in known for b in uses[a] if a < b and a in uses[b]}
    rows = {pair for pair in pairs if pair[1] == "verify.table" and pair[0].startswith("verify.")}
    assert pairs - rows <= BOTH_WAYS


def module_of(path: Path) -> str:
    """Name after the package: "solve.newton"; a room's ``__init__`` is the room."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imported_modules(tree: ast.Module) -> Iterator[str]:
    """Modules of this package that a file imports when it runs, lazily or not."""
    for lazily in (False, True):
        for node in _walk(tree, lazily):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("slipstick."):
                own = str(node.module).removeprefix("slipstick.")
                yield own
                yield from (f"{own}.{alias.name}" for alias in node.names)


def test_rooms_of_the_application_keep_their_order() -> None:
    """Case files know nothing of verbs and terminals, the terminal nothing of verbs."""
    later = {"case": ("terminal", "verbs", "cli"), "terminal": ("verbs", "cli"), "verbs": ("cli",)}
    for room, rooms in later.items():
        found = [
            f"{path.name} imports {name}"
            for path in (ROOT / "app" / room).glob("*.py")
            for name in read(path).modules
            if name.startswith(tuple(f"app.{other}" for other in rooms))
        ]
        assert not found


def test_tests_mirror_the_package() -> None:
    """Each file has its tests at the same place, and each test of a room a file that it tests."""
    files = {path.relative_to(ROOT).as_posix() for path in FILES if path.name != "__init__.py"}
    tested = {
        (path.parent / path.name.removeprefix("test_")).relative_to(TESTS).as_posix()
        for path in TESTS.rglob("test_*.py")
    }
    missing = files - tested - UNTESTED.keys()
    assert {path for path in missing if not _by_another(path)} == set()
    assert set() == UNTESTED.keys() & tested, "these have tests now"
    rooms = {path for path in tested if "/" in path and path.partition("/")[0] not in (*WHOLE, "app")}
    folders = {path.with_suffix(".py").relative_to(ROOT).as_posix() for path in ROOT.rglob("*") if path.is_dir()}
    assert rooms <= files | folders, "tests of whole problems stand in consistency/, convergence/ or hostile/"


def _by_another(path: str) -> bool:
    return path in BY_OTHERS or any(path.startswith(f"{folder}/") for folder in BY_OTHERS)


def test_a_name_means_one_thing() -> None:
    """No public class, function or constant stands in two files; a verb of the terminal is called as it is typed."""
    places: dict[str, set[str]] = {}
    for path in FILES:
        for name in read(path).public:
            places.setdefault(name, set()).add(path.relative_to(ROOT).as_posix())
    twice = {name: found for name, found in places.items() if len(found - VERBS) > 1}
    assert not twice


VERBS = {"app/cli.py"}


def public_names(tree: ast.Module) -> Iterator[str]:
    """Names defined at the top of a file; single capitals are type variables."""
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names = [node.name]
        elif isinstance(node, ast.Assign):
            names = [name.id for target in node.targets for name in ast.walk(target) if isinstance(name, ast.Name)]
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names = [node.target.id]
        else:
            continue
        yield from (name for name in names if not name.startswith("_") and len(name) > 1)


def test_compiled_code_stays_in_its_rooms() -> None:
    """Only contact and trig import numba, so that everything else can be read and stepped through."""
    users = {room_of(path) for path in FILES if "numba" in read(path).packages}
    assert users <= {"contact", "trig"}


def test_checker_sees_a_wrong_import() -> None:
    """The checker itself: a module-level import to the right is seen, one inside a function or for types is lazy."""
    source = (
        "from typing import TYPE_CHECKING\n"
        "from slipstick.analysis.response import follow\n"
        "from ..balance import problem\n"
        "import slipstick.io.store\n"
        "from slipstick import plots\n"
        "if TYPE_CHECKING:\n    from slipstick.app import cli\n"
        "def late() -> None:\n    from slipstick.verify import table\n"
    )
    tree, path = ast.parse(source), ROOT / "trig" / "x.py"
    assert [room for _, room in imported_rooms(tree, path, lazily=False)] == ["analysis", "balance", "io", "plots"]
    assert [room for _, room in imported_rooms(tree, path, lazily=True)] == ["verify"]


def _external(tree: ast.Module) -> Iterator[str]:
    """Packages that a file imports, for types too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.split(".")[0]
