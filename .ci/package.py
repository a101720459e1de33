"""What lies in dist/ is what should be published: one wheel and one sdist of the version, complete and small."""

import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
VERSION = PROJECT["version"]
LARGEST = {"wheel": 2e6, "sdist": 8e6, "file": 1e6}


def in_wheel(path: Path) -> dict[str, int]:
    """Names and sizes."""
    with zipfile.ZipFile(path) as archive:
        return {item.filename: item.file_size for item in archive.infolist()}


def in_sdist(path: Path) -> dict[str, int]:
    """Names and sizes, without the folder that holds them."""
    with tarfile.open(path) as archive:
        return {item.name.partition("/")[2]: item.size for item in archive.getmembers() if item.isfile()}


def sources(folder: str) -> set[str]:
    """Every file of a folder of the tree, but for what running leaves there."""
    found = (p for p in (ROOT / folder).rglob("*") if p.is_file())
    left = ("__pycache__", "slipstick-cache", "-results", ".ipynb_checkpoints", "_build")
    return {p.relative_to(ROOT).as_posix() for p in found if not any(name in p.as_posix() for name in left)}


def faults(wheel: dict[str, int], sdist: dict[str, int]) -> list[str]:
    """Everything that is missing, too much or too large, one sentence each."""
    package = {name.removeprefix("src/") for name in sources("src")} | {
        f"slipstick/{name}" for name in sources("examples")
    }
    package.discard("slipstick/examples/demo.py")  # runs on a clone
    info = f"slipstick-{VERSION}.dist-info/"
    wanted = package | {info + name for name in ("METADATA", "RECORD", "WHEEL", "entry_points.txt")}
    licences = {p.relative_to(ROOT).as_posix() for pattern in PROJECT["license-files"] for p in ROOT.glob(pattern)}
    wanted |= {f"{info}licenses/{name}" for name in licences}
    found = [f"wheel: {name} is missing" for name in sorted(wanted - set(wheel))]
    found += [f"wheel: {name} does not belong there" for name in sorted(set(wheel) - wanted)]
    needed = {
        "pyproject.toml",
        "README.md",
        "CONTRIBUTING.md",
        "LICENSE",
        "CHANGELOG.md",
        "CITATION.cff",
        "Makefile",
        "PKG-INFO",
    }
    needed |= sources("src") | sources("tests") | sources("docs") | sources("examples") | sources("paper")
    found += [f"sdist: {name} is missing" for name in sorted(needed - set(sdist))]
    for where, files in (("wheel", wheel), ("sdist", sdist)):
        found += [f"{where}: {name} has {size} bytes" for name, size in files.items() if size > LARGEST["file"]]
    assert "slipstick/py.typed" in package
    return found


def main() -> int:
    """1 if something is wrong."""
    dist = ROOT / "dist"
    (wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    found = faults(in_wheel(wheel), in_sdist(sdist))
    for name, path in (("wheel", wheel), ("sdist", sdist)):
        if f"slipstick-{VERSION}" not in path.name:
            found.append(f"{path.name} is not of version {VERSION}")
        if path.stat().st_size > LARGEST[name]:
            found.append(f"{path.name} has {path.stat().st_size} bytes")
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
    print("\n".join(found) or "complete")
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
