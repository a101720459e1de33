"""Motion of every sector of a disc: that of a wave from sector to sector, or that of a whole disc."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import shown, text
from slipstick.results.view import names_of
from slipstick.typing import Array

if TYPE_CHECKING:
    from xarray import DataArray

    from slipstick.results.solutions import Solutions


class Disc(NamedTuple):
    """Sectors of a disc and their dofs in the results.

    Attributes
    ----------
    sectors
        Number of sectors N.
    engine_order
        Of the fundamental frequency: sector s moves with the delay 2 pi s E / N of phase. 0 of a whole disc.
    whole
        Whether every sector has dofs of its own, ``tip@0`` to ``tip@23``.
    dofs
        Names of dofs that every sector has in the results, with the places (sectors,) there.
    """

    sectors: int
    engine_order: int
    whole: bool
    dofs: dict[str, list[int]]

    @property
    def delays(self) -> Array:
        """Phase (sectors,) in rad by which each moves later than its own coefficients say."""
        return 2.0 * np.pi * np.arange(self.sectors) * self.engine_order / self.sectors


def disc_of(branch: Solutions) -> Disc | None:
    """The disc of which these are results; None where they are of something else, or without their problem."""
    around = None if branch.problem is None else branch.problem.structure.around
    if around is None:
        return None
    sectors = around.sectors
    places = {name: place for place, name in enumerate(names_of(branch.table, "dof"))}
    if not around.whole:
        dofs = {name: [place] * sectors for name, place in places.items() if "@" not in name}
        return Disc(sectors, around.engine_order, False, dofs)
    names = dict.fromkeys(name.rpartition("@")[0] for name in places)
    every = {name: [places.get(f"{name}@{s}", -1) for s in range(sectors)] for name in names}
    return Disc(sectors, 0, True, {name: where for name, where in every.items() if min(where) >= 0})


def amplitude_on_disc(solutions: Solutions, dof: str) -> DataArray:
    """See ``Branch.on_disc``."""
    from xarray import DataArray

    disc, table = disc_of(solutions), solutions.table
    if disc is None:
        raise InputError("on_disc: the results are not of a travelling wave or a disc, or without their problem")
    dof = text("dof", dof)
    if dof not in disc.dofs:
        known = names_of(table, "dof")
        whole_disc = [f"{dof}@{s}" for s in range(disc.sectors)] if disc.whole else [dof]
        missing = next((name for name in whole_disc if name not in known), dof)
        raise InputError(f"on_disc: there is no dof {shown(missing)} in the results")
    values, sectors = table["amplitude"].to_numpy()[:, disc.dofs[dof]], disc.sectors
    coords = {solutions.followed: ("point", table[solutions.followed].to_numpy()), "sector": np.arange(sectors)}
    return DataArray(
        values, dims=("point", "sector"), coords=coords, name="amplitude", attrs=dict(table["amplitude"].attrs)
    )
