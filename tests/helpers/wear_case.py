"""A case whose contact wears; OMEGA stands for a frequency, or for the peak."""

CASE = """
format = 1
title = "A damper that wears"
harmonics = "0..5"
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
kn = 1.0
normal_load = 800.0
[response]
from = 6.0
to = 15.0
[wear]
kappa = { damper = 8e-4 }
to = 300
omega = OMEGA
at = [100]
"""
