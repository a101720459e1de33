"""Structure given by its mass, damping and stiffness matrices, at rest or turning."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array

from slipstick.errors import Fault, InputError
from slipstick.faults import number
from slipstick.html import dofs_words
from slipstick.structure.checks import (
    checked_names,
    damping_faults,
    directions,
    known_shapes,
    real,
    shape_forces,
)
from slipstick.structure.complex_modes import ComplexModes, complex_modes, critical_modes
from slipstick.structure.dynamic import SPEED, DynamicStiffness, checked_values
from slipstick.structure.matrix_checks import (
    FREE,
    definite_faults,
    energy_fed,
    fed_modes,
    is_symmetric,
    rotation_matrices,
    symmetric_part,
    system_matrices,
)
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.protocol import Structure, TimeEquations
from slipstick.structure.receptance import ModalReceptance, PoleReceptance, Receptance, SolvedReceptance
from slipstick.structure.truncation import Truncation
from slipstick.typing import Array, Matrix, MatrixLike, Reals

DENSE_LIMIT = 1500
"""Largest number of dofs treated densely: all modes are computed."""

_LISTED_FREQUENCIES = 20
"""Natural frequencies of a large structure."""
_POLE_LIMIT = 200
"""Dofs up to which receptances are sums over poles."""
_POLE_ERROR = 1e-10
"""Relative error of the sum over poles up to which it is used."""
_SMALL = 10_000
"""Entries up to which a dense matrix stays dense, however many are zero."""
_STILL = 1e-6
"""Frequency over the largest, below which that of a free structure belongs to its rigid-body motion."""

NOTHING_HOLDS = Fault(
    "K",
    "the stiffness matrix is singular, and no contact holds the structure in harmonic 0",
    remedy="hold it, give a contact along which it is held, or take ss.models.free_structure",
)


class MatrixStructure(Structure):
    """``M x'' + (C + W G) x' + (K + W N) x = forces`` at a speed of rotation W, with hysteretic damping.

    That makes the symmetric part of K ``K (1 + i loss_factor)`` at nonzero harmonics. G and N are zero unless given.

    Parameters
    ----------
    M
        Mass matrix (n_dofs, n_dofs), dense or scipy sparse; real, symmetric and positive definite.
    C
        Damping matrix (n_dofs, n_dofs); None: zero. It may be unsymmetric (bearings and seals, gyroscopic forces at one
        speed), but one triangle alone is refused. Where it is not positive semidefinite it feeds energy in, and a
        problem warns.
    K
        Stiffness matrix (n_dofs, n_dofs): positive definite where nothing turns, else regular; singular where contacts
        alone hold the structure (up to 1500 dofs; friction alone fixes no mean position, taken without rigid-body
        motion). It may be unsymmetric as C; circulatory stiffness beyond the damping feeds energy in, and a problem
        warns.
    dofs
        A name for each degree of freedom, in the order of the matrices.
    loss_factor
        Structural (hysteretic) loss factor, >= 0.
    load_shapes
        Distributed loads: name -> forces on all dofs (n_dofs,).
    damping
        Factor on the symmetric part of C, >= 0: the parameter "damping".
    gyroscopic
        Gyroscopic matrix G (n_dofs, n_dofs) for unit speed, skew-symmetric [G. Genta, Dynamics of Rotating Systems,
        2005].
    circulatory
        N (n_dofs, n_dofs), skew-symmetric: the stiffness that damping in the rotating part (internal damping) makes in
        the fixed frame, for unit speed.
    speed
        W, rad/s, fixed, of either sense: the parameter "speed" (without ``circulatory``, whose harmonic 0 depends on
        it).
    engine_order
        In place of ``speed``: ``W = omega / engine_order``, tied to the response's fundamental frequency; 1 is
        synchronous (unbalance). Not with ``circulatory``.

    Raises
    ------
    InputError
        With one sentence for each fault of the matrices, names and values.

    Examples
    --------
    >>> s = MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> s.natural_frequencies.round(4)
    array([6.3246])
    >>> value, slope = s.project([[1.0]], [[1.0]]).at([1], 6.0)
    >>> complex(value[0, 0, 0].round(4))
    (0.1838-0.1103j)
    """

    def __init__(
        self,
        *,
        M: MatrixLike,
        K: MatrixLike,
        dofs: Iterable[str],
        C: MatrixLike | None = None,
        loss_factor: float = 0.0,
        load_shapes: Mapping[str, Reals] | None = None,
        damping: float = 1.0,
        gyroscopic: MatrixLike | None = None,
        circulatory: MatrixLike | None = None,
        speed: float | None = None,
        engine_order: int | None = None,
    ) -> None:
        self._dofs, faults = checked_names(dofs)
        n = len(self._dofs)
        if not n:
            raise InputError(faults)
        arguments = {"M": M, "K": K} | ({} if C is None else {"C": C})
        self._dense = n <= DENSE_LIMIT
        matrices, wrong = system_matrices(arguments, n, dense=self._dense, turns=gyroscopic is not None)
        self._may_be_free = FREE in wrong
        faults += [fault for fault in wrong if fault != FREE or not self._dense]
        turning, wrong = rotation_matrices(
            {"gyroscopic": gyroscopic, "circulatory": circulatory}, speed, engine_order, n, dense=self._dense
        )
        faults += wrong
        self._shapes = shape_forces(load_shapes, n, faults)
        faults += damping_faults(loss_factor, damping)
        if faults:
            raise InputError(faults)
        self.loss_factor, self.damping = float(real(loss_factor)), float(real(damping))
        self.M, self.K, given_damping = matrices["M"], matrices["K"], matrices.get("C")
        self.gyroscopic: Any
        self.circulatory: Any
        self.gyroscopic, self.circulatory = turning.get("gyroscopic"), turning.get("circulatory")
        self.speed = 0.0 if speed is None else float(real(speed))
        self.engine_order = None if engine_order is None else int(engine_order)
        self._elastic, self._skew_stiffness = _parts(self.K)
        self._support_stiffness: Array | None = None
        self._viscous: Any = None
        self._skew_damping: Any = None
        if given_damping is not None:
            self._viscous, self._skew_damping = _parts(given_damping)

    @property
    def C(self) -> Any:
        """Matrix of the velocities (n_dofs, n_dofs), factor ``damping`` and rotation at ``speed`` included, or None."""
        parts = (
            [] if self._viscous is None else [self._viscous if self.damping == 1.0 else self.damping * self._viscous]
        )
        parts += [] if self._turned_damping is None else [self._turned_damping]
        return sum(parts[1:], parts[0]) if parts else None

    @property
    def _turned_damping(self) -> Any:
        """Skew part of the matrix of the velocities: that of C, and G at a fixed speed; None: there is none."""
        turned = None if self.gyroscopic is None or self.engine_order else self.speed * self.gyroscopic
        return _added(self._skew_damping, turned)

    @property
    def static_stiffness(self) -> Any:
        """Matrix of the displacements (n_dofs, n_dofs), N at a fixed speed included."""
        return _added(self.K, None if self.circulatory is None else self.speed * self.circulatory)

    @cached_property
    def _rigid(self) -> Array:
        """Mass-normalised motions (n_dofs, k) that the static stiffness does not resist."""
        if not self._may_be_free:
            return np.zeros((len(self._dofs), 0))
        K, M = self.static_stiffness, self.M
        scale = np.sqrt(np.diag(M) / max(np.abs(K).max() / np.abs(M).max(), np.finfo(float).tiny))
        root = np.sqrt(np.abs(K).sum(axis=1))
        root = np.where(root > 0.0, root, np.where(scale > 0.0, scale, 1.0))
        _, sizes, vectors = np.linalg.svd(K / root[:, None] / root)
        free = vectors[sizes <= 1e-13 * len(K)].T / root[:, None]
        values, turned = np.linalg.eigh(free.T @ M @ free)
        return np.asarray(free @ (turned / np.sqrt(values)))

    @property
    def held(self) -> bool:
        """Whether the structure is held by itself; else its contacts have to, and harmonic 0 asks for them."""
        return not self._rigid.shape[1]

    @property
    def rigid_motions(self) -> Array:
        """Mass-normalised motions (n_dofs, k) that the static stiffness does not resist."""
        return self._rigid

    def supported_at(self, ports: Array, fixing: Array) -> tuple[MatrixStructure, Array, Array]:
        """The structure with reference springs along ports (n_dofs, n_ports) in its static compliance.

        ``fixing`` (n_ports,) marks those along which a mean displacement is resisted. Returned too: the stiffness of
        each spring (n_ports,), and the rigid-body motions (n_dofs, k) that none of these holds, mass-normalised. Along
        them inertia is the spring: in balance, the mean displacement has no part of them.
        """
        R, natural = self._rigid, self.natural_frequencies
        square = float(natural[0] ** 2) if natural.size else 1.0
        seen = np.where(fixing[:, None], ports.T @ R, 0.0)
        size = np.sum(seen**2, axis=1)
        light = np.sum(ports**2 / np.diag(self.M)[:, None], axis=0)
        springs = np.divide(square, size, out=np.zeros_like(size), where=size > 1e-12 * light)
        _, held, turned = np.linalg.svd(np.sqrt(springs / square)[:, None] * seen)
        rank = int(np.count_nonzero(held > 1e-6))
        free = R @ turned[rank:].T
        if free.shape[1] and self._circulates:
            raise InputError(NOTHING_HOLDS)  # what is in balance is not told by the motion alone
        inertia = self.M @ free
        new = copy(self)
        new.__dict__.pop("_static_factors", None)
        new._support_stiffness = (ports * springs) @ ports.T + square * inertia @ inertia.T
        return new, springs, np.asarray(free)

    @property
    def _circulates(self) -> bool:
        return self._skew_stiffness is not None or self.circulatory is not None

    @cached_property
    def _indefinite(self) -> bool:
        """Whether the stiffness of what turns is not positive definite: gyroscopic forces may hold it all the same."""
        return not self._classical and bool(definite_faults("K", self._elastic))

    @property
    def _classical(self) -> bool:
        """Whether nothing is unsymmetric."""
        return self._skew_damping is None and self.gyroscopic is None and not self._circulates

    @property
    def values(self) -> dict[str, float]:
        """Named parameters: ``loss_factor``; ``damping``, a factor on the viscous damping; ``speed`` (rad/s).

        The last two where there is any; a speed that is fixed, and does not change the static compliance.
        """
        turns = self.gyroscopic is not None and not self.engine_order and self.circulatory is None
        damped = {} if self._viscous is None else {"damping": self.damping}
        return {"loss_factor": self.loss_factor} | damped | ({SPEED: self.speed} if turns else {})

    def changed(self, **values: float) -> MatrixStructure:
        """A copy with another ``loss_factor``, factor ``damping`` (InputError below 0) or ``speed``."""
        checked = checked_values(self.values, values)
        new = self._copied(checked.get(SPEED, self.speed))
        new.loss_factor = checked.get("loss_factor", self.loss_factor)
        new.damping = checked.get("damping", self.damping)
        return new

    def _copied(self, speed: float) -> MatrixStructure:
        new, kept = copy(self), speed == self.speed
        for known in ("_poles", "energy_fed", "self_excited"):
            new.__dict__.pop(known, None)
        for known in () if kept else ("_rigid", "_whirl", "_natural_frequencies", "_viscous_ratios", "_static_factors"):
            new.__dict__.pop(known, None)
        new.speed = speed
        return new

    def at_speed(self, speed: float) -> MatrixStructure:
        """A copy that turns at a fixed speed, rad/s; InputError without ``gyroscopic`` and ``circulatory``."""
        if self.gyroscopic is None and self.circulatory is None:
            raise InputError(Fault("speed", "nothing turns", remedy="give the gyroscopic matrix for unit speed"))
        new = self._copied(number("speed", speed))
        new.engine_order = None
        for known in ("_rigid", "_whirl", "_natural_frequencies", "_viscous_ratios"):
            new.__dict__.pop(known, None)
        return new

    @property
    def tied(self) -> bool:
        """Whether its speed is tied to the frequency of the response."""
        return self.engine_order is not None

    def turning_with(self, omega: float) -> MatrixStructure:
        """The structure at a fundamental frequency, rad/s: at the speed that this is tied to."""
        return self if self.engine_order is None else self.at_speed(omega / self.engine_order)

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self._dofs

    @property
    def arguments(self) -> dict[str, Any]:
        """What an equal structure is made from; matrices that are mostly zeros as sparse ones."""
        matrices = {"M": self.M, "C": _added(self._viscous, self._skew_damping), "K": self.K}
        turns = self.gyroscopic is not None or self.circulatory is not None
        tied = {"engine_order": self.engine_order} if self.engine_order else {SPEED: self.speed}
        matrices |= {"gyroscopic": self.gyroscopic, "circulatory": self.circulatory} | (tied if turns else {})
        matrices = {name: _thin(matrix) for name, matrix in matrices.items() if matrix is not None}
        numbers = {"loss_factor": self.loss_factor, "damping": self.damping}
        return {**matrices, **numbers, "dofs": self._dofs, "load_shapes": self._shapes}

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """Names of the distributed loads."""
        return tuple(self._shapes)

    @property
    def natural_frequencies(self) -> Array:
        """Undamped natural frequencies, rad/s, ascending: all of them, or the lowest 20 of a large sparse structure.

        Of a structure that turns at a fixed speed those of whirl in both senses; tied to the response's frequency those
        at which it is in resonance (critical speeds times the engine order); of a large sparse one those at rest.
        Rigid-body motions, whose frequency is zero, are left out. Those of ``ss.models.campbell`` are damped.
        """
        return self._natural_frequencies

    @cached_property
    def _natural_frequencies(self) -> Array:
        if self._dense and not self._classical:
            return np.abs(self._whirl.poles.imag)
        return np.sqrt(np.maximum((self._modes[0] if self._dense else self._lowest[0])[self._rigid.shape[1] :], 0.0))

    @cached_property
    def _whirl(self) -> ComplexModes:
        """Complex modes in the upper half plane without what dissipates, by ascending frequency."""
        skew = np.zeros_like(self.M) if self._turned_damping is None else self._turned_damping
        if self.engine_order:
            return critical_modes(
                self.M, self.gyroscopic / self.engine_order, skew, self._elastic, singular=not self.held
            )
        whirl = complex_modes(self.M, skew, self.static_stiffness).upper
        if self.held:
            return whirl
        moves = np.abs(whirl.poles.imag) > _STILL * np.abs(whirl.poles.imag).max(initial=0.0)
        return ComplexModes(whirl.poles[moves], whirl.right[:, moves], whirl.left[:, moves])

    @property
    def damping_ratios(self) -> Array:
        """Damping ratio of each of the ``natural_frequencies``: viscous, with half the loss factor."""
        return self.damping * self._viscous_ratios + 0.5 * self.loss_factor

    @cached_property
    def _viscous_ratios(self) -> Array:
        if self._dense and not self._classical:
            poles, right, left = self._whirl
            if self._viscous is None:
                return np.zeros(poles.size)
            return np.asarray((poles * np.einsum("ik,ij,jk->k", left, self._viscous, right)).real / np.abs(poles))
        squared, modes = self._modes if self._dense else self._lowest
        if self._viscous is None:
            return np.zeros(self.natural_frequencies.size)
        squared, modes = squared[self._rigid.shape[1] :], modes[:, self._rigid.shape[1] :]
        return np.asarray(np.einsum("ir,ir->r", modes, self._viscous @ modes) / (2.0 * np.sqrt(squared)))

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Nothing: there are no modes."""
        del order
        return ()

    @cached_property
    def energy_fed(self) -> str:
        """Where viscous damping feeds energy in, in words; empty where it takes it out of every motion."""
        where = "" if self._viscous is None or self.damping == 0.0 else energy_fed(self._viscous, self.M)
        return (fed_modes(self.natural_frequencies, self._viscous_ratios) or where) if where and self._dense else where

    @cached_property
    def self_excited(self) -> str:
        """What circulatory or negative stiffness makes grow without contacts, in words; empty where nothing grows."""
        if self._classical or not (self._circulates or self._indefinite):
            return ""
        if not self._dense:
            return f"perhaps: it is not known of {len(self._dofs)} dofs; reduce them with ss.models.craig_bampton"
        tied = self.natural_frequencies[:_LISTED_FREQUENCIES] if self.engine_order else [0.0]
        none = np.zeros((len(self._dofs), 0))
        for omega in tied:
            equations = self.turning_with(float(omega)).time_equations(none, none)
            poles = complex_modes(equations.M, equations.C, equations.K).upper.poles
            poles = poles if self.held else poles[np.abs(poles) > _STILL * np.abs(poles).max(initial=0.0)]
            ratios = -poles.real / np.maximum(np.abs(poles), np.finfo(float).tiny)
            if words := fed_modes(np.abs(poles.imag), ratios):
                return words
        return ""

    @cached_property
    def _lowest(self) -> tuple[Array, Array]:
        """The lowest 20 modes of a large sparse structure, as ``_modes``."""
        from scipy.sparse.linalg import eigsh

        values, modes = eigsh(self._elastic, k=_LISTED_FREQUENCIES, M=self.M, sigma=0.0)
        order = np.argsort(values)
        return values[order], modes[:, order]

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        """Squared frequencies (n,) and mass-normalised modes (n, n) of the symmetric parts."""
        from scipy.linalg import eigh

        values, modes = eigh(self._elastic, self.M)
        return np.maximum(values, 0.0), modes

    @cached_property
    def _modal_damping(self) -> Array | None:
        """Viscous damping of each mode, without the factor on it, if the modes diagonalise all matrices, else None."""
        if not self._classical:
            return None
        squared, modes = self._modes
        if self._viscous is None:
            return np.zeros(squared.size)
        projected = modes.T @ self._viscous @ modes
        diagonal = np.diag(projected).copy()
        rest = np.abs(projected - np.diag(diagonal)).max()
        return diagonal if rest <= 1e-12 * max(np.abs(diagonal).max(), 1e-300) else None

    @cached_property
    def _poles(self) -> ComplexModes | None:
        """All complex modes of what has the same matrices at all frequencies, or None.

        They are inaccurate where two poles meet (critical damping), so they are compared with direct solutions.
        """
        n = len(self._dofs)
        if not self._dense or self.C is None or n > _POLE_LIMIT or self.engine_order:
            return None
        lossy = 1j * self.loss_factor * self._elastic if self.loss_factor else 0.0
        found = complex_modes(self.M, self.C, self.static_stiffness + lossy)
        poles, right, left = found
        positive = self.natural_frequencies[self.natural_frequencies > 0.0]
        for w in np.quantile(positive, (0.0, 0.5, 1.0)) * (1.0, 1.1, 3.0) if positive.size else (1.0,):
            exact = np.linalg.inv(self._stiffness(float(w))[0])
            if not np.abs((right / (1j * w - poles)) @ left.T - exact).max() <= _POLE_ERROR * np.abs(exact).max():
                return None
        return found

    @property
    def modal_viscous(self) -> Array | None:
        """Viscous damping between the modes (n, n), factor ``damping`` included; None where it is diagonal."""
        if self._modal_damping is not None:
            return None
        modes = self._modes[1]
        return np.asarray(self.damping * (modes.T @ self._viscous @ modes))

    def by_modes(self, *, alone: bool = False) -> ModalStructure:
        """The structure by all of its modes; InputError where these do not exist, or are too many.

        ``alone``: where viscous damping couples them, each has its diagonal part, and ``modal_viscous`` all of it.
        """
        if not self._dense:
            raise InputError(f"the structure has {len(self._dofs)} dofs, too many for all of its modes: reduce it")
        if not self._classical:
            raise InputError(
                "the structure has unsymmetric matrices (gyroscopic, circulatory, or as C or K were given), whose "
                "modes are complex: analyses by real modes do not apply"
            )
        if self._modal_damping is None and not alone:
            raise InputError(
                "the viscous damping couples the modes: give the structure as ss.ModalStructure, with a damping_ratio "
                "of each mode, or C as a sum of M and K"
            )
        if not self.held:
            raise InputError(
                Fault(
                    "K",
                    "the structure is not held: its rigid-body modes have no static compliance",
                    remedy="hold it, or take ss.models.free_structure",
                )
            )
        squared, modes = self._modes
        omega, damping = np.sqrt(squared), self._modal_damping
        if damping is None:
            damping = np.einsum("ir,ir->r", modes, self._viscous @ modes)
        shapes = {
            name: LoadShape(participation=modes.T @ load, static_response=self._static_solve(load))
            for name, load in self._shapes.items()
        }
        return ModalStructure(
            omega=omega, mode_shapes=modes, dofs=self._dofs, static_compliance=self._static_solve(np.eye(omega.size)),
            loss_factor=self.loss_factor, damping_ratio=damping / (2.0 * omega), load_shapes=shapes,
            damping=self.damping,
        )  # fmt: skip

    def _columns(self, columns: ArrayLike, shapes: Sequence[str]) -> Array:
        known_shapes(shapes, self._shapes)
        cosines = directions("columns", columns, len(self._dofs))
        return np.column_stack([cosines, *(self._shapes[s] for s in shapes)]) if shapes else cosines

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> Receptance:
        """Receptance between directions ``rows`` (n_dofs, n_rows) and ``columns`` (n_dofs, n_columns) and load shapes.

        Summed over all modes (exact) where these diagonalise the damping, over the poles where it is small enough for
        that, and solved at each frequency otherwise.
        """
        left, right = directions("rows", rows, len(self._dofs)), self._columns(columns, shapes)
        static = left.T @ self._static_solve(right)
        if self._dense and self.held and self._modal_damping is not None:
            squared, modes = self._modes
            return ModalReceptance(
                left=left.T @ modes,
                right=right.T @ modes,
                stiffness=squared * (1.0 + 1j * self.loss_factor),
                damping=self._modal_damping,
                factor=self.damping,
                static=static,
            )
        solved = SolvedReceptance(stiffness=self._stiffness, rows=left, columns=right, static=static)
        if self._poles is None:
            return solved
        poles, from_right, from_left = self._poles
        return PoleReceptance(
            left=left.T @ from_right, right=right.T @ from_left, poles=poles, static=static, solved=solved
        )

    def shape_load(self, name: str) -> Array:
        """Forces on all dofs (n_dofs,) of a load shape."""
        return self._shapes[name]

    def _static_solve(self, right: Array) -> Array:
        return np.asarray(self._static_factors(right), dtype=float)

    @cached_property
    def _static_factors(self) -> Callable[[Array], Array]:
        """Function that applies the inverse static stiffness to columns; its factors serve several projections."""
        if self._dense:
            from scipy.linalg import cho_factor, cho_solve, lu_factor, lu_solve

            if not self.held:
                if self._support_stiffness is None:
                    raise InputError(NOTHING_HOLDS)
                return partial(lu_solve, lu_factor(self.static_stiffness + self._support_stiffness))
            if self._circulates or self._indefinite:
                return partial(lu_solve, lu_factor(self.static_stiffness))
            return partial(cho_solve, cho_factor(self.K))
        from scipy.sparse.linalg import splu

        return splu(csc_array(self.static_stiffness)).solve

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the factors, which cannot be pickled."""
        return {name: value for name, value in self.__dict__.items() if name != "_static_factors"}

    @property
    def _stiffness(self) -> DynamicStiffness:
        skew = self._skew_damping  # of C as given: not damping, so not under its factor
        return DynamicStiffness(
            M=self.M, C=self._viscous, K=self.K, loss_factor=self.loss_factor, damping=self.damping, S=skew,
            elastic=None if self._skew_stiffness is None else self._elastic, G=self.gyroscopic, N=self.circulatory,
            speed=self.speed, engine_order=self.engine_order,
        )  # fmt: skip

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Equations of motion in time; hysteretic damping becomes viscous, equal at each natural frequency or at one.

        ``damping_at`` is that frequency, rad/s.
        """
        n = len(self._dofs)
        if self.engine_order:
            tied = f"the speed of rotation is tied to the response's frequency (engine order {self.engine_order})"
            raise InputError(Fault("engine_order", tied, remedy="give a fixed speed: at_speed, turning_with"))
        if not self._dense:
            raise InputError(
                Fault(
                    "time integration",
                    f"the structure has {n} dofs, too many for dense matrices",
                    remedy="reduce it to modes first",
                )
            )
        damping = np.zeros((n, n)) if self.C is None else self.C
        if damping_at is not None:
            damping = damping + self.loss_factor / damping_at * self._elastic
        elif self.loss_factor:
            squared, modes = self._modes
            weighted = self.M @ modes
            damping = damping + (weighted * (self.loss_factor * np.sqrt(squared))) @ weighted.T
        left, right = directions("rows", rows, n), self._columns(columns, shapes)
        return TimeEquations(
            M=self.M,
            C=damping,
            K=self.static_stiffness,
            rows=left.T.copy(),
            columns=right,
            feedthrough=np.zeros((left.shape[1], right.shape[1])),
        )

    def __repr__(self) -> str:
        return f"MatrixStructure({dofs_words(len(self._dofs))}, {'dense' if self._dense else 'sparse'})"


def _parts(matrix: Matrix) -> tuple[Matrix, Matrix | None]:
    """Symmetric and skew part of a matrix, the latter None for what is symmetric to rounding."""
    if is_symmetric(matrix):
        return matrix, None
    even = symmetric_part(matrix)
    return even, matrix - even


def _added(first: Any, second: Any) -> Any:
    """The sum of matrices of which either may be None."""
    if first is None or second is None:
        return second if first is None else first
    return first + second


def _thin(matrix: Matrix) -> Matrix:
    """A large dense matrix of mostly zeros as a sparse one, others as they are."""
    if isinstance(matrix, np.ndarray) and matrix.size > _SMALL and 4 * np.count_nonzero(matrix) < matrix.size:
        return csc_array(matrix)
    return matrix
