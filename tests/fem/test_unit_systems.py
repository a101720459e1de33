"""Systems of units stated as texts, and materials that do not go with them."""

import pytest
from helpers.faults import raises_fault

from slipstick.fem.materials import Material
from slipstick.fem.unit_systems import conversion, factors_of, material_warnings, names_of, system, system_like


@pytest.mark.parametrize(
    ("text", "length", "force", "mass"),
    [
        ("SI", 1.0, 1.0, 1.0),
        ("SI (m, kg, s)", 1.0, 1.0, 1.0),
        ("N, m, kg, s", 1.0, 1.0, 1.0),
        ("N, mm, t, s", 1e-3, 1.0, 1e3),
        ("mm, tonne, s", 1e-3, 1.0, 1e3),
        ("mN mm kg", 1e-3, 1e-3, 1.0),
        ("lbf, in", 0.0254, 4.4482216, 175.12684),
        ("lbf s2/in, in, s", 0.0254, 4.4482216, 175.12684),
        ("foot, slug, s", 0.3048, 4.4482216, 14.593903),
        ("kN, mm, kg, ms", 1e-3, 1e3, 1.0),
    ],
)
def test_systems(text, length, force, mass):
    found = system(text)
    assert (found.length, found.force, found.mass) == pytest.approx((length, force, mass), rel=1e-6)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("furlong, N", "units: found 'furlong, N'; expected units such as"),
        ("mm, s", "expected a length with a force or a mass"),
        ("N, mm, m", "expected units such as"),
        ("N, mm, kg, s", "units: mass, length and time make a force 0.001, given is 1; leave one out"),
    ],
)
def test_what_is_no_system(text, sentence):
    with raises_fault("units", says=sentence):
        system(text)


def test_factors_follow():
    assert factors_of({"length": 25.4e-3}, "scale").mass == pytest.approx(1.0 / 25.4e-3)
    assert factors_of({"length": 2.0, "mass": 3.0, "time": 5.0}, "scale").force == pytest.approx(6.0 / 25.0)
    with raises_fault("scale", says="mass, length and time"):
        factors_of({"mass": 2.0, "force": 3.0}, "scale")
    found = conversion("N, mm, t, s", "lbf, in")
    assert found.length == pytest.approx(1.0 / 25.4)
    with raises_fault("to", found="'here'"):
        conversion("SI", "here")


@pytest.mark.parametrize(
    ("young", "density", "units", "said"),
    [
        (2.1e11, 7800.0, "not stated", ""),
        (2e6, 1100.0, "not stated", ""),  # rubber
        (2.1e11, 7.8e-9, "not stated", "E = 2.1e+11 and density = 7.8e-09 fit no common system of units"),
        (2.1e5, 7.8e-9, "N, mm, t, s", ""),
        (2.1e5, 7.8e-6, "N, mm, t, s", "would be 2.1e+11 Pa and 7.8e+06 kg/m3 in the units stated"),
        (2.1e11, 7800.0, "N, mm, t, s", "which no solid has; they look like SI"),
        (2.1e11, 0.0, "N, mm, t, s", ""),
    ],
)
def test_materials_are_held_against_each_other_and_the_units(young, density, units, said):
    material = Material(young=young, poisson=0.3, density=density)
    found = " ".join(material_warnings({"steel": material}, units, "m.inp"))
    assert said in found
    assert bool(found) == bool(said)
    assert not found or found.startswith("m.inp: steel: E = ")


def test_recognised_systems():
    assert system_like(Material(young=3e7, poisson=0.3, density=7.3e-4)) == "lbf, inch, s"
    assert system_like(Material(young=1.0, poisson=0.3, density=1.0)) == ""


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("SI", ("m", "N", "s")),
        ("N, mm, t, s", ("mm", "N", "s")),
        ("mm, tonne, s", ("mm", "N", "s")),
        ("cm, g, s", ("cm", "dyn", "s")),
        ("micrometre, kg, s", ("micrometre", "uN", "s")),
        ("foot, slug, s", ("foot", "lbf", "s")),
        ("kN, mm, kg, ms", ("mm", "kN", "ms")),
        ("t, m", ("m", "kN", "s")),
        ("g, ft, s", ("ft", "force", "s")),
    ],
)
def test_names_of_a_system(text, names):
    found = names_of(text)
    assert (found.length, found.force, found.time) == names


@pytest.mark.parametrize("text", ["not stated", "", "mine", "mm, s", "N, mm, kg, s"])
def test_what_is_no_system_has_no_names(text):
    assert names_of(text) is None
