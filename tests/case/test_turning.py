"""Rotors of beams, stators and bodies that are not held in a case file: every fault at its key."""

from __future__ import annotations

from pathlib import Path

import pytest

import slipstick as ss
from slipstick.case.case import Case
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import save_model

ROTOR = """format = 1
harmonics = "0..3"
[structure]
kind = "rotor"
material = { young = 211e9, poisson = 0.3, density = 7810.0 }
shaft = [{ length = 1.0, outer = 0.05, elements = 4 }, { length = 0.5, outer = 0.05, inner = 0.01, elements = 2 }]
discs = [{ node = 2, width = 0.07, outer = 0.28, inner = 0.05 }]
bearings = [{ node = 0, kxx = 1e6, kyy = 0.8e6, cxx = 400.0 }, { node = 6, kxx = 1e6, cxx = 400.0 }]
engine_order = 1
[[load]]
dof = "n2x"
motion = "unbalance"
cos = 0.02
[[contact]]
name = "stator"
law = "stator"
ports = { x = "n2x", y = "n2y" }
kn = 2e6
gap = 2e-4
mu = 0.1
slip_velocity = 0.01
rubbing = { velocity_per_omega = 0.14 }
[response]
from = 76.0
to = 77.0
"""
FREE = """format = 1
harmonics = "0..3"
[structure]
kind = "free"
dofs = ["a", "b", "c"]
mass = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]]
stiffness = [[30.0, -30.0, 0.0], [-30.0, 50.0, -20.0], [0.0, -20.0, 20.0]]
keep = ["a", "c"]
modes = 2
[[load]]
dof = "a"
sin = 3.0
[[contact]]
name = "clamp"
tangential = { a = 1.0, c = -1.0 }
kt = 5.0
mu = 0.3
normal_load = 2.0
[response]
from = 3.0
to = 4.0
"""


def told(text: str, old: str, new: str) -> list[str]:
    assert old in text
    with pytest.raises(InputError) as raised:
        Case.from_text(text.replace(old, new))
    return str(raised.value).splitlines()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("outer = 0.05, elements", "outr = 0.05, elements",
         "unknown key 'outr' in [structure] shaft, number 1; did you mean 'outer'?"),
        ("node = 2, width", "node = 22, width", "[structure] discs, number 1.node: found 22; expected at most 6"),
        ("inner = 0.01", "inner = 0.1", "[structure] shaft, number 2.inner: found 0.1; expected less than outer, 0.05"),
        ("kxx = 1e6, cxx", "kxy = 1e6, cxx",
         "[structure] bearings, number 2.kxx is missing; give a finite number, force/length"),
        ("width = 0.07, ", "", "[structure] discs, number 1.width is missing; a disc has width, outer, inner"),
        ("width = 0.07", "width = 0.07, mass = 3.0",
         "[structure] discs, number 1.width is given together with mass; keep one"),
        ("engine_order = 1\n", "", "[structure] speed is missing; give speed, or engine_order"),
        ("engine_order = 1\n", "engine_order = 1\ninternal_damping = 1e-5\n",
         "[structure] internal_damping is given with an engine order; give a fixed speed"),
        ("engine_order = 1\n", 'engine_order = 1\nkeep = ["n2z"]\nmodes = 2\n',
         "[structure] keep: there is no dof 'n2z'; did you mean 'n2y'?"),
        ("engine_order = 1\n", "engine_order = 1\nmodes = 2\n",
         "[structure] keep is missing; give the dofs that are loaded, in contact or looked at"),
        ('law = "stator"', 'law = "stater"',
         "[[contact]] 'stator' law: found \"stater\"; expected \"stator\", \"iwan\", \"dahl\" or \"bouc_wen\"; "
         "left out for friction contacts; did you mean 'stator'?"),
        ('x = "n2x", y', 'x = "n9x", y', "[[contact]] 'stator' ports.x: there is no dof 'n9x' in the structure; did "
         "you mean 'n6x'?"),
        ("slip_velocity = 0.01\n", "",
         "[[contact]] 'stator' slip_velocity: friction needs it; give a velocity that counts as slow"),
        ("velocity_per_omega = 0.14", "velocity = [1.0, 2.0]",
         "[[contact]] 'stator' rubbing.velocity is a vector, but the contact slides in one direction; give one number"),
    ],
)  # fmt: skip
def test_a_rotor(old: str, new: str, said: str) -> None:
    assert told(ROTOR, old, new) == [said]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("mass =", "mas =", "unknown key 'mas' in [structure]; did you mean 'mass'?"),
        ('["a", "c"]', '["a", "d"]', "[structure] keep: there is no dof 'd'; there are a, b, c"),
        ("modes = 2\n", "", "[structure] modes is missing; give a whole number >= 1, how many elastic modes to keep"),
        ("{ a = 1.0, c = -1.0 }", '"a"', "[[contact]] 'clamp': its mean force pushes the structure away, and nothing "
         "holds it; hold the structure, or give the contact between two of its dofs on one line"),
        ("30.0, -30.0, 0.0], [-30", "33.0, -30.0, 0.0], [-30",
         "[structure] stiffness: holds the body, or leaves more than rigid-body motion without stiffness; of a "
         "body that is held use ss.reduce; look for mechanisms and parts that are not connected"),
    ],
)  # fmt: skip
def test_a_free_body(old: str, new: str, said: str) -> None:
    assert told(FREE, old, new) == [said]


def test_many_faults_at_once() -> None:
    text = ROTOR.replace("kn = 2e6", "kn = -1.0").replace("node = 2,", "node = -2,").replace('"n2y"', '"n7y"')
    assert told(text, "gap = 2e-4", "gap = 0.0") == [
        "[[contact]] 'stator' kn: found -1.0; expected a number >= 0, the radial contact stiffness (force/length)",
        "[[contact]] 'stator' gap: found 0.0; expected a number > 0, the clearance all round",
        "[structure] discs, number 1.node: found -2; expected a whole number >= 0, the node of the shaft, counted "
        "from 0",
        "[[contact]] 'stator' ports.y: there is no dof 'n7y' in the structure; did you mean 'n6y'?",
    ]


def test_coriolis_forces_that_a_reduction_leaves_out(tmp_path: Path) -> None:
    """Said in the same words by the library and of a case."""
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    mesh = MeshModel(mesh=box((0.2, 0.02, 0.01), (2, 1, 1), "hex20"))
    save_model(assemble_mesh(mesh, source="beam", material=steel, fixed=["x0"]), tmp_path / "model.h5")
    model = ss.import_model(tmp_path / "model.h5")
    end = next(name for name in model.dofs if name.endswith("z"))
    turning = ss.at_speed(model, 300.0, axis={"direction": (0.0, 1.0, 0.0)}, coriolis=True)
    with pytest.warns(ss.SlipstickWarning) as told:
        ss.reduced_body(turning, keep=[end], modes=5)
    (words,) = [str(one.message) for one in told]
    assert words.startswith(
        "beam: holds Coriolis forces, which a reduction to real modes leaves out; for these make an"
    )
    (tmp_path / "case.toml").write_text(f"""format = 1
harmonics = "0..1"
[structure]
kind = "fe"
file = "model.h5"
keep = ["{end}"]
modes = 5
rotation = {{ speed = 300.0, axis = {{ direction = [0, 1, 0] }}, coriolis = true }}
[[load]]
dof = "{end}"
cos = 1.0
[[contact]]
name = "pad"
tangential = "{end}"
kt = 1e4
mu = 0.3
normal_load = 0.1
[response]
from = 300.0
to = 310.0
""")
    assert Case.from_file(tmp_path / "case.toml").noticed == (words,)
