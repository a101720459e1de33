"""A plate on its side, pressed on friction contacts all over its face: seconds and memory a point, by number.

    OMP_NUM_THREADS=1 python benchmarks/many_contacts.py [10 50 1000 10000] [--whole] [--residuals solved] [--seen .]

Each contact has a tangential and a normal port and harmonics 0 to 5: 22 unknowns. The plate lifts off most of them at
its resonance and slips on others. Without ``--whole`` eight points are followed from the middle of the flank on.
With ``--seen`` the file for ParaView of the last point, and the page, are written to a folder.

    OMP_NUM_THREADS=1 python benchmarks/many_contacts.py --chains [1 2 5 10 20 40 100 200]

Chains of as many oscillators with a contact each, harmonics 0 to 10: 21 unknowns a contact, one output, through the
frequencies at which they slip. Seconds, evaluations and factorisations a point, the exponent of the seconds from size
to size, and what the time goes to, by samples of the innermost of a few functions.

    OMP_NUM_THREADS=1 python benchmarks/many_contacts.py --peaks [10 20 40]

The same chains with the peaks of every output, from 2 to 15 rad/s: points, peaks, evaluations and seconds of a curve.

    OMP_NUM_THREADS=1 python benchmarks/many_contacts.py --joint 35 115 400 686 [--jacobian dense] [--force 1] [--first]
    OMP_NUM_THREADS=1 python benchmarks/many_contacts.py --joint 400 686 --force 0.3 --omega 1100 1189

Two beams that overlap, clamped together by three bolts of 5 kN, with as many planar contacts in the lap, harmonics 0 to
5, through the first resonance or at its first frequency alone: seconds, Newton steps, factorisations, products of the
Jacobian, and products of the iterations for the contacts that slip.
"""

from __future__ import annotations

import argparse
import json
import signal
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from time import process_time
from types import FrameType
from typing import Any

import numpy as np
from clocks import one_thread, peak_memory
from ensembles import chain
from scipy import sparse

import slipstick as ss
from slipstick.analysis.events import StrategyTried
from slipstick.fem.boundary import surface_where
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.fem.retained import skin_rows
from slipstick.structure.reduction.reduce import reduce_model

SIZE = (0.4, 0.25, 0.008)
GRIDS = {
    10: (5, 2),
    20: (5, 4),
    50: (10, 5),
    100: (10, 10),
    200: (20, 10),
    300: (20, 15),
    500: (25, 20),
    1000: (40, 25),
}
GRIDS |= {3000: (75, 40), 10_000: (125, 80)}
RANGE, FLANK = (1000.0, 2500.0), (1650.0, 1690.0)
STEEL = Material(young=2.1e11, poisson=0.3, density=7800.0)


