"""Input files as blocks: every way of writing the same keyword gives the same block."""

import pytest

from slipstick.importers.abaqus.keywords import blocks

PLAIN = "*ELEMENT, TYPE=C3D8, ELSET=All\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"


@pytest.mark.parametrize(
    "text",
    [
        "*Element,type=c3d8,elset=all\n1,1,2,3,4,5,6,7,8\n",
        "** first\n\n*ELEMENT,\n TYPE=C3D8,\n ELSET=All\n** between\n1, 1, 2, 3, 4, 5, 6, 7, 8\n",
        '*ELEMENT, TYPE = C3D8, ELSET="All"\r\n1, 1, 2, 3, 4, 5, 6, 7, 8\r\n',
    ],
    ids=["case", "comments and continued keyword", "quotes and line ends"],
)
def test_the_same_block(text):
    (found,) = blocks(text)
    (plain,) = blocks(PLAIN)
    assert (found.keyword, found.parameters, found.rows) == (plain.keyword, plain.parameters, plain.rows)


def test_entries_that_go_on_are_joined_however_they_are_cut():
    words = [str(i) for i in range(1, 22)]
    for cut in range(1, 21):
        text = f"*ELEMENT, TYPE=C3D20\n{','.join(words[:cut])},\n{','.join(words[cut:])}\n99, 1\n"
        (block,) = blocks(text)
        assert list(block.joined()) == [(2, words), (4, ["99", "1"])]


def test_an_entry_cut_off_at_the_end_is_kept():
    (block,) = blocks("*ELEMENT, TYPE=C3D8\n1, 2, 3,\n")
    assert list(block.joined()) == [(2, ["1", "2", "3"])]


def test_lines_are_those_of_the_file():
    found = list(blocks("** a\n*NODE\n1, 0., 0., 0.\n** b\n2, 0., 0., 0.\n*SOLID SECTION,\nELSET=A\n*STEP"))
    assert [(block.shown, block.line, block.lines) for block in found] == [
        ("*NODE", 2, [3, 5]),
        ("*SOLID SECTION", 6, []),
        ("*STEP", 8, []),
    ]


def test_text_before_the_first_keyword_is_no_block():
    assert list(blocks("1, 2, 3\n")) == []
