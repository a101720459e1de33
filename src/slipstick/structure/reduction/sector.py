"""A finite element sector reduced to modes and two residual terms at a few directions, phase by phase.

The matrices of a phase ``phi = 2 pi k / N`` are Hermitian (THEORY.md (24.2)); what they give is that of a reduction of
a structure (10.1) with ``a a^H`` in the place of ``a a^T``. Phases are computed when they are asked for: a wave needs
those of its harmonics, a whole disc all of 0 to N/2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.faults import whole
from slipstick.solve.linear.factorisation import SingularMatrixError
from slipstick.solve.linear.lanczos import BlockLanczos, Factors
from slipstick.solve.linear.modes import StageListener
from slipstick.structure.checks import array_faults, checked_names, number_faults, real
from slipstick.structure.cyclic import NEXT, CyclicStructure, PhaseModes, influences
from slipstick.structure.reduction.compute import at_resonance, probed, reduced_data
from slipstick.structure.reduction.data import Columns, ReducedData
from slipstick.structure.reduction.request import Accuracy
from slipstick.typing import Array, ComplexArray, Sparse

_PARTS = ("omega", "shapes", "static", "second")


def reduce_phase(
    K: Sparse,
    M: Sparse,
    columns: Columns,
    want: Accuracy,
    factors: Factors,
    *,
    listener: StageListener | None = None,
    where: str = "this phase",
) -> ReducedData:
    """Reduce symmetric or Hermitian sparse K, M (n, n), of which there are factors, to the directions of ``columns``.

    Raises
    ------
    InputError
        For a stiffness that is singular or not positive definite.
    EigenError
        Modes that do not converge.
    """
    try:
        iteration = BlockLanczos(K, M, listener=listener, factors=factors)
    except SingularMatrixError as error:
        statement = f"the stiffness is singular for {where}: some motion meets no resistance"
        raise InputError(Fault("model", statement, remedy="hold the disc, at its bore for instance")) from error
    if iteration.inertia is not None and iteration.inertia.negative:
        count = f"the stiffness has {iteration.inertia.negative} negative eigenvalues for {where}"
        raise InputError(Fault("model", count, remedy="check material, speed and prestress"))
    probe = None
    if want.modes is None and want.highest is not None:
        try:
            probe = probed(factors.at(want.highest**2), columns.all)
        except SingularMatrixError as error:
            raise InputError(Fault("up_to", at_resonance(want.highest, f" for {where}"))) from error
    data = reduced_data(iteration, M, columns, want, probe=probe)
    if not np.all(data.omega > 0.0):
        raise InputError(Fault("model", f"a mode has no stiffness for {where}", remedy="hold the disc"))
    return data


class SectorModes(CyclicStructure):
    """A sector known by the modes and residuals of its phases, as ``ss.reduced_sector`` makes it of finite elements.

    Parameters
    ----------
    dofs
        Names of the directions kept; each load shape is one of them, whose motion is what the load works on.
    sectors
        Number of sectors N.
    phases
        What is known: by k, 0 to N/2, of the phase ``2 pi k / N``. Arrays "omega" (n_modes,), "shapes"
        (2, n_dofs, n_modes), "static" and "second" (2, n_dofs, n_dofs), real and imaginary parts; "blade"
        (2, n, n_modes), where blades may differ: their motion, in coordinates in which their stiffness is 1.
    load_shapes
        Names of the dofs that are distributed loads.
    loss_factor
        Hysteretic loss factor, >= 0.
    damping_ratio
        Ratio to critical damping of all modes.
    damping
        Factor on it, >= 0: the parameter "damping".
    aerodynamic
        Influence coefficients of the gas between the dofs kept, see ``CyclicStructure``.
    compute
        Gives the modes of a phase that is not known; None: these are all.
    """

    def __init__(
        self,
        *,
        dofs: Iterable[str],
        sectors: int,
        phases: Mapping[int, Mapping[str, ArrayLike]] | None = None,
        load_shapes: Iterable[str] = (),
        loss_factor: float = 0.0,
        damping_ratio: float = 0.0,
        damping: float = 1.0,
        aerodynamic: Mapping[int, ArrayLike] | None = None,
        compute: Callable[[int], ReducedData] | None = None,
    ) -> None:
        self.dofs, faults = checked_names(dofs)
        self.sectors = whole("sectors", sectors, 2, 1000)
        n = len(self.dofs)
        if any(NEXT in str(name) for name in self.dofs):
            faults.append(Fault("dofs", f"a name has {NEXT}, which means the next sector", remedy="rename it"))
        self._shapes = {}
        for name in load_shapes:
            if name not in self.dofs:
                faults.append(Fault("load_shapes", f"'{name}' is not among the dofs"))
            else:
                self._shapes[name] = np.eye(n)[self.dofs.index(name)]
        for word, value in (("loss_factor", loss_factor), ("damping", damping), ("damping_ratio", damping_ratio)):
            negative = word != "damping_ratio"
            faults += number_faults(word, value) or array_faults(word, real(value), (), non_negative=negative)
        self.aerodynamic, wrong = influences(aerodynamic, n)
        faults += wrong
        if faults:
            raise InputError(faults)
        self.loss_factor, self.damping, self.damping_ratio = (
            float(real(value)) for value in (loss_factor, damping, damping_ratio)
        )
        self._pairs = {"C": None} if self.damping_ratio else {}  # type: ignore[dict-item]
        self._compute = compute
        self._blade: dict[int, ComplexArray]
        self._by_phase, self._blade = {}, {}
        for k, arrays in (phases or {}).items():
            self._by_phase[whole("phases", k, 0, self.sectors // 2)] = self._stored(k, arrays)

    def _stored(self, k: int, arrays: Mapping[str, ArrayLike]) -> PhaseModes:
        n = len(self.dofs)
        try:
            omega, shapes, static, second = (np.asarray(arrays[name], dtype=float) for name in _PARTS)
        except KeyError as error:
            raise InputError(Fault(("phases", k), f"{error.args[0]!r} is missing")) from None
        if "blade" in arrays:
            blade = np.asarray(arrays["blade"], dtype=float)
            if blade.ndim != 3 or blade.shape[::2] != (2, omega.size):
                raise InputError(Fault(("phases", k, "blade"), found=f"shape {blade.shape}"))
            self._blade[k] = blade[0] + 1j * blade[1]
        known = (2, n, n)
        if shapes.shape != (2, n, omega.size) or static.shape != known or second.shape != known or omega.ndim != 1:
            raise InputError(Fault(("phases", k), found=f"shapes of {shapes.shape}", expected=f"(2, {n}, n_modes)"))
        parts = {name: value[0] + 1j * value[1] for name, value in (("shapes", shapes), ("static", static))}
        return self._damped(omega=omega, **parts, second=second[0] + 1j * second[1])

    def _damped(self, **known: Any) -> PhaseModes:
        return PhaseModes(**known, damping=2.0 * self.damping_ratio * known["omega"])

    def _modes(self, k: int) -> PhaseModes:
        if self._compute is None:
            found = ", ".join(map(str, sorted(self._by_phase))) or "none"
            statement = f"the modes of nodal diameter {k} are not stored with this sector (those of {found} are)"
            raise InputError(Fault("phases", statement, remedy="reduce the finite element model again"))
        return self._made(self._compute(k))

    def _made(self, data: ReducedData) -> PhaseModes:
        parts = (data.amplitudes, data.static, data.second_residual)
        shapes, static, second = (np.asarray(part, dtype=complex) for part in parts)
        return self._damped(omega=data.omega, shapes=shapes, static=static, second=second)

    @property
    def passive(self) -> bool:
        """Whether nothing can feed energy in."""
        return not self.aerodynamic and self.damping_ratio >= 0.0

    @property
    def arguments(self) -> dict[str, Any]:
        """What an equal sector is made from: with the phases known by now."""
        phases = {
            k: {
                "omega": modes.omega,
                **{
                    name: np.array([value.real, value.imag])
                    for name in _PARTS[1:]
                    if (value := getattr(modes, name)) is not None
                },
                **({"blade": np.array([self._blade[k].real, self._blade[k].imag])} if k in self._blade else {}),
            }
            for k, modes in sorted(self._by_phase.items())
        }
        return {
            "dofs": self.dofs, "sectors": self.sectors, "phases": phases, "load_shapes": self.load_shapes,
            "loss_factor": self.loss_factor, "damping_ratio": self.damping_ratio, "damping": self.damping,
            "aerodynamic": {j: np.array([L.real, L.imag]) for j, L in self.aerodynamic.items()},
        }  # fmt: skip

    def with_blades(self, phases: Mapping[int, ReducedData], blade: Mapping[int, ComplexArray]) -> SectorModes:
        """A copy with the modes of phases, and the motion of the blade by them, of all 0 to N/2."""
        new = copy(self)
        new._by_phase = {k: self._made(data) for k, data in phases.items()}
        new._blade = dict(blade)
        return new

    def blade_rows(self, k: int) -> ComplexArray | None:
        """Motion of the blade by the modes of a phase, (n, n_modes), in which its stiffness is 1; None: not known."""
        k %= self.sectors
        if 2 * k > self.sectors:
            found = self._blade.get(self.sectors - k)
            return None if found is None else found.conj()
        return self._blade.get(k)

    def matrices(self, k: int) -> dict[str, ComplexArray]:
        """None: a reduced sector has modes. Raises InputError."""
        raise InputError(Fault("sector", "is reduced to modes: it has no matrices", remedy="see phase_modes"))

    def reduction_error(self, nodal_diameter: int, frequency: ArrayLike) -> Array:
        """Relative error of the receptance of a nodal diameter by the modes left out, estimated, undamped."""
        (left_out,) = self.truncations(whole("nodal_diameter", nodal_diameter, 0, self.sectors // 2))
        return left_out.error(frequency)

    def changed(self, **values: float) -> SectorModes:
        """A copy with another ``loss_factor`` or factor ``damping``; phases computed later are shared."""
        new = copy(self)
        given = super().changed(**values)
        new.loss_factor, new.damping = given.loss_factor, given.damping
        return new

    def __repr__(self) -> str:
        return f"SectorModes({len(self.dofs)} dofs, {self.sectors} sectors)"