def plate(
    nx: int, ny: int, modes: int = 128, residuals: str = "auto", seen: bool = False
) -> tuple[ss.ModalStructure, int]:
    """The plate fixed at one end, reduced to nx ny points of its lower face, dofs "1t", "1n", ...; and their number."""
    mesh = box(SIZE, (nx, ny - 1, 1), "hex20")
    model = elastic_model(mesh, STEEL, "x0")
    x, y, z = mesh.nodes.T
    steps = x * nx / SIZE[0], y * (ny - 1) / SIZE[1]
    on_grid = np.all([np.abs(s - np.round(s)) < 1e-6 for s in steps], axis=0)
    dofs = model.indices(np.flatnonzero(on_grid & (z < 1e-9) & (x > 1e-9)))
    rows = dofs[:, [0, 2]].ravel()
    keep = sparse.csc_array((np.ones(rows.size), (rows, np.arange(rows.size))), shape=(model.K.shape[0], rows.size))
    tip, press = np.zeros(model.K.shape[0]), np.zeros(model.K.shape[0])
    edge = model.indices(np.flatnonzero(x > SIZE[0] - 1e-9))
    tip[edge[:, [0, 2]]] = 1.0 / len(edge)
    press[dofs[:, 1]] = 1.0
    places, below = mesh.nodes[model.free[rows] // 3], mesh.surface("z0").nodes
    skin = skin_rows(model, places, below, len(dofs)) if seen else None
    structure = reduce_model(
        model.K, model.M, skin=skin, keep=keep, names=[f"{i + 1}{port}" for i in range(len(dofs)) for port in "tn"],
        load_shapes={"tip": tip, "press": press}, modes=min(modes, len(tip) - 1), loss_factor=0.002,
        residuals=residuals,
    ).structure  # fmt: skip
    return structure, len(dofs)


def problem(structure: ss.ModalStructure, n: int) -> ss.Problem:
    """The same total stiffness and pressing load whatever the number of contacts."""
    law = ss.FrictionContact(kt=5e7 / n, mu=0.3, kn=4e6 / n, normal_load=500.0 / n)
    pairs = [ss.ContactPair(name=f"c{i}", contact=law, tangential=f"{i}t", normal=f"{i}n") for i in range(1, n + 1)]
    loads = [ss.Load(shape="tip", harmonic=1, cos=20.0), ss.Load(shape="press", harmonic=0, cos=500.0 / n)]
    return ss.Problem(structure, contacts=pairs, loads=loads, harmonics=range(6), outputs=[f"{n}n"])


def written(branch: ss.Branch, folder: str | None) -> dict[str, float]:
    """Seconds and megabytes of the file for ParaView, and of the page; none without a folder."""
    if folder is None:
        return {}
    out = {}
    for name, write in (
        ("shape.xdmf", lambda path: branch.save_shape(path, len(branch) - 1)),
        ("report.html", branch.report),
    ):
        began, path = process_time(), Path(folder) / name
        write(path)
        out |= {f"{name}, s": process_time() - began, f"{name}, MB": path.stat().st_size / 1e6}
    return out


def measure(n: int, whole: bool, residuals: str = "auto", seen: str | None = None) -> dict[str, Any]:
    """One row of the table; memory is the largest of the process so far, reduction included."""
    began = process_time()
    structure, n = plate(*GRIDS[n], residuals=residuals, seen=seen is not None)
    built, given = process_time() - began, problem(structure, n)
    times: list[float] = []

    def listen(event: object) -> None:
        if type(event).__name__ == "PointFound":
            times.append(process_time())

    first = process_time()
    options = {} if whole else {"max_points": 8, "max_step": 1 / 8, "first_step": 1 / 8}
    branch = ss.forced_response(given, omega=RANGE if whole else FLANK, options=options, listeners=listen)
    dataset, steps = branch.dataset, np.diff(times)
    return {
        "contacts": n, "unknowns": 22 * n, "structure": type(structure).__name__,
        "reduction, s": built, "first point, s": times[0] - first,
        "s a point": float(steps.mean()), "s a point, median": float(np.median(steps)), "points": len(times),
        "evaluations": int(dataset.attrs["evaluations"]), "jacobian": str(dataset.attrs["jacobian"]),
        "GB": peak_memory(), "peak": float(dataset.amplitude.max()),
        "stick, last point": float(dataset.stick_fraction[-1].mean()),
        "slip, last point": float(dataset.slip_fraction[-1].mean()), "outcome": branch.outcome.name,
        **written(branch, seen),
    }  # fmt: skip


CHAINS = (1, 2, 5, 10, 20, 40, 100, 200)
SLIPPING, PASSED = (8.0, 11.0), (2.0, 15.0)
PARTS = {
    ("solve/linear/dense.py", "_factors"): "factors", ("contact_jacobian.py", "_preconditioner"): "factors",
    ("jacobian_backends.py", "_write"): "written", ("solve/linear/dense.py", "solve"): "solutions",
    ("iterative.py", "solve"): "solutions", ("iterative.py", "solve_correction"): "solutions",
    ("iterative.py", "sign"): "signs", ("balance/evaluation.py", "evaluate"): "evaluations",
    ("results/record.py", "values"): "results", ("continuation/follow.py", "_between"): "between points",
}  # fmt: skip
"""Functions, by the end of the file's name, and what their time is called; the innermost counts."""


@contextmanager
def sampled() -> Iterator[Counter[str]]:
    """Samples of the processor time, one a millisecond, by ``PARTS``."""
    parts: Counter[str] = Counter()

    def look(_: int, frame: FrameType | None) -> None:
        while frame is not None:
            code = frame.f_code
            for (file, name), part in PARTS.items():
                if code.co_name == name and code.co_filename.endswith(file):
                    parts[part] += 1
                    return
            frame = frame.f_back
        parts["other"] += 1

    before = signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, 1e-3, 1e-3)
    try:
        yield parts
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


