"""The text of the case that most tests begin with: an oscillator with a rubbing friction contact."""

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
