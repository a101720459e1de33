"""What is suspicious of pairs and sections of bolts, in the same words for every code."""

import numpy as np
import pytest
from helpers.ansys import stack_text
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError
from slipstick.importers.import_model import read_model

SIDES = """*SURFACE, NAME=Low, TYPE=ELEMENT
EALL, S1
*SURFACE, NAME=Front, TYPE=ELEMENT
EALL, S2
*NODE, NSET=PULL
77, 3., 3., 3.
*NODE, NSET=OTHER
78, 4., 3., 3.
*SURFACE INTERACTION, NAME=Dry
*FRICTION
0.3,
*SURFACE INTERACTION, NAME=Wet
*FRICTION
35.,
"""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "*CONTACT PAIR, INTERACTION=Wet\nLow, Front\n",
            "m.inp: contact pair LOW/FRONT has a coefficient of friction of 35: is it in percent?",
        ),
        ("*CONTACT PAIR\nLow\n", "m.inp: contact pair LOW/LOW is in contact with itself, which no joint can be"),
        (
            "*CONTACT PAIR\nLow, Front\nFront, Low\n",
            "m.inp: contact pair FRONT/LOW is LOW/FRONT with its sides exchanged: put contacts on one of the two",
        ),
        (
            "*CONTACT PAIR, INTERACTION=Dry\nLow, Front\n*CONTACT PAIR\nLow, Front\n",
            "*CONTACT PAIR gives LOW/FRONT again with other properties (): those before are kept",
        ),
        (
            "*PRE-TENSION SECTION, SURFACE=Low, NODE=77\n*PRE-TENSION SECTION, SURFACE=Front, NODE=77\n",
            "m.inp: pretension section FRONT shares the node 77 with the section LOW",
        ),
        (
            "*SURFACE, NAME=Same\nEALL, S1\n*PRE-TENSION SECTION, SURFACE=Low, NODE=77\n"
            "*PRE-TENSION SECTION, SURFACE=Same, NODE=78\n",
            "m.inp: pretension section SAME shares 1 faces with the section LOW, as one at node 1: the bolt is cut",
        ),
        ("*SURFACE, NAME=Nix\nEALL, S1\n*CONTACT PAIR\nLow, Front\n", ""),
    ],
)
def test_what_is_suspicious_is_told(tmp_path, text, said):
    model = read_model(write(tmp_path, CUBE + HELD + SIDES + text), quiet=True)
    ours = [sentence for sentence in model.warnings if "contact pair" in sentence or "pretension section" in sentence]
    assert any(said in sentence for sentence in model.warnings)
    assert bool(ours) == (bool(said) and "*CONTACT" not in said)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("*CONTACT PAIR, INTERACTION=Oil\nLow, Front\n", "names the interaction OIL, which the file does not have"),
        (
            "*PRE-TENSION SECTION, SURFACE=Low, NODE=2\n",
            "pretension section LOW has the node 2, which belongs to a solid element; give the load of the bolt a node",
        ),
    ],
)
def test_what_cannot_be_meant_is_refused(tmp_path, text, said):
    with pytest.raises(InputError) as caught:
        read_model(write(tmp_path, CUBE + HELD + SIDES + text))
    assert said in str(caught.value)


def test_parts_in_different_units_are_suspected(tmp_path):
    """The second of two bricks is a thousand times larger, far from the first one."""
    pytest.importorskip("mapdl_archive")
    pair = [(2, 2, 7, 1, [5, 6, 7, 8]), (2, 3, 7, 1, [9, 10, 11, 12])]
    lines = []
    for line in stack_text(pair).splitlines():
        label = line[:9].strip()
        if len(line) == 90 and label.isdigit() and 9 <= int(label) <= 16:
            places = [1000.0 * float(line[27 + 21 * i : 48 + 21 * i]) + 8000.0 for i in range(3)]
            line = line[:27] + "".join(f"{x:21.13E}" for x in places)
        lines.append(line)
    (tmp_path / "m.cdb").write_text("\n".join(lines) + "\n")
    model = read_model(tmp_path / "m.cdb", quiet=True)
    (said,) = (sentence for sentence in model.warnings if "apart" in sentence)
    assert said.startswith("m.cdb: contact pair contact 7/target 7 has surfaces that lie")
    assert said.endswith("they span 1 and 1e+03: is one in mm, one in m?")
    assert "nodes 7 and 9" in said


def test_matrices_may_hold_the_contacts(tmp_path):
    """Pairs of a mesh beside matrices are kept too; whether the other code's contacts are in these nobody can see."""
    path = write(tmp_path, CUBE + HELD + SIDES + "*CONTACT PAIR, INTERACTION=Dry\nLow, Front\n")
    whole = read_model(path, quiet=True)
    bundle = {"K": whole.K.toarray(), "M": whole.M.toarray(), "dof_nodes": whole.dof_nodes}
    np.savez(tmp_path / "m.npz", **bundle, dof_components=whole.dof_components + 1)
    model = read_model([tmp_path / "m.npz", path], quiet=True)
    assert model.contact_pairs == whole.contact_pairs
    assert any("the matrices may hold the contact stiffness of LOW/FRONT" in sentence for sentence in model.warnings)
