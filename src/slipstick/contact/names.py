"""Names of contacts: "tip.3" is the third of the contacts called tip, "tip 3" the third of the block called tip."""

from __future__ import annotations

from collections.abc import Sequence


def pair_of(name: str) -> str:
    """Name of a contact pair: of its k-th contact, "name.k", without the number.

    >>> pair_of("shroud.12"), pair_of("shroud")
    ('shroud', 'shroud')
    """
    return _without_number(name, ".")


def block_of(name: str) -> str:
    """Name of a block of contacts "name 1", "name 2", ..., as ``ss.surface_contacts`` makes them.

    >>> block_of("tip 12"), block_of("tip 12.3"), block_of("tip")
    ('tip', 'tip', 'tip')
    """
    return _without_number(pair_of(name), " ")


def standing_for(owner: str, names: Sequence[str]) -> list[int]:
    """Indices of the contacts of a name: a single contact, else those of a pair, else those of a block.

    >>> standing_for("tip", ["tip 1", "tip 2", "foot.1"]), standing_for("foot", ["tip 1", "foot.1"])
    ([0, 1], [1])
    """
    for called in (str, pair_of, block_of):
        if found := [i for i, name in enumerate(names) if called(name) == owner]:
            return found
    return []


def _without_number(name: str, mark: str) -> str:
    first, _, last = name.rpartition(mark)
    return first if first and last.isdigit() else name
