"""Constraints for pip that pin every dependency in pyproject.toml to its lower bound: what `make lowest` installs."""

import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())
groups = [project["project"]["dependencies"], *project["project"]["optional-dependencies"].values()]
groups += project["dependency-groups"].values()
for requirement in sorted({requirement for group in groups for requirement in group}):
    what, semicolon, marker = requirement.partition(";")
    name, bound, version = what.partition(">=")
    if not bound:
        raise SystemExit(f"pyproject.toml: {requirement!r} has no lower bound (name>=version)")
    name, _, _ = name.partition("[")  # constraints have no extras
    print(f"{name}=={version}{semicolon}{marker}")