@contextmanager
def factorisations() -> Iterator[Counter[str]]:
    """Counts factors of dense Jacobians and preconditioners of iterative ones."""
    from slipstick.balance import contact_jacobian
    from slipstick.solve.linear import dense

    made, factorise, preconditioner = Counter[str](), dense.dgetrf, contact_jacobian.Preconditioner

    def counted(make: Any) -> Any:
        def call(*given: Any, **options: Any) -> Any:
            made["factorisations"] += 1
            return make(*given, **options)

        return call

    dense.dgetrf, contact_jacobian.Preconditioner = counted(factorise), counted(preconditioner)
    try:
        yield made
    finally:
        dense.dgetrf, contact_jacobian.Preconditioner = factorise, preconditioner


def growth(counts: Sequence[int] = CHAINS, least: float = 1.0) -> Iterator[dict[str, Any]]:
    """A row for each chain, followed again until ``least`` seconds have passed."""
    before: dict[str, Any] = {}
    for n in counts:
        given = replace(chain(n, 11), outputs=["x0"])
        ss.forced_response(given, omega=SLIPPING, options={"max_points": 3})
        with one_thread(), factorisations() as made, sampled() as parts:
            began, points, evaluations = process_time(), 0, 0
            while process_time() - began < least:
                branch = ss.forced_response(given, omega=SLIPPING)
                points, evaluations = points + len(branch), evaluations + int(branch.dataset.attrs["evaluations"])
            seconds = (process_time() - began) / points
        row = {
            "contacts": n, "unknowns": 21 * n, "ms a point": 1e3 * seconds, "points": len(branch),
            "evaluations a point": evaluations / points, "factorisations a point": made["factorisations"] / points,
            "jacobian": str(branch.dataset.attrs["jacobian"]),
        }  # fmt: skip
        if before:
            row["exponent"] = float(np.log(row["ms a point"] / before["ms a point"]) / np.log(n / before["contacts"]))
        before, all_ = row, max(1, parts.total())
        yield row | {"where": ", ".join(f"{part} {100 * k // all_} %" for part, k in parts.most_common(4))}


LAP_RANGE = (1000.0, 1250.0)


def lap_joint(points: int, force: float) -> ss.Problem:
    """The joint of docs/bolted-joint.md with its bolts tightened, on a finer mesh for many points."""
    fine = 2 if points > 200 else 1
    lower = box((0.30, 0.03, 0.01), (20 * fine, 3 * fine, 1))
    upper = box((0.30, 0.03, 0.01), (15 * fine, 3 * fine - 1, 1), at=(0.21, 0.0, 0.01))
    mesh = together({"lower": lower, "upper": upper})
    beams = elastic_model(mesh, Material(young=2e11, poisson=0.3, density=7800.0), ["lower.x0", "upper.x1"])
    x, y, z = mesh.nodes.T
    lap = [
        surface_where(mesh, np.isin(np.arange(mesh.n_nodes), mesh.surface(side).nodes) & (x > 0.209) & (x < 0.301))
        for side in ("lower.z1", "upper.z0")
    ]
    law = ss.PlanarFrictionContact(kt=5e13, kn=1e14, mu=0.3, gap=0.0)
    joint = ss.surface_pair(beams, *lap, contact=law, name="lap", points=points)
    bolts, kept = [], []
    for number, place in enumerate((0.23, 0.255, 0.28), 1):
        head, nut = (
            [f"n{mesh.labels[n]}z" for n in mesh.surface(side).nodes if np.hypot(x[n] - place, y[n] - 0.015) < 0.009]
            for side in ("upper.z1", "lower.z0")
        )
        elongation = {dof: 1 / len(head) for dof in head} | {dof: -1 / len(nut) for dof in nut}
        bolts.append(ss.bolt(name=f"bolt {number}", elongation=elongation, stiffness=2.8e8))
        kept += [*head, *nut]
    shaken = f"n{mesh.labels[np.argmin(np.hypot(x - 0.15, y - 0.015) + np.abs(z - 0.01))]}z"
    body = ss.reduced_body(
        beams, pairs=joint, keep=[*dict.fromkeys(kept), shaken], modes=30, loss_factor=0.002, residuals="written"
    )
    given = ss.Problem(
        body.structure, contacts=[*joint, *bolts], loads=ss.Load(dof=shaken, cos=force), harmonics=5, outputs=shaken
    )
    tight = ss.LoadStep(name="tightened", bolts={bolt.name: 5e3 for bolt in bolts})
    return given.preloaded(ss.preload(given, [tight], pairs=joint))


