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
from helpers.counting import calls_of
from helpers.results import LAYOUT, opened, point, written

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


def test_appending_points_does_not_renew_the_file_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock stands still: what was written at the start is renewed at the end."""
    monkeypatch.setattr(store_module, "time", Clock())
    renewed = calls_of(monkeypatch, store_module, "write_netcdf")
    with ResultStore(tmp_path / "r.nc", LAYOUT) as store:
        for i in range(200):
            store.append(point(i))
    assert 1 <= len(renewed) <= 3


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
    [(OSError(errno.ENOSPC, "No space left on device"), "no space left on device"), (OSError("odd"), "odd")],
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
    with pytest.raises(InputError, match="no space left"):
        save_dataset(data * 2, path)
    assert opened(path)["omega"].values.tolist() == [1.0, 2.0]


def test_points_of_many_blocks_are_those_of_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """While the run goes on, from its journal, and once that is removed; every renewal on the way."""
    written(tmp_path / "one.nc", 23)
    expected = load_dataset(tmp_path / "one.nc")
    monkeypatch.setattr(store_module, "_BLOCK", 4 * 8 * LAYOUT.size)
    path = tmp_path / "many.nc"
    store = ResultStore(path, LAYOUT)
    for i in range(23):
        store.append(point(i))
        if i in (3, 4, 17):
            store.write()
            assert opened(path)["omega"].values.tolist() == list(range(i + 1))
    xarray.testing.assert_identical(store.table().to_dataset(), expected)
    assert store.values().get("nothing") is None
    store.close(finished=False)
    xarray.testing.assert_identical(store.table().to_dataset(), expected)
    xarray.testing.assert_identical(load_dataset(path), expected)
    recorded = read_journal(journal_of(path))
    again = ResultStore(path, LAYOUT, recorded=recorded, keep=21)
    assert opened(path).sizes["point"] == 21
    for i in (21, 22):
        again.append(point(i))
    again.close()
    assert not journal_of(path).exists()
    xarray.testing.assert_identical(again.table().to_dataset(), expected)
    xarray.testing.assert_identical(opened(path), opened(tmp_path / "one.nc"))
    again.close()  # nothing is left to close


def test_points_that_a_file_lacks_are_read_in_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store_module, "_BLOCK", 3 * 8 * LAYOUT.size)
    path = tmp_path / "r.nc"
    store = ResultStore(path, LAYOUT)
    for i in range(7):
        store.append(point(i))
    store.write()
    store._cost = 1e9
    for i in range(7, 18):
        store.append(point(i))
    assert opened(path).sizes["point"] == 7
    recovered = load_dataset(path)
    store.close()
    xarray.testing.assert_identical(load_dataset(path), recovered)
    assert recovered["kind"].values.tolist() == ["start", *["end"] * 17]


FULL = """
import errno, resource, sys
from pathlib import Path
sys.path.insert(0, {here!r})
from helpers.results import LAYOUT, opened, point, written
from slipstick.io import store as store_module
from slipstick.io.journal import journal_of
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore

store_module._BLOCK = {block}
path = Path({path!r})
store = ResultStore(path, LAYOUT)
for i in range(40):
    store.append(point(i))
store.write()
none, room = resource.getrlimit(resource.RLIMIT_FSIZE), journal_of(path).stat().st_size + 3_000
assert room < path.stat().st_size, (room, path.stat().st_size)
resource.setrlimit(resource.RLIMIT_FSIZE, (room, none[1]))
for i in range(40, 60):
    store._cost = 0.0  # a renewal after every point
    store.append(point(i))
assert store._cost > 0.0
try:
    store.close({{"outcome": "completed"}})
except OSError as error:
    assert error.errno == errno.EFBIG
    print("told")
assert load_dataset(path).sizes["point"] == 60
assert sorted(p.name for p in path.parent.iterdir()) == ["r.nc", "r.nc.journal"]
assert opened(path).sizes["point"] == 40
resource.setrlimit(resource.RLIMIT_FSIZE, none)
store.close()
assert opened(path)["omega"].values.tolist() == list(range(60))
assert [p.name for p in path.parent.iterdir()] == ["r.nc"]
"""


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
@pytest.mark.parametrize("block", [32 * 1024**2, 1000])
def test_a_disk_that_is_full_at_renewals_and_at_the_end(tmp_path: Path, block: int) -> None:
    """Room for the journal alone: the file stays as it was, every point is in the journal, and the process lives."""
    folder = tmp_path / "run"
    folder.mkdir()
    code = FULL.format(here=str(Path(__file__).parents[1]), path=str(folder / "r.nc"), block=block)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "told\n")


MEMORY = """
import sys
from pathlib import Path
import numpy as np
from slipstick.io import store as store_module
from slipstick.io.journal import journal_of, read_journal
from slipstick.io.loading import load_table
from slipstick.io.store import ResultStore
from slipstick.results.schema import Declared, Layout

def most():
    line = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) * 1024

store_module._BLOCK = 2 * 1024**2
names = "tangential", "normal", "friction", "pressure"
layout = Layout(
    labels={{"contact": tuple(map(str, range(4000))), "coefficient": tuple(map(str, range(11)))}},
    variables={{"omega": Declared((), "1", "")}} | {{n: Declared(("contact", "coefficient"), "1", "") for n in names}},
)
row = {{name: np.random.default_rng(1).random((4000, 11)) for name in names}}
note = {{"state": np.zeros(80_000)}}
path, count = Path({path!r}), 48
whole = count * 8 * layout.size
with ResultStore(path, layout) as store:
    store.append(row | {{"omega": 0.0}})
load_table(path)
before = most()

def told(what):
    print(what, (most() - before) / whole)

store = ResultStore(path, layout)
for i in range(count):
    store.append(row | {{"omega": i}}, note)
store.write()
store.values()["omega"]
store.close(finished=False)
told("written")
recorded = read_journal(journal_of(path))
store = ResultStore(path, layout, recorded=recorded, keep=count - 1)
store._cost = 1e9
store.append(row | {{"omega": count - 1}}, note)
told("gone on with")
assert load_table(path).sizes["point"] == count
told("loaded")
store.close()
assert store.table().sizes["point"] == count
told("closed")
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="memory is told by Linux")
def test_points_are_not_in_memory_while_they_are_written_and_once_when_they_are_read(tmp_path: Path) -> None:
    """Shares of the 68 MB of 48 points; the rest are blocks, and the copies that HDF5 makes of them."""
    code = MEMORY.format(path=str(tmp_path / "r.nc"))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    shares = {what: float(share) for what, share in (line.rsplit(" ", 1) for line in done.stdout.splitlines())}
    assert list(shares) == ["written", "gone on with", "loaded", "closed"]
    assert shares["gone on with"] < 0.4
    assert shares["closed"] < 1.7
