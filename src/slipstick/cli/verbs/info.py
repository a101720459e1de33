"""The verb ``info``: what a bug report needs."""

from __future__ import annotations

import os
import platform

from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say
from slipstick.cli.verb import verb

_PACKAGES = ("numpy", "scipy", "numba", "xarray", "h5netcdf", "h5py", "pydantic", "typer", "rich", "matplotlib")


def all_versions() -> dict[str, str]:
    """Versions of this package, Python and what it computes with."""
    from importlib.metadata import PackageNotFoundError, version  # which no other verb needs

    from slipstick import __version__

    versions = {"slipstick": __version__, "python": platform.python_version()}
    for name in _PACKAGES:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "missing"
    return versions


@verb
def info(answer: Answer) -> None:
    """Versions, platform, threads, and whether the contact kernel is compiled."""
    from slipstick.contact.kernel.compilation import COMPILE_TIME, is_compiled
    from slipstick.studies.workers import cores
    from slipstick.trig.compiled import cache_folder

    answer["versions"] = all_versions()
    answer |= {"platform": platform.platform(), "processors": cores()}
    answer["kernel"] = {"compiled": is_compiled(), "cache": cache_folder()}
    for name, number in all_versions().items():
        say(f"{name:<12} {number}")
    say(f"{'platform':<12} {platform.platform()}")
    threads = os.environ.get("NUMBA_NUM_THREADS") or os.environ.get("OMP_NUM_THREADS")
    say(f"{'threads':<12} {cores()} processors" + (f", limited to {threads} by the environment" * bool(threads)))
    state = "compiled" if is_compiled() else f"not compiled yet ({COMPILE_TIME}, once, at the first run)"
    say(f"{'kernel':<12} {state}; cache in {cache_folder()}")
