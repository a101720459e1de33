"""Results read again, with the points that only their own journal holds."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import xarray
from helpers.results import LAYOUT, journal_of_three, opened, point, written

from slipstick.errors import InputError, SlipstickWarning
from slipstick.io.journal import journal_of
from slipstick.io.loading import load, load_dataset
from slipstick.io.store import ResultStore


def test_the_results_lag_is_in_the_journal(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    store._cost = 1e9
    for i in range(7):
        store.append(point(i))
    assert opened(path).sizes["point"] == 0
    recovered = load_dataset(path)
    assert recovered["omega"].values.tolist() == list(range(7))
    assert recovered["omega"].attrs["units"] == "rad/s"
    store.close()
    xarray.testing.assert_identical(load_dataset(path), recovered)


OTHER_CASE = replace(LAYOUT, attributes={"case": "format = 1"})


OTHER_DOFS = replace(LAYOUT, labels={**LAYOUT.labels, "dof": ("x", "z")})


@pytest.mark.parametrize("count", [0, 2])
@pytest.mark.parametrize(
    "foreign",
    [
        lambda path: journal_of(path).write_bytes(b""),
        lambda path: journal_of(path).write_bytes(os.urandom(5000)),
        lambda path: journal_of(path).write_bytes(b"[" * 100_000),
        lambda path: journal_of_three(path, OTHER_CASE),
        lambda path: journal_of_three(path, OTHER_DOFS),
    ],
    ids=["empty", "garbage", "deep", "other case", "other dofs"],
)
def test_a_journal_that_is_not_its_own_neither_hides_nor_replaces_results(
    tmp_path: Path, count: int, foreign: Callable[[Path], object]
) -> None:
    path = tmp_path / "r.nc"
    written(path, count)
    sound = load_dataset(path)
    foreign(path)
    with pytest.warns(SlipstickWarning, match=r"r\.nc was read without it"):
        assert load_dataset(path).identical(sound)


def test_a_journal_with_other_points_is_not_its_own(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    written(path, 2)
    journal_of_three(path, first=1)
    with pytest.warns(SlipstickWarning, match="not the journal of these results"):
        assert load_dataset(path)["omega"].values.tolist() == [0.0, 1.0]
    journal_of_three(path)
    assert load_dataset(path)["omega"].values.tolist() == [0.0, 1.0, 2.0]


def test_what_is_no_results_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "r.nc").write_text("hello")
    with pytest.raises(InputError, match="not a results file"):
        load_dataset(tmp_path / "r.nc")
    with pytest.raises(InputError, match="there is no such file"):
        load_dataset(tmp_path / "none.nc")


def test_a_folder_is_told_as_a_folder(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r": there is no results\.nc in it"):
        load(tmp_path)
    (tmp_path / "results.nc").touch()
    with pytest.raises(InputError, match=r"is a folder; .*: give .*results\.nc"):
        load(tmp_path)
