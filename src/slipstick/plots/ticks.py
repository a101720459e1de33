"""Lengths in metres on an axis: as millimetres or micrometres where they are small."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.ticker import Formatter, LogFormatterSciNotation, MaxNLocator

from slipstick.units import length_shown

METRES = "[m]"
_PREFIXED = ("[mm]", "[µm]")
_LETTER, _GAP = 0.65, 1.0
"""Width of a digit, and what is left between two texts, in heights of a letter."""


class Roomy(MaxNLocator):
    """Ticks at 1, 2 and 5 times powers of ten along an x axis, as many as their texts leave a gap between."""

    axis: Any

    def __init__(self) -> None:
        super().__init__(steps=[1, 2, 5, 10])

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """The ticks of a range."""
        thirds = self.axis.get_tick_space()  # of the room, in heights of a letter
        ticks: Any = []
        for most in range(min(9, max(thirds, 2)), 1, -1):
            self.set_params(nbins=most)
            ticks = super().tick_values(vmin, vmax)
            texts = self.axis.get_major_formatter().format_ticks(ticks)
            inside = [text for text, tick in zip(texts, ticks, strict=True) if vmin <= tick <= vmax]
            if sum(_LETTER * len(text) + _GAP for text in inside) <= 3 * thirds:
                break
        return ticks


class Lengths(Formatter):
    """Ticks of an axis whose ``label`` ends in "[m]"; values stay metres, the label names the unit they are shown in.

    That of the ``largest`` length, which results tell, else that of the visible range.
    """

    axis: Any

    def __init__(self, label: str, largest: float = 0.0) -> None:
        self.label, self.largest = label, largest

    @property
    def texts(self) -> list[str]:
        """The label with each of the units that it may name."""
        return [self.label.replace(METRES, name) for name in (METRES, *_PREFIXED)]

    def _unit(self) -> tuple[float, str]:
        if not self._labelled:
            return 1.0, METRES
        factor, name = length_shown("m", self.largest or max(map(abs, self.axis.get_view_interval())))
        return factor, f"[{name}]"

    @property
    def _labelled(self) -> bool:
        """Whether the axis still has this label; ticks under a label of the user are metres."""
        return self.axis.label.get_text() in self.texts

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """The texts of all ticks, which are about to be drawn: labels follow, those of axes that share them too."""
        text = self.label.replace(METRES, self._unit()[1])
        for axis in _sharing(self.axis):
            if axis.label.get_text() in self.texts:
                axis.label.set_text(text)
        return [self(value) for value in values]

    def __call__(self, x: float, pos: int | None = None) -> str:
        """One value."""
        return f"{x * self._unit()[0]:.10g}".replace("-", "\N{MINUS SIGN}")


def _sharing(axis: Any) -> list[Any]:
    """The axis of a figure and those that share its ticks, and so what writes their texts."""
    ax, name = axis.axes, f"{axis.axis_name}axis"
    siblings = getattr(ax, f"get_shared_{axis.axis_name}_axes")().get_siblings(ax)
    return [getattr(each, name) for each in siblings]


class _BetweenDecades(Lengths):
    """Ticks between powers of ten."""

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """The texts of those that are named."""
        return _named(self.axis, values, super().format_ticks(values))


class _Numbers(LogFormatterSciNotation):
    """Plain numbers where an axis shows less than two decades, else powers of ten."""

    axis: Any

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """The texts of those that are named."""
        low, high = self.axis.get_view_interval()
        plain = [f"{value:.6g}" for value in values]
        return _named(self.axis, values, plain if high < 100.0 * low else super().format_ticks(list(values)))


def _named(axis: Any, values: Sequence[float], texts: Sequence[str]) -> list[str]:
    """Texts by their leading digit: the fewer powers of ten an axis shows, the more ticks between them are named."""
    low, high = axis.get_view_interval()
    digits = next((d for span, d in ((5.0, "123456789"), (20.0, "1235"), (100.0, "125")) if high < span * low), "1")
    return [text if f"{value:.0e}"[0] in digits else "" for value, text in zip(values, texts, strict=True)]


def log_scale(ax: Any, name: str, **options: Any) -> None:
    """Give the axis "x" or "y" a logarithmic scale, with ticks whose texts do not touch."""
    axis = getattr(ax, f"{name}axis")
    largest = getattr(axis.get_major_formatter(), "largest", 0.0)
    getattr(ax, f"set_{name}scale")("log", **options)
    label = axis.get_label_text()
    metres = label.endswith(METRES)
    axis.set_major_formatter(Lengths(label, largest) if metres else _Numbers())
    axis.set_minor_formatter(_BetweenDecades(label, largest) if metres else _Numbers())


def show_lengths(axis: Any, largest: float) -> None:
    """Show lengths on an axis in metres in the unit of the ``largest`` one of the results, here and drawn before."""
    for numbers in (axis.get_major_formatter(), axis.get_minor_formatter()):
        if isinstance(numbers, Lengths):
            numbers.largest = max(numbers.largest, largest)
