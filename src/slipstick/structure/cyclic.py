"""Sectors of a disc with cyclic symmetry, and the waves that travel over them.

Each of ``N`` equal sectors is described in its own coordinates, which turn with it. A wave repeats from sector to
sector with a delay, ``x_s(tau) = x_0(tau - s phi_1)`` with ``phi_1 = 2 pi E / N`` (THEORY.md section 24): its harmonic
m has the phase ``e^{-i s phi_m}``, ``phi_m = m phi_1``, and everything is known from sector 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import issparse

from slipstick.errors import Fault, InputError
from slipstick.faults import shown, whole
from slipstick.structure.checks import (
    DAMPING_ELSEWHERE,
    array_faults,
    checked_names,
    complex_numbers,
    damping_faults,
    directions,
    known_shapes,
    number_faults,
    real,
    shape_forces,
    symmetry_faults,
)
from slipstick.structure.dynamic import checked_values
from slipstick.structure.protocol import Around, Structure, TimeEquations
from slipstick.structure.receptance import Receptance, Waves
from slipstick.structure.truncation import Truncation
from slipstick.typing import AnyArray, Array, ComplexArray
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.structure.disc import Disc

NEXT = "@next"
"""Suffix of the name of a dof of the next sector."""

DIAGONAL = 1e-12
"""Largest coupling of modes by damping, relative to its diagonal, that is rounding."""
_MOST_SECTORS = 1000
_MOST_ORDER = 1_000_000
_GROWS = 1e-12
"""Real part of a pole, over its size, above which it grows: rounding is below."""
_ABSENT = 1e30
"""Natural frequency of padding modes, which do not move."""


@dataclass(frozen=True, kw_only=True)
class PhaseModes:
    """Modes of a sector for one phase from sector to sector, with static compliance and residual.

    Attributes
    ----------
    omega
        Natural frequencies (n_modes,), rad/s, ascending.
    shapes
        Modes at the dofs of the sector, complex (n_dofs, n_modes), ``V^H M(phi) V = 1``.
    static
        Exact static compliance ``K(phi)^-1`` at the dofs, complex and Hermitian (n_dofs, n_dofs).
    damping
        Viscous damping of the modes: (n_modes,) where they diagonalise it, else ``V^H C(phi) V``.
    second
        Second-order residual: ``K(phi)^-1 M(phi) K(phi)^-1`` at the dofs less its modal part; None: no modes are left
        out.
    """

    omega: Array
    shapes: ComplexArray
    static: ComplexArray
    damping: ComplexArray | Array
    second: ComplexArray | None = None

    @property
    def residual(self) -> ComplexArray:
        """Static compliance of the modes left out, (n_dofs, n_dofs)."""
        return np.asarray(self.static - (self.shapes / self.omega**2) @ self.shapes.conj().T)

    def left_by(self, families: int | None = None) -> ComplexArray | None:
        """Second-order residual of the first families, with the part of the other modes; None: none are left out."""
        others = self.shapes[:, families:] if families is not None else self.shapes[:, :0]
        if not others.size:
            return self.second
        added = (others / self.omega[families:] ** 4) @ others.conj().T
        return np.asarray(added if self.second is None else self.second + added)

    def conjugate(self) -> PhaseModes:
        """Modes of the opposite phase."""
        return PhaseModes(
            omega=self.omega, shapes=self.shapes.conj(), static=self.static.conj(), damping=self.damping.conj(),
            second=None if self.second is None else self.second.conj(),
        )  # fmt: skip


class WaveHarmonic(NamedTuple):
    """Nodal diameter and direction of one harmonic of a wave."""

    order: int
    nodal_diameter: int
    direction: str
    """"forward" towards growing sector numbers, "backward", or "standing"."""


class CyclicStructure:
    """One of N equal sectors that form a ring (THEORY.md section 24, (24.2)).

    ``K(phi) = K0 + K1 e^{-i phi} + K1^T e^{i phi}``: ``K1[i, j]`` is the force on dof i of a sector from dof j of the
    next one. M and C alike. All are in coordinates that turn with the sector.

    Parameters
    ----------
    M
        Pair of mass matrices (n_dofs, n_dofs): within the sector (symmetric) and from the next one; the first alone
        where there is no coupling.
    K
        Stiffness matrices, as ``M``.
    C
        Damping matrices, as ``M``; None: zero.
    dofs
        A name for each degree of freedom of a sector.
    sectors
        Number of sectors N.
    loss_factor
        Hysteretic loss factor, >= 0.
    load_shapes
        Distributed loads on a sector: name -> forces (n_dofs,).
    damping
        Factor on C, >= 0: the parameter "damping".
    aerodynamic
        Influence coefficients of the gas, stiffness: j -> complex (n_dofs, n_dofs), the force against the motion on a
        sector by the motion of the one j further (negative j: before it). A positive imaginary part for the motion of
        the sector itself is damping. They hold at all frequencies above 0 and not for harmonic 0; see also
        :meth:`with_aerodynamics`. Real arrays (2, n_dofs, n_dofs) are real and imaginary parts.

    Raises
    ------
    InputError
        With one sentence for each fault.

    Examples
    --------
    >>> sector = CyclicStructure(M=([[1.0]], [[0.0]]), K=([[3.0]], [[-1.0]]), dofs=["x"], sectors=4)
    >>> [float(w.round(4)) for w in sector.natural_frequencies(1)]
    [1.7321]
    """

    units: Units | None = None
    """Those of its numbers, of an imported model; a problem takes them, or refuses others. None: they are not known."""

    def __init__(
        self,
        *,
        M: Any,
        K: Any,
        C: Any = None,
        dofs: Iterable[str],
        sectors: int,
        loss_factor: float = 0.0,
        load_shapes: Mapping[str, ArrayLike] | None = None,
        damping: float = 1.0,
        aerodynamic: Mapping[int, ArrayLike] | None = None,
    ) -> None:
        self.dofs, faults = checked_names(dofs)
        self.sectors = whole("sectors", sectors, 2, _MOST_SECTORS)
        n = len(self.dofs)
        faults += [
            Fault("dofs", f"{name!r} ends in {NEXT}, which means the next sector", remedy="rename it")
            for name in self.dofs
            if isinstance(name, str) and NEXT in name
        ]
        self._pairs: dict[str, tuple[Array, Array]] = {}
        for name, given in {"M": M, "K": K, **({} if C is None else {"C": C})}.items():
            pair, wrong = _pair(name, given, n)
            faults += wrong
            if pair is not None:
                self._pairs[name] = pair
        self._shapes = shape_forces(load_shapes, n, faults)
        faults += damping_faults(loss_factor, damping)
        self.aerodynamic, wrong = influences(aerodynamic, n)
        faults += wrong
        if faults:
            raise InputError(faults)
        self.loss_factor, self.damping = float(real(loss_factor)), float(real(damping))
        self._by_phase: dict[int, PhaseModes] = {}

    @property
    def passive(self) -> bool:
        """Whether nothing can feed energy in, in any phase."""
        return not self.aerodynamic and "C" not in self._pairs

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Names of the distributed loads."""
        return tuple(self._shapes)

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal sector."""
        return {
            **self._pairs, "dofs": self.dofs, "sectors": self.sectors, "loss_factor": self.loss_factor,
            "load_shapes": self._shapes, "damping": self.damping,
            "aerodynamic": {j: np.array([L.real, L.imag]) for j, L in self.aerodynamic.items()},
        }  # fmt: skip

    def matrices(self, k: int) -> dict[str, ComplexArray]:
        """``M(phi)``, ``K(phi)`` and ``C(phi)``, Hermitian, for ``phi = 2 pi k / N``."""
        turn = np.exp(-2j * np.pi * k / self.sectors)
        return {name: A0 + A1 * turn + A1.T * np.conj(turn) for name, (A0, A1) in self._pairs.items()}

    def influence(self, k: int) -> ComplexArray | None:
        """Gas stiffness in ``K(phi)``, ``phi = 2 pi k / N``, (n_dofs, n_dofs), not Hermitian; None without gas."""
        if not self.aerodynamic:
            return None
        turns = {j: np.exp(-2j * np.pi * j * k / self.sectors) for j in self.aerodynamic}
        return np.asarray(sum(turns[j] * L for j, L in self.aerodynamic.items()), dtype=complex)

    def gas_between(self, k: int, families: int | None = None) -> ComplexArray | None:
        """Stiffness of the gas between the modes of a phase, all or the first families, not Hermitian.

        Modes left out respond to it statically; None without gas.
        """
        gas, shapes = self.influence(k), self.phase_modes(k).shapes[:, :families]
        if gas is None:
            return None
        gas_reduction = self.gas_reduction(k)
        return np.asarray(shapes.conj().T @ (gas if gas_reduction is None else gas_reduction @ gas) @ shapes)

    def gas_reduction(self, k: int) -> ComplexArray | None:
        """``(1 + G R)^-1`` (n_dofs, n_dofs): factor on forces on the dofs by the gas G on the residual R.

        R is the static compliance of the modes left out of a phase; None: there is no gas, or no modes are left out.
        """
        gas, modes = self.influence(k), self.phase_modes(k)
        if gas is None or modes.second is None:
            return None
        return np.asarray(np.linalg.inv(np.eye(len(gas)) + gas @ modes.residual))

    def blade_rows(self, k: int) -> ComplexArray | None:
        """Motion of the blade by the modes of a phase, (n, n_modes), in which its stiffness is 1; None: not known."""
        del k
        return None

    def load_vector(self, name: str) -> Array:
        """The forces (n_dofs,) of a load shape."""
        return self._shapes[name]

    def with_aerodynamics(self, coefficients: ArrayLike, shape: ArrayLike) -> CyclicStructure:
        """A copy with the gas as a complex stiffness for each nodal diameter (THEORY.md (24.8)).

        Parameters
        ----------
        coefficients
            Complex (N,), by the number d of the phase ``2 pi d / N``: d <= N/2 is the wave of d nodal diameters that
            travels towards growing sector numbers, N - d the same against them. The imaginary part is the damping
            force over the displacement: negative where the gas feeds the wave.
        shape
            Real, symmetric (n_dofs, n_dofs): which dofs feel it, 1 on the diagonal for a single one.
        """
        N, n = self.sectors, len(self.dofs)
        given = complex_numbers(coefficients)
        faults = number_faults("shape", shape) or array_faults("shape", real(shape), (n, n))
        faults = faults or symmetry_faults("shape", real(shape))
        if given is None or given.shape != (N,):
            expected = f"{N} finite complex numbers, one for each phase"
            faults.append(Fault("coefficients", found=shown(coefficients), expected=expected))
        if faults:
            raise InputError(faults)
        assert given is not None
        influence, matrix = np.fft.ifft(given), real(shape)  # sum_d c_d e^(2 pi i j d / N) / N
        new = copy(self)
        new.aerodynamic = {j: influence[j] * matrix.astype(complex) for j in range(N)}
        return new

    def phase_modes(self, k: int) -> PhaseModes:
        """Modes for the phase ``2 pi k / N`` from sector to sector; those of -k are the conjugates.

        Raises InputError where mass or stiffness are not positive definite for that phase.
        """
        k %= self.sectors
        if 2 * k > self.sectors:
            return self.phase_modes(self.sectors - k).conjugate()
        if k not in self._by_phase:
            self._by_phase[k] = self._modes(k)
        return self._by_phase[k]

    def _modes(self, k: int) -> PhaseModes:
        from scipy.linalg import cho_factor, cho_solve, eigh

        at = self.matrices(k)
        if k == 0 or 2 * k == self.sectors:
            at = {name: np.ascontiguousarray(matrix.real) for name, matrix in at.items()}
        for name in ("M", "K"):
            if not _definite(at[name]):
                remedy = f"hold the disc, and give {name}1[i, j] as what acts on dof i from dof j of the next sector"
                raise InputError(Fault(name, f"is not positive definite for nodal diameter {k}", remedy=remedy))
        factors = cho_factor(at["K"])
        squared, V = eigh(at["K"], at["M"])
        damping: Any = np.zeros(squared.size)
        if "C" in at:
            damping = V.conj().T @ at["C"] @ V
            diagonal = np.diag(damping).real.copy()
            rest = np.abs(damping - np.diag(diagonal)).max()
            if rest <= DIAGONAL * max(np.abs(diagonal).max(), 1e-300):
                damping = diagonal
        return PhaseModes(
            omega=np.sqrt(np.maximum(squared, 0.0)), shapes=V.astype(complex), damping=damping,
            static=cho_solve(factors, np.eye(len(self.dofs), dtype=complex)),
        )  # fmt: skip

    def truncations(self, k: int, families: int | None = None) -> tuple[Truncation, ...]:
        """Errors by the modes left out of the phase ``2 pi k / N``, all or the first ``families`` kept; empty: none.

        Dofs are scaled by their compliance in the phase 0, so that phases can be compared.
        """
        modes, still = self.phase_modes(k), np.diag(self.phase_modes(0).static).real
        second = modes.left_by(families)
        if second is None:
            return ()
        kept, own = slice(families), np.diag(modes.static).real
        loads = np.array([self.load_vector(name) for name in self.load_shapes]).reshape(-1, len(self.dofs))
        return (
            Truncation(
                omega=modes.omega[kept], mode_shapes=modes.shapes[:, kept], static_compliance=modes.static,
                second_residual=second, participation=loads @ modes.shapes[:, kept].conj(),
                load_response=modes.static @ loads.T, second_load_response=second @ loads.T,
                own=np.where(still > 0.0, still, own),
            ),
        )  # fmt: skip

    def natural_frequencies(self, nodal_diameter: int) -> Array:
        """Undamped natural frequencies of a nodal diameter, 0 to N/2, rad/s, ascending."""
        return self.phase_modes(whole("nodal_diameter", nodal_diameter, 0, self.sectors // 2)).omega

    def travelling_wave(self, engine_order: int) -> TravellingWave:
        """The sector in a travelling wave, as a structure: loads and contacts are those of sector 0, the others follow.

        ``engine_order`` E is that of the fundamental frequency: sector s moves as sector 0 with the delay
        ``2 pi s E / N``; only E modulo N counts. A pattern fixed in space that blades numbered in the sense of rotation
        run through arrives earlier on the next blade: ``E = -EO``; numbered against it ``E = +EO``.
        """
        return TravellingWave(self, engine_order)

    def mistuned(
        self,
        stiffness: ArrayLike | None = None,
        blade: ArrayLike | None = None,
        families: int | None = None,
        *,
        spread: float | None = None,
        seed: int = 0,
    ) -> Disc:
        """The whole disc with blades that differ: sector s has ``stiffness[s] * blade`` more stiffness (24.6).

        Parameters
        ----------
        stiffness
            Deviations (N,), relative; None for a tuned disc, or where ``spread`` is given.
        blade
            The blade's share of ``K0``, (n_dofs, n_dofs), symmetric; needed where blades differ.
        families
            Families of tuned modes kept, at most n_dofs (by default all): those up to the highest harmonic kept.
        spread
            Instead of ``stiffness``: standard deviation of normal random deviations.
        seed
            Seed that they are drawn with; the same seed gives the same blades.

        Returns
        -------
        Disc
            A structure with dofs "tip@0", "tip@1", ..., whose parameters "stiffness@0", ... are the deviations and
            "mistuning" a factor on all of them: 0 is the tuned disc.

        Raises
        ------
        InputError
            For arrays of another shape, and deviations that make the disc unstable.
        """
        from slipstick.structure.disc import Disc, random_deviations

        if spread is not None:
            if stiffness is not None:
                raise InputError(Fault("spread", "is given together with stiffness", remedy="keep one of them"))
            stiffness = random_deviations(self.sectors, spread, seed)
        return Disc(sector=self, stiffness=stiffness, blade=blade, families=families)

    def changed(self, **values: float) -> CyclicStructure:
        """A copy with another ``loss_factor`` or factor ``damping``; InputError below 0."""
        new, given = copy(self), checked_values(self.values, values)
        new.loss_factor = given.get("loss_factor", self.loss_factor)
        new.damping = given.get("damping", self.damping)
        return new

    @property
    def values(self) -> dict[str, float]:
        """Named parameters: ``loss_factor``, and ``damping``, a factor on C, where there is any."""
        return {"loss_factor": self.loss_factor} | ({"damping": self.damping} if "C" in self._pairs else {})

    def __repr__(self) -> str:
        return f"CyclicStructure({len(self.dofs)} dofs, {self.sectors} sectors)"


class TravellingWave(Structure):
    """A sector in a wave: a structure with the dofs of sector 0 and, as ``dof@next``, of the sector after it.

    Parameters
    ----------
    sector
        The sector.
    engine_order
        E of the fundamental frequency, see :meth:`CyclicStructure.travelling_wave`.

    Attributes
    ----------
    dofs
        Those of the sector, and each with ``@next``.
    """

    self_excited = ""
    """Its stiffness is Hermitian and positive definite."""

    def __init__(self, sector: CyclicStructure, engine_order: int) -> None:
        self.sector, self.loss_factor = sector, sector.loss_factor
        self.engine_order = whole("engine_order", engine_order, -_MOST_ORDER, _MOST_ORDER)
        self.dofs: tuple[str, ...] = (*sector.dofs, *(name + NEXT for name in sector.dofs))

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Names of the distributed loads."""
        return self.sector.load_shapes

    @property
    def units(self) -> Units | None:
        """Those of the sector."""
        return self.sector.units

    @property
    def sectors(self) -> int:
        """Number of sectors N."""
        return self.sector.sectors

    @property
    def around(self) -> Around:
        """Its cyclic symmetry."""
        return Around(self.sectors, self.engine_order, whole=False)

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal wave."""
        return {"sector": self.sector, "engine_order": self.engine_order}

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Errors by the modes left out of the phase of a harmonic."""
        return self.sector.truncations(self.phase_number(order))

    @property
    def values(self) -> dict[str, float]:
        """Named parameters of the sector."""
        return self.sector.values

    def changed(self, **values: float) -> TravellingWave:
        """A copy with other values of them."""
        return TravellingWave(self.sector.changed(**values), self.engine_order)

    def phase_number(self, order: int) -> int:
        """``d`` of harmonic ``order``: its phase from sector to sector is ``2 pi d / N``."""
        return int(order) * self.engine_order % self.sectors

    def harmonic(self, order: int) -> WaveHarmonic:
        """Nodal diameter and direction of a harmonic: it aliases to one of 0 to N/2."""
        d = self.phase_number(order)
        if 2 * d % self.sectors == 0:
            return WaveHarmonic(int(order), d, "standing")
        return WaveHarmonic(int(order), min(d, self.sectors - d), "forward" if 2 * d < self.sectors else "backward")

    def harmonics(self, orders: Iterable[int]) -> tuple[WaveHarmonic, ...]:
        """Nodal diameter and direction of each of some harmonics."""
        return tuple(self.harmonic(order) for order in orders)

    @property
    def natural_frequencies(self) -> Array:
        """Those of the nodal diameter of the fundamental, rad/s, ascending."""
        return self.sector.phase_modes(self.phase_number(1)).omega

    @property
    def damping_ratios(self) -> Array:
        """Damping ratio of each of the ``natural_frequencies``: viscous, of the gas, with half the loss factor."""
        modes, gas = self.sector.phase_modes(self.phase_number(1)), self.sector.gas_between(self.phase_number(1))
        viscous = modes.damping if modes.damping.ndim == 1 else np.diag(modes.damping).real
        ratios = 0.5 * (self.sector.loss_factor + self.sector.damping * viscous / modes.omega)
        if gas is not None:
            ratios = ratios + 0.5 * np.diag(gas).imag / modes.omega**2
        return np.asarray(ratios, dtype=float)

    def resonances(self, orders: Array) -> Array:
        """Frequencies at which one of the harmonics meets a natural frequency of its own nodal diameter, ascending."""
        found = [self.sector.phase_modes(self.phase_number(m)).omega / m for m in orders if m]
        return np.unique(np.concatenate([np.zeros(0), *found]))

    def growing(self, d: int) -> ComplexArray:
        """Poles of positive frequency of the sector without contacts, phase ``2 pi d / N``, that grow, rad/s."""
        modes, gas = self.sector.phase_modes(d), self.sector.gas_between(d)
        K = np.diag(modes.omega**2 * (1.0 + 1j * self.sector.loss_factor))
        if gas is not None:
            K = K + gas
        C = self.sector.damping * (np.diag(modes.damping) if modes.damping.ndim == 1 else modes.damping)
        n = len(K)
        poles = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-K, -C]]))
        return np.asarray(poles[(poles.imag > 0.0) & (poles.real > _GROWS * np.abs(poles))], dtype=complex)

    @cached_property
    def energy_fed(self) -> str:
        """Nodal diameters to which damping or the gas feed energy, in words; empty where there are none."""
        if self.sector.passive:
            return ""
        known = sorted({min(k, self.sectors - k) for k in range(self.sectors) if self.growing(k).size})
        if not known:
            return ""
        return f"nodal diameter{'s' if len(known) > 1 else ''} {', '.join(map(str, known))}"

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between directions ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) and load shapes.

        A force on a dof of the next sector acts, from the contact with the sector before, on sector 0 (24.5).
        """
        known_shapes(shapes, dict.fromkeys(self.sector.load_shapes))
        n, both = len(self.sector.dofs), len(self.dofs)
        left, right = directions("rows", rows, both), directions("columns", columns, both)
        if shapes:
            loads = np.column_stack([self.sector.load_vector(name) for name in shapes])
            right = np.hstack([right, np.vstack([loads, np.zeros_like(loads)])])
        return WaveReceptance(self, left.reshape(2, n, -1), right.reshape(2, n, -1))

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Raises InputError: the motion of a sector depends on the past motion of its neighbour."""
        raise InputError(
            Fault(
                "time integration",
                "a travelling wave has no equations in time of one sector",
                remedy="integrate the whole disc, sector.mistuned().problem(problem)",
            )
        )

    def __repr__(self) -> str:
        return f"TravellingWave(engine order {self.engine_order}, {self.sectors} sectors)"


