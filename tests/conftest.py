"""Makes what several rooms' tests share importable, ``from helpers.cases import ...``; everything is compiled once."""

import gc
import os
import sys
from collections.abc import Generator, Iterator
from functools import cache
from pathlib import Path

import pytest
import typer.testing
from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))
from helpers.sampling import sample

settings.register_profile("any machine", deadline=None)  # how long one example takes is not what is tested
settings.load_profile("any machine")

# the runner makes the commands from their signatures again for each call, which takes as long as many of the calls do
typer.testing._get_command = cache(typer.testing._get_command)


os.environ["MPLBACKEND"] = "agg"  # no windows


@pytest.fixture(autouse=True)
def _no_figures_left() -> Iterator[None]:
    """Figures are pyplot's, which keeps them until they are closed."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


def pytest_configure(config: pytest.Config) -> None:
    """Compile before there are workers, each of which would do so for itself."""
    if getattr(config.option, "numprocesses", None) and not config.option.collectonly:
        _compile()


def pytest_report_header() -> list[str]:
    """What a run that is repeated has to set."""
    names = ("SLIPSTICK_SEED", "SLIPSTICK_PART")
    return [f"{name}={os.environ[name]}" for name in names if os.environ.get(name)]


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keep what is drawn of sampled families, and of that the part that is asked for."""
    kept = _part(_drawn(items))
    if len(kept) < len(items):
        config.hook.pytest_deselected(items=[item for item in items if item not in set(kept)])
        items[:] = kept


def _drawn(items: list[pytest.Item]) -> list[pytest.Item]:
    families: dict[tuple[str, int], list[pytest.Item]] = {}
    for item in items:
        mark = item.get_closest_marker("verify")
        if mark and "sample" in mark.kwargs:
            families.setdefault((item.nodeid.split("[")[0], mark.kwargs["sample"]), []).append(item)
    left: set[pytest.Item] = set()
    for (_, count), family in families.items():
        left |= set(family) - set(sample(family, count, name=lambda item: item.nodeid))
    return [item for item in items if item not in left]


def _part(items: list[pytest.Item]) -> list[pytest.Item]:
    """With SLIPSTICK_PART=2/5 the second of five: every fifth file, or every fifth test where they are of one file."""
    if not (part := os.environ.get("SLIPSTICK_PART")):
        return items
    number, parts = (int(word) for word in part.split("/"))
    places = list(dict.fromkeys(item.path for item in items))
    which = [i if len(places) == 1 else places.index(item.path) for i, item in enumerate(items)]
    return [item for item, i in zip(items, which, strict=True) if i % parts == number - 1]


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Nothing that is collected is garbage, now or later."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def _compile() -> None:
    """The kernel, and what of it tests call by itself; what is compiled already is read."""
    from slipstick.balance.kernel.compilation import compile_all
    from slipstick.trig.harmonics import Harmonics
    from slipstick.trig.integrals import interval_integrals
    from slipstick.trig.roots import roots

    compile_all()
    h = Harmonics([0, 1])
    roots(h, [0.0, 1.0, 0.0])
    interval_integrals(h, 0.0, 1.0)
