"""The examples that come with the program: the folder ``examples`` of the source, carried by the installation."""

from __future__ import annotations

import ast
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import slipstick
from slipstick.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Example:
    """One example: a case file, or a script, with the files it needs beside it."""

    name: str
    about: str
    """What it shows, one line."""
    path: Path
    needs: tuple[Path, ...] = ()

    @property
    def is_case(self) -> bool:
        """Whether it is a case file."""
        return self.path.suffix == ".toml"


def folder() -> Path:
    """Where the examples lie: with the installed package, or in the source tree it is run from."""
    package = Path(slipstick.__file__).parent
    places = (package / "examples", package.parent.parent / "examples")
    place = next((place for place in places if place.is_dir()), None)
    if place is None:
        raise InputError(f"{places[0]}: the examples are missing from this installation; install slipstick again")
    return place


def examples() -> dict[str, Example]:
    """All examples by name: cases as "blade", then scripts as "oscillator/constant_velocity"."""
    cases = [_case(path) for path in sorted(folder().glob("*/*.toml"))]
    scripts = [_script(path) for path in sorted(folder().glob("*/*.py")) if "__main__" in path.read_text("utf-8")]
    return {example.name: example for example in (*cases, *scripts)}


def example(name: str) -> Example:
    """The example of a name; InputError with a suggestion where there is none."""
    known = examples()
    from slipstick.faults import suggestion

    wanted = name.removesuffix(".toml").removesuffix(".py")
    if wanted not in known:
        raise InputError(f"there is no example '{name}'; {suggestion(wanted, list(known))}")
    return known[wanted]


def _case(path: Path) -> Example:
    text = path.read_text(encoding="utf-8")
    named = {value for value in _texts(tomllib.loads(text)) if (path.parent / value).is_file()}
    needs = tuple(path.parent / name for name in sorted(named))
    return Example(name=path.stem, about=text.splitlines()[0].lstrip("# "), path=path, needs=needs)


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _texts(inner)


@cache
def _script(path: Path) -> Example:
    about = (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "").splitlines()[0]
    needs = tuple(sorted(_beside(path, {path}) - {path}))
    return Example(name=f"{path.parent.name}/{path.stem}", about=about, path=path, needs=needs)


def _beside(path: Path, known: set[Path]) -> set[Path]:
    """The modules in the folder of a script that it imports, and the files it names, with all they need."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else [node.module or ""]
            names |= {f"{module}.py" for module in modules}
    files = {path.parent / name for name in names if "\0" not in name and len(name) < 100 and "\n" not in name}
    for new in {file for file in files if file.is_file()} - known:
        known.add(new)
        if new.suffix == ".py":
            _beside(new, known)
    return known