class _PhaseTerms(NamedTuple):
    """Terms of the receptance of one phase; of several phases, with one leading axis for these."""

    omega: Array
    damping: Any
    left: ComplexArray
    """Modes at the rows (n_rows, n_modes)."""
    right: ComplexArray
    """Conjugate modes at the columns (n_columns, n_modes)."""
    residual: ComplexArray
    gas: ComplexArray | None
    """Stiffness of the gas between the modes (n_modes, n_modes)."""
    second: ComplexArray | float
    """Second-order residual."""


class WaveReceptance(Receptance, Waves):
    """``A_m(w) = rows_m Z(phi_m, m w)^-1 columns_m`` by the modes of each phase and their residual (24.3).

    Parameters
    ----------
    wave
        The wave; harmonic m has its phase ``2 pi d_m / N``.
    rows, columns
        Direction cosines on sector 0 and on the next one, (2, n_dofs, n_rows) and (2, n_dofs, n_columns).
    """

    def __init__(self, wave: TravellingWave, rows: Array, columns: Array) -> None:
        self._wave, self._rows, self._columns = wave, rows, columns
        self._own = {"loss_factor": wave.sector.loss_factor, "damping": wave.sector.damping}
        self._terms: dict[int, _PhaseTerms] = {}
        self._stacked: dict[tuple[int, ...], _PhaseTerms] = {}
        still = wave.sector.phase_modes(0).static.real
        self.static: Array = (rows[0] + rows[1]).T @ still @ (columns[0] + columns[1])

    def _phase(self, d: int) -> _PhaseTerms:
        if d not in self._terms:
            modes, turn = self._wave.sector.phase_modes(d), np.exp(-2j * np.pi * d / self._wave.sectors)
            rows, columns = self._rows[0] + turn * self._rows[1], self._columns[0] + np.conj(turn) * self._columns[1]
            left, right = rows.T @ modes.shapes, columns.T @ modes.shapes.conj()
            residual = rows.T @ modes.static @ columns - (left / modes.omega**2) @ right.T
            sector, gas = self._wave.sector, self._wave.sector.gas_between(d)
            if (gas_reduction := sector.gas_reduction(d)) is not None:  # the gas acts on the residual too
                moved = rows.T @ modes.residual @ gas_reduction
                left, residual = left - moved @ sector.influence(d) @ modes.shapes, moved @ columns
                right = (modes.shapes.conj().T @ gas_reduction @ columns).T
            second = 0.0 if modes.second is None else rows.T @ modes.second @ columns
            self._terms[d] = _PhaseTerms(modes.omega, modes.damping, left, right, residual, gas, second)
        return self._terms[d]

    def at(self, orders: ArrayLike, omega: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Receptance at ``orders * omega`` and its derivative by omega, see ``Receptance.at``."""
        value, rate = self._summed(orders, omega, "omega")
        rate *= np.asarray(orders, dtype=float)[:, None, None]
        return value, rate

    @property
    def waves(self) -> Waves:  # type: ignore[override]
        """Itself: it has disturbances of every phase."""
        return self

    @property
    def wave_numbers(self) -> int:  # type: ignore[override]
        """Number of wave numbers of disturbances: N."""
        return self._wave.sectors

    def phase_number(self, order: int) -> int:
        """``d`` of a harmonic of the wave."""
        return self._wave.phase_number(order)

    def natural(self, d: int) -> Array:
        """Natural frequencies for the phase ``2 pi d / N``, rad/s."""
        return self._wave.sector.phase_modes(d % self._wave.sectors).omega

    def growing(self, d: int) -> ComplexArray:
        """Growing poles of the sector without contacts, of positive frequency, with the phase ``2 pi d / N``."""
        wave = self._wave.changed(**{n: v for n, v in self._own.items() if n in self._wave.values})
        return wave.growing(d)

    def vibration(self, d: int, stiffness: Array) -> tuple[ComplexArray, ComplexArray]:
        """Poles of positive frequency, rad/s, with springs (n_rows, n_rows) at the ports, phase ``2 pi d / N``.

        And their motion at the ports, (n_rows, n_poles). Residuals are taken as static.
        """
        terms, e, n = self._phase(d % self._wave.sectors), 1.0 + 1j * self._own["loss_factor"], len(stiffness)
        moved = np.linalg.solve(np.eye(n) + terms.residual[:, :n] / e @ stiffness, terms.left)
        K = e * np.diag(terms.omega**2) + terms.right[:n].T @ stiffness @ moved
        if terms.gas is not None:
            K = K + terms.gas
        C = self._own["damping"] * (terms.damping if terms.damping.ndim == 2 else np.diag(terms.damping))
        size = len(K)
        A = np.block([[np.zeros((size, size)), np.eye(size)], [-K, -C]])
        poles, vectors = np.linalg.eig(A)
        vibrating = poles.imag > _GROWS * np.abs(poles)
        return poles[vibrating], moved @ vectors[:size, vibrating]

    def of_order(self, order: int, frequency: ArrayLike, wave_number: int = 0) -> ComplexArray:
        """Receptance of a harmonic at any frequencies (...), rad/s, of either sign, (..., n_rows, n_columns).

        A complex frequency ``-i s`` is an exponent s. Those of negative real part have the loss factor and the gas of
        motion at negative frequency: what is real in time stays real.

        ``wave_number`` k: of a disturbance with the phase ``2 pi k / N`` more from sector to sector (24.7).
        """
        w = np.asarray(frequency)
        flat, d = w.reshape(-1), self._wave.phase_number(order) + wave_number
        out = np.empty((flat.size, *self.static.shape), dtype=complex)
        for below in (False, True):
            at = (flat.real < 0.0) == below
            if at.any():
                own = -flat[at].conj() if below else flat[at]
                terms = self._of_phases(((-d if below else d) % self._wave.sectors,))
                found = self._at(terms, own[:, None], "omega")[0][:, 0]
                out[at] = found.conj() if below else found
        return out.reshape(*w.shape, *self.static.shape)

    def changed(self, **values: float) -> WaveReceptance:
        """A copy with another ``loss_factor`` or factor ``damping``."""
        new = copy(self)
        new._own = {**self._own, **values}
        return new

    def by_parameter(self, name: str, orders: ArrayLike, omega: ArrayLike) -> ComplexArray:
        """Derivative by ``loss_factor`` or ``damping``, of the shape of ``at``."""
        return self._summed(orders, omega, name)[1]

    def _summed(self, orders: ArrayLike, omega: ArrayLike, by: str) -> ComplexArray:
        """Receptance at all orders of all omegas, and its derivative by each order's own frequency or a parameter."""
        m = np.asarray(orders, dtype=float)
        w = np.multiply.outer(np.asarray(omega, dtype=float), m)
        return self._at(self._of_phases(tuple(self._wave.phase_number(int(order)) for order in m)), w, by)

    def _of_phases(self, phases: tuple[int, ...]) -> _PhaseTerms:
        """Terms of several phases with one leading axis, padded to equal numbers of modes."""
        if phases not in self._stacked:
            each = [self._phase(d % self._wave.sectors) for d in phases]
            count = max((terms.omega.size for terms in each), default=0)
            each = [_padded(terms, count) for terms in each]
            if any(terms.damping.ndim == 2 or terms.gas is not None for terms in each):
                each = [t._replace(damping=t.damping if t.damping.ndim == 2 else np.diag(t.damping)) for t in each]
            parts: Any = (None if own[0] is None else np.array(own) for own in zip(*each, strict=True))
            self._stacked[phases] = _PhaseTerms(*parts)
        return self._stacked[phases]

    def _at(self, terms: _PhaseTerms, w: AnyArray, by: str) -> ComplexArray:
        """Receptance of phases at frequencies (..., n_phases) and its derivative, (2, ..., n_rows, n_columns)."""
        if not terms.omega.size:
            return np.zeros((2, *w.shape, *self.static.shape), dtype=complex)
        e, factor = 1.0 + 1j * self._own["loss_factor"], self._own["damping"]
        K: Any = terms.omega**2
        C, one = terms.damping, np.ones(terms.omega.shape[-1:])
        full = C.ndim == 3
        if full:
            K, one = K[..., None] * np.eye(one.size), np.eye(one.size)  # type: ignore[assignment]
        second, each = np.asarray(terms.second), w[..., None, None]
        growth = each * (second if second.ndim == 3 else second[:, None, None])
        w = w.reshape(*w.shape, *(1,) * one.ndim)
        Z = e * K + 1j * factor * w * C - w**2 * one
        if terms.gas is not None:
            Z = Z + terms.gas
        if by == "omega":
            slope = 1j * factor * C - 2.0 * w * one
        else:
            slope = 1j * K + 0.0 * w if by == "loss_factor" else 1j * w * C
        left, right = terms.left, terms.right.swapaxes(-1, -2)
        if full:
            moved = np.linalg.solve(Z, np.broadcast_to(right, (*Z.shape[:-2], *right.shape[-2:])))
            across = left.swapaxes(-1, -2)
            turned = np.linalg.solve(Z.swapaxes(-1, -2), np.broadcast_to(across, (*Z.shape[:-2], *across.shape[-2:])))
            value, rate = left @ moved, -turned.swapaxes(-1, -2) @ (slope @ moved)
        else:
            D = 1.0 / Z
            value = (left * D[..., None, :]) @ right
            rate = (left * (-slope * D * D)[..., None, :]) @ right
        value += terms.residual / e + each * growth / e**2
        if by == "loss_factor":
            rate -= 1j * terms.residual / e**2 + 2j * each * growth / e**3
        elif by == "omega":
            rate += 2.0 * growth / e**2
        return np.array([value, rate])


def _padded(terms: _PhaseTerms, count: int) -> _PhaseTerms:
    """Terms with ``count`` modes, of which the added ones do not move."""
    more = count - terms.omega.size
    if not more:
        return terms
    ends = ((0, 0), (0, more))
    square = ((0, more), (0, more))
    return terms._replace(
        omega=np.append(terms.omega, np.full(more, _ABSENT)), left=np.pad(terms.left, ends),
        right=np.pad(terms.right, ends), damping=np.pad(terms.damping, square[: terms.damping.ndim]),
        gas=None if terms.gas is None else np.pad(terms.gas, square),
    )  # fmt: skip


def influences(given: Any, n: int) -> tuple[dict[int, ComplexArray], list[Fault]]:
    """Influence coefficients by offset, complex (n, n), and their faults."""
    found: dict[int, ComplexArray] = {}
    faults: list[Fault] = []
    expected = f"complex matrices ({n}, {n}) by how many sectors further the blade moves, such as {{0: L0, 1: L1}}"
    if given is None:
        return {}, []
    if not isinstance(given, Mapping):
        return {}, [Fault("aerodynamic", found=shown(given), expected=expected)]
    for offset, value in given.items():
        matrix = complex_numbers(value)
        if matrix is not None and matrix.shape == (2, n, n) and not matrix.imag.any():
            matrix = matrix[0] + 1j * matrix[1]
        if isinstance(offset, bool) or not isinstance(offset, int | np.integer):
            faults.append(Fault("aerodynamic", found=shown(offset), expected=expected))
        elif matrix is None or matrix.shape != (n, n):
            faults.append(Fault(("aerodynamic", int(offset)), found=shown(value), expected=expected))
        else:
            found[int(offset)] = matrix
    return found, faults


def _definite(M: ComplexArray) -> bool:
    """Whether a Hermitian matrix is positive definite."""
    try:
        np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        return False
    return True


def _pair(name: str, given: Any, n: int) -> tuple[tuple[Array, Array] | None, list[Fault]]:
    """Matrix of the sector (n, n) and that from the next sector, zero where only the first is given; and faults."""
    expected = f"a pair ({name}0, {name}1) of matrices ({n}, {n}), of the sector and from the next one"
    pair = given if isinstance(given, tuple | list) and len(given) == 2 and np.ndim(given[0]) == 2 else (given, None)
    matrices: list[Array] = []
    for k, matrix in enumerate(pair):
        if matrix is None:
            matrices.append(np.zeros((n, n)))
            continue
        dense = matrix.toarray() if issparse(matrix) else matrix
        where = (name, k)
        wrong = number_faults(where, dense, DAMPING_ELSEWHERE) or array_faults(where, real(dense), (n, n))
        wrong = wrong or ([] if k else symmetry_faults(where, real(dense)))
        if wrong:
            return None, [
                Fault(f.where, f.statement or f"found {f.found}", expected=expected) if f.found else f for f in wrong
            ]
        matrices.append(real(dense))
    return (matrices[0], matrices[1]), []
