"""The results file: point by point, whole at any moment, nothing lost by a kill or a full disk."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray

from slipstick.errors import InputError, SlipstickWarning
from slipstick.io import journal as journal_module
from slipstick.io import store as store_module
from slipstick.io.journal import Journal, journal_of, read_journal
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore, remove_leftovers, save_dataset
from slipstick.results.schema import Declared, Layout

LAYOUT = Layout(
    labels={"dof": ("x", "y"), "coefficient": ("0", "c1", "s1"), "contact": ("tip",)},
    variables={
        "omega": Declared((), "rad/s", "principal frequency"),
        "displacement": Declared(("dof", "coefficient"), "length", "displacement coefficients"),
        "power": Declared(("contact",), "force length/s", "dissipated power"),
        "count": Declared((), "1", "count", whole=True),
        "kind": Declared((), "1", "kind of point", texts=("start", "end")),
    },
    attributes={"case": "format = 1\n" + "# a long case\n" * 8000},
)


def point(i: int) -> dict[str, object]:
    return {
        "omega": float(i),
        "displacement": np.arange(6.0).reshape(2, 3) + i,
        "power": np.array([i / 7]),
        "count": i,
        "kind": "start" if i == 0 else "end",
    }


def opened(path: Path) -> xarray.Dataset:
    return xarray.load_dataset(path, engine="h5netcdf")


def test_points_are_read_back_exactly_with_units(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    with ResultStore(path, LAYOUT) as store:
        for i in range(5):
            store.append(point(i))
    data = opened(path)
    assert data.sizes == {"point": 5, "dof": 2, "coefficient": 3, "contact": 1}
    assert list(data["dof"].values) == ["x", "y"]
    assert data["displacement"].values[3].tolist() == (np.arange(6.0).reshape(2, 3) + 3).tolist()
    assert all(data[name].attrs.keys() >= {"units", "long_name"} for name in data.variables)
    assert data["count"].values.tolist() == [0, 1, 2, 3, 4]
    assert data["count"].dtype == np.int32
    assert data["kind"].values.tolist() == ["start", "end", "end", "end", "end"]
    assert data.attrs["case"] == LAYOUT.attributes["case"]
    assert data.encoding["unlimited_dims"] == {"point"}
    assert [p.name for p in tmp_path.iterdir()] == ["r.nc"]


def test_variables_left_out_are_nan_and_wrong_shapes_refused(tmp_path: Path) -> None:
    with ResultStore(tmp_path / "r.nc", LAYOUT) as store:
        store.append({"omega": 1.0})
        with pytest.raises(InputError, match=r"'displacement' has shape \(3,\); expected \(2, 3\)"):
            store.append({"omega": 2.0, "displacement": np.zeros(3)})
    data = opened(tmp_path / "r.nc")
    assert data.sizes["point"] == 1
    assert np.isnan(data["power"].values).all()
    assert (data["count"].item(), data["kind"].item()) == (-1, "")


def test_an_empty_store_opens(tmp_path: Path) -> None:
    with ResultStore(tmp_path / "r.nc", LAYOUT):
        assert opened(tmp_path / "r.nc").sizes["point"] == 0


def test_appending_200_points_is_cheap(tmp_path: Path) -> None:
    with ResultStore(tmp_path / "warm.nc", LAYOUT) as store:
        store.append(point(0))
    begin = time.process_time()
    with ResultStore(tmp_path / "r.nc", LAYOUT) as store:
        for i in range(200):
            store.append(point(i))
    assert time.process_time() - begin < 0.4  # 0.1 s on a quiet machine


def test_final_attributes_are_written(tmp_path: Path) -> None:
    store = ResultStore(tmp_path / "r.nc", LAYOUT)
    store.append(point(1))
    store.close({"outcome": "completed"})
    assert opened(tmp_path / "r.nc").attrs["outcome"] == "completed"


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


def test_a_torn_or_damaged_record_ends_the_journal(tmp_path: Path) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    for i in range(4):
        store.append(point(i))
    file = journal_of(path)
    data = file.read_bytes()
    file.write_bytes(data[:-3])
    assert len(read_journal(file)[1]) == 3
    file.write_bytes(data[:-9] + b"\0" + data[-8:])
    assert len(read_journal(file)[1]) == 3
    store.close()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"nothing\n",
        b'{"magic": "x"}\n',
        b'{"magic": "slipstick journal 2"}\n',
        b"[]",
        b"[" * 10**6,
        b'{"magic": ' + b"9" * 5000 + b"}",
        b'{"magic": "slipstick journal 2", "labels": {"a": "'
        + b"x" * 2000
        + b'"}, "variables": {"v": '
        + b'["a", "a", "a", "a", "a", "a", "a"]}, "meanings": {}, "attributes": {}}\n',
        b'{"magic": "slipstick journal 2", "labels": {"a": "x"}, "variables": {"v": ['
        + b'"a", ' * 99
        + b'"a"]}, "meanings": {}, "attributes": {}}\n',
        b'{"magic": "slipstick journal 2", "labels": {}, "variables": {}, "meanings": {}, "attributes": {}}\n'
        + bytes(99),
    ],
)
def test_a_foreign_journal_is_refused_with_a_sentence(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "j").write_bytes(content)
    with pytest.raises(InputError, match="not a journal of slipstick"):
        read_journal(tmp_path / "j")


def journal_of_three(path: Path, layout: Layout = LAYOUT, first: int = 0) -> None:
    """A sound journal beside ``path``, as a killed run leaves it."""
    journal = Journal(journal_of(path), layout)
    for i in range(first, first + 3):
        journal.append(layout.pack(point(i)))
    journal.close(remove=False)


def written(path: Path, count: int, layout: Layout = LAYOUT) -> None:
    with ResultStore(path, layout) as store:
        for i in range(count):
            store.append(point(i))


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


def test_results_that_cannot_be_renewed_do_not_end_a_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk has room for the journal but not for the results file; later it has."""
    path, tries = tmp_path / "r.nc", []

    def full(*_: object) -> None:
        tries.append(1)
        raise OSError(errno.ENOSPC, "No space left on device")

    store = ResultStore(path, LAYOUT)
    with monkeypatch.context() as patch:
        patch.setattr(store_module, "write_netcdf", full)
        for i in range(50):
            store.append(point(i))
    assert 1 <= len(tries) < 10
    assert load_dataset(path).sizes["point"] == 50
    store.close()
    assert opened(path).sizes["point"] == 50
    assert [p.name for p in tmp_path.iterdir()] == ["r.nc"]


