"""The results file: point by point, whole at any moment, nothing lost by a kill or a full disk."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import xarray
from helpers.results import LAYOUT, opened, point

from slipstick.branch import Branch
from slipstick.errors import InputError, Outcome
from slipstick.io import journal as journal_module
from slipstick.io import store as store_module
from slipstick.io.journal import journal_of, read_journal
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore, save_dataset


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


WRITER = """
import sys, numpy as np
sys.path.insert(0, {here!r})
from helpers.results import LAYOUT, point
from slipstick.io.store import ResultStore
store = ResultStore({path!r}, LAYOUT)
for i in range(10**6):
    store.append(point(i))
    print(i, flush=True)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs SIGKILL")
@pytest.mark.parametrize(
    "delay", [0.03, *(pytest.param(delay, marks=pytest.mark.verify) for delay in (0.0, 0.11, 0.3))]
)
def test_a_killed_writer_leaves_every_completed_point(tmp_path: Path, delay: float) -> None:
    path = tmp_path / "r.nc"
    code = WRITER.format(here=str(Path(__file__).parents[1]), path=str(path))
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
    assert len(read_journal(journal_of(path))) == 2
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


def test_what_could_not_be_written_at_the_end_is_written_when_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    store.append(point(0))
    with monkeypatch.context() as patch:
        patch.setattr(store_module, "write_netcdf", no_room)
        with pytest.raises(OSError, match="No space left"):
            store.close({"outcome": "completed"})
    store.close()
    assert opened(path).attrs["outcome"] == "completed"
    assert [p.name for p in tmp_path.iterdir()] == ["r.nc"]


def no_room(*_: object, **__: object) -> None:
    raise OSError(errno.ENOSPC, "No space left on device")


class Clock:
    """Time that passes when it is told to."""

    def __init__(self) -> None:
        self.now = 0.0

    def perf_counter(self) -> float:
        return self.now


def test_after_a_failure_it_is_tried_again_later_each_time_twice_as_late(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, tries = Clock(), []
    monkeypatch.setattr(store_module, "time", clock)
    store = ResultStore(tmp_path / "r.nc", LAYOUT)

    def full(*_: object) -> None:
        tries.append(clock.now)
        no_room()

    with monkeypatch.context() as patch:
        patch.setattr(store_module, "write_netcdf", full)
        for i in range(80):  # a point every tenth of a second
            clock.now += 0.1
            store.append(point(i))
    waits = np.diff(tries)
    assert len(tries) > 2
    np.testing.assert_allclose(waits, 2.0 ** np.arange(len(waits)), atol=0.11)
    clock.now += 100.0
    store.append(point(80))
    assert opened(tmp_path / "r.nc").sizes["point"] == 81
    store.close()


def test_the_file_is_renewed_in_a_tenth_of_the_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each renewal takes a second of a clock that points take half a second of."""
    clock, renewed = Clock(), []
    monkeypatch.setattr(store_module, "time", clock)
    whole = store_module.write_netcdf

    def slow(*given: object) -> None:
        whole(*given)  # type: ignore[arg-type]
        clock.now += 1.0
        renewed.append(clock.now)

    monkeypatch.setattr(store_module, "write_netcdf", slow)
    store = ResultStore(tmp_path / "r.nc", LAYOUT)
    for i in range(100):
        clock.now += 0.5
        store.append(point(i))
    assert 0.05 < len(renewed) / clock.now < 0.11
    before = len(renewed)
    store.write()
    store.write()
    assert len(renewed) <= before + 1  # what is written already is not written again
    store.close()


def test_a_run_that_goes_on_keeps_so_many_points_and_their_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "r.nc"
    first = ResultStore(path, LAYOUT, about={"run": "first"})
    for i in range(4):
        first.append(point(i))
    first.close(finished=False)
    recorded = read_journal(journal_of(path))
    with monkeypatch.context() as patch:
        patch.setattr(store_module, "write_netcdf", no_room)
        with pytest.raises(OSError, match="No space left"):
            ResultStore(path, LAYOUT, recorded=recorded, keep=4)
        assert len(read_journal(journal_of(path)).rows) == 4  # what is to be gone on with is not thrown away
        with pytest.raises(OSError, match="No space left"):
            ResultStore(tmp_path / "new.nc", LAYOUT)
        assert not journal_of(tmp_path / "new.nc").exists()
    second = ResultStore(path, LAYOUT, about={"run": "second"}, recorded=recorded, keep=2)
    assert len(second) == 2
    second.append(point(9))
    found = read_journal(journal_of(path))
    assert found.about == {"run": "first"}
    assert [LAYOUT.unpack(found.rows)["omega"][i] for i in range(3)] == [0.0, 1.0, 9.0]
    second.close()
    assert opened(path)["omega"].values.tolist() == [0.0, 1.0, 9.0]


def test_an_unwritable_place_is_told_on_opening(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        ResultStore(tmp_path / "missing" / "r.nc", LAYOUT)


@pytest.mark.parametrize(
    ("error", "reason"),
    [(OSError(errno.ENOSPC, "No space left on device"), "No space left on device"), (OSError("odd"), "odd")],
)
def test_why_a_branch_could_not_be_saved_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError, reason: str
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(store_module, "write_netcdf", broken)
    made = Branch(xarray.Dataset({"omega": ("point", [1.0, 2.0])}), Outcome.COMPLETED)
    with pytest.raises(InputError, match=rf"b.nc: cannot be written \({reason}\); choose another place"):
        store_module.save_branch(made, tmp_path / "b.nc")


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
