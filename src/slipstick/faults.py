"""Checks of what users give: the value as it is computed with, or a fault that says what was expected."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import wraps
from itertools import islice
from numbers import Integral, Real
from os import PathLike, fspath, stat
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from slipstick.errors import Fault, InputError, SlipstickWarning, Where, close_names
from slipstick.quantities import WithUnit, frequency_unit, read_frequency, unit_of_time_fault

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from slipstick.units import Units

    Array = NDArray[np.float64]

T = TypeVar("T")
P = ParamSpec("P")

Name = str | Where
"""What a checked value is called: its name, or the path to it."""

MOST_ITEMS = 1_000_000
"""No more of anything is computed or recorded by one call; an endless iterator is refused here, a long list is not."""

LARGEST = 1e100
"""No quantity of a machine is above it in any units; beyond, products overflow."""

SMALLEST = 1.0 / LARGEST
"""What must not be zero is not below it either."""

_LISTED = 12

_PASSED_BY = ("slipstick", "dataclasses", "functools", "contextlib")


class Gathering:
    """Collects the faults of several checks so that a user hears of all at once.

    >>> gathering = Gathering()
    >>> gathering.take(number, "kt", "a"), gathering.take(number, "mu", 0.3)
    (None, 0.3)
    >>> [str(fault) for fault in gathering.faults]
    ["kt: found 'a'; expected a finite number"]
    """

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def __enter__(self) -> Gathering:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        """The faults of an InputError are kept, and what comes after the block goes on."""
        if isinstance(error, InputError):
            self.faults += error.faults
            return True
        return False

    def take(self, check: Callable[P, T], *args: P.args, **options: P.kwargs) -> T | None:
        """What a check makes of a value, or None and its faults are kept."""
        return self.inside((), check, *args, **options)

    def optional(self, check: Callable[..., T], name: Name, value: object, *args: Any, **options: Any) -> T | None:
        """As ``take``; None is a value that is left out."""
        return None if value is None else self.take(check, name, value, *args, **options)

    def inside(self, where: Where, check: Callable[P, T], *args: P.args, **options: P.kwargs) -> T | None:
        """As ``take`` for a check that does not know what its value is part of."""
        try:
            return check(*args, **options)
        except InputError as error:
            self.faults += [fault.inside(*where) for fault in error.faults]
            return None

    def end(self, *where: str | int) -> None:
        """Raise InputError with all faults, which lie in ``where``, if there are any."""
        if self.faults:
            raise InputError([fault.inside(*where) for fault in self.faults])


def path_of(name: Name) -> Where:
    """The path to a value that has a name, or a path already."""
    return (name,) if isinstance(name, str) else name


def shown(value: Any, limit: int = 60) -> str:
    """A value as Python writes it, on one short line.

    >>> shown([1.0] * 50)
    '[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1...'
    """
    try:
        few = _of_numpy(value) and 0 < value.size <= 1000
        text = plain(value) if few else repr(value)
    except Exception:  # such as an integer of more digits than Python writes
        text = f"a {type(value).__name__}"
    text = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    return text if len(text) <= limit else text[: limit - 3] + "..."


def plain(value: Any) -> str:
    """A value as it can be typed again: arrays as lists, numpy's numbers as Python's.

    >>> import numpy as np
    >>> plain(np.array([1.0, 2.0])), plain({1: np.float64(0.1 + 0.2)}), plain("x")
    ('[1.0, 2.0]', '{1: 0.30000000000000004}', "'x'")
    """
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{plain(key)}: {plain(item)}' for key, item in value.items())}}}"
    return repr(value.tolist() if _of_numpy(value) else value)


def wrong(name: Name, value: object, expected: str) -> InputError:
    """The exception for a value that is not what was expected."""
    return InputError(Fault(path_of(name), found=shown(value), expected=expected))


def suggestion(name: object, known: Iterable[str]) -> str:
    """A close match among the known names, or some of these.

    >>> suggestion("stifness", ["mass", "stiffness"]), suggestion("q", ["x", "y"])
    ("did you mean 'stiffness'?", 'there are x, y')
    """
    names = list(known)
    if close := close_names(name if isinstance(name, str) else shown(name), names):
        return f"did you mean '{close[0]}'?"
    return f"there are {enumerated(names)}" if names else "there are none"


def enumerated(names: Sequence[str]) -> str:
    """Names with commas between, the first twelve of them.

    >>> enumerated(["x", "y"])
    'x, y'
    """
    more = f", ... ({len(names)} in all)" if len(names) > _LISTED else ""
    return f"{', '.join(names[:_LISTED])}{more}"


def number(name: Name, value: object, expected: str = "a finite number", *, above: float = -float("inf")) -> float:
    """One finite real number >= ``above``."""
    scalar = _scalar(value)
    if isinstance(scalar, Real) and not isinstance(scalar, bool):
        try:
            result = scalar if isinstance(scalar, WithUnit) else float(scalar)
        except (OverflowError, ValueError):
            result = float("inf")
        if 0.0 < abs(result) < SMALLEST:
            raise wrong(name, value, f"{expected}, 0 or above {SMALLEST:g}: check the units")
        if abs(result) <= LARGEST and result >= above:
            return result
        if LARGEST < abs(result) < float("inf"):
            expected = _below_largest(expected)
    raise wrong(name, value, expected)


def frequency(name: Name, value: object, units: Units | None = None) -> float:
    """One frequency > 0, rad/s, from a number or a text such as "15 Hz", "3000 rpm"."""
    omega = in_radians(name, value, units)
    if isinstance(value, str) and omega <= 0:
        raise wrong(name, value, "a frequency > 0")
    return number(name, omega, "a frequency > 0 in rad/s", above=SMALLEST)


def in_radians(name: Name, value: object, units: Units | None = None) -> Any:
    """A text with the unit of a frequency as a number, rad/s; what is no text stays as it is.

    >>> in_radians("omega", "3000 rpm"), in_radians("omega", 2.0)
    (314.1592653589793, 2.0)
    """
    if not isinstance(value, str):
        return value
    if units is not None and not units.in_seconds and frequency_unit(value) is not None:
        raise InputError(unit_of_time_fault(path_of(name), shown(value), units.time, units.angular))
    try:
        return read_frequency(value)
    except InputError as error:
        faults = [replace(fault, found=shown(value)).inside(*path_of(name)) for fault in error.faults]
        raise InputError(faults) from None


def whole(name: Name, value: object, least: int = 0, most: int | None = None) -> int:
    """One whole number; 2.0 is one too."""
    limits = f">= {least}" if most is None else f"from {least} to {most}"
    expected = f"a whole number {limits}"
    scalar = _scalar(value)
    if isinstance(scalar, float) and scalar.is_integer():
        scalar = int(scalar)
    if isinstance(scalar, bool) or not isinstance(scalar, Integral):
        raise wrong(name, value, expected)
    result = int(scalar)
    if result < least or (most is not None and result > most):
        raise wrong(name, value, expected)
    return result


def point_numbers(name: Name, value: Any, count: int) -> list[int]:
    """Numbers of points among ``count``, from 0; negative ones count from the end, None is all.

    >>> point_numbers("points", [0, -1], 5), point_numbers("points", 2, 5)
    ([0, 4], [2])
    """
    if value is None:
        return list(range(count))
    given = value.tolist() if _of_numpy(value) else value
    given = list(given) if isinstance(given, list | tuple | range) else [given]
    if not given:
        raise wrong(name, value, f"numbers of points such as [0, 5], each below {count}")
    return [whole(name, k, -count, count - 1) % count for k in given]


def numbers(name: Name, value: object, expected: str = "finite real numbers") -> Array:
    """Finite real numbers of any shape, as a new array."""
    import numpy as np

    try:
        array = np.asarray(value)
    except Exception:  # rows of different lengths, objects that refuse
        raise wrong(name, value, expected) from None
    if array.dtype.kind not in "iuf":
        raise wrong(name, value, expected)
    copy = array.astype(float)
    if not np.vdot(copy, copy) <= LARGEST**2 and not np.abs(copy).max(initial=0.0) <= LARGEST:
        raise wrong(name, value, _below_largest(expected) if np.all(np.isfinite(array)) else expected)
    return copy


MEASURED = f"a number, none above {LARGEST:g}, or nan where nothing was measured"
"""What is expected of each measured number."""


def no_measured_numbers(values: Any) -> list[int]:
    """Flat places of real or complex numbers that nobody measured: infinite ones and those above ``LARGEST``.

    nan is what is missing.

    >>> import numpy as np
    >>> no_measured_numbers(np.array([1.0, np.nan, np.inf, -1e300, 1e300j]))
    [2, 3, 4]
    """
    import numpy as np

    array = np.asarray(values)
    if array.dtype.kind not in "fc":
        return []
    large = np.fmax(np.abs(array.real), np.abs(array.imag)) > LARGEST  # false of nan
    return list(map(int, np.flatnonzero(large)))


def count_or_numbers(name: Name, value: object, expected: str) -> int | Array:
    """A whole number >= 1, or an array with dimensions."""
    if isinstance(value, list | tuple) or _shape(value):
        return numbers(name, value, expected)
    return whole(name, value, 1, MOST_ITEMS)


def number_or_numbers(name: Name, value: object, expected: str = "a finite number, or one for each element") -> Any:
    """A float, or an array (n_elements,) of finite numbers that nothing outside can change."""
    array = numbers(name, value, expected)
    if array.ndim > 1 or array.size == 0:
        raise wrong(name, value, expected)
    if array.ndim == 0:
        return float(array)
    array.flags.writeable = False
    return array


def same_length(name: Name, values: Mapping[str, Any]) -> None:
    """InputError where lists (n_elements,) have different lengths; single numbers fit all."""
    import numpy as np

    sizes = {key: int(np.size(value)) for key, value in values.items() if np.size(value) > 1}
    if len(set(sizes.values())) > 1:
        listed = ", ".join(f"{size} of {key}" for key, size in sizes.items())
        raise InputError(Fault(path_of(name), "the numbers of elements do not agree", found=listed))


def text(name: Name, value: object, expected: str = "a text") -> str:
    """A text."""
    if not isinstance(value, str) or "\0" in value:
        raise wrong(name, value, expected)
    return str(value)


def truth(name: Name, value: object) -> bool:
    """True or False."""
    return one(name, value, bool, "True or False")


def path(name: Name, value: object, expected: str = "the path of a file") -> Path:
    """A path that the system accepts, whether there is a file or not."""
    if not isinstance(value, str | PathLike) or value == "" or not isinstance(fspath(value), str):
        raise wrong(name, value, expected)
    if reason := unreached(value):
        described = f"{shown(fspath(value), _LONGEST_PATH)}, which cannot be reached ({reason})"
        raise InputError(Fault(path_of(name), found=described, expected=expected))
    return Path(value)


def unreached(place: str | PathLike[str]) -> str:
    """Why the system cannot reach a path; empty where it can, and where nothing is there."""
    try:
        stat(place)
    except FileNotFoundError:
        pass
    except (OSError, ValueError) as error:  # too long, not permitted, a zero character, links in a circle
        return getattr(error, "strerror", None) or str(error)
    return ""


def real_path(place: Path) -> Path:
    """The absolute path behind links; ``Path.resolve`` fails, in some versions, where these lead in a circle."""
    return Path(realpath(place))


def one(name: Name, value: object, kind: type[T] | tuple[type[T], ...], expected: str) -> T:
    """One object of a class."""
    if not isinstance(value, kind):
        raise wrong(name, value, expected)
    return value


def listed(name: Name, value: object, expected: str) -> tuple[Any, ...]:
    """The items of a list, tuple, array, generator; a text or a table is not a list."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise wrong(name, value, expected)
    most = None if isinstance(value, list | tuple) or _shape(value) is not None else MOST_ITEMS + 1
    try:
        items = tuple(islice(value, most))
    except TypeError:  # such as an array without dimensions
        raise wrong(name, value, expected) from None
    if len(items) == most:
        raise wrong(name, value, f"{expected}, at most {MOST_ITEMS} of them")
    return items


