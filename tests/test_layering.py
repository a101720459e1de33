"""The rooms of the package, and who may import whom: nothing imports to the right, not even inside a function."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import slipstick

ROOT = Path(slipstick.__file__).parent
ORDER = (
    ("errors",),
    ("quantities",),
    ("faults", "html", "interrupts", "public_names", "replacing", "typing"),
    ("trig", "units"),
    ("solve",),
    ("contact", "structure"),
    ("state", "fem"),
    ("balance",),
    ("results",),
    ("branch",),
    ("analysis",),
    ("models", "io", "plots", "progress"),
    ("importers", "report"),
    ("studies",),
    ("verify",),
    ("case",),
    ("runs",),
    ("cli",),
    ("__main__",),
)
LEVEL = {room: level for level, rooms in enumerate(ORDER) for room in rooms}
FILES = sorted(path for path in ROOT.rglob("*.py") if path != ROOT / "__init__.py")

LAZY = "branch.py"
"""What users hold looks both ways, to its right in its methods; nothing else imports to the right at all."""


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


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_module(path: Path) -> None:
    tree, room, name = ast.parse(path.read_text(encoding="utf-8")), room_of(path), path.relative_to(ROOT).as_posix()
    assert room in LEVEL, f"{path}: the room '{room}' has no place in the order"
    wrong = [
        f"line {line}: {room} imports {other}"
        for lazily in (False, True)
        for line, other in imported_rooms(tree, path, lazily)
        if not (lazily and name == LAZY)
        if other != room and LEVEL[other] >= LEVEL[room]
    ]
    assert not wrong, f"{name}: {wrong}"


@pytest.mark.parametrize("path", sorted((ROOT / "analysis" / "road").glob("*.py")), ids=lambda path: path.name)
def test_the_road_of_all_analyses_knows_none(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imported = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    analyses = [name for name in imported if name.startswith("slipstick.analysis.")]
    assert not [name for name in analyses if not name.startswith("slipstick.analysis.road.")]


def test_checker_sees_a_wrong_import() -> None:
    """The checker itself: a module-level import to the right is seen, one inside a function or for types is lazy."""
    source = (
        "from typing import TYPE_CHECKING\n"
        "from slipstick.analysis.curve.response import follow\n"
        "from ..balance import problem\n"
        "import slipstick.io.store\n"
        "from slipstick import plots\n"
        "if TYPE_CHECKING:\n    from slipstick.cli import main\n"
        "def late() -> None:\n    from slipstick.verify import table\n"
    )
    tree, path = ast.parse(source), ROOT / "trig" / "x.py"
    assert [room for _, room in imported_rooms(tree, path, lazily=False)] == ["analysis", "balance", "io", "plots"]
    assert [room for _, room in imported_rooms(tree, path, lazily=True)] == ["verify"]
