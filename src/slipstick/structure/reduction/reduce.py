"""Sparse stiffness and mass of a finite element model reduced to modes and two residual terms at a few directions.

For directions B (n, n_keep) and modes phi_r, omega_r (THEORY.md (10.1))::

    A(omega) = sum_r a_r a_r^T / (omega_r^2 - omega^2) + [B^T U - sum_r a_r a_r^T / omega_r^2]
               + omega^2 [U^T M U - sum_r a_r a_r^T / omega_r^4],      a_r = B^T phi_r,   U = K^-1 B

Each mode not taken leaves the error ``a_r a_r^T / omega_r^2 (omega / omega_r)^4 / (1 - omega^2 / omega_r^2)``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import warn
from slipstick.solve.linear.modes import StageListener
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.receptance import undamped
from slipstick.structure.reduction.compute import compute, direct_receptance, modes_below, reached
from slipstick.structure.reduction.data import Columns, ReducedData
from slipstick.structure.reduction.request import Accuracy, Damping, as_csr, checked_request, real_matrices
from slipstick.structure.reduction.store import Store
from slipstick.structure.residuals import FullModel
from slipstick.structure.skin import Skin
from slipstick.structure.solved_modes import SolvedModes
from slipstick.structure.strains import StrainPlaces, Strains
from slipstick.structure.truncation import WARNED_REDUCTION, Truncation, WorstError, band
from slipstick.typing import Array, FrequencyRange, IntArray, Matrix, Reals, Sparse


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """A reduced structure and where it comes from.

    ``directions`` (n, n_keep) sparse; ``residuals`` (n_modes,) backward errors of the modes; ``complete``: no mode is
    missing, by a count or, of large models, by a search that overlooks one with a probability of 1e-12;
    ``error_estimate``: largest relative error of the receptance over the frequency range asked, load shapes included:
    bounded by what is measured against the full model at its upper end, for a fixed number of modes estimated
    (``structure.reduction_error``), None without a range; ``seconds`` by stage; ``reused``: read from the store;
    ``data``: what is stored of it.

    Examples
    --------
    >>> import numpy as np
    >>> from slipstick.structure.reduction.reduce import reduce_model
    >>> K = 1e4 * (np.diag([2.0, 2.0, 2.0, 1.0]) - np.eye(4, k=1) - np.eye(4, k=-1))
    >>> reduction = reduce_model(K, np.eye(4), keep=["a", "d"], dofs=["a", "b", "c", "d"], modes=3)
    >>> reduction.n_full, reduction.complete, reduction.structure.omega.round(2)
    (4, True, array([ 34.73, 100.  , 153.21]))
    """

    structure: ModalStructure
    data: ReducedData
    directions: Matrix
    n_full: int
    solver: str
    residuals: Array
    complete: bool | None
    error_estimate: float | None
    seconds: Mapping[str, float] = field(default_factory=dict)
    reused: bool = False


@dataclass(frozen=True, kw_only=True)
class SkinRows:
    """A surface to be seen: nodes (n, 3), triangles (t, 3), and their dofs in the model, sparse (n_full, 3 n).

    ``rows`` None: of what is read from disk. ``places`` (n_keep, 3) of the kept directions, nan where they are not
    known; None: of none. ``held``: motion that the supports of load shapes have themselves, (3 n,).
    """

    nodes: Array
    triangles: IntArray
    rows: Matrix | None = None
    places: Array | None = None
    held: Mapping[str, Array] = field(default_factory=dict)


def reduce(
    K: Matrix,
    M: Matrix,
    *,
    keep: Sequence[str] | Any,
    dofs: Sequence[str] | None = None,
    names: Sequence[str] | None = None,
    load_shapes: Mapping[str, Reals] | None = None,
    modes: int | None = None,
    accuracy: float = 1e-7,
    frequency_range: FrequencyRange | None = None,
    loss_factor: float | Reals = 0.0,
    damping_ratio: float | Reals = 0.0,
    rayleigh: tuple[float, float] = (0.0, 0.0),
    force: bool = False,
    solver: str | None = None,
    cache: str | Path | None = None,
    listener: StageListener | None = None,
    residuals: str = "auto",
) -> ModalStructure:
    """Reduce sparse symmetric K, M (n, n) of a constrained structure to named directions: modes and static residual.

    Parameters
    ----------
    keep
        Names of the dofs to keep (``dofs`` must then name all n), or a matrix (n, n_keep) of directions, each column a
        unit direction or a patch: its motion is ``column^T x`` and a unit force on it loads ``x`` with the column.
    names
        Of the columns of ``keep`` when that is a matrix.
    load_shapes
        Full load vectors (n,) by name: pressures and other distributed loads.
    modes
        How many; when left out, as many as bring the receptance to ``accuracy`` everywhere up to the upper end of
        ``frequency_range`` (rad/s). The error is relative, in the Frobenius norm over the kept directions and over
        those for each load shape; where modes cancel each other between resonances the receptance counts as a tenth of
        what they come to without. The range should hold the harmonics that matter: of friction about the first three to
        five times the frequency. Without a range too, as many as bring the estimate of that error to ``accuracy`` up to
        ten times the first natural frequency, and 128 at most.
    force
        Take a reduction whose error over ``frequency_range`` is above 1e-2, which is refused otherwise. Without a range
        the structure knows how far it holds: ``reduction_error(frequency)`` and ``valid_to``.
    loss_factor, damping_ratio, rayleigh
        See :class:`Damping`.
    solver
        One of ``slipstick.solve.linear.factorisation.available_solvers()``; the best one by default.
    cache
        Folder in which reductions are kept and found again by content; damping is not part of it.
    residuals
        How what the modes leave out is applied: "written" out as matrices (n_keep, n_keep), or "solved" for with the
        factorised stiffness at each product: for thousands of directions, to rounding the same. "auto" takes what costs
        less over the reduction and one curve, and "solved" where the matrices would fill more than 4 GB. The structure
        is then a ``structure.solved_modes.SolvedModes``; where all entries of a receptance are needed (stability, dense
        Jacobians), it writes them out for a few thousand contacts at most.

    Raises
    ------
    InputError
        Sizes, names, complex or non-finite values, asymmetry, singular or indefinite matrices: one sentence each.
        A relative error of the receptance above 1e-2 over ``frequency_range``, unless forced.
    EigenError
        Modes that do not converge, or an accuracy out of reach.

    Warns
    -----
    SlipstickWarning
        An error above 1e-4 over ``frequency_range``.

    See :func:`reduce_model` for where the result comes from and how good it is.

    Examples
    --------
    Four masses in a row, the first held; the two in the middle are not kept.

    >>> import numpy as np
    >>> K = np.diag([2.0, 2.0, 2.0, 1.0]) - np.eye(4, k=1) - np.eye(4, k=-1)
    >>> reduced = reduce(1e4 * K, np.eye(4), keep=["a", "d"], dofs=["a", "b", "c", "d"], modes=3, loss_factor=1e-3)
    >>> reduced.dofs, reduced.natural_frequencies.round(2)
    (('a', 'd'), array([ 34.73, 100.  , 153.21]))
    """
    reduction = reduce_model(
        K,
        M,
        keep=keep,
        dofs=dofs,
        names=names,
        load_shapes=load_shapes,
        modes=modes,
        accuracy=accuracy,
        frequency_range=frequency_range,
        loss_factor=loss_factor,
        damping_ratio=damping_ratio,
        rayleigh=rayleigh,
        force=force,
        solver=solver,
        cache=cache,
        listener=listener,
        residuals=residuals,
    )
    return reduction.structure


@dataclass(frozen=True, kw_only=True)
class StrainRows:
    """Places whose strain is wanted, and what takes it out of a motion, sparse (n_full, 6 n_places).

    ``rows`` None: of what is read from disk. ``free``: strain without stress of load shapes, (6 n_places,); ``held``:
    strain by the motion that their supports have themselves.
    """

    places: StrainPlaces
    rows: Matrix | None = None
    free: Mapping[str, Array] = field(default_factory=dict)
    held: Mapping[str, Array] = field(default_factory=dict)


def reduce_model(
    K: Matrix,
    M: Matrix,
    *,
    skin: SkinRows | None = None,
    strains: StrainRows | None = None,
    reach: float = 0.0,
    **asked: Any,
) -> Reduction:
    """As :func:`reduce`, with where the result comes from and how good it is.

    Arguments ``asked`` and errors are those of :func:`reduce`; with ``skin`` and ``strains`` the structure has them.
    Where neither a number of modes nor a range is given, the modes serve frequencies up to ``reach`` (rad/s) at least.
    """
    K, M = real_matrices(K, M)
    request = checked_request(K.shape[0], reach=reach, **asked)
    directions, loads, want, solver = request.directions, request.loads, request.want, request.solver
    began = perf_counter()
    columns = Columns(directions, loads, *_seen_rows(skin, strains))
    store = Store(
        request.cache, "reduction", (K, M, directions, loads, *(() if columns.seen is None else (columns.seen,))),
        (asdict(want), solver, request.residuals, columns.n_strains), ("solve", "structure"),
    )  # fmt: skip
    make = partial(
        compute, K, M, columns, dofs=request.dofs, want=want, solver=solver, residuals=request.residuals,
        listener=request.listener,
    )  # fmt: skip
    data, reused = store.kept(make, columns.of)
    if reused:
        data = replace(data, seconds={"reading the stored reduction": perf_counter() - began})
    structure: ModalStructure
    if data.near is not None:
        full = FullModel(K=K, M=M, directions=directions, solver=data.solver)
        structure = solved_structure(data, full, request.kept, request.load_names, request.damping, skin, strains)
    else:
        structure = modal_structure(data, request.kept, request.load_names, request.damping, skin, strains)
    error = data.error_estimate
    if request.frequency_range is not None:
        worst = _worst(structure, request.frequency_range, error)
        _judge(worst, request.force, lambda: modes_below(K, M, worst.needed, solver))
        error = worst.relative if error is None else error
    else:
        below = partial(modes_below, K, M, solver=solver)
        judge_served(structure.truncations(1), structure.omega, want, request.force, below)
    return Reduction(
        structure=structure,
        data=data,
        directions=directions,
        n_full=K.shape[0],
        solver=data.solver,
        residuals=data.residuals,
        complete=data.complete,
        error_estimate=error,
        seconds=data.seconds,
        reused=reused,
    )


def _seen_rows(skin: SkinRows | None, strains: StrainRows | None) -> tuple[Sparse | None, int]:
    """Rows of both (n_full, n), those of the skin first, and how many are strains."""
    parts = [as_csr(part.rows) for part in (skin, strains) if part is not None and part.rows is not None]
    rows = sparse.csr_array(sparse.hstack(parts)) if parts else None
    return rows, 0 if strains is None else parts[-1].shape[1]


def _worst(structure: ModalStructure, frequency_range: tuple[float, float], measured: float | None) -> WorstError:
    """Measured, else the estimate over the range."""
    top = max(frequency_range)
    error, at = measured, top
    if error is None:
        grid = band(structure.omega, min(frequency_range), top)
        errors = structure.reduction_error(grid)
        worst = int(np.argmax(errors))
        error, at = float(errors[worst]), float(grid[worst])
    return WorstError(value=error, relative=error, omega=at, last_mode=structure.last_mode, reach=top)


def _judge(worst: WorstError, force: bool, count: Callable[[], int | None], where: str = "") -> None:
    if worst.refused and not force:
        raise InputError(Fault(where, worst.sentence(count())) if where else worst.sentence(count()))
    if worst.value > WARNED_REDUCTION:
        warn([f"{where}: {worst.sentence()}" if where else worst.sentence()])


def judge_served(
    left_out: Sequence[Truncation],
    omega: Array,
    want: Accuracy,
    force: bool,
    below: Callable[[float], int | None],
    where: str = "",
    measured: float | None = None,
) -> None:
    """Where the number of modes is not given: whether as many as are allowed serve what they should.

    Bodies and the phases of sectors alike, made or read: up to ``want.reach`` an error above 1e-2 is refused, unless
    forced, and one above 1e-4 warned of; where nothing is asked, up to ten times the first natural frequency, it is
    warned of. Of an accuracy up to ``want.highest`` the error ``measured`` there is judged by the same limits.
    ``below`` tells how many modes lie below a frequency.
    """
    if want.modes is not None:
        return
    if want.highest is not None:
        assert measured is not None
        worst = WorstError(
            value=measured, relative=measured, omega=want.highest, last_mode=float(omega.max()), reach=want.highest
        )
        _judge(worst, force, partial(below, worst.needed), where)
        return
    top = reached(omega, want)
    grid = band(omega, 0.0, top)
    for each in left_out:
        errors = each.error(grid)
        at = int(np.argmax(errors))
        value = float(errors[at])
        worst = WorstError(
            value=value, relative=value, omega=float(grid[at]), last_mode=each.last, reach=top, kind=each.kind
        )
        _judge(worst, force or not want.reach, partial(below, worst.needed), where)


def receptance_error(
    structure: ModalStructure, directions: Matrix, K: Matrix, M: Matrix, omega: float, *, solver: str | None = None
) -> float:
    """Relative error of the undamped receptance between the kept directions against the full model.

    One direct solution of ``K - omega^2 M`` (sparse, n rows; rad/s), Frobenius norm over the kept directions.
    Undamped, because damping changes the physics, not the quality of the reduction; next to a resonance the figure
    grows with the receptance's own sensitivity to frequency. Raises InputError at a resonance itself.
    """
    s = structure
    exact = direct_receptance(as_csr(K), as_csr(M), directions, omega, solver).exact
    modal = undamped(s.omega, s.mode_shapes, s.static_compliance, s.second_residual).at([1], omega)[0][0]
    return float(np.linalg.norm(modal - exact) / np.linalg.norm(exact))


def modal_structure(
    data: ReducedData,
    kept: tuple[str, ...],
    loads: tuple[str, ...],
    damping: Damping,
    skin: SkinRows | None = None,
    strains: StrainRows | None = None,
) -> ModalStructure:
    """The structure of computed or stored data with names and damping."""
    n = len(kept)
    a, w2 = data.amplitudes, data.omega**2
    second = data.second - (a / w2**2) @ a.T
    shapes = {
        name: LoadShape(
            participation=a[n + k], static_response=data.static[:n, n + k], second_response=second[:n, n + k]
        )
        for k, name in enumerate(loads)
    }
    return ModalStructure(
        omega=data.omega,
        mode_shapes=a[:n],
        static_compliance=data.static[:n, :n],
        dofs=kept,
        loss_factor=damping.loss_factor,
        damping_ratio=damping.ratios(data.omega),
        second_residual=0.5 * (second[:n, :n] + second[:n, :n].T),
        load_shapes=shapes,
        skin=None if skin is None else _skin(data, n, loads, skin),
        strains=None if strains is None else _strains(data, n, loads, strains),
    )


def solved_structure(
    data: ReducedData,
    full: FullModel,
    kept: tuple[str, ...],
    loads: tuple[str, ...],
    damping: Damping,
    skin: SkinRows | None = None,
    strains: StrainRows | None = None,
) -> SolvedModes:
    """The structure of data whose residuals are applied by solutions with the full model."""
    assert data.sample is not None
    assert data.near is not None
    n, s, a = len(kept), len(data.sample), data.amplitudes
    if data.factors is not None:
        full.__dict__["factors"] = data.factors
    static, second = data.static[:n], data.second_residual[:n]
    shapes = {
        name: LoadShape(participation=a[n + k], static_response=static[:, s + k], second_response=second[:, s + k])
        for k, name in enumerate(loads)
    }
    return SolvedModes(
        omega=data.omega, mode_shapes=a[:n], dofs=kept, full=full, near=data.near[0], near_second=data.near[1],
        sample=data.sample, sample_static=static[:, :s], sample_second=second[:, :s],
        loss_factor=damping.loss_factor, damping_ratio=damping.ratios(data.omega), load_shapes=shapes,
        skin=None if skin is None else _skin(data, n, loads, skin),
        strains=None if strains is None else _strains(data, n, loads, strains),
    )  # fmt: skip


def _skin(data: ReducedData, n_keep: int, loads: tuple[str, ...], rows: SkinRows) -> Skin:
    seen = slice(3 * len(rows.nodes))
    static, of_loads = _apart(data, data.seen_static, n_keep)
    assert data.seen_modes is not None
    return Skin(
        nodes=rows.nodes,
        triangles=rows.triangles,
        modes=data.seen_modes[seen],
        static=None if static is None else static[seen],
        loads=_with_held(loads, of_loads[seen], rows.held),
        rows=as_csr(rows.rows) if data.near is not None else None,
        places=rows.places,
    )


def _strains(data: ReducedData, n_keep: int, loads: tuple[str, ...], rows: StrainRows) -> Strains:
    seen = slice(-6 * len(rows.places.labels), None)
    (static, of_loads), (second, second_loads) = (
        _apart(data, part, n_keep) for part in (data.seen_static, data.seen_second)
    )
    assert data.seen_modes is not None
    return Strains(
        places=rows.places,
        modes=data.seen_modes[seen],
        static=None if static is None else static[seen],
        second=second,
        loads=_with_held(loads, of_loads[seen], rows.held),
        second_loads=dict(zip(loads, second_loads.T, strict=True)),
        free=rows.free,
        rows=as_csr(rows.rows) if data.near is not None else None,
    )


def _with_held(loads: tuple[str, ...], motion: Array, held: Mapping[str, Array]) -> dict[str, Array]:
    """Response of each load shape at rows seen, with the motion of the supports themselves."""
    every = dict(zip(loads, motion.T, strict=True))
    return {name: own + held[name] if name in held else own for name, own in every.items()}


def _apart(data: ReducedData, part: Array | None, n_keep: int) -> tuple[Array | None, Array]:
    """Responses at rows seen to kept directions, None where they are solved for, and to loads."""
    assert part is not None
    return (None, part) if data.near is not None else (part[:, :n_keep], part[:, n_keep:])
