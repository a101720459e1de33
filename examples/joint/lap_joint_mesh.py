"""The mesh of the lap joint: two beams, three bolts; writes lap_joint.inp, which the case file reads.

Change a size or a number of elements below and run it again, then the case.
"""

from pathlib import Path

import numpy as np

from slipstick.fem.box import box
from slipstick.fem.mesh import together

LENGTH, WIDTH, THICKNESS, LAP = 0.30, 0.03, 0.01, 0.09  # of a beam and of the lap, m
BOLTS = (0.225, 0.255, 0.285)  # places of the bolts, m
WASHER = 0.009  # radius under heads and nuts, m
SENSOR = (0.15, 0.015, 0.01)  # where it is shaken and measured, m


def beams():
    """Both beams: the upper one begins where the lap does; their meshes do not match."""
    lower = box((LENGTH, WIDTH, THICKNESS), (20, 4, 1))
    upper = box((LENGTH, WIDTH, THICKNESS), (20, 2, 1), at=(LENGTH - LAP, 0.0, THICKNESS))
    return together({"lower": lower, "upper": upper})


def deck(mesh):
    """The lines of an Abaqus input file."""
    corners = mesh.blocks["hex20"]
    middle = mesh.nodes[corners].mean(axis=1)
    in_lap = (middle[:, 0] > LENGTH - LAP) & (middle[:, 0] < LENGTH)
    lower = middle[:, 2] < THICKNESS
    lines = ["** Lap joint of two beams with three bolts: m, N, kg, s", "*NODE"]
    lines += [f"{label}, {x:.9g}, {y:.9g}, {z:.9g}" for label, (x, y, z) in enumerate(mesh.nodes, 1)]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=BEAMS")
    for number, element in enumerate(corners + 1, 1):
        words = [str(number), *map(str, element)]
        lines += [", ".join(words[:16]) + ",", ", ".join(words[16:])]
    for name, on in (("LOWER_LAP", lower & in_lap), ("UPPER_LAP", ~lower & in_lap)):
        lines += [f"*ELSET, ELSET={name}", *(f"{number}," for number in np.flatnonzero(on) + 1)]
    # faces of a brick: S1 is below, S2 above
    lines += ["*SURFACE, NAME=LAP_BELOW", "LOWER_LAP, S2", "*SURFACE, NAME=LAP_ABOVE", "UPPER_LAP, S1"]
    for number, place in enumerate(BOLTS, 1):
        for end, side, z in ((f"HEAD_{number}", "upper.z1", 2 * THICKNESS), (f"NUT_{number}", "lower.z0", 0.0)):
            lines += washer(mesh, end, side, (place, WIDTH / 2, z), 9000 + 2 * number + (z == 0.0))
    for name, side in (("LEFT", "lower.x0"), ("RIGHT", "upper.x1")):
        lines += [f"*NSET, NSET={name}", *(f"{node}," for node in mesh.surface(side).nodes + 1)]
    sensor = np.linalg.norm(mesh.nodes - SENSOR, axis=1).argmin() + 1
    lines += ["*NSET, NSET=SENSOR", f"{sensor},"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "2e11, 0.3", "*DENSITY", "7800.,"]
    return [*lines, "*SOLID SECTION, ELSET=BEAMS, MATERIAL=STEEL"]


def washer(mesh, name, side, place, reference):
    """A reference node that moves as the mean of the nodes under a head or a nut: a single node would give way."""
    on = mesh.surface(side).nodes
    near = on[np.linalg.norm(mesh.nodes[on] - place, axis=1) < WASHER]
    x, y, z = place
    return [
        *("*NODE", f"{reference}, {x:.9g}, {y:.9g}, {z:.9g}"),
        *(f"*NSET, NSET={name}", *(f"{node}," for node in near + 1)),
        *(f"*SURFACE, TYPE=NODE, NAME={name}_WASHER", f"{name},"),
        *(f"*COUPLING, CONSTRAINT NAME={name}, REF NODE={reference}, SURFACE={name}_WASHER", "*DISTRIBUTING"),
    ]


if __name__ == "__main__":
    Path("lap_joint.inp").write_text("\n".join(deck(beams())) + "\n")
    print("wrote lap_joint.inp")
