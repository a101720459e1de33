"""A travelling wave before it moves: the sector at rest, and whether its disturbances grow (THEORY.md (24.8)).

A disturbance of the phase ``2 pi d / N`` from sector to sector vibrates with the stiffness of its nodal diameter, the
gas and the contacts as they are at rest. Only that of the wave's own phase becomes the wave.
"""

from __future__ import annotations

import numpy as np

from slipstick.analysis.self_excited.steady_sliding import ROUNDING, Sliding, SteadySliding
from slipstick.analysis.stability.floquet import StabilityWatch
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail
from slipstick.typing import Array


class WaveAtRest(SteadySliding):
    """The sector at rest over a parameter, and disturbances of all phases from sector to sector.

    Hysteretic damping and the gas are those of motion at positive frequencies, as in the balance itself.
    """

    def __init__(self, balance: Balance, parameter: str) -> None:
        super().__init__(balance, parameter)
        self._watch = StabilityWatch(self._balance)

    @property
    def in_time(self) -> bool:
        """Disturbances are known by their phases."""
        return True

    def _sliding(self, value: float, x: Array, detail: Detail) -> Sliding:
        waves = self._balance.receptance.adjusted(detail.inputs.structure).waves
        assert waves is not None
        form = self._watch.form(x, detail)
        stiffness = form.fixed.reshape(x.size, x.size).real
        own = waves.phase_number(1)
        exponents, shapes = waves.vibration(own, stiffness)
        order = np.lexsort((exponents.imag, -exponents.real))
        exponents, shapes = exponents[order], shapes[:, order]
        size = np.abs(exponents).max(initial=0.0)
        growing = {
            d: int(np.sum(waves.vibration(d, stiffness)[0].real > ROUNDING * size)) for d in range(waves.wave_numbers)
        }
        others = [d for d in growing if growing[d] and d != own]
        return Sliding(
            value=value, x=x, exponents=np.concatenate([exponents, exponents.conj()]),
            shapes=np.concatenate([shapes, shapes.conj()], axis=1), neutral=form.neutral,
            elsewhere=2 * sum(growing[d] for d in others),
            wave_number=(others[0] - own) % waves.wave_numbers if others else 0 if growing[own] else None,
        )  # fmt: skip
