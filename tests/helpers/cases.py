"""Texts of cases: the oscillator with a rubbing friction contact that most tests begin with, contacts on a surface."""

OSCILLATOR = """\
format = 1
{head}[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
{load}sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
kt = 100.0
mu = 0.3
normal_load = 800.0
rubbing = {{ {rubbing} }}
[response]
{response}"""


def oscillator(*, head: str, rubbing: str, response: str, load: str = "") -> str:
    """The case with these lines in its head, its load and its range, each ended."""
    return OSCILLATOR.format(head=head, load=load, rubbing=rubbing, response=response)


BLOCKS = """
[[contact]]
name = "pad"
points = [2, 1]
direction = [0.0, 1.0, 1.0]
normal = "surface"
kt = 1e5
kn = 2e4
mu = { table = [[20, 0.4], [200, 0.2]] }
normal_load_total = 1.0
rubbing = { velocity = 0.005 }
thermal = { resistance = 2.0 }
[[contact]]
name = "curve"
points = [3]
direction = [1.0, 0.0, 0.0]
kt = 2e5
mu = 0.3
normal_load = 0.7
"""


MEASURED = """
format = 1
harmonics = [0, 1, 3]
[structure]
kind = "measured"
file = "rig.npz"
{keys}[[load]]
dof = "low"
sin = 8.0
[[contact]]
name = "joint"
tangential = {{ tip = 1.0, root = -1.0 }}
kt = 20.0
mu = 0.3
normal_load = 20.0
[response]
from = 4.0
to = {to}
"""


def measured(keys: str = "", to: float = 9.0) -> str:
    """The case of a joint between two points of a structure measured in rig.npz, with these lines of the structure."""
    return MEASURED.format(keys=keys, to=to)
