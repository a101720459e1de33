"""Flipped bits in results and journals: the numbers that were written, or one sentence; never other numbers."""

from __future__ import annotations

import random
import shutil
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
import samples
from helpers.results import journal_of_three, opened, point, written

from slipstick.errors import InputError
from slipstick.io.hdf5 import seal
from slipstick.io.journal import journal_of, read_journal
from slipstick.io.loading import load, load_table
from slipstick.results.table import ResultTable

SEAL = 24


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results file of a run with its problem, and the journal that a kill left, one point longer."""
    return samples.write_results(tmp_path_factory.mktemp("run"))


def alike(a: ResultTable, b: ResultTable, points: int | None = None) -> bool:
    """Whether all names, dimensions, values, texts and attributes are equal, over the first points."""
    if set(a.variables) != set(b.variables) or a.attrs != b.attrs:
        return False
    for name, mine in a.variables.items():
        other = b.variables[name]
        x, y = (v.values[:points] if v.dims[:1] == ("point",) else v.values for v in (mine, other))
        equal = np.array_equal(x, y, equal_nan=x.dtype.kind == "f")
        if mine.dims != other.dims or dict(mine.attrs) != dict(other.attrs) or not equal:
            return False
    return True


def flipped(data: bytes, rng: random.Random, bits: int = 3) -> bytes:
    out = bytearray(data)
    for at in rng.sample(range(8 * len(data)), bits):
        out[at // 8] ^= 1 << at % 8
    return bytes(out)


def test_results_with_three_flipped_bits_are_never_loaded(run: Path, tmp_path: Path) -> None:
    """300 files: each is refused with one sentence that names it."""
    data, path = run.read_bytes(), tmp_path / "results.nc"
    for seed in range(300):
        path.write_bytes(flipped(data, random.Random(seed)))
        with pytest.raises(InputError, match=r"results\.nc: damaged") as caught:
            load_table(path)
        assert len(caught.value.sentences) == 1


def test_the_bits_of_the_first_block_and_of_the_seal_count(run: Path, tmp_path: Path) -> None:
    """Where the file says what it is, where it ends, and which hash it has."""
    data, path = run.read_bytes(), tmp_path / "results.nc"
    for bit in [*range(0, 8 * 48, 3), *range(8 * (len(data) - SEAL), 8 * len(data), 3)]:
        spoilt = bytearray(data)
        spoilt[bit // 8] ^= 1 << bit % 8
        path.write_bytes(spoilt)
        with pytest.raises(InputError, match="damaged"):
            load_table(path)
    path.write_bytes(data)
    load_table(path)


def test_journals_with_three_flipped_bits(run: Path, tmp_path: Path) -> None:
    """200 of them: the points before the damage, which is named, or one sentence."""
    journal, sound, refused = tmp_path / "r.nc.journal", read_journal(journal_of(run)), []
    for seed in range(200):
        journal.write_bytes(flipped(journal_of(run).read_bytes(), random.Random(seed)))
        try:
            found = read_journal(journal)
        except InputError as error:
            refused += error.sentences
        else:
            assert "damaged" in found.damage
            assert np.array_equal(found.rows, sound.rows[: len(found.rows)], equal_nan=True)
            assert (found.layout, found.about, len(found.rows) < len(sound.rows)) == (sound.layout, sound.about, True)
    assert 0 < len(refused) < 200
    assert all("r.nc.journal: damaged" in sentence for sentence in refused)


def test_results_beside_a_damaged_journal(run: Path, tmp_path: Path) -> None:
    path, whole = tmp_path / run.name, load_table(run)
    shutil.copy(run, path)
    alone = load_table(path)
    for seed in range(6):
        journal_of(path).write_bytes(flipped(journal_of(run).read_bytes(), random.Random(seed)))
        with pytest.warns(match="damaged"):
            assert alike(load_table(path), alone)
    assert alone.sizes["point"] == whole.sizes["point"] - 1


def test_damage_in_a_journal_is_told_from_a_record_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    journal_of_three(path)
    data = journal_of(path).read_bytes()
    ends = read_journal(journal_of(path)).ends
    for cut in (ends[2], ends[2] + 5, ends[2] + 20, ends[3] - 1):
        journal_of(path).write_bytes(data[:cut])
        assert (len(read_journal(journal_of(path)).rows), read_journal(journal_of(path)).damage) == (2, "")
    journal_of(path).write_bytes(data[: ends[2]] + bytes(40))  # what a loss of power leaves
    assert read_journal(journal_of(path)).damage == ""
    for at in (ends[1], ends[1] + 9, ends[1] + 14, ends[1] + 30):  # length, both check sums, numbers
        journal_of(path).write_bytes(data[:at] + bytes([data[at] ^ 4]) + data[at + 1 :])
        found = read_journal(journal_of(path))
        assert len(found.rows) == 1
        assert "r.nc.journal: damaged after 1 points" in found.damage


def test_other_readers_see_damaged_numbers(tmp_path: Path) -> None:
    """By the check sums of the data sets, which every reader of HDF5 looks at."""
    path = tmp_path / "r.nc"
    written(path, 50)
    data = path.read_bytes()
    at = data.index(np.arange(50.0).tobytes())  # omega
    path.write_bytes(data[: at + 8] + bytes([data[at + 8] ^ 1]) + data[at + 9 : -SEAL])
    with pytest.raises(OSError, match=r"checksum|filter"):
        opened(path)["omega"].values  # noqa: B018
    with pytest.raises(InputError, match="damaged"):
        load_table(path)


def test_every_array_of_numbers_has_a_check_sum(run: Path) -> None:
    def look(name: str, node: object) -> None:
        if isinstance(node, h5py.Dataset) and node.shape and not h5py.check_string_dtype(node.dtype):
            assert node.fletcher32, name

    with h5py.File(run, "r") as file:
        file.visititems(look)


def test_a_file_that_another_program_changed_or_wrote_is_read(run: Path, tmp_path: Path) -> None:
    """Copies through xarray and changes in place lose the seal, and stay files."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        copy, changed = tmp_path / "copy.nc", tmp_path / "changed.nc"
        opened(run).to_netcdf(copy, engine="h5netcdf")
        shutil.copy(run, changed)
        with h5py.File(changed, "a") as file:
            file.attrs["comment"] = "x" * 500
        assert load_table(changed).attrs["comment"] == "x" * 500
        assert len(load_table(copy)["omega"].values) == len(load(changed))


def test_a_file_without_a_seal_is_read(run: Path, tmp_path: Path) -> None:
    """As other programs write it."""
    path = tmp_path / "results.nc"
    path.write_bytes(run.read_bytes()[:-SEAL])
    assert alike(load_table(path), load_table(run), load_table(path).sizes["point"])


def test_a_seal_is_of_what_stands_before_it(tmp_path: Path) -> None:
    """One that is made anew makes a changed file whole again: it finds damage, and is no signature."""
    path = tmp_path / "r.nc"
    written(path, 3)
    with h5py.File(path, "a") as file:
        file["omega"][0] = 7.0
    seal(path)
    assert float(load_table(path)["omega"].values[0]) == 7.0
    assert point(0)["omega"] == 0.0
