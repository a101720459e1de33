"""Files that an input file includes: the same model as one file; only from its own folder."""

import numpy as np
import pytest
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model


def test_an_included_file_is_part_of_the_text(tmp_path):
    whole = read_model(write(tmp_path, CUBE + HELD))
    nodes, rest = CUBE.split("*ELEMENT")
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "nodes.inc").write_text(nodes)
    (tmp_path / "rest.inc").write_text("*ELEMENT" + rest)
    text = "*Include, input=parts/nodes.inc\n** between\n*INCLUDE,INPUT=rest.inc\n" + HELD
    model = read_model(write(tmp_path, text))
    np.testing.assert_array_equal(model.K.toarray(), whole.K.toarray())
    assert "m.inp: 2 included files were read" in model.notes


def test_faults_name_the_file_they_are_in(tmp_path):
    (tmp_path / "more.inc").write_text("** a comment\n*BOUNDARY\n2, first\n")
    with pytest.raises(InputError, match=r"^more\.inc, line 2: \*BOUNDARY cannot be read"):
        read_model(write(tmp_path, CUBE + "*INCLUDE, INPUT=more.inc\n"))
    (tmp_path / "more.inc").write_text("*CONTACT\n")
    with pytest.raises(InputError, match=r"^more\.inc, line 1: \*CONTACT holds surfaces"):
        read_model(write(tmp_path, CUBE + "*INCLUDE, INPUT=more.inc\n" + HELD))


def test_files_elsewhere_missing_ones_and_rings_are_refused(tmp_path):
    deep = tmp_path / "deep"
    deep.mkdir()
    (tmp_path / "other.inc").write_text(HELD)
    (deep / "ring.inc").write_text("*INCLUDE, INPUT=ring.inc\n")
    for name, said in (
        ("../other.inc", r"\.\./other\.inc does not lie in the folder of the file"),
        (str(tmp_path / "other.inc"), "does not lie in the folder"),
        ("nowhere.inc", "there is no file nowhere.inc"),
        ("ring.inc", r"ring\.inc includes itself"),
        ("m.inp", r"m\.inp includes itself"),
        ("", "lacks INPUT="),
    ):
        with pytest.raises(InputError, match=said):
            read_model(write(deep, f"*INCLUDE, INPUT={name}\n" + CUBE + HELD))


def test_a_link_that_leads_out_of_the_folder_is_refused(tmp_path):
    deep = tmp_path / "deep"
    deep.mkdir()
    (tmp_path / "secret.inc").write_text(HELD)
    (deep / "link.inc").symlink_to(tmp_path / "secret.inc")
    with pytest.raises(InputError, match="does not lie in the folder"):
        read_model(write(deep, CUBE + "*INCLUDE, INPUT=link.inc\n"))
