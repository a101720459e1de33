"""File formats: one table, and a reader of one's own in it."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss
from slipstick.errors import InputError, Place, SlipstickWarning
from slipstick.fem.box import box
from slipstick.importers import formats
from slipstick.importers.deck import Deck
from slipstick.importers.findings import Table, Verdict
from slipstick.importers.formats import FORMATS, Format, format_of, register
from slipstick.importers.mesh_model import assemble_mesh
from slipstick.importers.text_numbers import reading

STEEL = ss.Material(young=2.1e5, poisson=0.3, density=7.8e-9)


def test_every_ending_has_one_format_with_a_reader_that_is_there():
    endings = [suffix for known in FORMATS for suffix in known.suffixes]
    assert len(endings) == len(set(endings))
    for known in FORMATS:
        assert callable(known.reader)


@pytest.fixture
def own_formats(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(formats, "FORMATS", [*FORMATS])
    return


CARDS = Table(("shell", Verdict.COUPLING, "adds a shell"), ("comment", Verdict.HARMLESS, ""))


@CARDS.reads("node")
def _node(deck: Deck, words: list[str], line: int) -> None:
    label, x, y, z = words
    deck.nodes[int(label)] = float(x), float(y), float(z)


@CARDS.reads("brick")
def _brick(deck: Deck, words: list[str], line: int) -> None:
    label, *nodes = map(int, words)
    deck.element("hex8", label, nodes, deck.place(line, "brick"))


@CARDS.reads("hold")
def _hold(deck: Deck, words: list[str], line: int) -> None:
    deck.held |= {(int(words[0]), axis) for axis in range(3)}


def read_tiny(path: Path) -> Deck:
    """A whole importer: lines of a name and numbers."""
    deck = Deck(source=path.name, units="N, mm, t, s", materials={"all": STEEL})
    for line, text in enumerate(path.read_text().splitlines(), 1):
        name, *words = text.split()
        entry = CARDS.get(name)
        if entry is not None and entry.read is not None:
            with reading(deck.place(line, name)):
                entry.read(deck, words, line)
        else:
            deck.look_up(CARDS, name, name, line)
    deck.build()
    return deck


def write_tiny(path: Path, more: str = "") -> Path:
    mesh = box((30.0, 10.0, 10.0), (3, 1, 1), "hex8")
    lines = [f"node {label} {' '.join(map(str, place))}" for label, place in enumerate(mesh.nodes.tolist(), 1)]
    lines += [f"brick {k} {' '.join(str(n + 1) for n in row)}" for k, row in enumerate(mesh.blocks["hex8"].tolist(), 1)]
    lines += [f"hold {node + 1}" for node in np.flatnonzero(mesh.nodes[:, 0] == 0.0)]
    path.write_text("\n".join(lines) + "\n" + more)
    return path


@pytest.mark.usefixtures("own_formats")
def test_a_reader_of_ones_own_is_one_function(tmp_path: Path) -> None:
    register(Format(suffixes=(".tiny",), holds="mesh", read=read_tiny))
    with pytest.warns(SlipstickWarning):
        model = ss.import_model(write_tiny(tmp_path / "bar.tiny", "comment\nodd 1\n"))
    same = assemble_mesh(
        Deck(mesh=box((30.0, 10.0, 10.0), (3, 1, 1), "hex8")), source="bar", material=STEEL, fixed=["x0"]
    )
    np.testing.assert_allclose(model.K.toarray(), same.K.toarray(), atol=1e-9 * abs(same.K).max())
    assert "bar.tiny: without effect here: comment" in model.notes
    assert any("line 25: odd is not understood" in warning for warning in model.warnings)
    structure = ss.reduced_body(model, keep=model.dofs[-1], modes=3).structure
    assert ss.Problem(structure).units.length == "mm"
    with pytest.raises(InputError) as caught:
        ss.import_model(write_tiny(tmp_path / "bar.tiny", "shell 1\n"))
    (fault,) = caught.value.faults
    assert fault.where == ("bar.tiny", "line 24", "shell")
    assert str(fault).startswith("bar.tiny, line 24: shell adds a shell; an assembly of the mesh here")
    with pytest.raises(InputError, match=r"bar\.tiny, line 24: brick: element 1 is given twice"):
        ss.import_model(write_tiny(tmp_path / "bar.tiny", "brick 1 1 2 3 4 5 6 7 9\n"))
    with pytest.raises(InputError, match=r"bar\.tiny, line 24: brick: element 9 has 3 nodes; expected 8, as of hex8"):
        ss.import_model(write_tiny(tmp_path / "bar.tiny", "brick 9 1 2 3\n"))
    with pytest.raises(InputError, match=r"bar\.tiny, line 24: node cannot be read \(not enough values"):
        ss.import_model(write_tiny(tmp_path / "bar.tiny", "node 99 1.0\n"))


@pytest.mark.usefixtures("own_formats")
def test_an_ending_that_is_known_is_not_taken() -> None:
    with raises_fault("suffixes", says="files of type '.inp' are read already"):
        register(Format(suffixes=(".tiny", ".INP".lower()), holds="mesh", read=read_tiny))
    assert format_of(Path("x.tiny")) is None
    assert format_of(Path("X.CDB")) is FORMATS[0]


def test_a_place_in_a_file_is_a_path_with_words() -> None:
    place = Place("a.inp", "line 3").at("*TIE")
    assert place == ("a.inp", "line 3", "*TIE")
    assert f"{place}" == "a.inp, line 3: *TIE"
