"""The oscillator of Petrov (2012): one mass on a spring, rubbed by a friction contact under a constant normal load."""

import slipstick as ss


def oscillator(velocity=0.0, cos=None, force=100.0, harmonics=range(11)):
    """The problem; ``velocity`` and ``cos`` describe the rubbing motion, ``force`` the load p sin(omega t)."""
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    damper = ss.ContactPair(
        name="damper",
        contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0),
        tangential={"x": 1.0},
        rubbing=ss.RubbingMotion(velocity=velocity, cos=cos or {}),
    )
    loads = [ss.Load(dof="x", harmonic=1, sin=force)] if force else []
    return ss.Problem(structure, contacts=[damper], loads=loads, harmonics=ss.Harmonics(harmonics))
