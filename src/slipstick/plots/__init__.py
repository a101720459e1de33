"""Figures of branches: every function takes a branch (or its dataset) and returns matplotlib Axes."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_FIGURES = {
    "curves": "response phase mean power friction temperature fractions stability compare",
    "points": "loop loops orbit states history spectrum",
    "discs": "disc blades",
    "fits": "fit",
    "tolerances": "tolerance_band tornado",
    "modes": "backbone damping",
    "worn": "wear worn_surface",
    "stresses": "haigh",
    "passing": "run_up section spectrogram",
    "rotor": "campbell interference",
    "study": "study_map study_curves percentile_band percentile_convergence",
    "quantities": "abscissa_text",
    "style": "save_figure",
}
"""Public functions by file."""
_PUBLIC = {name: f"slipstick.plots.{file}" for file, names in _FIGURES.items() for name in names.split()}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'slipstick.plots' has no attribute '{name}'")
    return getattr(import_module(_PUBLIC[name]), name)
