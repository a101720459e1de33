"""A disc of 24 blades with shrouds that rub against each other, from equal blades to blades that differ.

Engine order 4 excites the first family of blade modes. With equal blades one sector in a travelling wave tells
everything; with blades that differ by some percent all 24 are computed, in the modes of the tuned disc.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slipstick as ss

SECTORS, ENGINE_ORDER = 24, 4
SPREAD, SEED = 0.01, 7


def sector() -> ss.CyclicStructure:
    """A blade with its tip and shroud on a piece of the disc, coupled to the next one through the disc (kg, N, m)."""
    blade, disc, between = 4.0e4, 4.0e5, 1.5e5
    K0 = np.array([[blade, -blade], [-blade, blade + disc + 2.0 * between]])
    K1 = np.array([[0.0, 0.0], [0.0, -between]])
    return ss.CyclicStructure(
        M=np.diag([0.3, 1.2]), K=(K0, K1), dofs=["tip", "disc"], sectors=SECTORS, loss_factor=2e-3
    )


def blade() -> np.ndarray:
    """What of the stiffness of a sector deviates with its blade."""
    return 4.0e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])


def wave(normal_load: float = 10.0, kt: float = 4.0e3) -> ss.Problem:
    """A sector in the wave, with its shroud against that of the next one. Blades are numbered against the rotation."""
    shroud = ss.ContactPair(
        name="shroud",
        contact=ss.FrictionContact(kt=kt, mu=0.3, normal_load=normal_load),
        tangential={"tip": 1.0, "tip@next": -1.0},
    )
    return ss.Problem(
        sector().travelling_wave(ENGINE_ORDER),
        contacts=shroud,
        loads=ss.Load(dof="tip", amplitude=1.0),
        harmonics=[0, 1, 3],
        outputs=["tip"],
        title="bladed disc",
    )


def disc(spread: float = SPREAD, seed: int = SEED) -> ss.Problem:
    """The whole disc with blades that differ."""
    return sector().mistuned(blade=blade(), spread=spread, seed=seed).problem(wave())


def compute(omega: tuple[float, float] = (345.0, 385.0)) -> dict[str, ss.Branch]:
    """Tuned and mistuned."""
    return {
        "tuned": ss.forced_response(wave(), omega=omega),
        "mistuned": ss.forced_response(disc(), omega=omega, peaks_of="largest"),
    }


def amplification(branches: dict[str, ss.Branch]) -> float:
    """Largest amplitude of any blade over that of the tuned disc."""
    largest = {name: float(branch.on_disc("tip").max()) for name, branch in branches.items()}
    return largest["mistuned"] / largest["tuned"]


def draw(branches: dict[str, ss.Branch], folder: Path) -> None:
    """Every blade over frequency, and around the disc at the largest amplitude."""
    figure = Figure(figsize=(9.6, 3.6), layout="constrained")
    curves, around = figure.subplots(1, 2)
    blades = branches["mistuned"].on_disc("tip")
    one = branches["tuned"].on_disc("tip")
    curves.plot(blades.omega, 1e3 * blades, color="#9db8d9", linewidth=0.8)
    curves.plot(blades.omega, 1e3 * blades.max("sector"), color="#1f5fa8", label="largest of the mistuned")
    curves.plot(one.omega, 1e3 * one[:, 0], color="#c03a2b", label="tuned")
    curves.set(xlabel="Fundamental frequency [rad/s]", ylabel="Amplitude of the blade tips [mm]")
    curves.legend()
    at = int(np.argmax(blades.max("sector").values))
    around.bar(blades.sector, 1e3 * blades[at], color="#1f5fa8")
    around.axhline(1e3 * float(one.max()), color="#c03a2b")
    around.set(xlabel="Blade", title=f"at {float(blades.omega[at]):.1f} rad/s", ylabel="Amplitude of the tip [mm]")
    figure.savefig(folder / "bladed_disc.png", dpi=120)


if __name__ == "__main__":
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    folder.mkdir(parents=True, exist_ok=True)
    found = compute()
    for name, branch in found.items():
        blades = branch.on_disc("tip")
        point, largest = np.unravel_index(int(blades.values.argmax()), blades.shape)
        where = "any blade" if name == "tuned" else f"blade {largest}"
        size, omega = 1e3 * float(blades[point, largest]), float(blades.omega[point])
        print(f"{name}: {len(branch)} points, largest amplitude {size:.6g} mm of {where} at {omega:.5g} rad/s")
    print(f"amplification by mistuning, the ratio of both: {amplification(found):.4f}")
    draw(found, folder)
