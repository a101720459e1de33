"""Calls of public names, to be made or to be written in a script, and other pieces of Python text."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Mapping
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

from slipstick.quantities import WithUnit, frequency_unit

_WIDTH = 100
_CONSTANT = {"rad/s": "", "rad": "", "Hz": "HZ", "kHz": "KHZ", "rpm": "RPM", "deg": "DEG", "°": "DEG"}


class Code(NamedTuple):
    """A value that a script says in its own words: a variable, a file that it reads."""

    text: str
    value: Any = None


class Call(NamedTuple):
    """A call of a public name, to be made or to be written in a script.

    >>> call = Call("ss.Load", named={"dof": "x", "cos": 2.0})
    >>> call.written(), call.made()
    ('ss.Load(dof="x", cos=2.0)', Load(dof='x', cos=2.0))
    """

    name: str
    arguments: tuple[Any, ...] = ()
    named: Mapping[str, Any] = {}

    def but(self, **named: Any) -> Call:
        """The same with other arguments."""
        return self._replace(named={**self.named, **named})

    def made(self) -> Any:
        """What it returns."""
        import slipstick

        function = attrgetter(self.name.removeprefix("ss."))(slipstick)
        return function(*map(made, self.arguments), **{name: made(value) for name, value in self.named.items()})

    def written(self) -> str:
        """Its text in a script."""
        return call(self.name, *map(literal, self.arguments), **{n: literal(v) for n, v in self.named.items()})


def made(value: Any) -> Any:
    """A value of a call as it is passed on."""
    if isinstance(value, Call):
        return value.made()
    return value.value if isinstance(value, Code) else value


def literal(value: object) -> str:
    """A value of the file as Python writes it, long lists over several lines."""
    if isinstance(value, Call):
        return value.written()
    if isinstance(value, Code):
        return value.text
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return _enclosed("{", [f"{literal(key)}: {literal(inner)}" for key, inner in value.items()], "}")
    if isinstance(value, tuple):
        return f"({', '.join(map(literal, value))})"
    if isinstance(value, list):
        return _enclosed("[", [literal(item) for item in value], "]")
    if isinstance(value, WithUnit) and value.text:
        return quantity_text(value.text)
    return _number(value) if isinstance(value, float) else repr(value)


def _number(value: float) -> str:
    """The shortest text of exactly this number.

    >>> _number(2.08e11), _number(0.3), _number(1e-5), _number(27450.33)
    ('2.08e11', '0.3', '1e-5', '27450.33')
    """
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        return repr(value)
    texts = (f"{value:.{digits}e}" for digits in range(17))
    mantissa, _, exponent = next(text for text in texts if float(text) == value).partition("e")
    return f"{mantissa}e{int(exponent)}"


def call(name: str, /, *arguments: str, **named: str) -> str:
    """A call, over several lines where it is long."""
    return _enclosed(f"{name}(", [*arguments, *(f"{key}={value}" for key, value in named.items())], ")")


def _enclosed(start: str, items: list[str], end: str) -> str:
    inside = ", ".join(items)
    if len(start + inside) < _WIDTH and "\n" not in inside:
        return start + inside + end
    if all(len(item) < 30 and "\n" not in item for item in items) and start == "[":
        lines = textwrap.fill(f"{inside},", _WIDTH, break_long_words=False, break_on_hyphens=False)
    else:
        lines = ",\n".join(items) + ","
    return f"{start}\n{textwrap.indent(lines, '    ')}\n{end}"


def quantity_text(value: Any) -> str:
    """A number of the file, with its unit as a factor: "150 Hz" is ``150.0 * HZ``."""
    if not isinstance(value, str):
        return literal(float(value))
    unit = frequency_unit(value) or value.strip().lstrip("+-.0123456789eE ").lower()
    number = literal(float(value.strip()[: len(value.strip()) - len(unit)]))
    return f"{number} * {_CONSTANT[unit]}" if _CONSTANT[unit] else number


def listed_text(items: list[str]) -> str:
    """A list with an item a line."""
    if len(items) == 1 and len(items[0]) < _WIDTH and "\n" not in items[0]:
        return f"[{items[0]}]"
    inside = "".join(textwrap.indent(item, "    ") + ",\n" for item in items)
    return f"[\n{inside}]" if items else "[]"


def here(name: str, path: Path | None = None) -> Code:
    """The path of a file beside the script."""
    return Code(f"HERE / {literal(name)}", path)


def file_code(name: str, folder: Path) -> str:
    """Code that reads one matrix from a file."""
    from slipstick.structure.npz import array_shapes

    if name.lower().endswith(".mtx"):
        return f"mmread({here(name).text}, spmatrix=False)"
    arrays = list(array_shapes(folder / name))
    where = here(name).text
    return f"load_npz({where})" if "indptr" in arrays else f"np.load({where})[{literal(arrays[0])}]"
