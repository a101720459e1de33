"""What is taken for a law that tells nothing beyond its members, and that a law's own word wins."""

import numpy as np

from slipstick.contact import traits
from slipstick.contact.friction import FrictionContact
from slipstick.contact.sampled import SampledLaw

FRICTION = FrictionContact(kt=2.0, mu=0.4, kn=3.0, gap=-0.5)
CUBIC = SampledLaw(force=lambda x, velocity, k, a: k * x + a * x**3, parameters={"k": 2.0, "a": 0.5}, ports=("x",))
VALUES = {"k": np.array([2.0, 3.0]), "a": np.array([0.5, 0.0])}


def test_defaults():
    assert traits.optional_ports(CUBIC) == ()
    assert traits.dissipating(CUBIC) == tuple(range(len(CUBIC.ports)))
    assert traits.factors(CUBIC) == {}
    assert traits.units(CUBIC, "k") == "1"
    assert set(traits.variables(CUBIC)) == {"k", "a"}
    assert traits.derived(CUBIC, "k", VALUES) == ("k", 1.0)
    assert traits.derived(CUBIC, "load", VALUES) is None
    assert traits.linear_states(CUBIC) == ("stuck", "free")
    assert list(traits.ramps(CUBIC, VALUES)) == [("k ramp", "k", 0.0), ("a ramp", "a", 0.0)]
    np.testing.assert_array_equal(traits.kinked(CUBIC, VALUES), [False, False])
    assert traits.force_names(CUBIC) == tuple(CUBIC.ports)
    assert traits.stiffness_names(CUBIC) == {}
    assert list(traits.warnings(CUBIC, {"k": 2.0, "a": 0.5}, {"x"}, 0.0)) == []


def test_at_rest_a_law_is_its_tangent():
    """The cubic part does nothing at rest; free means nothing at all."""
    drift = np.zeros((len(CUBIC.ports), 2))
    stuck = traits.linear(CUBIC, "stuck", VALUES, drift)
    np.testing.assert_allclose(stuck.stiffness[0, 0], VALUES["k"], rtol=1e-12)
    np.testing.assert_allclose(stuck.constant[0], 0.0, atol=1e-15)
    assert traits.linear(CUBIC, "free", VALUES, drift) == ({}, {})
    assert traits.linear(CUBIC, "sliding", VALUES, drift) is None


def test_a_laws_own_word_wins():
    values = {name: np.array([value]) for name, value in FRICTION.values.items()}
    assert traits.optional_ports(FRICTION) == ("normal",)
    assert traits.dissipating(FRICTION) == (0,)
    assert traits.factors(FRICTION) == {"friction": "mu"}
    assert traits.units(FRICTION, "kt") == "force/length"
    assert "stick_fraction" in traits.variables(FRICTION)
    name, factor = traits.derived(FRICTION, "normal_load", values)
    assert (name, float(factor[0])) == ("gap", -1.0 / 3.0)
    assert traits.kinked(FRICTION, values).all()
    assert not traits.kinked(FRICTION, values | {"mu": np.zeros(1)}).any()
    assert traits.force_names(FRICTION) == ("friction", "normal")


def test_laws_of_one_kind_are_computed_together_and_others_are_not():
    other = FrictionContact(kt=1.0, mu=0.1, gap=-1.0)
    assert traits.kind(FRICTION) == traits.kind(other)
    twin = type("Own", (), {"ports": ("x",), "values": {}})
    a, b = twin(), twin()
    assert traits.kind(a) != traits.kind(b)
