"""A shroud after a million cycles: wear at the resonance, and the frequency and amplitude it moves to."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss

CASE = Path(__file__).resolve().parent / "worn_shroud.toml"
CYCLES, KAPPA, BAND = 1e6, 6.5e-8, (345.0, 385.0)


def problem() -> ss.Problem:
    """The disc as it is new."""
    return ss.load_case(CASE)


def compute() -> dict[str, ss.Branch]:
    """Wear at the resonance wherever it moves to, and at the frequency of the new disc."""
    new = problem()
    peak = max(ss.forced_response(new, omega=BAND, peaks_of="tip").peaks("tip"), key=lambda found: found[1])
    return {
        "at the peak": ss.wear(new, KAPPA, (0.0, CYCLES), omega="peak", range=BAND, dof="tip"),
        "at one frequency": ss.wear(new, KAPPA, (0.0, CYCLES), omega=peak[0]),
    }


def curves(worn: ss.Branch, shown: tuple[float, ...] = (0.0, 4e5, 1e6)) -> dict[str, ss.Branch]:
    """Responses of the disc as it is after so many cycles."""
    return {f"{n:g} cycles": ss.forced_response(worn.problem_at(worn.at(n)), omega=BAND) for n in shown}


def draw(branches: dict[str, ss.Branch], folder: Path) -> None:
    """Load, amplitude and frequency over the cycles, and curves of the worn disc."""
    figure = Figure(figsize=(9.6, 6.0), layout="constrained")
    places = figure.subplots(2, 2)
    for name, branch in branches.items():
        data = branch.dataset
        n = data["cycles"].to_numpy()
        places[0, 0].plot(n, data["normal_load"].to_numpy()[:, 0], label=name)
        places[0, 1].plot(n, 1e3 * data["amplitude"].sel(dof="tip").to_numpy(), label=name)
        places[1, 0].plot(n, data["omega"].to_numpy(), label=name)
    for name, branch in curves(branches["at the peak"]).items():
        data = branch.dataset
        places[1, 1].plot(data["omega"].to_numpy(), 1e3 * data["amplitude"].sel(dof="tip").to_numpy(), label=name)
    labels = ("normal load, N", "amplitude of the tip, mm", "frequency, rad/s", "amplitude of the tip, mm")
    for ax, label in zip(places.flat, labels, strict=True):
        ax.set(xlabel="cycles", ylabel=label)
        ax.legend(fontsize="small")
    places[1, 1].set(xlabel="frequency, rad/s", yscale="log")
    figure.savefig(folder / "worn_shroud.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    found = compute()
    for name, branch in found.items():
        data = branch.dataset
        load, size = data["normal_load"].to_numpy()[:, 0], 1e3 * data["amplitude"].sel(dof="tip").to_numpy()
        least = int(np.argmin(size))
        print(f"{name}: {len(branch)} points, {branch.message}")
        print(f"  load {load[0]:.4g} to {load[-1]:.4g} N, amplitude {size[0]:.4g} to {size[-1]:.4g} mm,", end=" ")
        print(f"least {size[least]:.4g}")
    draw(found, folder)