def one_or_listed(name: Name, value: object, expected: str) -> tuple[Any, ...]:
    """As ``listed``; one item alone, a text too, is a list of it."""
    alone = isinstance(value, str) or not isinstance(value, Iterable) or _shape(value) == ()
    return (value,) if alone else listed(name, value, expected)


def table(name: Name, value: object, expected: str) -> dict[str, Any]:
    """Values by name, of a dict or another mapping."""
    if not isinstance(value, Mapping):
        raise wrong(name, value, expected)
    for key in value:
        text((*path_of(name), "name"), key)
    return dict(value)


def several(name: Name, value: object, kind: type[T], expected: str) -> tuple[T, ...]:
    """Objects of a class; one alone is taken too. ``expected`` names one of them, such as "an ss.Load"."""
    if isinstance(value, kind):
        return (value,)
    items = listed(name, value, f"{expected}, or a list of them")
    faults = [
        Fault((*path_of(name), place), found=shown(item), expected=expected)
        for place, item in enumerate(items)
        if not isinstance(item, kind)
    ]
    if faults:
        raise InputError(faults[:_LISTED])
    return items


def names(name: Name, value: object, expected: str = "the name of a dof") -> tuple[str, ...]:
    """Texts; one alone is taken too."""
    return tuple(str(item) for item in several(name, value, str, expected))


