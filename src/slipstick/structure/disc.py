"""A whole disc by the modes of its tuned sectors: the blades may differ (THEORY.md section 24, (24.6))."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import number, shown, suggestion, whole
from slipstick.structure.checks import array_faults, directions, known_shapes, number_faults, real, symmetry_faults
from slipstick.structure.cyclic import DIAGONAL, NEXT, CyclicStructure
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.protocol import Around, TimeEquations
from slipstick.structure.receptance import Factors, ModalReceptance, Receptance, SolvedReceptance
from slipstick.structure.truncation import Truncation
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem

MISTUNING = "mistuning"
"""The parameter that is a factor on all deviations."""
_STIFFNESS = "stiffness@"


@dataclass(frozen=True, kw_only=True)
class TunedModes:
    """Real modes of a ring of equal sectors: a travelling pair gives a cosine and a sine.

    Attributes
    ----------
    omega
        Natural frequencies (n,).
    shapes
        By sector (N, n_dofs, n), mass-normalised over the disc.
    static
        Exact static compliance of all families (N n_dofs, N n_dofs).
    damping
        Viscous damping between the modes (n, n); None without any.
    gas
        Stiffness of the gas between them, complex (n, n); None without any.
    blade
        Motion of the blades by sector (N, n_blade, n), that of the dofs where the sector has no blade.
    second
        Second-order residual (N n_dofs, N n_dofs), families left out included; None: no modes are left out.
    """

    omega: Array
    shapes: Array
    static: Array
    damping: Array | None
    gas: ComplexArray | None
    blade: Array
    second: Array | None


def tuned_modes(sector: CyclicStructure, families: int) -> TunedModes:
    """The first families of all phases."""
    N, n = sector.sectors, len(sector.dofs)
    omega: list[Array] = []
    shapes: list[Array] = []
    blade: list[Array] = []
    every = np.arange(N)
    static, damping, gas = np.zeros((N, n, n), dtype=complex), [], []
    second: ComplexArray | None = None
    for k in range(N):
        modes, turns = sector.phase_modes(k), np.exp(-2j * np.pi * k * every / N)[:, None, None]
        static += modes.static * turns / N
        count = min(families, modes.omega.size)
        if (left := modes.left_by(count)) is not None:
            second = left * turns / N + (0.0 if second is None else second)
        if 2 * k > N:
            continue
        alone, own = 2 * k % N == 0, sector.blade_rows(k)
        for moved, parts in ((modes.shapes, shapes), (modes.shapes if own is None else own, blade)):
            turned = turns * moved[:, :count] / np.sqrt(N)
            parts += [turned.real] if alone else [np.sqrt(2.0) * turned.real, np.sqrt(2.0) * turned.imag]
        omega += [modes.omega[:count]] * (1 if alone else 2)
        phases = (k,) if alone else (k, N - k)
        damping.append(_real_pair([_between(sector, d, count) for d in phases]))
        gas.append(_real_pair([_gas_between(sector, d, count) for d in phases]))
    apart = (every[:, None] - every[None, :]) % N
    ring, rest = (
        None if by is None else by.real[apart].transpose(0, 2, 1, 3).reshape(N * n, N * n) for by in (static, second)
    )
    assert ring is not None
    C = _block_diagonal(damping).real
    return TunedModes(
        omega=np.concatenate(omega), shapes=np.concatenate(shapes, axis=2), static=ring,
        damping=C if C.any() else None, gas=_block_diagonal(gas) if sector.aerodynamic else None,
        blade=np.concatenate(blade, axis=2), second=rest,
    )  # fmt: skip


def _between(sector: CyclicStructure, d: int, count: int) -> ComplexArray:
    """Viscous damping between the modes of a phase (count, count)."""
    damping = sector.phase_modes(d).damping
    full = damping if damping.ndim == 2 else np.diag(damping)
    return np.asarray(full[:count, :count], dtype=complex)


def _gas_between(sector: CyclicStructure, d: int, count: int) -> ComplexArray:
    gas = sector.gas_between(d, count)
    return np.zeros((count, count), dtype=complex) if gas is None else gas


def _real_pair(blocks: Sequence[ComplexArray]) -> ComplexArray:
    """Block of a wave and the opposite one on their cosine and sine; that of a standing wave itself."""
    if len(blocks) == 1:
        return blocks[0]
    one, zero = np.eye(len(blocks[0])), np.zeros_like(blocks[0])
    W = np.block([[one, -1j * one], [one, 1j * one]]) / np.sqrt(2.0)
    return np.asarray(W.conj().T @ np.block([[blocks[0], zero], [zero, blocks[1]]]) @ W)


def _block_diagonal(blocks: Sequence[ComplexArray]) -> ComplexArray:
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*blocks), dtype=complex)


def random_deviations(sectors: int, spread: float, seed: int) -> Array:
    """Normal random deviations (N,) of the standard deviation ``spread``; the same seed gives the same."""
    spread = number("spread", spread, "a number >= 0", above=0.0)
    return np.random.default_rng(whole("seed", seed)).normal(0.0, spread, sectors)


class Disc(ModalStructure):
    """All sectors of a disc by its modes: dofs ``tip@0``, ``tip@1``, ... ``CyclicStructure.mistuned`` makes it.

    The deviations are parameters, "stiffness@0" and so on, and "mistuning" is a factor on all of them. Viscous damping
    and the gas are those of the tuned sectors.

    Parameters
    ----------
    sector
        A tuned sector.
    stiffness, blade, families
        See ``CyclicStructure.mistuned``.
    mistuning
        Factor on the deviations.

    Raises
    ------
    InputError
        For arrays of another shape, and deviations that make the disc unstable.
    """

    def __init__(
        self,
        *,
        sector: CyclicStructure,
        stiffness: ArrayLike | None = None,
        blade: ArrayLike | None = None,
        families: int | None = None,
        mistuning: float = 1.0,
    ) -> None:
        N, n = sector.sectors, len(sector.dofs)
        self.sector, self.sectors = sector, N
        most = int(sector.phase_modes(0).omega.size)
        self.families = most if families is None else whole("families", families, 1, most)
        own = sector.blade_rows(0)
        self._knows_blade = own is not None and blade is None
        if own is not None and blade is None:
            blade, n_blade = np.eye(len(own)), len(own)
        else:
            n_blade = n
        self.blade, self.deviations = _checked(stiffness, blade, (N, n_blade))
        self.mistuning = number(MISTUNING, mistuning)
        self._tuned = tuned_modes(sector, self.families)
        flat = self._tuned.shapes.reshape(N * n, -1)
        self._flat, self._rest = flat, self._tuned.static - (flat / self._tuned.omega**2) @ flat.T
        if self.families == most == n:
            self._rest[:] = 0.0  # no modes are left out: rounding
        omega, turned = self._modes()
        shapes = {
            f"{name}@{s}": self._load_shape(sector.load_vector(name), s, omega, turned)
            for s in range(N)
            for name in sector.load_shapes
        }
        super().__init__(
            omega=omega, mode_shapes=flat @ turned, dofs=[f"{name}@{s}" for s in range(N) for name in sector.dofs],
            static_compliance=self._static(omega, turned), loss_factor=sector.loss_factor, damping=sector.damping,
            damping_ratio=self._ratios(omega, turned), load_shapes=shapes, second_residual=self._tuned.second,
        )  # fmt: skip
        self._turned, self.units = turned, sector.units

    @property
    def around(self) -> Around:
        """Its cyclic symmetry: the whole disc."""
        return Around(self.sectors, 0, whole=True)

    def _modes(self) -> tuple[Array, Array]:
        """Frequencies of the disc, and its modes by the tuned ones."""
        K = np.diag(self._tuned.omega**2)
        if self.blade is None or not np.any(self.mistuning * self.deviations):
            return self._tuned.omega, np.eye(len(K))
        for deviation, at in zip(self.mistuning * self.deviations, self._moved, strict=True):
            if deviation:
                K += deviation * at.T @ self.blade @ at
        squared, turned = np.linalg.eigh(K)
        if squared[0] <= 0:
            fault = "makes the disc unstable"
            raise InputError(Fault("stiffness", fault, remedy="give deviations relative to the blade"))
        return np.sqrt(squared), turned

    @property
    def _moved(self) -> Array:
        """Motion of the blades, on which the deviations act, by sector."""
        return self._tuned.blade if self._knows_blade else self._tuned.shapes

    def _static(self, omega: Array, turned: Array) -> Array:
        modes = self._flat @ turned
        return self._rest + (modes / omega**2) @ modes.T

    def _load_shape(self, load: Array, s: int, omega: Array, turned: Array) -> LoadShape:
        force = np.zeros((self.sectors, load.size))
        force[s] = load
        whole, second = force.reshape(-1), self._tuned.second
        return LoadShape(
            participation=(self._flat @ turned).T @ whole, static_response=self._static(omega, turned) @ whole,
            second_response=None if second is None else second @ whole,
        )  # fmt: skip

    def _ratios(self, omega: Array, turned: Array) -> Array:
        """Damping ratios of the modes, each by itself."""
        if self._tuned.damping is None:
            return np.zeros(omega.size)
        return np.asarray(np.einsum("ir,ij,jr->r", turned, self._tuned.damping, turned) / (2.0 * omega))

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Errors by the tuned modes left out, for every phase: all of them move where blades differ."""
        del order
        phases = range(self.sectors // 2 + 1)
        return tuple(each for k in phases for each in self.sector.truncations(k, self.families))

    @property
    def couples(self) -> bool:
        """Whether damping or the gas couple the modes of the undamped disc."""
        if self._tuned.gas is not None:
            return True
        if self._tuned.damping is None:
            return False
        C = self._turned.T @ self._tuned.damping @ self._turned
        own = np.abs(np.diag(C))
        return bool(np.abs(C - np.diag(np.diag(C))).max() > DIAGONAL * max(float(own.max()), 1e-300))

    @property
    def damping_ratios(self) -> Array:
        """Damping ratio of each of the ``natural_frequencies``, that of the gas included, each mode by itself."""
        ratios = super().damping_ratios
        if self._tuned.gas is None:
            return ratios
        own = np.einsum("ir,ij,jr->r", self._turned, self._tuned.gas, self._turned).imag / (2.0 * self.omega**2)
        return np.asarray(ratios + own[np.argsort(self.omega)])

    @property
    def energy_fed(self) -> str:
        """Waves, or uncoupled modes, to which damping or the gas feed energy, in words."""
        return self.sector.travelling_wave(1).energy_fed if self.couples else super().energy_fed

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal disc."""
        sector = self.sector.changed(**{n: v for n, v in self._damping_values.items() if n in self.sector.values})
        return {
            "sector": sector, "stiffness": self.deviations, "blade": None if self._knows_blade else self.blade,
            "families": self.families,
            "mistuning": self.mistuning,
        }  # fmt: skip

    @property
    def _damping_values(self) -> dict[str, float]:
        return {"loss_factor": float(self.loss_factor[0]), "damping": self.damping}

    @property
    def values(self) -> dict[str, float]:
        """Named parameters: those of a modal structure, "mistuning" and "stiffness@0", ... where blades differ."""
        if self.blade is None:
            return super().values
        own = {f"{_STIFFNESS}{s}": float(value) for s, value in enumerate(self.deviations)}
        return super().values | {MISTUNING: self.mistuning} | own

    @property
    def further_values(self) -> dict[str, float]:
        """None: the modes of a disc are those of its sector and the deviations."""
        return {}

    def changed(self, **values: float) -> Disc:
        """A copy with other values of its parameters."""
        known = self.values
        for name in values:
            if name not in known:
                raise InputError(f"the structure has no parameter '{name}'; {suggestion(name, list(known))}")
        mine = {n: number(n, v) for n, v in values.items() if n == MISTUNING or n.startswith(_STIFFNESS)}
        new: Disc = super().changed(**{n: v for n, v in values.items() if n not in mine})  # type: ignore[assignment]
        if not mine:
            return new
        new.mistuning = mine.pop(MISTUNING, self.mistuning)
        new.deviations = self.deviations.copy()
        for name, value in mine.items():
            new.deviations[int(name.removeprefix(_STIFFNESS))] = value
        new.omega, new._turned = new._modes()
        new.mode_shapes = new._flat @ new._turned
        new.static_compliance = new._static(new.omega, new._turned)
        new._viscous = new._ratios(new.omega, new._turned)
        new.loss_factor = np.full(new.omega.shape, new.loss_factor[0])
        new.shapes = {
            f"{name}@{s}": new._load_shape(self.sector.load_vector(name), s, new.omega, new._turned)
            for s in range(self.sectors)
            for name in self.sector.load_shapes
        }
        return new

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between directions ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) and loads.

        Summed over the modes where these diagonalise the damping, else solved at each frequency.
        """
        known_shapes(shapes, self.shapes)
        n = len(self.dofs)
        r, c = directions("rows", rows, n), directions("columns", columns, n)
        left, right, static, second = self.modal_parts(r, c, shapes)
        parts = _Parts(self, r, c, tuple(shapes), left, right, static - (left / self.omega**2) @ right.T)
        if self.couples:
            return CoupledDiscReceptance(parts, static, second)
        return DiscReceptance(
            parts, left=left, right=right, stiffness=self.omega**2 * (1.0 + 1j * self.loss_factor),
            damping=2.0 * self._viscous * self.omega, factor=self.damping, static=static, residual=parts.residual,
            second=second,
        )  # fmt: skip

    def stiffness_between(self) -> tuple[ComplexArray, Array]:
        """Complex stiffness and viscous damping between the modes of the disc, (n, n) each, for positive frequencies.

        The factor ``damping`` is not in the damping.
        """
        n = self.omega.size
        K: ComplexArray = np.diag(self.omega**2 * (1.0 + 1j * self.loss_factor))
        if self._tuned.gas is not None:
            K = K + self._turned.T @ self._tuned.gas @ self._turned
        C = np.zeros((n, n)) if self._tuned.damping is None else self._turned.T @ self._tuned.damping @ self._turned
        return K, C

    def blade_forms(self, name: str, along: Array) -> Iterable[tuple[float, Array]]:
        """Derivative of the stiffness by a parameter: factors, and motion of blades along directions by the modes.

        Directions (n, k) and motion (k, n_modes).
        """
        if name == MISTUNING:
            own: Iterable[tuple[float, int]] = zip(self.deviations.tolist(), range(self.sectors), strict=True)
        else:
            own = [(self.mistuning, int(name.removeprefix(_STIFFNESS)))]
        return [(factor, along.T @ self._moved[s] @ self._turned) for factor, s in own if factor]

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Modal equations in time; the static residual is a feedthrough.

        The loss factor and the imaginary part of the gas become viscous damping, equal at each mode's own
        frequency, or at ``damping_at`` (rad/s).
        """
        plain = super().time_equations(rows, columns, shapes, damping_at=damping_at)
        if not self.couples:
            return plain
        lost = self.loss_factor * self.omega * (1.0 if damping_at is None else self.omega / damping_at)
        C, K = np.diag(lost), plain.K
        if self._tuned.damping is not None:
            C = C + self.damping * self._turned.T @ self._tuned.damping @ self._turned
        if self._tuned.gas is not None:
            gas = self._turned.T @ self._tuned.gas @ self._turned
            at = np.sqrt(np.multiply.outer(self.omega, self.omega)) if damping_at is None else damping_at
            C, K = C + gas.imag / at, K + gas.real
        return replace(plain, C=C, K=K)

    def contacts(self, pair: ContactPair, engine_order: int = 0) -> ContactPair:
        """The contacts of all sectors of those given on ``dof`` and ``dof@next``, sector 0 first.

        Of one contact "shroud.1" is that of sector 0; of K contacts those of sector s are "shroud.(s K + 1)" and so on.
        Its rubbing motion is delayed by ``2 pi s engine_order / N`` at sector s.
        """
        if set(pair.ports or ()) - {"second"}:
            expected = "contacts of a sector by tangential and normal"
            raise InputError(Fault(("contact", pair.name), found="ports", expected=expected))
        count, N = len(pair), self.sectors

        def spread(value: Any) -> Array:
            return np.tile(np.broadcast_to(np.asarray(value, dtype=float), (count,)), N)

        along: dict[str, Any] = {
            side: [self._turned_to(own, s) if own else own for s in range(N) for own in cosines]
            for side, cosines in pair.directions.items()
        }
        if "second" in along:
            along["ports"] = {"second": along.pop("second")}
        rubbing, moved = pair.rubbing, dict[str, Any]()
        for name, value in rubbing.velocities.items():
            if np.ndim(value):
                moved[name] = spread(value)
        delay = np.repeat(2.0 * np.pi * engine_order * np.arange(N) / N, count)
        for cos, sin in (("cos", "sin"), ("second_cos", "second_sin"), ("normal_cos", "normal_sin")):
            a, b = rubbing.parts[cos], rubbing.parts[sin]
            parts = {
                m: (spread(a.get(m, 0.0)) - 1j * spread(b.get(m, 0.0))) * np.exp(-1j * m * delay) for m in {*a, *b}
            }
            if parts:
                moved[cos] = {m: z.real for m, z in parts.items()}
                moved[sin] = {m: -z.imag for m, z in parts.items() if m}
        rubbing = replace(rubbing, **moved)
        contact = pair.contact.changed(**{name: spread(value) for name, value in pair.contact.values.items()})
        return replace(pair, contact=contact, rubbing=rubbing, **along)

    def loads(self, load: Load, engine_order: int) -> list[Load]:
        """The loads of all sectors of one given for sector 0: a wave, at sector s ``2 pi s engine_order / N`` later.

        ``engine_order`` is that of the fundamental frequency: harmonic m of the load has the phase of m times it.
        """
        E = _signed(engine_order)
        found = []
        for s in range(self.sectors):
            z = (load.cos - 1j * load.sin) * np.exp(-2j * np.pi * load.harmonic * E * s / self.sectors)
            given = {name: getattr(load, name) for name in ("dof", "shape")}
            place: dict[str, Any] = {name: f"{value}@{s}" for name, value in given.items() if value is not None}
            found.append(replace(load, **place, cos=float(z.real), sin=-float(z.imag) if load.harmonic else load.sin))
        return found

    def problem(self, wave: Problem, outputs: Sequence[str] | None = None) -> Problem:
        """The problem of this disc for that of a travelling wave: its contacts and loads at all sectors.

        Parameters
        ----------
        wave
            Its structure is a ``TravellingWave`` of the sector.
        outputs
            Dofs of sectors such as "tip@3"; "tip" is that of every sector. By default those of the wave.

        Raises
        ------
        InputError
            For another structure, or contacts that are not given by tangential and normal.
        """
        from slipstick.structure.cyclic import TravellingWave

        if not isinstance(wave.structure, TravellingWave):
            raise InputError(Fault("problem", found=shown(wave.structure), expected="the problem of a travelling wave"))
        E, e, r = wave.structure.engine_order, wave.load_order, wave.rubbing_order
        asked = [name for name in wave.outputs or () if NEXT not in name] if outputs is None else list(outputs)
        single = [name for name in asked if name not in self.sector.dofs]
        outputs = [f"{name}@{s}" for s in range(self.sectors) for name in asked if name not in single] + single
        return replace(
            wave, structure=self, contacts=[self.contacts(pair, E * r) for pair in wave.contacts],
            loads=[own for load in wave.loads for own in self.loads(load, E * e)], outputs=tuple(outputs),
        )  # fmt: skip

    def _turned_to(self, cosines: Mapping[str, float], s: int) -> dict[str, float]:
        return {
            f"{name.removesuffix(NEXT)}@{(s + name.endswith(NEXT)) % self.sectors}": cosine
            for name, cosine in cosines.items()
        }

    def __repr__(self) -> str:
        return f"Disc({self.sectors} sectors, {self.omega.size} modes)"


def _signed(engine_order: Any) -> int:
    return whole("engine_order", engine_order, -1_000_000, 1_000_000)


def _checked(stiffness: Any, blade: Any, sizes: tuple[int, int]) -> tuple[Array | None, Array]:
    """Stiffness of the blade and deviations; InputError with the faults of both."""
    N, n = sizes
    faults: list[Fault] = []
    if stiffness is not None:
        faults += number_faults("stiffness", stiffness) or array_faults("stiffness", real(stiffness), (N,))
    if blade is not None:
        faults += number_faults("blade", blade) or array_faults("blade", real(blade), (n, n))
        faults = faults or symmetry_faults("blade", real(blade))
    elif not faults and stiffness is not None and np.any(real(stiffness)):
        faults.append(Fault("blade", "is missing", expected=f"the blade's share of K0, ({n}, {n}), symmetric"))
    if faults:
        raise InputError(faults)
    return None if blade is None else real(blade), np.zeros(N) if stiffness is None else real(stiffness)


@dataclass(frozen=True, kw_only=False)
class _Parts:
    """Arguments of a receptance of a disc, for other deviations."""

    disc: Disc
    rows: Array
    columns: Array
    shapes: tuple[str, ...]
    left: Array
    right: Array
    residual: Array

    def changed(self, values: Mapping[str, float]) -> Any:
        """The receptance with other values."""
        return self.disc.changed(**values).project(self.rows, self.columns, self.shapes)

    def forms(self, name: str) -> list[tuple[float, Array]]:
        """Blades' motions by modes, in coordinates in which their stiffness is diagonal; its sizes in the factors."""
        assert self.disc.blade is not None
        size, axes = np.linalg.eigh(self.disc.blade)
        kept = np.abs(size) > 1e-14 * np.abs(size).max(initial=0.0)
        return [
            (factor * float(own), moved)
            for factor, motion in self.disc.blade_forms(name, axes[:, kept])
            for own, moved in zip(size[kept], motion, strict=True)
        ]

    def static_rate(self, name: str) -> Array:
        """Derivative of the static compliance (n_rows, n_columns)."""
        out = np.zeros((len(self.left), len(self.right)))
        if name == MISTUNING or name.startswith(_STIFFNESS):
            squared = self.disc.omega**2
            for size, b in self.forms(name):
                out -= size * np.outer((self.left / squared) @ b, (self.right / squared) @ b)
        return out


class _OfDisc:
    """Common members of receptances of discs: other deviations, and derivatives of the static compliance."""

    _disc: _Parts

    def changed(self, **values: float) -> Any:
        """With other values of the parameters of the disc."""
        return self._disc.changed(values)

    def static_by_parameter(self, name: str) -> Array:
        """Derivative of ``static`` by a parameter, (n_rows, n_columns)."""
        return self._disc.static_rate(name)


def _of_blades(name: str) -> bool:
    return name == MISTUNING or name.startswith(_STIFFNESS)


class DiscReceptance(_OfDisc, ModalReceptance):
    """Receptance by the modes of a disc, whose deviations are parameters: ``dA = -(1 + i eta) A K_b A dstiffness``."""

    def __init__(self, parts: _Parts, **modal: Any) -> None:
        super().__init__(**modal)
        self._disc = parts

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter, of the shape of ``at``."""
        if not _of_blades(name):
            return super().by_parameter(name, orders, omega)
        w = np.multiply.outer(np.asarray(omega, dtype=float), np.asarray(orders, dtype=float))
        flat = w.reshape(-1, 1)
        D = 1.0 / (self._stiffness + flat * (self._damping - flat))
        e = 1.0 + 1j * self._disc.disc.loss_factor[0]
        out = np.zeros((len(flat), *self.static.shape), dtype=complex)
        for size, b in self._disc.forms(name):
            near = D * b
            out -= e * size * (near @ self._left.T)[:, :, None] * (near @ self._right.T)[:, None, :]
        return out.reshape(*w.shape, *self.static.shape)

    def factors(self, orders: ArrayLike, omega: ArrayLike, along: Mapping[str, float] | None = None) -> Factors:
        """See ``ModalReceptance``; deviations couple the modes in the derivative along them."""
        found = super().factors(orders, omega, along)
        forms = [
            (rate * size, b) for name, rate in (along or {}).items() if _of_blades(name)
            for size, b in self._disc.forms(name)
        ]  # fmt: skip
        if not forms:
            return found
        sizes, moved = np.array([size for size, _ in forms]), np.array([b for _, b in forms])
        e = 1.0 + 1j * self._disc.disc.loss_factor[0]
        between = np.append(1.0, np.full(len(found.weight) - 1, e))
        return replace(found, coupling=(moved.T, -sizes), coupling_weight=between)


class CoupledDiscReceptance(_OfDisc, Receptance):
    """Receptance of a disc whose modes are coupled by damping or the gas: solved at each frequency.

    ``A(w) = left^T (K + i w C - w^2)^-1 right + residual / (1 + i eta) + w^2 second / (1 + i eta)^2``.
    """

    def __init__(self, parts: _Parts, static: Array, second: Array | None) -> None:
        self.static, self._disc = static, parts
        self._second = second
        K, C = parts.disc.stiffness_between()
        self._e = 1.0 + 1j * float(parts.disc.loss_factor[0])
        stiffness = _CoupledStiffness(K=K, C=C, squared=parts.disc.omega**2, factor=parts.disc.damping)
        self._solved = SolvedReceptance(
            stiffness=stiffness, rows=parts.left.T, columns=parts.right.T, static=static - parts.residual
        )
        self._stiffness = stiffness

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        value, slope = self._solved.at(orders, omega)
        value = value + self._disc.residual / self._e
        if self._second is None:
            return value, slope
        m, w = _frequencies(orders, omega)
        growth = w * self._second / self._e**2
        return value + w * growth, slope + 2.0 * m * growth

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by a parameter, of the shape of ``at``."""
        if not _of_blades(name):
            found = np.asarray(self._solved.by_parameter(name, orders, omega), dtype=complex)
            if name == "loss_factor":
                found = found - 1j * self._disc.residual / self._e**2
                if self._second is not None:
                    found -= 2j * _frequencies(orders, omega)[1] ** 2 * self._second / self._e**3
            return found
        w = np.multiply.outer(np.asarray(omega, dtype=float), np.asarray(orders, dtype=float))
        out = np.zeros((w.size, *self.static.shape), dtype=complex)
        forms = self._disc.forms(name)
        B, sizes = np.array([b for _, b in forms]).T, np.array([size for size, _ in forms])
        for i, each in enumerate(w.reshape(-1)):
            Z = self._stiffness(float(each))[0]
            left = np.linalg.solve(Z.T, self._disc.left.T.astype(complex)).T @ B
            out[i] = -self._e * (left * sizes) @ (B.T @ np.linalg.solve(Z, self._disc.right.T.astype(complex)))
        return out.reshape(*w.shape, *self.static.shape)


def _frequencies(orders: ArrayLike, omega: ArrayLike) -> tuple[Array, Array]:
    """Orders (k, 1, 1) and ``orders * omega`` (..., k, 1, 1)."""
    m = np.asarray(orders, dtype=float)[:, None, None]
    return m, np.asarray(omega, dtype=float)[..., None, None, None] * m


@dataclass(frozen=True, kw_only=True)
class _CoupledStiffness:
    """``Z(w)`` between the modes of a disc, as ``DynamicStiffness``."""

    K: ComplexArray
    C: Array
    squared: Array
    factor: float

    def __call__(self, w: float) -> tuple[ComplexArray, ComplexArray]:
        """``Z(w)`` and ``dZ/dw``."""
        one = np.eye(len(self.K), dtype=complex)
        Z = self.K + 1j * w * self.factor * self.C - w * w * one
        return np.asarray(Z, dtype=complex), np.asarray(1j * self.factor * self.C - 2.0 * w * one, dtype=complex)

    def rate(self, name: str, w: float) -> ComplexArray:
        """``dZ/dname`` at ``w``."""
        return np.asarray(np.diag(1j * self.squared) if name == "loss_factor" else 1j * w * self.C, dtype=complex)
