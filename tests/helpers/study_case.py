"""A small case with a study of three curves."""

CASE = """
format = 1
title = "oscillator"
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
kt = 100.0
mu = 0.3
normal_load = 800.0
rubbing = { velocity = 10.0 }
[response]
from = 5.0
to = 7.0
first_step = 0.05
max_step = 0.05
[study]
"damper.velocity" = [20, 30, 40]
"""
