"""The Brake-Reuss beam from its public Abaqus deck: frequencies, three bolts of 12 kN, frequency and damping over
amplitude, beside published figures.

Fetch the deck (assets/demo/Job.inp of github.com/Nidish96/Abaqus4Joints); it is read as it is:

    OMP_NUM_THREADS=1 python benchmarks/brake_reuss.py Job.inp [--points 600] [--patches 35] [--backbone] [--identify]

Frequencies: N. N. Balaji's table of that repository (docs/abqtut.org), of a model whose interface is closed everywhere
and does not resist sliding. The backbone: examples/structures/results/brb_epmc_flat.yaml of tmd-lab/tmdsimpy on GitHub,
of another reduced model of the beam with a law of rough contact, 12.2 kN a bolt and a friction coefficient of 0.03.
Here kn is that of the first table, kt grows with the third root of the pressure, and kt and mu are fitted (--identify).
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
import xarray as xr
from clocks import peak_memory
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import LinearOperator, eigsh, splu

import slipstick as ss
from slipstick.analysis.preload.preload import Preload
from slipstick.fem.model import FiniteElementModel
from slipstick.models.surface_pair import SurfacePair
from slipstick.typing import Array, Sparse

SIDES = ("TOPBEAM_INSURF", "BOTBEAM_INSURF")
AREA = 120e-3 * 25.4e-3 - 3.0 * np.pi * (8.5e-3 / 2.0) ** 2
KN = 5e6 / (AREA / 600)
"""Normal stiffness per area of the published frequencies: 5e6 N/m for each of 600 elements."""
FREE = (70.323, 151.26, 609.25)
PUBLISHED = (143.74, 151.30, 575.08, 642.81, 870.59, 945.37)
KINDS = (
    "bending across the joint",
    "bending along it",
    "bending across",
    "bending along",
    "sliding on the bolts",
    "bending along",
)
FORCE = 12e3
LAW = {"kt": 2.68e12, "kn": KN, "mu": 0.0282}
EXPONENT = 1.0 / 3.0
"""Power of the pressure with which kt grows."""
SOUGHT = ("lap.kt_per_area", "lap.mu")
NOISE = {"omega": 2.0 * np.pi * 0.5, "modal_damping": 0.15}
"""Standard deviations for the fit: of frequencies, rad/s, and of damping over its size."""
DAMPING = 8.7e-4
"""Damping ratio of the published first mode without friction, added to that of friction here."""
BACKBONE = (
    (9.73e-8, 168.502, 8.73e-4), (1.23e-6, 168.432, 1.15e-3), (3.28e-6, 168.153, 2.11e-3), (8.69e-6, 166.918, 6.15e-3),
    (2.29e-5, 164.034, 1.22e-2), (5.45e-5, 158.667, 2.63e-2), (6.74e-5, 156.674, 3.06e-2),
)  # fmt: skip
"""Amplitude at the accelerometer (m), frequency (Hz), damping ratio."""
SOFT = 2.0 * np.pi * 2.0
"""Springs of 2 Hz hold the body, which nothing else does; a frequency of 140 Hz rises by 1e-4."""


def frequencies(K: Sparse, M: csr_array, count: int) -> Array:
    """The lowest natural frequencies of a body that nothing holds, in Hz; those of rigid motion are about 0."""
    shift = -((2.0 * np.pi * 20.0) ** 2)
    A = csc_array(K - shift * M)
    factors = splu(A, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    inverse = LinearOperator(A.shape, factors.solve, dtype=float)
    values = np.sort(eigsh(K, count, M, sigma=shift, OPinv=inverse, return_eigenvectors=False))
    return np.asarray(np.sqrt(np.abs(values)) / (2.0 * np.pi))


def closed(model: FiniteElementModel, joint: SurfacePair, kn: float, kt: float) -> csr_array:
    """The stiffness with the contacts of a joint closed and stuck everywhere."""
    K, points = csr_array(model.K), joint.points
    for axis, stiffness in zip(np.eye(3), (kt, kt, kn), strict=True):
        along = csc_array(model.restrict(joint.facing.directions(np.tile(axis, (points.count, 1)))))
        K = csr_array(K + along @ diags_array(stiffness * points.areas) @ along.T)
    return K


def row(name: str, ours: float, theirs: float) -> None:
    print(f"| {name} | {ours:.2f} | {theirs:.2f} | {100.0 * (ours / theirs - 1.0):+.2f} % |")


def backbone(problem: ss.Problem, dof: str) -> Array:
    """Amplitude (m), frequency (Hz) and damping ratio of the first bending mode across the joint."""
    mode = ss.nonlinear_modes(problem, amplitude=(BACKBONE[0][0], 1.02 * BACKBONE[-1][0]), mode=8, dof=dof)
    data = mode.dataset
    amplitude = np.hypot(*(data.displacement.sel(dof=dof, coefficient=part).values for part in ("c1", "s1")))
    return np.stack([amplitude, data.omega.values / (2.0 * np.pi), data.modal_damping.values + DAMPING])


def measured(dof: str) -> xr.Dataset:
    """The published backbone as ``ss.identify`` takes it, without the damping of the material."""
    amplitude, hertz, damping = np.array(BACKBONE[1:]).T
    columns = {
        "omega": 2.0 * np.pi * hertz,
        "modal_damping": damping - DAMPING,
        "omega_noise": np.full(len(hertz), NOISE["omega"]),
        "modal_damping_noise": NOISE["modal_damping"] * damping,
    }
    return xr.Dataset(
        {name: ("modal_amplitude", values) for name, values in columns.items()},
        coords={"modal_amplitude": amplitude},
        attrs={"dof": dof, "mode": 8},
    )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("deck", type=Path, help="Job.inp, or the model.h5 that slipstick import made of it")
    parser.add_argument("--points", type=int, default=600, help="contacts of the joint under load")
    parser.add_argument("--patches", type=int, default=35, help="patches of these that move as one in the vibration")
    parser.add_argument("--backbone", action="store_true", help="frequency and damping over amplitude too")
    parser.add_argument("--identify", action="store_true", help="kt and mu fitted to the published backbone")
    wanted = parser.parse_args(arguments)
    warnings.simplefilter("ignore", ss.SlipstickWarning)  # what is approximated of the deck; slipstick import says it
    clocks = process_time(), perf_counter()

    def passed() -> str:
        seconds = process_time() - clocks[0], perf_counter() - clocks[1]
        return f"{seconds[0]:.0f} s of processor, {seconds[1]:.0f} s, {peak_memory():.1f} GB"

    model = ss.import_model(wanted.deck)
    print(f"{model.n_dofs} dofs ({passed()})\n\n| free parts, Hz | here | Abaqus | |\n|---|---|---|---|")
    for ours, theirs in zip(frequencies(model.K, model.M, 10)[7:], FREE, strict=True):
        row("bending", ours, theirs)
    law = ss.PlanarFrictionContact(kt=KN, kn=KN, mu=LAW["mu"], gap=0.0)
    whole = ss.surface_pair(model, *SIDES, contact=law, gap="touching")
    print("\n| joint closed everywhere, free to slide, Hz | here | published | |\n|---|---|---|---|")
    for kind, ours, theirs in zip(
        KINDS, frequencies(closed(model, whole, KN, 0.0), model.M, 12)[6:], PUBLISHED, strict=True
    ):
        row(kind, ours, theirs)
    stuck = frequencies(closed(model, whole, KN, KN), model.M, 12)[6:]
    print(f"\njoint closed and stuck everywhere: {', '.join(f'{f:.2f}' for f in stuck)} Hz ({passed()})")

    held = replace(model, K=csr_array(model.K + SOFT**2 * model.M))
    law = ss.PlanarFrictionContact(**LAW, gap=0.0)
    joint = ss.surface_pair(held, *SIDES, contact=law, gap="touching", points=wanted.points, name="lap")
    ends = [
        [f"n{model.nodes_of(f'{side}-{k}_SET-1')[0]}z" for k in (1, 2, 3)] for side in ("BPT", "NPT")
    ]  # reference nodes of shank and nut
    tip = f"n{model.nodes_of('OUTNODES')[0]}z"
    body = ss.reduced_body(held, pairs=joint, keep=[*ends[0], *ends[1], tip], modes=30)
    print(f"\n{joint.notes[-1]}; {len(body.structure.dofs)} dofs kept ({passed()})")
    loads = [
        ss.Load(dof=dof, harmonic=0, cos=sign * FORCE)
        for dofs, sign in zip(ends, (1.0, -1.0), strict=True)
        for dof in dofs
    ]
    problem = ss.Problem(body.structure, contacts=joint, outputs=[tip], harmonics=[0, 1])

    def tightened(pair: SurfacePair) -> Preload:
        smooth = [replace(one, contact=one.contact.changed(mu=0.0)) for one in pair]  # as the published preload
        return ss.preload(replace(problem, contacts=smooth), ss.LoadStep(name="tighten", loads=loads), pairs=pair)

    state = tightened(joint)
    print(f"{state.table()} ({passed()})")
    if not (wanted.backbone or wanted.identify):
        return
    joint = joint.gathered(wanted.patches, state, exponent=EXPONENT)
    problem = replace(problem, contacts=joint)
    state = tightened(joint)
    problem = problem.preloaded(state)
    print(f"{joint.notes[-1]}\n{state.table()} ({passed()})")
    if wanted.identify:
        fit = ss.identify(problem, measured(tip), SOUGHT)
        print(f"{fit} ({passed()})")
        for name in SOUGHT:
            problem = problem.with_parameter(name, float(fit.values[name]))
    if not wanted.backbone:
        return
    found = backbone(problem, tip)
    print("\n| amplitude, um | Hz here | published | | damping here | published | |\n|---|---|---|---|---|---|---|")
    for amplitude, hertz, damping in BACKBONE:
        ours, ratio = (float(np.interp(amplitude, found[0], part)) for part in found[1:])
        print(
            f"| {1e6 * amplitude:.3g} | {ours:.2f} | {hertz:.2f} | {100.0 * (ours / hertz - 1.0):+.2f} % "
            f"| {ratio:.2e} | {damping:.2e} | {100.0 * (ratio / damping - 1.0):+.0f} % |"
        )
    print(f"\n{found.shape[1]} points ({passed()})")


if __name__ == "__main__":
    main()