_ALIKE, _NAMED = 5, 3
_LONGEST_PATH = 200
"""Characters shown of a path, whose end says most."""
_OF_CONTACT, _NUMBERS = re.compile(r"contact '(.+?)': "), re.compile(r"[-+]?\d[\d.e+-]*")


def few_alike(sentences: Iterable[str]) -> list[str]:
    """Sentences, of which more than five that differ in the contact and in numbers alone are one.

    >>> few_alike(f"contact 'c{k}': the gap {k}.5 is open" for k in range(1, 101))
    ["contact 'c1': the gap 1.5 is open; likewise 99 more contacts: 'c2', 'c3', 'c4', ..."]
    """
    groups: dict[str, list[tuple[str, str]]] = {}
    for sentence in dict.fromkeys(sentences):
        found = _OF_CONTACT.match(sentence)
        key = sentence if found is None else _NUMBERS.sub("#", f"contact: {sentence[found.end() :]}")
        groups.setdefault(key, []).append(("" if found is None else found[1], sentence))
    out = []
    for (_, first), *others in groups.values():
        if len(others) < _ALIKE:
            out += [first, *(sentence for _, sentence in others)]
        else:
            some = ", ".join(f"'{name}'" for name, _ in others[:_NAMED])
            out.append(f"{first}; likewise {len(others)} more contacts: {some}, ...")
    return out


