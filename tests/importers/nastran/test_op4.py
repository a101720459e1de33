"""OUTPUT4 files by hand from the documented format, and by an independent writer."""

import struct

import numpy as np
import pytest
from helpers.nastran import K, M, write_binary, write_text

from slipstick.errors import InputError
from slipstick.importers.nastran.matrices import read_op4

DENSE = """\
       3       3       6       2KGG     1P,3E23.16
       1       1       2
 4.0000000000000000E+00-1.0000000000000000E+00
       2       1       3
-1.0000000000000000E+00 3.0000000000000000E+00 5.0000000000000000E-01
       3       2       2
 5.0000000000000000E-01 2.0000000000000000E+00
       4       1       1
 1.0000000000000000E+00
       3       3       6       2MGG     1P,3E23.16
       1       1       1
 1.0000000000000000E+00
       3       3       1
 7.0000000000000000D-01
       4       1       1
 1.0000000000000000E+00
"""


# strings: the header counts words of 4 bytes, two a value; IS = row + 65536 (words + 1), here 196609 = row 1, 2 words
SPARSE = """\
       3       3       6       2KGG     1P,3E23.16
       1       0       5
  327681
 4.0000000000000000E+00-1.0000000000000000E+00
       2       0       7
  458753
-1.0000000000000000E+00 3.0000000000000000E+00 5.0000000000000000E-01
       3       0       5
  327682
 5.0000000000000000E-01 2.0000000000000000E+00
       4       1       1
 1.0000000000000000E+00
       3      -3       6       2MGG     1P,3E23.16
       1       0       8
       3       1
 1.0000000000000000E+00
       3       3
 0.0000000000000000E+00
       3       0       4
       3       3
 7.0000000000000000E-01
       4       1       1
 1.0000000000000000E+00
"""


@pytest.mark.parametrize("text", [DENSE, SPARSE], ids=["dense", "strings"])
def test_text_by_hand(tmp_path, text):
    (tmp_path / "a.op4").write_text(text)
    found = read_op4(tmp_path / "a.op4")
    np.testing.assert_array_equal(found["KGG"].toarray(), K)
    np.testing.assert_array_equal(found["MGG"].toarray(), M)


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
def test_text_round_trip(tmp_path, matrices, form):
    (tmp_path / "a.op4").write_text(write_text(matrices, form))
    for name, found in read_op4(tmp_path / "a.op4").items():
        np.testing.assert_array_equal(found.toarray(), matrices[name])


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize(("kind", "wide"), [(1, False), (2, False), (2, True)])
def test_binary_round_trip(tmp_path, matrices, form, order, kind, wide):
    (tmp_path / "a.op4").write_bytes(write_binary(matrices, form, order, kind, wide))
    found = read_op4(tmp_path / "a.op4")
    assert set(found) == set(matrices)
    for name in found:
        np.testing.assert_array_equal(found[name].toarray(), matrices[name])


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (DENSE[:200].encode(), "damaged or truncated"),
        (
            DENSE.replace("       3       3       6       2KGG", f"{3:8d}{10**12:15d}{6:8d}{2:8d}KGG").encode(),
            "op4|rows",
        ),
        (DENSE.replace("6       2KGG", "6       4KGG").encode(), "matrix KGG is complex; expected a real one"),
        (DENSE.replace("       2       1       3\n", "       2       2       3\n").encode(), "outside its 3 x 3"),
        (b"hello world\n", "not a readable op4 file"),
        (b"\x18\x00\x00\x00\x00\x00", "not a readable op4 file"),
        (struct.pack("<i4i", 24, 10**9, 10**9, 6, 2) + b"KGG     " + struct.pack("<i", 24), "claims 1000000000 rows"),
    ],
)
def test_faults_of_op4(tmp_path, content, sentence):
    (tmp_path / "a.op4").write_bytes(content)
    with pytest.raises(InputError, match=sentence) as caught:
        read_op4(tmp_path / "a.op4")
    assert len(caught.value.sentences) == 1


@pytest.mark.parametrize("form", ["dense", "strings", "big"])
def test_every_cut_of_an_op4_file_is_refused(tmp_path, matrices, form):
    data = write_binary(matrices, form)
    first_end = len(write_binary({"KAA": matrices["KAA"]}, form))
    for length in range(1, len(data), 37):
        if length == first_end:
            continue
        (tmp_path / "a.op4").write_bytes(data[:length])
        with pytest.raises(InputError):
            read_op4(tmp_path / "a.op4")
