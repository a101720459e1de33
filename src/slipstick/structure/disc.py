"""A whole disc by the modes of its tuned sectors: the blades may differ (THEORY.md section 24, (24.6))."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import whole
from slipstick.structure.checks import array_faults, number_faults, real, symmetry_faults
from slipstick.structure.cyclic import NEXT, CyclicStructure
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load


def tuned_modes(sector: CyclicStructure, families: int) -> tuple[Array, Array, Array]:
    """Frequencies (n,) of all phases, real modes of the ring by sector (N, n_dofs, n), and the static compliance.

    The compliance (N n_dofs, N n_dofs) is that of all families. A travelling pair gives a cosine and a sine.
    """
    N, n = sector.sectors, len(sector.dofs)
    omega, shapes, every = [], [], np.arange(N)
    static = np.zeros((N, n, n), dtype=complex)
    for k in range(N):
        modes = sector.phase_modes(k)
        static += modes.static * np.exp(-2j * np.pi * k * every / N)[:, None, None] / N
        if 2 * k > N:
            continue
        turned = np.exp(-2j * np.pi * k * every / N)[:, None, None] * modes.shapes[:, :families] / np.sqrt(N)
        alone = 2 * k % N == 0
        for part in (turned.real,) if alone else (np.sqrt(2.0) * turned.real, np.sqrt(2.0) * turned.imag):
            omega.append(modes.omega[:families])
            shapes.append(part)
    ring = static.real[(every[:, None] - every[None, :]) % N].transpose(0, 2, 1, 3).reshape(N * n, N * n)
    return np.concatenate(omega), np.concatenate(shapes, axis=2), ring


class Disc(ModalStructure):
    """All sectors of a disc, by its modes: dofs ``tip@0``, ``tip@1``, ... Made by ``CyclicStructure.mistuned``."""

    def __init__(self, *, sectors: int, **modal: Any) -> None:
        super().__init__(**modal)
        self.sectors = sectors

    @property
    def arguments(self) -> dict[str, Any]:
        """What an equal disc is made from."""
        return {**super().arguments, "sectors": self.sectors}

    def contacts(self, pair: ContactPair, engine_order: int = 0) -> ContactPair:
        """The contacts of all sectors of one given on ``dof`` and ``dof@next``: "shroud.1" is that of sector 0.

        Its rubbing motion is delayed by ``2 pi s engine_order / N`` at sector s.
        """
        every = range(self.sectors)
        directions = {
            side: [self._turned(cosines, s) for s in every]
            for side in ("tangential", "normal")
            if (cosines := getattr(pair, side)) is not None
        }
        if len(pair) != 1 or pair.ports:
            found = f"{len(pair)} contacts" if len(pair) != 1 else "ports"
            raise InputError(
                Fault(("contact", pair.name), found=found, expected="one contact of a sector, by tangential and normal")
            )
        rubbing = pair.rubbing
        delay = 2.0 * np.pi * engine_order * np.arange(self.sectors) / self.sectors
        for cos, sin in (("cos", "sin"), ("normal_cos", "normal_sin")):
            a, b = getattr(rubbing, cos), getattr(rubbing, sin)
            parts = {m: (a.get(m, 0.0) - 1j * b.get(m, 0.0)) * np.exp(-1j * m * delay) for m in {*a, *b}}
            if parts:
                turned = {cos: {m: z.real for m, z in parts.items()}, sin: {m: -z.imag for m, z in parts.items()}}
                rubbing = replace(rubbing, **turned)
        contact = pair.contact.changed(
            **{name: np.full(self.sectors, float(value)) for name, value in pair.contact.values.items()}
        )
        return replace(pair, contact=contact, rubbing=rubbing, **directions)

    def loads(self, load: Load, engine_order: int) -> list[Load]:
        """The loads of all sectors of one given for sector 0: a wave, at sector s ``2 pi s engine_order / N`` later."""
        E = whole("engine_order", engine_order)
        found = []
        for s in range(self.sectors):
            z = (load.cos - 1j * load.sin) * np.exp(-2j * np.pi * load.harmonic * E * s / self.sectors)
            place = {name: f"{getattr(load, name)}@{s}" for name in ("dof", "shape") if getattr(load, name) is not None}
            found.append(replace(load, **place, cos=float(z.real), sin=-float(z.imag) if load.harmonic else load.sin))
        return found

    def _turned(self, cosines: Mapping[str, float], s: int) -> dict[str, float]:
        return {
            f"{name.removesuffix(NEXT)}@{(s + name.endswith(NEXT)) % self.sectors}": cosine
            for name, cosine in cosines.items()
        }

    def __repr__(self) -> str:
        return f"Disc({self.sectors} sectors, {self.omega.size} modes)"


def mistuned_disc(sector: CyclicStructure, stiffness: ArrayLike, blade: ArrayLike, families: int | None = None) -> Disc:
    """See ``CyclicStructure.mistuned``."""
    N, n = sector.sectors, len(sector.dofs)
    families = n if families is None else whole("families", families, 1, n)
    faults = []
    for name, value, shape in (("stiffness", stiffness, (N,)), ("blade", blade, (n, n))):
        faults += number_faults(name, value) or array_faults(name, real(value), shape)
    faults = faults or symmetry_faults("blade", real(blade))
    if faults:
        raise InputError(faults)
    deviations, own = real(stiffness), real(blade)
    omega, shapes, static = tuned_modes(sector, families)
    K = np.diag(omega**2)
    for deviation, at in zip(deviations, shapes, strict=True):
        if deviation:
            K += deviation * at.T @ own @ at
    squared, turned = np.linalg.eigh(K)
    if squared[0] <= 0:
        raise InputError(Fault("stiffness", "makes the disc unstable", remedy="give deviations relative to the blade"))
    flat = shapes.reshape(N * n, -1)
    residual = static - (flat / omega**2) @ flat.T
    modes = flat @ turned
    return Disc(
        sectors=N, omega=np.sqrt(squared), mode_shapes=modes, loss_factor=sector.loss_factor,
        dofs=[f"{name}@{s}" for s in range(N) for name in sector.dofs],
        static_compliance=residual + (modes / squared) @ modes.T,
    )  # fmt: skip
