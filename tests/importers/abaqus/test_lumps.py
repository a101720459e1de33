"""Point masses and springs of input files: frequencies as CalculiX has them, and what is refused."""

import numpy as np
import pytest
from helpers.abaqus import needs_ccx
from helpers.coupled import STEEL, beam, calculix, frequencies, lines_of
from helpers.input_file import CUBE, HELD, write

from slipstick.errors import InputError, SlipstickWarning
from slipstick.importers.import_model import read_model

HEAD = STEEL + lines_of(beam(), "A") + "*BOUNDARY\nAx0, 1, 3\n"
DECKS = {
    "a mass": "*ELEMENT, TYPE=MASS, ELSET=M\n9001, 25\n9002, 30\n*MASS, ELSET=M\n2.e-6\n",
    "a spring along its line": "*ELEMENT, TYPE=SPRINGA, ELSET=P\n9001, 25, 1\n*SPRING, ELSET=P\n\n3.e4\n",
    "a spring to ground": "*ELEMENT, TYPE=SPRING1, ELSET=P\n9001, 25\n*SPRING, ELSET=P\n2\n3.e4\n",
    "a spring between directions": "*ELEMENT, TYPE=SPRING2, ELSET=P\n9001, 25, 30\n*SPRING, ELSET=P\n2, 3\n3.e4\n",
}


@needs_ccx
@pytest.mark.parametrize("more", DECKS.values(), ids=DECKS)
def test_frequencies_are_those_of_calculix(tmp_path, more):
    ours = frequencies(read_model(write(tmp_path, HEAD + more)), 6)
    theirs = calculix(write(tmp_path, HEAD + more), 6)
    np.testing.assert_allclose(ours, theirs, rtol=1e-6)
    assert np.abs(ours / frequencies(read_model(write(tmp_path, HEAD)), 6) - 1.0).max() > 1e-3


def test_rotary_inertia_of_a_reference_node(tmp_path):
    reference = "*NODE\n1001, 43., 8., 6.\n*RIGID BODY, NSET=Ax1, REF NODE=1001\n"
    inertia = "*ELEMENT, TYPE=ROTARYI, ELSET=R\n9001, 1001\n*ROTARY INERTIA, ELSET=R\n1e-3, 2e-3, 3e-3, 1e-4\n"
    plain, heavy = (read_model(write(tmp_path, HEAD + reference + more)) for more in ("", inertia))
    at = [[model.index(f"n1001r{axis}") for axis in "xyz"] for model in (plain, heavy)]
    without, own = (model.M.toarray()[np.ix_(i, i)] for model, i in zip((plain, heavy), at, strict=True))
    added = own - without
    np.testing.assert_allclose(added, [[1e-3, 1e-4, 0], [1e-4, 2e-3, 0], [0, 0, 3e-3]], rtol=1e-9, atol=1e-15)


def test_dashpots_are_warned_of(tmp_path):
    more = "*ELEMENT, TYPE=DASHPOTA, ELSET=D\n9, 2, 3\n*DASHPOT, ELSET=D\n\n1.\n"
    with pytest.warns(SlipstickWarning, match="damping to 1 dashpots"):
        assert read_model(write(tmp_path, CUBE + HELD + more)).n_dofs == 12


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("*ELEMENT, TYPE=SPRING2, ELSET=P\n9, 2, 5\n*SPRING, ELSET=P\n1\n1.", "SPRING2 with 1 directions"),
        ("*ELEMENT, TYPE=SPRINGA, ELSET=P\n9, 2, 99\n*SPRING, ELSET=P\n1.", "names node 99"),
        ("*SPRING, ELSET=NOWHERE\n1.", "names NOWHERE"),
        ("*ELEMENT, TYPE=SPRINGA, ELSET=P\n9, 2, 5\n*SPRING, ELSET=P, NONLINEAR\n0., 0.\n1., 1.", "not linear"),
        ("*ELEMENT, TYPE=SPRINGA, ELSET=P\n9, 2, 2\n*SPRING, ELSET=P\n1.", "needs a distance"),
    ],
)
def test_springs_that_cannot_be_applied(tmp_path, more, said):
    with pytest.raises(InputError, match=said):
        read_model(write(tmp_path, CUBE + HELD + more + "\n"))
