"""Every curve of the blade study as a case file for the command line, with the reduced blade beside them.

python examples/blade/case_files.py [small | medium | large] [--output FOLDER] [--cache FOLDER]
slipstick run FOLDER/load-100_velocity-5.toml
"""

import argparse
from pathlib import Path

import numpy as np
from shrouded_blade import (
    BACKGROUND,
    CONTACTS,
    DEFAULT_CACHE,
    FRICTION,
    KN,
    KT,
    LOSS_FACTOR,
    MU,
    OUTPUT,
    PRESSURE,
    RANGE,
    RUBBING_DIRECTION,
    contact_load,
    heat,
    reduced_blade,
)
from study import curves

BLADE = "blade.npz"


def write(blade, folder):
    """The arrays and one case file a curve; returns the case files."""
    folder.mkdir(parents=True, exist_ok=True)
    structure, load = blade.structure, blade.structure.shapes["pressure"]
    np.savez(
        folder / BLADE,
        omega=structure.omega,
        mode_shapes=structure.mode_shapes,
        static_compliance=structure.static_compliance,
        second_residual=structure.second_residual,
        load_participation=load.participation,
        static_load_response=load.static_response,
        second_load_response=load.second_response,
    )
    paths = []
    for curve in curves():
        path = folder / f"{curve.name}.toml"
        path.write_text(case(blade, curve))
        paths.append(path)
    return paths


def case(blade, curve):
    """Text of a case file."""
    start, stop = (f'"{omega / (2 * np.pi):.10g} Hz"' for omega in RANGE)
    names = ", ".join(f'"{name}"' for name in blade.structure.dofs)
    parts = [
        f'format = 1\ntitle = "Blade, {curve.load:g} %, {curve.velocity:g} m/s{", mu(T)" if curve.hot else ""}"\n'
        'harmonics = "0..5"',
        f'[structure]\nkind = "modal"\nfile = "{BLADE}"\nloss_factor = {LOSS_FACTOR}\ndofs = [{names}]',
        f'[[load]]\nshape = "pressure"\ncos = {PRESSURE}  # Pa',
        f'[output]\ndofs = ["{OUTPUT}"]',
        f"[response]\nfrom = {start}\nto = {stop}",
    ]
    if curve.hot:
        rows = np.asarray(heat(blade, curve.load).resistance).tolist()
        parts.append(f"[thermal]\nbackground = {BACKGROUND}\ninfluence = {rows}  # K/W")
    parts += [contact(blade, curve, k) for k in range(CONTACTS)]
    return "\n\n".join(parts) + "\n"


def contact(blade, curve, k):
    """Text of one contact."""
    mu = f'{{ table = {FRICTION.tables["mu"].tolist()}, interpolation = "cubic" }}' if curve.hot else MU
    tangential, normal = (
        "{ " + ", ".join(f"{dof} = {cosine!r}" for dof, cosine in directions.items()) + " }"
        for directions in (blade.points.tangential(RUBBING_DIRECTION)[k], blade.points.normal[k])
    )
    return (
        f'[[contact]]\nname = "c{k + 1}"\ntangential = {tangential}\nnormal = {normal}\n'
        f"kt = {KT}\nkn = {KN}\nmu = {mu}\n"
        f"normal_load = {contact_load(curve.load)}\nrubbing = {{ velocity = {curve.velocity} }}"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Case files of the blade study")
    parser.add_argument("size", nargs="?", default="small", choices=("small", "medium", "large"))
    parser.add_argument("--output", type=Path, default=Path("blade-study") / "cases")
    parser.add_argument("--cache", type=Path, default=DEFAULT_CACHE)
    given = parser.parse_args()
    print(f"{len(write(reduced_blade(given.size, cache=given.cache), given.output))} case files in {given.output}")
