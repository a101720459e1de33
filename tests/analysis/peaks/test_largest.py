"""Peaks of the largest amplitude of all outputs, against those of every output by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.rings import BLADE, a_sector, pairs, wave_problem

import slipstick as ss
from slipstick.errors import InputError


def disc(sectors: int = 4, **more: Any) -> ss.Problem:
    """Blades that differ."""
    wave = wave_problem(sectors, 1, pairs(), 1 - 6j, 0.3)
    given = {"spread": 0.03, "seed": 2} | more
    return a_sector(sectors).mistuned(blade=BLADE, **given).problem(wave, outputs=["tip"])


def test_they_are_those_of_some_output_that_is_the_largest_there() -> None:
    """Each of them is located for its own dof too, and none of those that are the largest is missing."""
    span = (7.6, 8.4)
    largest = ss.forced_response(disc(), omega=span, peaks_of="largest")
    every = ss.forced_response(disc(), omega=span, peaks_of=[f"tip@{s}" for s in range(4)])
    found, data = largest.peaks("largest"), every.dataset
    assert found == largest.peaks()
    expected = []
    for i in np.flatnonzero(data.kind.values == "peak"):
        sizes = data.amplitude.values[i]
        if sizes.argmax() == data.peak_dof.values[i]:
            expected.append((float(data.omega[i]), float(sizes.max())))
    assert len(found) == len(expected) > 0
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    with pytest.warns(ss.SlipstickWarning, match="were not sought"):
        largest.peaks("tip@0")


def test_a_study_has_the_largest_of_each_case() -> None:
    """That of the worst blade; of the others it is not known."""
    table = ss.study(disc(), {"mistuning": [0.0, 1.0]}, omega=(7.6, 8.4), peaks_of="largest", options={"max_step": 0.1})
    assert (table.peak_amplitude.notnull().sum("dof") == 1).all()
    one = ss.forced_response(disc(), omega=(7.6, 8.4), peaks_of="largest")
    assert float(table.peak_amplitude.max("dof")[1]) == pytest.approx(max(a for _, a in one.peaks()), rel=1e-6)


def test_it_is_no_name_of_a_list() -> None:
    """Alone it stands for all."""
    with pytest.raises(InputError, match="largest"):
        ss.forced_response(disc(), omega=(7.6, 8.4), peaks_of=["largest", "tip@0"])
