"""Stability of one point after another of a branch."""

from __future__ import annotations

from typing import Any

import numpy as np

from slipstick.analysis.stability.dynamics import dynamics
from slipstick.analysis.stability.intervals import StickStarts, timeline
from slipstick.analysis.stability.iterate import Iteration
from slipstick.analysis.stability.laws import Combinations, Contacts
from slipstick.analysis.stability.monodromy import monodromy

class Watch:
    def __init__(self, balance: Any, full: bool=False) -> None:
        self.balance, self.iteration = balance, Iteration(balance)
        self.full=full
        eq = balance.problem.structure.time_equations(balance.directions, balance.directions)
        self.dynamics = dynamics(eq)
        self._key=None

    def at(self, x, detail):
        m = self.iteration(x, detail)
        b=self.balance
        (batch,) = b.batches
        g=m.given
        normal=np.full(batch.count,-1); normal[batch.ports[1].members]=np.arange(b.n_ports)[batch.ports[1].rows]
        tang=np.arange(b.n_ports)[batch.ports[0].rows]
        c=Contacts(tangential=tang, normal=normal, kt=g["kt"],mu=g["mu"],kn=g["kn"],velocity=g["v"]*detail.omega,n_ports=b.n_ports)
        d=self.dynamics if self.full else self.dynamics.below(4*b.harmonics.highest*detail.omega)
        key=(d.size,c.kt.tobytes(),c.mu.tobytes(),c.kn.tobytes())
        if key!=self._key: self._key, self.comb = key, Combinations(d,c)
        line = timeline(m)
        return monodromy(line, StickStarts(m,c,self.comb), self.comb, detail.omega), line
