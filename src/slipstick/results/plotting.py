"""Figures of one branch, as ``branch.plot.response("x")``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from slipstick.results.branch import Branch


class BranchPlots:
    """Each figure returns its Axes; options are those of ``slipstick.plots``."""

    def __init__(self, branch: Branch) -> None:
        self._branch = branch

    def response(self, dof: str | None = None, **options: Any) -> Axes:
        """Amplitude over the followed quantity."""
        from slipstick.plots.curves import response

        return response(self._branch, dof, **options)

    def mean(self, dof: str | None = None, **options: Any) -> Axes:
        """Zero harmonic."""
        from slipstick.plots.curves import mean

        return mean(self._branch, dof, **options)

    def power(self, contact: str | None = None, **options: Any) -> Axes:
        """Dissipated power, of one contact or all together."""
        from slipstick.plots.curves import power

        return power(self._branch, contact, **options)

    def friction(self, contact: str | None = None, **options: Any) -> Axes:
        """Friction coefficient."""
        from slipstick.plots.curves import friction

        return friction(self._branch, contact, **options)

    def temperature(self, contact: str | None = None, **options: Any) -> Axes:
        """Contact temperature, where friction heats the contacts."""
        from slipstick.plots.curves import temperature

        return temperature(self._branch, contact, **options)

    def fractions(self, contact: str | None = None, **options: Any) -> Axes:
        """Parts of the period in stick, slip and separation."""
        from slipstick.plots.curves import fractions

        return fractions(self._branch, contact, **options)

    def loop(self, point: int, contact: str | None = None, **options: Any) -> Axes:
        """Hysteresis loop of a contact at a point: friction force over its vibration."""
        from slipstick.plots.points import loop

        period = self._branch.loop(point, contact)
        return loop(period["motion"], period["friction"], **options)

    def states(self, point: int, **options: Any) -> Axes:
        """States of all contacts over a period."""
        from slipstick.plots.points import states

        return states(self._branch.states(point), **options)
