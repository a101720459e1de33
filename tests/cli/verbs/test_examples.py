"""The examples travel with the program: one folder, and the wheel and the sdist carry it."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

import slipstick
from slipstick.cli import examples as module
from slipstick.cli.examples import example, examples, folder
from slipstick.errors import InputError

ROOT = Path(__file__).parents[3]


def test_every_case_and_script_is_offered() -> None:
    files = set(folder().glob("*/*.toml"))
    offered = {found.path: found for found in examples().values()}
    assert files <= set(offered)
    assert len(offered) == len(list(folder().glob("*/*.toml"))) + len([e for e in offered.values() if not e.is_case])
    used = set(offered) | {need for found in offered.values() for need in found.needs}
    assert {path for path in folder().glob("*/*.*") if path.suffix in (".toml", ".py", ".npz", ".inp")} == used


def test_names_of_cases_are_not_used_twice() -> None:
    stems = [path.stem for path in folder().glob("*/*.toml")]
    assert len(set(stems)) == len(stems)


def test_the_wheel_and_the_sdist_carry_the_folder() -> None:
    build = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"]
    assert "examples" in build["wheel"]["only-include"]
    assert build["wheel"]["sources"]["examples"] == "slipstick/examples"
    assert "examples" in build["sdist"]["include"]


def test_an_installation_looks_beside_its_modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slipstick, "__file__", str(tmp_path / "site" / "slipstick" / "__init__.py"))
    with pytest.raises(InputError, match="examples are missing"):
        module.folder()
    (tmp_path / "site" / "slipstick" / "examples" / "one").mkdir(parents=True)
    (tmp_path / "site" / "slipstick" / "examples" / "one" / "a.toml").write_text(
        '# About\nfile = "b.npz"\nc = ["d", 1]\n'
    )
    (tmp_path / "site" / "slipstick" / "examples" / "one" / "b.npz").write_text("")
    found = example("a")
    assert (found.about, [path.name for path in found.needs]) == ("About", ["b.npz"])


def test_an_unknown_name_has_a_suggestion() -> None:
    with pytest.raises(InputError, match="there is no example 'blde'; did you mean 'blade'"):
        example("blde")
