"""The linear systems of a branch: structure and contacts as they are at a point, kept as long as they stay the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from slipstick.analysis.stability.dynamics import Dynamics, dynamics
from slipstick.analysis.stability.switched_system import Combinations, FrictionPorts
from slipstick.analysis.time_domain.piecewise_model import slider_values
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs
from slipstick.contact.friction_law import is_friction
from slipstick.errors import InputError
from slipstick.structure.checks import dense
from slipstick.typing import Array, IntArray

IN_MOTION = 4.0
"""Modes stay in motion up to this times the highest harmonic."""


def friction_batch(balance: Balance) -> int | None:
    """Number of the batch of friction contacts; None without any."""
    return next((k for k, batch in enumerate(balance.batches) if is_friction(batch.law)), None)


def friction_values(balance: Balance, detail: Detail) -> Mapping[str, Array]:
    """Parameters (n,) of the friction contacts at a point, then of the sliders that others consist of."""
    batch = friction_batch(balance)
    asked = detail.asked.batches
    own = dict.fromkeys(("kt", "mu", "kn", "gap"), np.zeros(0)) if batch is None else asked[batch].values
    more = [slider_values(balance.batches[k].law, asked[k].values) for k in slider_batches(balance)]
    return {name: np.concatenate([own[name], *(one[name] for one in more)]) for name in ("kt", "mu", "kn", "gap")}


def slider_batches(balance: Balance) -> list[int]:
    """Numbers of the batches whose contacts consist of sliders: they stand behind the friction contacts."""
    return [k for k, batch in enumerate(balance.batches) if batch.law.slider_count]


def port_numbers(balance: Balance, k: int) -> IntArray:
    """Numbers of the ports of a batch among all ports of the balance, (n_ports, n); -1 where there is none."""
    batch, numbers = balance.batches[k], np.arange(balance.n_ports)
    out = np.full((len(batch.ports), batch.count), -1)
    for place, port in zip(out, batch.ports, strict=True):
        place[port.members] = numbers[port.rows]
    return out


class LinearSystems:
    """Makes them when a point asks.

    Hysteretic damping is viscous, equal at each natural frequency or at ``damping_at``, rad/s.

    Attributes
    ----------
    in_time
        Whether the structure has equations in time; without, only :meth:`contacts` is known.
    law_ports
        Numbers of the ports of contacts of other laws among all ports, -1 where there is none, as ``LawsInTime`` has
        them. With such contacts all modes stay in motion.
    """

    def __init__(self, balance: Balance, *, full: bool, damping_at: float | None = None) -> None:
        self._balance, self._full = balance, full
        self._damping: dict[str, Any] = {} if damping_at is None else {"damping_at": damping_at}
        self._batch, sliders = friction_batch(balance), slider_batches(balance)
        others = [k for k in range(len(balance.batches)) if k not in (self._batch, *sliders)]
        rows = [np.concatenate([*port_numbers(balance, k)]) for k in others]
        self.law_ports = np.concatenate([np.zeros(0, dtype=int), *rows])
        none = np.zeros((2, 0), dtype=int)
        own: IntArray = none if self._batch is None else port_numbers(balance, self._batch)
        joints = [np.repeat(port_numbers(balance, k)[0], balance.batches[k].law.slider_count) for k in sliders]
        with_joints = np.concatenate([own[0], *joints])
        self._ports = np.stack([with_joints, np.append(own[1], np.full(len(with_joints) - len(own[1]), -1))])
        self._structures: dict[tuple[tuple[str, float], ...], Dynamics] = {}
        self._key: object = None
        self._known: Dynamics | None = None
        self._asked: Inputs | None = None
        self._contacts: FrictionPorts | None = None
        self._combinations: Combinations | None = None
        try:
            self._dynamics({}, 1.0)
            self.in_time = True
        except (InputError, NotImplementedError):
            self.in_time = False

    def contacts(self, detail: Detail) -> FrictionPorts:
        """The contacts with the parameters of a point."""
        asked = detail.asked
        if self._contacts is None or asked is not self._asked:
            values = friction_values(self._balance, detail)
            self._asked, self._contacts = asked, FrictionPorts(
                tangential=self._ports[0], normal=self._ports[1], kt=values["kt"], mu=values["mu"], kn=values["kn"],
                n_ports=self._balance.n_ports,
            )  # fmt: skip
        return self._contacts

    def at(self, detail: Detail) -> Combinations:
        """Those of a point."""
        contacts, structure, size = self.contacts(detail), self._dynamics(detail.inputs.structure, detail.omega), 0
        if not self._full and not self.law_ports.size:
            size = structure.count_below(IN_MOTION * self._balance.harmonics.highest * detail.omega)
        parameters = (p.tobytes() for p in (contacts.kt, contacts.mu, contacts.kn))
        key = (size, *parameters)
        if self._combinations is None or key != self._key or structure is not self._known:
            self._known = structure
            self._key = key
            self._combinations = Combinations(structure.slowest(size) if size else structure, contacts)
        return self._combinations

    def _dynamics(self, values: Mapping[str, float], omega: float) -> Dynamics:
        structure = self._balance.problem.structure
        own = structure.turning_with(omega)
        key = (*sorted(values.items()), *(() if own is structure else (("omega", omega),)))
        if key not in self._structures:
            changed = own.changed(**values) if values else own
            directions, driven = dense(self._balance.directions), self._balance.problem.load_columns
            columns = np.hstack([directions, driven.vectors])
            equations = changed.time_equations(directions, columns, driven.shapes, **self._damping)
            self._structures = {key: dynamics(equations)}
        return self._structures[key]