def joint(points: int, force: float, jacobian: str, first: bool, omega: tuple[float, float]) -> dict[str, Any]:
    """A row for the curve of a joint, or for its first point."""
    given, tried = lap_joint(points, force), list[str]()

    def listen(event: object) -> None:
        if isinstance(event, StrategyTried):
            tried.append(event.name)

    products = Counter[str]()
    with one_thread(), factorisations() as made, counted_products(products):
        began = process_time()
        branch = (
            ss.steady_response(given, omega=omega[0], options={"jacobian": jacobian}, listeners=listen)
            if first
            else ss.forced_response(given, omega=omega, options={"jacobian": jacobian}, listeners=listen)
        )
        seconds = process_time() - began
    dataset = branch.dataset
    return {
        "contacts": points, "force, N": force, "jacobian": str(dataset.attrs["jacobian"]), "s": seconds,
        "points": len(branch), "evaluations": int(dataset.attrs["evaluations"]), "strategies": tried,
        "factorisations": made["factorisations"], **products, "peak": float(dataset.amplitude.max()),
        "stick, mean": float(dataset.stick_fraction.mean()), "outcome": branch.outcome.name,
    }  # fmt: skip


@contextmanager
def counted_products(counts: Counter[str]) -> Iterator[None]:
    """Counts solutions by GMRES and the products they take, and products of the Jacobian."""
    from slipstick.balance.contact_jacobian import ContactJacobian
    from slipstick.solve.linear import iterative

    gmres, multiply = iterative.gmres, ContactJacobian.multiply

    def counted(*given: Any, **options: Any) -> Any:
        solved = gmres(*given, **options)
        counts["iterative solutions"] += 1
        counts["products"] += solved.products
        return solved

    def whole(self: Any, x: Any, **options: Any) -> Any:
        counts["products of the Jacobian"] += 1
        return multiply(self, x, **options)

    iterative.gmres, ContactJacobian.multiply = counted, whole  # type: ignore[method-assign]
    try:
        yield
    finally:
        iterative.gmres, ContactJacobian.multiply = gmres, multiply  # type: ignore[method-assign]


def peaks(n: int) -> dict[str, Any]:
    """A chain of n oscillators through its range, the peaks of all outputs located."""
    with one_thread():
        ss.forced_response(chain(n, 11), omega=PASSED, options={"max_points": 3})
        began = process_time()
        data = ss.forced_response(chain(n, 11), omega=PASSED).dataset
        seconds = process_time() - began
    kinds = Counter(data.kind.values.tolist())
    return {
        "contacts": n, "points": data.sizes["point"], "peaks": kinds["peak"], "near peaks": kinds["near peak"],
        "evaluations": int(data.attrs["evaluations"]), "s": seconds,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    usual = [n for n in GRIDS if n <= 1000]
    parser.add_argument("counts", nargs="*", type=int, help=f"any of {', '.join(map(str, GRIDS))}; of a joint any")
    parser.add_argument("--whole", action="store_true", help="the whole curve through the resonance")
    parser.add_argument("--residuals", default="auto", help="auto, written or solved")
    parser.add_argument("--seen", help="a folder for the file for ParaView and the page")
    parser.add_argument("--chains", action="store_true", help="chains of oscillators in place of the plate")
    parser.add_argument("--joint", action="store_true", help="a bolted lap joint in place of the plate")
    parser.add_argument("--jacobian", default="auto", help="of the joint: auto, dense or iterative")
    parser.add_argument("--force", type=float, default=10.0, help="amplitude of the force on the joint, N")
    parser.add_argument("--omega", type=float, nargs=2, default=LAP_RANGE, help="range of the joint's curve, rad/s")
    parser.add_argument("--first", action="store_true", help="of the joint the first point alone")
    parser.add_argument("--peaks", action="store_true", help="peaks of every output of the chains")
    options = parser.parse_args()
    if options.peaks:
        for n in options.counts or (10, 20, 40):
            print(json.dumps(peaks(n)), flush=True)
        return
    if options.joint:
        for n in options.counts:
            print(
                json.dumps(joint(n, options.force, options.jacobian, options.first, tuple(options.omega))), flush=True
            )
        return
    if options.chains:
        for row in growth(options.counts or CHAINS):
            print(json.dumps(row), flush=True)
        return
    for n in options.counts or usual:
        print(json.dumps(measure(n, options.whole, options.residuals, options.seen)), flush=True)


if __name__ == "__main__":
    main()
