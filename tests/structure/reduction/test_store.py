"""Reductions on disk: found by content alone, whole or not there."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.structure.reduction.store import content_key, folders_digest, read, write

A = csr_array(np.diag([1.0, 2.0, 3.0]))


def test_equal_content_has_one_key_and_any_change_another():
    key = content_key([A], ["solver", 3])
    assert key == content_key([A.copy()], ["solver", 3])
    changed = A.copy()
    changed.data[0] = np.nextafter(1.0, 2.0)
    other = {"value": ([changed], 3), "parameter": ([A], 4), "number": ([A, A], 3)}
    others = [content_key(matrices, ["solver", n]) for matrices, n in other.values()]
    wider = csr_array((A.data, A.indices, A.indptr), shape=(3, 4))
    assert len({key, *others, content_key([wider], ["solver", 3])}) == 5


def test_arrays_come_back_and_damage_is_none(tmp_path):
    path = tmp_path / "new" / "r.npz"
    assert read(path) is None
    write(path, {"a": np.arange(3.0)})
    np.testing.assert_array_equal(read(path)["a"], [0.0, 1.0, 2.0])
    assert [p.name for p in path.parent.iterdir()] == ["r.npz"]
    path.write_bytes(path.read_bytes()[:50])
    assert read(path) is None


def test_a_place_that_cannot_be_written_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="the reduction cannot be stored in"):
        write(tmp_path / "file" / "r.npz", {"a": np.zeros(1)})


def test_changed_code_has_another_digest(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    before = folders_digest([tmp_path])
    (tmp_path / "notes.txt").write_text("no code")
    assert folders_digest([tmp_path]) == before
    (tmp_path / "a.py").write_text("x = 2\n")
    assert folders_digest([tmp_path]) != before
