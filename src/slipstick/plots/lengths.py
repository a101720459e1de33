"""Lengths in metres on an axis: as millimetres or micrometres where they are small."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.ticker import Formatter

METRES = "[m]"
_SMALLER = ((1e-4, 1e6, "[µm]"), (0.1, 1e3, "[mm]"))
"""Below which largest value on the axis, factor and name of a unit."""


class Lengths(Formatter):
    """Ticks of an axis whose ``label`` ends in "[m]"; values stay metres, the label follows what is in view."""

    axis: Any

    def __init__(self, label: str) -> None:
        self._label = label

    def _unit(self) -> tuple[float, str]:
        if not self._labelled:
            return 1.0, METRES
        largest = max(map(abs, self.axis.get_view_interval()))
        return next(((factor, name) for below, factor, name in _SMALLER if largest < below), (1.0, METRES))

    @property
    def _labelled(self) -> bool:
        """Whether the axis still has this label; ticks under a label of the user are metres."""
        names = (METRES, *(name for _, _, name in _SMALLER))
        return self.axis.label.get_text() in [self._label.replace(METRES, name) for name in names]

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """The texts of all ticks, which are about to be drawn: the label follows."""
        if self._labelled:
            self.axis.label.set_text(self._label.replace(METRES, self._unit()[1]))
        return [self(value) for value in values]

    def __call__(self, x: float, pos: int | None = None) -> str:
        """One value."""
        return f"{x * self._unit()[0]:.10g}".replace("-", "\N{MINUS SIGN}")


class _BetweenDecades(Lengths):
    """Some ticks between powers of ten, where there are hardly any of these."""

    def format_ticks(self, values: Sequence[float]) -> list[str]:
        """Of 2, 3 and 5 times a power of ten."""
        low, high = self.axis.get_view_interval()
        shown = [high < 20.0 * low and f"{value:.0e}"[0] in "235" for value in values]
        return [text if seen else "" for text, seen in zip(super().format_ticks(values), shown, strict=True)]


def on_log_axis(axis: Any) -> None:
    """Lengths on a logarithmic axis, whose scale has just been set."""
    label = axis.get_label_text()
    if label.endswith(METRES):
        axis.set_major_formatter(Lengths(label))
        axis.set_minor_formatter(_BetweenDecades(label))