def warn(sentences: Iterable[str], category: type[Warning] = SlipstickWarning) -> None:
    """Give each sentence as a warning at the user's own line.

    Steps over the frames of this package and of what stands between it and its user, so that it does not matter how
    deep the caller is.
    """
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and str(frame.f_globals.get("__name__", "")).partition(".")[0] in _PASSED_BY:
        level, frame = level + 1, frame.f_back
    for sentence in sentences:
        warnings.warn(sentence, category, stacklevel=level)


def old_names(**names: str) -> Callable[[Callable[P, T]], Callable[P, T]]:
    """Decorator of a function that takes arguments by their old names too, ``old_names(old="new")``.

    An old name gives a DeprecationWarning with the new one. Both together raise InputError.
    """

    def decorated(function: Callable[P, T]) -> Callable[P, T]:
        @wraps(function)
        def called(*arguments: P.args, **named: P.kwargs) -> T:
            for old in [name for name in names if name in named]:
                new = names[old]
                if new in named:
                    both = f"'{old}' is its old name, and both are given"
                    raise InputError(Fault(new, both, remedy=f"leave '{old}' out"))
                named[new] = named.pop(old)
                warn([f"{function.__name__}: the argument '{old}' is now called '{new}'"], DeprecationWarning)
            return function(*arguments, **named)

        return called

    return decorated


def _below_largest(expected: str) -> str:
    return f"{expected}, none above {LARGEST:g}: check the units"


def _scalar(value: object) -> Any:
    """An array without dimensions as the number it holds; anything else as it is."""
    return value.item() if _shape(value) == () and hasattr(value, "item") else value


def _shape(value: object) -> Any:
    """The shape of an array, or of a number of numpy; None of anything else. Numpy need not be loaded to tell."""
    return getattr(value, "shape", None)


def _of_numpy(value: Any) -> bool:
    """Whether it is an array, or a number of numpy."""
    return hasattr(value, "tolist") and hasattr(value, "dtype")
