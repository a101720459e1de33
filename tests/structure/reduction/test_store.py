"""Reductions on disk: found by content alone, whole or not there."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.structure.reduction.store import Store, content_key, folders_digest, read, write

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
    with pytest.raises(InputError, match=r"file: cannot be written \(found a file"):
        write(tmp_path / "file" / "r.npz", {"a": np.zeros(1)})


def test_changed_code_has_another_digest(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    before = folders_digest([tmp_path])
    (tmp_path / "notes.txt").write_text("no code")
    assert folders_digest([tmp_path]) == before
    (tmp_path / "a.py").write_text("x = 2\n")
    assert folders_digest([tmp_path]) != before


class Kept:
    """A number that is stored."""

    def __init__(self, value: float) -> None:
        self.value = value

    def arrays(self) -> dict:
        return {"value": np.array(self.value)}

    @classmethod
    def of(cls, arrays) -> "Kept | None":
        return cls(float(arrays["value"])) if arrays["value"].ndim == 0 else None


def store(folder, *, matrix=A, about=3, rooms=("trig",), kind="number"):
    return Store(folder, kind, (matrix, np.arange(3.0)), [about], rooms)


def test_what_is_kept_is_found_by_its_content_its_part_and_the_code(tmp_path):
    made, reused = store(tmp_path).kept(lambda: Kept(1.0), Kept.of)
    again, found = store(tmp_path, matrix=A.copy()).kept(lambda: Kept(2.0), Kept.of)
    assert (made.value, reused, again.value, found) == (1.0, False, 1.0, True)
    others = {"matrix": 2.0 * A, "about": 4, "rooms": ("trig", "solve"), "kind": "other"}
    for name, other in others.items():
        assert not store(tmp_path, **{name: other}).kept(lambda: Kept(2.0), Kept.of)[1], name
    assert not store(tmp_path).kept(lambda: Kept(2.0), Kept.of, "-1")[1]
    assert len(list(tmp_path.iterdir())) == 6
    assert not store(None).kept(lambda: Kept(2.0), Kept.of)[1]


@pytest.mark.parametrize("stored", [{}, {"value": np.zeros(2)}, {"value": np.array("text")}])
def test_what_is_of_another_form_is_made_again(tmp_path, stored):
    """A cache of before, or of something else: nothing is asked, and the next time it is found."""
    write(tmp_path / f"number-{store(tmp_path).key}.npz", stored)
    assert [store(tmp_path).kept(lambda: Kept(5.0), Kept.of)[1] for _ in range(2)] == [False, True]
