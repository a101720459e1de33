"""Disturbances of a travelling wave by their wave number, as the whole ring has them (THEORY.md (24.7)).

A disturbance of wave number k has the phase ``2 pi k / N`` more from sector to sector than the wave itself. Its
harmonic m meets the receptance of another nodal diameter; the tangent of one sector's contacts is the same for all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from slipstick.analysis.stability.harmonic_form import FIRST_NODES, WHOLE_TOLERANCE, Answers, HarmonicForm, refined
from slipstick.structure.receptance import Waves
from slipstick.typing import AnyArray, Array, ComplexArray

_FINEST_STEP, _MOST_HALVINGS = 1e-9, 4
"""Shortest step over omega in which the phase is followed, and how often all steps are halved until a count repeats."""

_CANDIDATES, _RATES = 3, (0.05, 0.2)
"""Exponents begin at so many of the smallest determinants, at the margin and at these growth rates over omega."""


@dataclass(frozen=True, kw_only=True)
class Growing:
    """A disturbance that grows as ``e^(exponent t)``, with the phase ``2 pi wave_number / N`` from sector to sector."""

    wave_number: int
    exponent: complex


def wave_answers(waves: Waves, orders: Array, omega: float, k: int) -> Answers:
    """Receptances that a disturbance of wave number k meets, at any exponent."""
    n = waves.static.shape[0]

    def at(exponent: complex) -> ComplexArray:
        each = orders.astype(int).tolist()
        return np.array([waves.of_order(m, -1j * (exponent + 1j * m * omega), k)[:, :n] for m in each])

    return at


class WaveDisturbances:
    """All disturbances at one point.

    Parameters
    ----------
    form
        Of the sector.
    waves
        Receptances of the ring by wave number.
    margin
        Growth rate, rad/s, from which a disturbance counts.
    """

    def __init__(self, form: HarmonicForm, waves: Waves, margin: float) -> None:
        self._form, self._waves, self._margin = form, waves, margin
        self._contacts: dict[float, ComplexArray] = {}
        self.N = waves.wave_numbers
        self._distinct = range(self.N // 2 + 1)  # D of -k is the conjugate one

    @property
    def neutral(self) -> int:
        """Contacts of the sector that are stuck all period."""
        return self._form.neutral

    def matrices(self, k: int, exponents: AnyArray) -> ComplexArray:
        """``D_k`` at exponents (n,), harmonic by harmonic, (n, K n_ports, K n_ports)."""
        orders, omega = self._form.orders, self._form.omega
        w = -1j * (np.asarray(exponents)[:, None] + 1j * omega * orders)
        each = orders.astype(int).tolist()
        A = np.stack([self._waves.of_order(m, w[:, i], k) for i, m in enumerate(each)], axis=1)
        J = np.stack([self._contact_answer(complex(own)) for own in exponents])
        n, K, ports = J.shape[:3]
        D: ComplexArray = (A[..., :ports] @ J.reshape(n, K, ports, -1)).reshape(n, K * ports, K * ports)
        at = np.arange(K * ports)
        D[:, at, at] += 1.0
        return D

    def _contact_answer(self, exponent: complex) -> ComplexArray:
        """``J`` (K, n_ports, K, n_ports), the same for all wave numbers."""
        nu = exponent.imag
        if exponent.real != self._margin:
            return self._form.contact_answer(exponent).transpose(1, 0, 3, 2)
        if nu not in self._contacts:
            self._contacts[nu] = np.ascontiguousarray(self._form.contact_answer(exponent).transpose(1, 0, 3, 2))
        return self._contacts[nu]

    def _nodes(self, k: int) -> Array:
        """Initial frequencies, among them those at which a harmonic meets a mode of its nodal diameter."""
        omega, half = self._form.omega, 0.5 * self._form.omega
        found = [np.linspace(-half, half, FIRST_NODES)]
        for m in self._form.orders.astype(int).tolist():
            for sign in (1.0, -1.0):
                natural = self._waves.natural(int(sign) * (self._waves.phase_number(m) + k))
                found.append(sign * natural - m * omega)
        nodes = np.concatenate(found)
        return np.unique(nodes[np.abs(nodes) <= half])

    def count(self) -> int | None:
        """Number of growing disturbances of the whole ring; None where it is not known."""
        poles = self._growing_poles()
        if poles is None:
            return None
        nodes = {k: self._nodes(k) for k in self._distinct}
        known: dict[int, dict[float, complex]] = {k: {} for k in nodes}
        before: int | None = None
        for _ in range(_MOST_HALVINGS):
            total = 0.0
            for k in nodes:
                turned = self._turns(k, nodes[k], known[k])
                if turned is None:
                    return None
                turns, nodes[k] = turned
                total += turns * (1.0 if 2 * k % self.N == 0 else 2.0)
            number = round(-total / (2.0 * pi))
            if number == before and abs(-total / (2.0 * pi) - number) < WHOLE_TOLERANCE:
                return number + poles if number + poles >= 0 else None
            before = number
            nodes = {k: np.sort(np.concatenate([own, 0.5 * (own[1:] + own[:-1])])) for k, own in nodes.items()}
        return None

    def _turns(self, k: int, nodes: Array, known: dict[float, complex]) -> tuple[float, Array] | None:
        new = np.array([nu for nu in nodes.tolist() if nu not in known])
        if new.size:
            signs = np.linalg.slogdet(self.matrices(k, self._margin + 1j * new))[0]
            known.update(zip(new.tolist(), signs.tolist(), strict=True))

        def at(nu: float) -> complex:
            if nu not in known:
                known[nu] = complex(np.linalg.slogdet(self.matrices(k, np.array([self._margin + 1j * nu])))[0][0])
            return known[nu]

        return refined(at, nodes.tolist(), _FINEST_STEP * self._form.omega, known)

    def _growing_poles(self) -> int | None:
        """Growing poles of the ring without contacts; None where one is above all harmonics kept."""
        found = [s for d in range(self.N) for s in self._waves.growing(d) if s.real > self._margin]
        highest = (float(self._form.orders[-1]) + 0.5) * self._form.omega
        return 2 * len(found) if all(s.imag <= highest for s in found) else None

    def fastest(self) -> Growing | None:
        """The fastest growing disturbance, sought from where determinants are small; None if none is found."""
        found: list[Growing] = []
        for k in self._distinct:
            nodes = self._nodes(k)
            form = replace(self._form, answers=wave_answers(self._waves, self._form.orders, self._form.omega, k))
            for rate in (self._margin, *(share * self._form.omega for share in _RATES)):
                size = np.linalg.slogdet(self.matrices(k, rate + 1j * nodes))[1]
                inner = np.concatenate([[np.inf], size, [np.inf]])
                low = np.flatnonzero((size <= inner[:-2]) & (size <= inner[2:]))
                for at in low[np.argsort(size[low])][:_CANDIDATES]:
                    exponent = form.exponent(rate + 1j * float(nodes[at]))
                    if exponent is not None and exponent.real > self._margin:
                        found.append(Growing(wave_number=k, exponent=exponent))
        return max(found, key=lambda own: own.exponent.real, default=None)
