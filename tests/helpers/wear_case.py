"""A case whose contact wears; OMEGA stands for a frequency, or for the peak."""

from helpers.cases import oscillator

_WEAR = """from = 6.0
to = 15.0
[wear]
kappa = { damper = 8e-4 }
to = 300
omega = OMEGA
at = [100]
"""
CASE = oscillator(
    head='title = "A damper that wears"\nharmonics = "0..5"\n', rubbing="velocity = 0.0", response=_WEAR
).replace("rubbing = { velocity = 0.0 }", "kn = 1.0")
