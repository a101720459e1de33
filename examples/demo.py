"""Runs the quick examples, about a minute, and leaves results and figures in demo-results/ (or the folder given)."""

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
CASES = ("oscillator/oscillator.toml", "blade_reduced/blade_reduced_no_rub.toml", "blade_reduced/blade_reduced.toml")
SCRIPTS = (
    "oscillator/constant_velocity.py",
    "oscillator/harmonics_kept.py",
    "oscillator/oscillating_rub.py",
    "oscillator/rub_excited.py",
    "oscillator/friction_force.py",
    "blade_reduced/blade.py",
    "lobed_casing/lobed_casing.py",
    "bladed_disc/bladed_disc.py",
    "blade_row/blade_row.py",
    "platform_damper/damper.py",
)


DRAWN = ("--figures", "all")


def step(title, *command):
    print(f"\n=== {title}", flush=True)
    subprocess.run([sys.executable, *map(str, command)], check=True)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for case in CASES:
        results = folder / case.removesuffix(".toml").replace("/", "_")
        step(f"slipstick run examples/{case}", "-m", "slipstick", "run", HERE / case, "-o", results, "--force", *DRAWN)
    for script in SCRIPTS:
        step(f"python examples/{script}", HERE / script, folder / "figures")
    print(f"\nResults and figures are in {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "demo-results").resolve())
