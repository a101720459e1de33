"""Figures of branches: every function takes a branch (or its dataset) and returns matplotlib Axes."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_PUBLIC = {
    "response": "slipstick.plots.curves",
    "phase": "slipstick.plots.curves",
    "mean": "slipstick.plots.curves",
    "power": "slipstick.plots.curves",
    "friction": "slipstick.plots.curves",
    "temperature": "slipstick.plots.curves",
    "fractions": "slipstick.plots.shares",
    "loop": "slipstick.plots.hysteresis",
    "loops": "slipstick.plots.hysteresis",
    "states": "slipstick.plots.points",
    "history": "slipstick.plots.points",
    "spectrum": "slipstick.plots.points",
    "stability": "slipstick.plots.multipliers",
    "tolerance_band": "slipstick.plots.tolerances",
    "tornado": "slipstick.plots.tolerances",
    "campbell": "slipstick.plots.rotor",
    "backbone": "slipstick.plots.modes",
    "damping": "slipstick.plots.modes",
    "compare": "slipstick.plots.comparison",
    "study_map": "slipstick.plots.study",
    "study_curves": "slipstick.plots.study",
    "abscissa_text": "slipstick.plots.quantities",
    "save_figure": "slipstick.plots.style",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'slipstick.plots' has no attribute '{name}'")
    return getattr(import_module(_PUBLIC[name]), name)
