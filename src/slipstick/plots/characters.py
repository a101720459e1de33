"""Characters that the font of the figures lacks: drawn in another font of this machine, else told in one sentence."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING
from unicodedata import name

from slipstick.faults import warn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BOXES = ("Last Resort", "LastResort", ".LastResort")
"""How fonts are called that have a box for every character."""


@contextmanager
def drawn_in_known_characters(figure: Figure, *, tell: bool = True) -> Iterator[None]:
    """Context in which a figure is drawn: texts take fonts that have their characters.

    Warns
    -----
    SlipstickWarning
        Where no font has one, and ``tell``; matplotlib would say so of each character each time it is drawn.
    """
    from matplotlib.text import Text

    unknown: set[str] = set()
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        lacking = [character for character in dict.fromkeys(text.get_text()) if not _usual(character)]
        found = {character: _font_with(character) for character in lacking}
        unknown |= {character for character, font in found.items() if font is None}
        if others := dict.fromkeys(font for font in found.values() if font is not None):
            text.set_fontfamily(list(dict.fromkeys([*text.get_fontfamily(), *others])))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r"Glyph \d+ ", UserWarning)
        yield
    if unknown and tell:
        scripts = sorted({name(character, "some").partition(" ")[0] for character in unknown})  # "CJK", "THAI"
        warn([
            f"figures: no font of this machine has their {' and '.join(scripts)} characters; boxes stand in their "
            "place: install a font that has them, such as one of Noto"
        ])  # fmt: skip


@cache
def _usual(character: str) -> bool:
    """Whether the font of the figures has a character, or it needs none."""
    from matplotlib.font_manager import FontProperties, findfont
    from matplotlib.ft2font import FT2Font

    if character.isascii() or not character.isprintable():
        return True
    return bool(FT2Font(findfont(FontProperties())).get_char_index(ord(character)))


@cache
def _font_with(character: str) -> str | None:
    """The name of a font that has a character."""
    from matplotlib.font_manager import fontManager
    from matplotlib.ft2font import FT2Font

    for font in fontManager.ttflist:
        if not font.name.startswith(_BOXES):
            try:
                if FT2Font(font.fname).get_char_index(ord(character)):
                    return font.name
            except (OSError, RuntimeError):  # gone since the list was made, or damaged
                continue
    return None
