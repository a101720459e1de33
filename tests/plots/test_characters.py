"""Texts of figures in characters that the usual font lacks."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.ft2font import FT2Font

from slipstick.errors import SlipstickWarning
from slipstick.plots import characters, save_figure
from slipstick.plots.style import legend, styled

NAME = "摩擦"


@pytest.fixture
def no_other_font(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(characters, "_font_with", lambda character: None)


def drawn(name: str):
    ax = styled(None, name, "y")
    ax.plot([0.0, 1.0], [0.0, 1.0], label=name)
    legend(ax)
    return ax


@pytest.mark.usefixtures("no_other_font")
def test_what_no_font_has_is_one_sentence(tmp_path: Path) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        save_figure(drawn(NAME), tmp_path / "a", formats=("png",))
    (warning,) = caught
    assert warning.category is SlipstickWarning
    said = "figures: no font of this machine has their CJK characters; boxes stand in their place"
    assert str(warning.message).startswith(said)
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_another_font_that_has_them_draws_them(tmp_path: Path) -> None:
    """The fonts that matplotlib brings: STIX has signs that DejaVu lacks."""
    usual, other = (FT2Font(findfont(font)) for font in (FontProperties(), FontProperties(family=["STIXGeneral"])))
    sign = chr(next(code for code in other.get_charmap() if code > 0x2000 and not usual.get_char_index(code)))
    ax = drawn(sign)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        save_figure(ax, tmp_path / "a", formats=("png", "pdf"))
    name = characters._font_with(sign)
    assert name is not None
    assert ax.xaxis.label.get_fontfamily()[-1] == name