def test_leftovers_of_killed_writers_are_removed(tmp_path: Path) -> None:
    for name in (".r.nc.7.tmp", "r.nc", ".q.nc.7.tmp"):
        (tmp_path / name).write_bytes(b"")
    remove_leftovers(tmp_path / "r.nc")
    assert sorted(p.name for p in tmp_path.iterdir()) == [".q.nc.7.tmp", "r.nc"]


WRITER = """
import sys, numpy as np
sys.path.insert(0, {here!r})
from test_store import LAYOUT, point
from slipstick.io.store import ResultStore
store = ResultStore({path!r}, LAYOUT)
for i in range(10**6):
    store.append(point(i))
    print(i, flush=True)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
@pytest.mark.parametrize("delay", [0.0, 0.03, 0.11, 0.3])
def test_a_killed_writer_leaves_every_completed_point(tmp_path: Path, delay: float) -> None:
    path = tmp_path / "r.nc"
    code = WRITER.format(here=str(Path(__file__).parent), path=str(path))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        assert child.stdout.readline() == "0\n"
        time.sleep(delay)
        child.send_signal(signal.SIGKILL)
        last = [line for line in child.stdout.read().splitlines(keepends=True) if line.endswith("\n")]
    announced = int(last[-1]) if last else 0
    assert opened(path).sizes["point"] >= 1
    found = load_dataset(path)
    assert found.sizes["point"] >= announced + 1
    assert found["omega"].values.tolist() == list(range(found.sizes["point"]))


def test_a_full_disk_keeps_the_points_before(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    store.append(point(0))
    store.append(point(1))
    whole = os.write

    def full(file: int, data: object) -> int:
        whole(file, bytes(data)[:9])  # type: ignore[call-overload]
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(journal_module.os, "write", full)
        with pytest.raises(OSError, match="No space left"):
            store.append(point(2))
    assert len(store) == 2
    assert len(read_journal(journal_of(path))[1]) == 2
    store.append(point(2))
    store.close()
    assert opened(path).sizes["point"] == 3


def test_a_failing_final_write_keeps_the_older_file_and_the_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    store.append(point(0))

    def full(temporary: Path, *_: object) -> None:
        temporary.write_bytes(b"half")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(store_module, "write_netcdf", full)
    with pytest.raises(OSError, match="No space left"):
        store.close()
    opened(path)
    assert load_dataset(path).sizes["point"] == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["r.nc", "r.nc.journal"]


def test_an_unwritable_place_is_told_on_opening(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        ResultStore(tmp_path / "missing" / "r.nc", LAYOUT)


def test_save_replaces_only_by_a_complete_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.nc"
    data = xarray.Dataset({"omega": ("point", [1.0, 2.0])})
    save_dataset(data, path)
    assert opened(path).encoding["unlimited_dims"] == {"point"}

    def broken(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(store_module, "write_netcdf", broken)
    with pytest.raises(OSError, match="No space left"):
        save_dataset(data * 2, path)
    assert opened(path)["omega"].values.tolist() == [1.0, 2.0]


def test_what_is_no_results_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "r.nc").write_text("hello")
    with pytest.raises(InputError, match="not a results file"):
        load_dataset(tmp_path / "r.nc")
    with pytest.raises(InputError, match="there is no such file"):
        load_dataset(tmp_path / "none.nc")


def test_texts_bare_dimensions_and_numbers_survive(tmp_path: Path) -> None:
    data = xarray.Dataset(
        {
            "kind": ("point", np.array(["start", "end"])),
            "x": (("point", "dof"), np.arange(4.0).reshape(2, 2), {"units": "m"}),
            "n": ((), 3),
        },
        coords={"dof": ["a", "ä"]},
        attrs={"seconds": 1.5, "points": 7, "title": "Größe", "none": None, "good": True},
    )
    save_dataset(data, tmp_path / "r.nc")
    for read in (load_dataset(tmp_path / "r.nc"), opened(tmp_path / "r.nc")):
        assert read["kind"].values.tolist() == ["start", "end"]
        assert read["x"].dims == ("point", "dof")
        assert read["x"].values.tolist() == [[0.0, 1.0], [2.0, 3.0]]
        assert read["dof"].values.tolist() == ["a", "ä"]
        assert int(read["n"]) == 3
        assert read.attrs == {"seconds": 1.5, "points": 7, "title": "Größe", "good": 1}


def test_a_claimed_size_is_refused(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "r.nc", "w") as file:
        file.create_dataset("x", (10**7, 10**7), dtype="f8", chunks=(100, 100))
    with pytest.raises(InputError, match="claims 100000000000000 entries, more than the file holds"):
        load_dataset(tmp_path / "r.nc")
