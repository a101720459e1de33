"""A modal structure seen at its skin: how forces on its dofs move what is to be looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from slipstick.structure.modal import ModalStructure
from slipstick.structure.protocol import Receptance
from slipstick.structure.skin import Skin
from slipstick.typing import Array


@dataclass(frozen=True)
class AtSkin:
    """A structure whose receptance is to the ``k`` columns of a basis (3 n, k) of the motion of its skin."""

    structure: ModalStructure
    skin: Skin
    basis: Array

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance from directions ``columns`` (n_dofs, n_columns) and loads to the basis; ``rows`` do not matter.

        How what the modes leave out grows with frequency is not known at the skin.
        """
        static = np.column_stack([self.skin.static @ np.asarray(columns), *(self.skin.loads[name] for name in shapes)])
        left = self.basis.T @ self.skin.modes
        return self.structure.receptance_to(left, self.basis.T @ static, columns, shapes)
