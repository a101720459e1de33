"""Numbers out of text: round trips with what Fortran and C print, and sentences for what is none."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipstick.errors import InputError
from slipstick.importers import text_numbers
from slipstick.importers.text_numbers import (
    fortran_real,
    number_table,
    read_bytes,
    require_plausible,
    whole_number,
    whole_numbers,
)

REALS = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e99, max_value=1e99)


@given(REALS)
def test_a_real_comes_back_in_every_way_fortran_writes_it(value):
    text = f"{value:.16E}"
    for written in (text, text.replace("E", "D"), text.replace("E", ""), text.lower(), f"  {text} "):
        assert fortran_real(written) == value


@pytest.mark.parametrize("text", ["", ".", "E5", "1.0.0", "nan", "inf", "1e", "0x10", "1_000", "--1"])
def test_what_is_no_real_is_refused(text):
    with pytest.raises(ValueError, match="is not a number"):
        fortran_real(text)


@given(st.lists(st.tuples(REALS, REALS), min_size=1, max_size=20))
def test_a_table_comes_back(rows):
    from pathlib import Path

    for separator, letter in ((" ", "E"), (",", "D"), ("\n", "e")):
        text = "\n".join(separator.join(f"{v:.16E}".replace("E", letter) for v in row) for row in rows)
        np.testing.assert_array_equal(number_table(text.encode(), 2, Path("a")), rows)


@pytest.mark.parametrize("data", [b"1 2 3", b"1 two", b"", b"1 2\x00", b"1 2e", "1 2 \u0663 4".encode()])
def test_a_table_that_is_none_is_refused(tmp_path, data):
    with pytest.raises(InputError, match=r"^a: "):
        number_table(data, 2, tmp_path / "a")


@pytest.mark.parametrize("values", [[0.0], [1.5], [np.nan], [np.inf], [2.0**53], [-3.0]])
def test_labels_are_whole_and_positive(tmp_path, values):
    assert whole_numbers(np.array([1.0, 2.0**53 - 1]), "labels", tmp_path / "a").tolist() == [1, 2**53 - 1]
    with pytest.raises(InputError, match="are not all whole numbers from 1 up"):
        whole_numbers(np.array(values), "labels", tmp_path / "a")


def test_a_label_of_any_length_is_a_number_or_a_sentence():
    assert whole_number("-12") == -12
    for text in ("9" * 19, "9" * 5000, "1.0", ""):
        with pytest.raises(ValueError, match=r"."):
            whole_number(text)


def test_files_that_are_missing_empty_folders_or_too_large(tmp_path, monkeypatch):
    (tmp_path / "empty").touch()
    (tmp_path / "file").write_bytes(b"12345")
    assert read_bytes(tmp_path / "file") == b"12345"
    monkeypatch.setattr(text_numbers, "LARGEST_TEXT_FILE", 4)
    for name, said in (("none", "no such file"), (".", "no such file"), ("empty", "is empty"), ("file", "larger than")):
        with pytest.raises(InputError, match=said):
            read_bytes(tmp_path / name)


def test_sizes_beyond_the_file_are_refused_before_memory_is_taken(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"x" * 100)
    require_plausible(2**20, 100, path)
    for rows, entries in ((0, 1), (-1, 1), (2**20 + 1, 1), (10**12, 1), (1, 101), (1, -1)):
        with pytest.raises(InputError, match="damaged or truncated"):
            require_plausible(rows, entries, path)
