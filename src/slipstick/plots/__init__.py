"""Figures of branches: every function takes a branch (or its dataset) and returns matplotlib Axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from slipstick.public_names import on_first_use

_FIGURES = {
    "curves": "response phase mean power friction temperature fractions stability compare",
    "points": "loop loops orbit states history spectrum",
    "discs": "disc blades",
    "fits": "fit",
    "preloaded": "preload",
    "tolerances": "tolerance_band tornado",
    "modes": "backbone damping campbell interference",
    "worn": "wear worn_surface",
    "stresses": "haigh",
    "interfaces": "interface",
    "passing": "run_up section spectrogram",
    "study": "study_map study_curves percentile_band percentile_convergence amplification_histogram worst_disc",
    "quantities": "abscissa_text",
    "style": "save_figure",
}
"""Public functions by file."""
_PUBLIC = {name: f"slipstick.plots.{file}" for file, names in _FIGURES.items() for name in names.split()}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:  # the same names for editors and type checkers
    from slipstick.plots.curves import compare as compare
    from slipstick.plots.curves import fractions as fractions
    from slipstick.plots.curves import friction as friction
    from slipstick.plots.curves import mean as mean
    from slipstick.plots.curves import phase as phase
    from slipstick.plots.curves import power as power
    from slipstick.plots.curves import response as response
    from slipstick.plots.curves import stability as stability
    from slipstick.plots.curves import temperature as temperature
    from slipstick.plots.discs import blades as blades
    from slipstick.plots.discs import disc as disc
    from slipstick.plots.fits import fit as fit
    from slipstick.plots.interfaces import interface as interface
    from slipstick.plots.modes import backbone as backbone
    from slipstick.plots.modes import campbell as campbell
    from slipstick.plots.modes import damping as damping
    from slipstick.plots.modes import interference as interference
    from slipstick.plots.passing import run_up as run_up
    from slipstick.plots.passing import section as section
    from slipstick.plots.passing import spectrogram as spectrogram
    from slipstick.plots.points import history as history
    from slipstick.plots.points import loop as loop
    from slipstick.plots.points import loops as loops
    from slipstick.plots.points import orbit as orbit
    from slipstick.plots.points import spectrum as spectrum
    from slipstick.plots.points import states as states
    from slipstick.plots.preloaded import preload as preload
    from slipstick.plots.quantities import abscissa_text as abscissa_text
    from slipstick.plots.stresses import haigh as haigh
    from slipstick.plots.study import amplification_histogram as amplification_histogram
    from slipstick.plots.study import percentile_band as percentile_band
    from slipstick.plots.study import percentile_convergence as percentile_convergence
    from slipstick.plots.study import study_curves as study_curves
    from slipstick.plots.study import study_map as study_map
    from slipstick.plots.study import worst_disc as worst_disc
    from slipstick.plots.style import save_figure as save_figure
    from slipstick.plots.tolerances import tolerance_band as tolerance_band
    from slipstick.plots.tolerances import tornado as tornado
    from slipstick.plots.worn import wear as wear
    from slipstick.plots.worn import worn_surface as worn_surface


__getattr__, __dir__ = on_first_use("slipstick.plots", _PUBLIC)
