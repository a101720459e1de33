"""Interference diagrams of a ring of masses, whose frequencies are in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.structure.interference import interference, nodal_diameter


@dataclass
class Ring:
    """``m w^2 = k + 2 c (1 - cos(2 pi d / N)) + s W^2``: masses on springs, coupled, that stiffen with the speed."""

    sectors: int = 12
    speed: float = 0.0

    def natural_frequencies(self, nodal_diameter: int) -> np.ndarray:
        own = 100.0 + 60.0 * (1.0 - np.cos(2.0 * np.pi * nodal_diameter / self.sectors))
        return np.sqrt(np.array([own, 9.0 * own]) + 2.0 * self.speed**2)


def test_resonances_of_frequency_and_shape() -> None:
    found = interference(Ring(), (1.0, 6.0), engine_orders=[2, 3, 10, 12, 6], modes=2)
    expected = []
    for n, d, wave in ((2, 2, 1), (3, 3, 1), (10, 2, -1), (12, 0, 0), (6, 6, 0)):
        assert nodal_diameter(n, 12) == d
        for mode, w in enumerate(Ring().natural_frequencies(d), start=1):
            if 1.0 <= w / n <= 6.0:
                expected.append((w / n, w, n, d, mode, wave))
    expected.sort()
    names = ("speed", "frequency", "order", "nodal_diameter", "mode", "wave")
    for i, name in enumerate(names):
        assert found[f"crossing_{name}"].values == pytest.approx([row[i] for row in expected])
    assert found.frequency.sel(nodal_diameter=0).values == pytest.approx([10.0, 30.0])
    assert found.sizes == {"nodal_diameter": 7, "mode": 2, "crossing": len(expected)}


def test_a_disc_that_stiffens() -> None:
    """``n^2 W^2 = w0^2 + 2 W^2``."""
    found = interference(lambda speed: Ring(speed=speed), (0.0, "2 Hz"), engine_orders=[3], modes=1)
    w0 = Ring().natural_frequencies(3)[0]
    assert found.crossing_speed.values == pytest.approx([w0 / np.sqrt(7.0)], rel=1e-12)


def test_faults() -> None:
    with pytest.raises(InputError, match=r"expected an ss\.CyclicStructure"):
        interference(3.0, (0.0, 1.0), engine_orders=[1])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the second one above the first"):
        interference(Ring(), (1.0, 1.0), engine_orders=[1])
    with pytest.raises(InputError, match="engine_orders"):
        interference(Ring(), (0.0, 1.0), engine_orders=[0])


def test_the_figure() -> None:
    from slipstick.plots import interference as draw

    axes = draw(interference(Ring(), (1.0, 6.0), engine_orders=[2, 3, 10], modes=2))
    assert "Nodal diameter" in axes.get_xlabel()
    assert len(axes.lines) >= 3
