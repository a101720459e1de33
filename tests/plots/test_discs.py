"""A disc from the front: colours are amplitudes, lengths the motion at an instant."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.figures import branch as chain
from helpers.rings import disc_and_wave

from slipstick.errors import InputError


def lengths(ax) -> np.ndarray:
    """Of every blade beyond the rest position, at the first corner of its tip."""
    return np.array([np.hypot(*path.vertices[0]) for path in ax.collections[0].get_paths()]) - 1.0


@pytest.mark.parametrize("tau", [0.0, 0.7])
def test_a_wave_looks_as_its_disc(tau: float) -> None:
    """From the delay of each sector, and from the motion of all of them."""
    wave, disc = disc_and_wave()
    one, every = (branch.plot.disc(0, "tip", tau=tau) for branch in (wave, disc))
    for ax, branch in ((one, wave), (every, disc)):
        np.testing.assert_array_equal(ax.collections[0].get_array(), branch.on_disc("tip").to_numpy()[0])
        assert sorted(int(text.get_text()) for text in ax.texts) == list(range(6))
    X = disc.dataset.displacement.to_numpy()[0]
    names = [str(name) for name in disc.dataset.dof.to_numpy()]
    motion = np.array([X[names.index(f"tip@{s}"), 1:] @ disc.harmonics.H_minus(tau)[1:] for s in range(6)])
    assert np.ptp(motion) > 0.5 * np.abs(motion).max()
    np.testing.assert_allclose(lengths(every) / np.abs(lengths(every)).max(), motion / np.abs(motion).max(), atol=1e-9)
    np.testing.assert_allclose(lengths(one), lengths(every), atol=1e-7)


def test_what_is_no_disc_is_refused() -> None:
    with pytest.raises(InputError, match="not of a travelling wave or a disc"):
        chain().plot.disc(0)
    with pytest.raises(InputError, match="no dof 'nose@0'"):
        disc_and_wave()[1].plot.disc(0, "nose")


def test_blades_over_the_frequency() -> None:
    """A line for each blade, the worst one named; those of a wave are one."""
    wave, disc = disc_and_wave()
    ax = disc.plot.blades("tip")
    amplitude = disc.on_disc("tip").to_numpy()
    worst = int(amplitude.max(axis=0).argmax())
    for s in range(6):
        np.testing.assert_array_equal(ax.lines[s].get_ydata(), amplitude[:, s])
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), disc.dataset.omega)
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert f"blade {worst} (of 0 to 5), the largest" in texts
    assert texts.count("others") == 1
    (line,) = wave.plot.blades("tip", frequency="Hz").lines
    np.testing.assert_array_equal(line.get_ydata(), wave.on_disc("tip").to_numpy()[:, 0])
    np.testing.assert_allclose(line.get_xdata(), wave.dataset.omega / (2.0 * np.pi))
    with pytest.raises(InputError, match="not of a travelling wave or a disc"):
        chain().plot.blades()
    with pytest.raises(InputError, match="no dof 'nose@0'"):
        disc.plot.blades("nose")
