"""Campbell and interference diagrams: what is shown of the frequencies, in which unit, and how crossings are named."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

import slipstick as ss
from slipstick import plots
from slipstick.errors import InputError


def top_and_more() -> xr.Dataset:
    """Two modes that order 1 meets far below a third one."""
    turn = np.zeros((3, 3))
    turn[0, 1], turn[1, 0] = 0.1, -0.1
    rotor = ss.MatrixStructure(
        M=np.eye(3), K=np.diag([4.0, 4.0, 4e4]), gyroscopic=turn, speed=0.0, dofs=["n1x", "n1y", "z"]
    )
    return ss.models.campbell(rotor, np.linspace(0.0, 4.0, 9), engine_orders=[1, 2])


@pytest.mark.parametrize(
    ("frequency", "across", "rise"),
    [(None, 1.0, 1.0), ("Hz", 0.5 / np.pi, 0.5 / np.pi), ("rpm", 30.0 / np.pi, 0.5 / np.pi)],
)
def test_a_campbell_diagram_shows_its_crossings_in_the_unit_asked_for(
    frequency: str | None, across: float, rise: float
) -> None:
    data = top_and_more()
    ax = plots.campbell(data, frequency=frequency)
    rings = next(line for line in ax.lines if line.get_marker() == "o")
    np.testing.assert_allclose(rings.get_xdata(), across * data["crossing_speed"].values)
    np.testing.assert_allclose(rings.get_ydata(), rise * data["crossing_frequency"].values)
    unit = frequency or "rad/s"
    assert ax.get_xlabel() == f"Speed of rotation [{unit}]"
    assert ax.get_ylabel() == f"Damped frequency [{'Hz' if unit == 'rpm' else unit}]"
    low, high = ax.get_ylim()
    assert low == 0.0
    assert high == pytest.approx(1.05 * 2 * 4.0 * rise)  # as far as order 2 reaches, not up to the third mode
    assert ax.get_legend().get_bbox_to_anchor().x0 > ax.bbox.x1  # beside the axes
    solid = [line for line in ax.lines if line.get_label() in ("forward whirl", "backward whirl")]
    assert {line.get_linestyle() for line in solid} == {"-"}


def test_without_crossings_all_frequencies_are_shown() -> None:
    data = top_and_more()
    none = data.isel(crossing=slice(0, 0))
    assert plots.campbell(none).get_ylim()[1] >= float(data["frequency"].max())


def test_names_of_crossings_do_not_lie_on_one_another() -> None:
    """Orders d and N - d meet the same frequency of a standing wave: one name."""
    sector = ss.CyclicStructure(M=[[1.0]], K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=6)
    data = ss.models.interference(sector, (0.1, 2.0), engine_orders=[1, 5, 2], modes=3)
    ax = plots.interference(data, frequency="Hz")
    places = [tuple(np.round(text.xy, 9)) for text in ax.texts]
    assert len(places) == len(set(places))
    assert any(text.get_text() in ("1x, 5x", "5x, 1x") for text in ax.texts)
    assert ax.get_ylabel() == "Undamped frequency [Hz]"
    assert {text.get_text() for text in ax.get_legend().get_texts()} == {"mode 1"}  # the others have no frequency


@pytest.mark.parametrize("draw", [plots.campbell, plots.interference])
def test_another_unit_is_refused(draw: object) -> None:
    data = top_and_more() if draw is plots.campbell else ss.models.interference(
        ss.CyclicStructure(M=[[1.0]], K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=6), (0.1, 2.0), engine_orders=[1]
    )  # fmt: skip
    with pytest.raises(InputError, match="frequency: found 'bar'; expected one of"):
        draw(data, frequency="bar")  # type: ignore[operator]
