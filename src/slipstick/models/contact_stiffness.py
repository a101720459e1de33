"""Contact stiffness where none was measured: rough surfaces, a curved body on another one, rules of other codes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import SMALLEST, Gathering, number, one, shown, suggestion, text
from slipstick.fem.geometry import volume
from slipstick.fem.loads import area
from slipstick.fem.materials import Material
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import FiniteElementModel, ImportedModel
from slipstick.fem.strains import chosen_elements

CALCULIX, LS_DYNA = "calculix", "ls-dyna"
_MODULI = 50.0
"""Stiffness over Young's modulus that CalculiX advises at most, 1/length of the model's unit."""
_DYNA = 0.1
"""Scale factor of the penalty stiffness of LS-DYNA by default."""
_FARTHEST, _NEAREST = 30.0, -30.0
"""Distances of mean planes, over the rms height, between which the pressure is sought."""


@dataclass(frozen=True, kw_only=True)
class ContactStiffness:
    """Normal and tangential stiffness of a contact that sticks.

    Attributes
    ----------
    kn, kt
        Per area (force/length^3) of rough surfaces and of rules, force/length of a single curved contact.
    contact_area
        Share of the area that touches of rough surfaces, the area itself of a curved contact; nan of a rule.
    closure
        Distance of the mean planes of rough surfaces; approach of a curved contact; nan of a rule.

    Examples
    --------
    >>> import slipstick as ss
    >>> steel = ss.Material(young=2e11, poisson=0.3)
    >>> found = ss.models.hertz_mindlin(100.0, radius=0.01, first=steel)
    >>> law = ss.FrictionContact(mu=0.3, gap=0.0, **found.given)
    >>> law.kt < law.kn
    True
    """

    kn: float
    kt: float
    contact_area: float = float("nan")
    closure: float = float("nan")

    @property
    def given(self) -> dict[str, float]:
        """``kt`` and ``kn`` as keywords of a contact law."""
        return {"kt": self.kt, "kn": self.kn}


def greenwood_williamson(
    pressure: float, *, height: float, radius: float, density: float, first: Material, second: Material | None = None
) -> ContactStiffness:
    """Stiffness per area of nominally flat rough surfaces, linearised at a pressure.

    Asperities of one radius, with normally distributed heights, are spheres of Hertz that do not feel each other:
    ``p = 4/3 E* density radius^(1/2) height^(3/2) F_(3/2)(d / height)``, and ``kn = dp/dd``. Along the
    surface each is a contact of Mindlin before slip. The answer holds while a small part of the area touches.

    Parameters
    ----------
    pressure
        Nominal pressure, force/length^2, > 0.
    height
        Root mean square of the heights of the summits of both surfaces together, length, > 0.
    radius
        Radius of the summits, length, > 0.
    density
        Summits per area, 1/length^2, > 0.
    first, second
        Materials of both bodies; by default the same.

    Raises
    ------
    InputError
        For values of another kind, and a pressure that would need the surfaces nearer than their summits.

    Notes
    -----
    J. A. Greenwood and J. B. P. Williamson (1966), Proc. R. Soc. Lond. A 295, 300-319; K. L. Johnson (1985), Contact
    Mechanics, sections 13.4 and 7.2.

    Examples
    --------
    Machined steel at 10 MPa:

    >>> steel = Material(young=2e11, poisson=0.3)
    >>> found = greenwood_williamson(1e7, height=1e-6, radius=1e-4, density=1e10, first=steel)
    >>> f"{found.kn:.3g} {found.kt / found.kn:.3f} {found.contact_area:.1e}"
    '3.42e+13 0.824 3.0e-03'
    """
    from scipy.optimize import brentq

    gathering = Gathering()
    values = {"pressure": pressure, "height": height, "radius": radius, "density": density}
    p, sigma, r, eta = (
        gathering.take(number, name, value, "a number > 0", above=SMALLEST) for name, value in values.items()
    )
    one_, other = _materials(gathering, first, second)
    gathering.end()
    assert p is not None
    assert sigma is not None
    assert r is not None
    assert eta is not None
    E, ratio = _plane_modulus(one_, other), _tangential_ratio(one_, other)
    scale = 4.0 / 3.0 * E * eta * np.sqrt(r) * sigma**1.5

    def above(h: float) -> float:
        return float(np.log(scale * _summits(1.5, h) / p))

    if above(_NEAREST) < 0.0 or above(_FARTHEST) > 0.0:
        found, most, least = shown(pressure), scale * _summits(1.5, _NEAREST), scale * _summits(1.5, _FARTHEST)
        raise InputError(Fault("pressure", found=found, expected=f"a pressure from {least:.3g} to {most:.3g}"))
    h = float(brentq(above, _NEAREST, _FARTHEST, xtol=1e-13, rtol=1e-14))
    kn = 2.0 * E * eta * np.sqrt(r * sigma) * _summits(0.5, h)
    share = np.pi * eta * r * sigma * _summits(1.0, h)
    return ContactStiffness(kn=float(kn), kt=ratio * float(kn), contact_area=float(share), closure=h * sigma)


def hertz_mindlin(force: float, *, radius: float, first: Material, second: Material | None = None) -> ContactStiffness:
    """Stiffness of one curved contact, a sphere against a plane or another sphere, linearised at a force.

    ``a^3 = 3 F R / (4 E*)``, ``kn = 2 E* a`` and, before any slip, ``kt = 8 G* a``.

    Parameters
    ----------
    force
        Normal force, > 0.
    radius
        Of the sphere; of two spheres ``1/R = 1/R1 + 1/R2``. Length, > 0.
    first, second
        Materials of both bodies; by default the same.

    Raises
    ------
    InputError
        For values of another kind.

    Notes
    -----
    K. L. Johnson (1985), Contact Mechanics, (3.70) to (3.74) and (7.43); R. D. Mindlin (1949), J. Appl. Mech. 16,
    259-268.

    Examples
    --------
    >>> steel = Material(young=2e11, poisson=0.3)
    >>> found = hertz_mindlin(100.0, radius=0.01, first=steel)
    >>> f"{found.kn:.4g} {found.kt:.4g} {found.closure:.3g}"
    '4.169e+07 3.433e+07 3.6e-06'
    """
    gathering = Gathering()
    F = gathering.take(number, "force", force, "a force > 0", above=SMALLEST)
    R = gathering.take(number, "radius", radius, "a length > 0", above=SMALLEST)
    one_, other = _materials(gathering, first, second)
    gathering.end()
    assert F is not None
    assert R is not None
    E = _plane_modulus(one_, other)
    a = (0.75 * F * R / E) ** (1.0 / 3.0)
    kn = 2.0 * E * a
    kt = _tangential_ratio(one_, other) * kn
    return ContactStiffness(kn=kn, kt=kt, contact_area=float(np.pi * a * a), closure=a * a / R)


def penalty_stiffness(code: str, model: ImportedModel, surface: str) -> ContactStiffness:
    """Stiffness per area by the rule of another code, for comparison with its results.

    "ls-dyna": ``0.1 K A / V`` with the bulk modulus, face areas and element volumes behind the surface, the default for
    bricks. "calculix": 50 times Young's modulus per unit length of the model, the most its manual advises. The rules
    stand for no property of the joint: they keep bodies apart. That of Abaqus is not published.

    Parameters
    ----------
    code
        "ls-dyna" or "calculix".
    model
        With mesh and materials.
    surface
        Name of the surface, of which the rule asks the elements.

    Returns
    -------
    ContactStiffness
        ``kn``; ``kt`` of a contact of equal bodies, ``2 (1 - nu) / (2 - nu)`` of it.

    Raises
    ------
    InputError
        For another code, and a surface that is not there or lies on elements of several materials.

    Notes
    -----
    LS-DYNA Theory Manual, standard penalty formulation; CalculiX CrunchiX User's Manual, contact.

    Examples
    --------
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.model import elastic_model
    >>> steel = Material(young=2e11, poisson=0.3, density=7800.0)
    >>> beam = elastic_model(box((0.1, 0.02, 0.01), (10, 2, 1)), steel, ["x0"])
    >>> f"{penalty_stiffness('ls-dyna', beam, 'z1').kn:.6g}"  # 0.1 K / 0.01 m
    '1.66667e+12'
    """
    gathering = Gathering()
    name = gathering.take(text, "code", code) or ""
    if name and name not in (CALCULIX, LS_DYNA):
        known = (CALCULIX, LS_DYNA)
        gathering.faults.append(Fault("code", f"there is no rule of {shown(code)}", remedy=suggestion(code, known)))
    gathering.take(one, "model", model, FiniteElementModel, "what ss.import_model returns")
    gathering.take(text, "surface", surface)
    gathering.end()
    mesh = model.in_mesh("penalties of contacts")
    faces, blocks = mesh.surface(surface), chosen_elements(mesh, surface)
    material = _behind(model, mesh, blocks, surface)
    kn = _MODULI * material.young
    if name == LS_DYNA:
        behind = Mesh(nodes=mesh.nodes, blocks={kind: mesh.blocks[kind][rows] for kind, rows in blocks.items()})
        bulk = material.young / (3.0 * (1.0 - 2.0 * material.poisson))
        kn = _DYNA * bulk * area(mesh, faces) / volume(behind)
    return ContactStiffness(kn=kn, kt=_tangential_ratio(material, material) * kn)


def _behind(model: ImportedModel, mesh: Mesh, blocks: Any, surface: str) -> Material:
    """The one material behind a surface."""
    found = [
        material
        for name, material in model.materials.items()
        if name not in mesh.element_sets
        or any(np.isin(rows, mesh.element_sets[name].get(kind, ())).any() for kind, rows in blocks.items())
    ]
    if len(set(found)) != 1:
        what = f"'{surface}' lies on elements of {len(set(found))} materials"
        raise InputError(Fault("surface", what, remedy="name a surface of one material"))
    return found[0]


def _materials(gathering: Gathering, first: Any, second: Any) -> tuple[Any, Any]:
    expected = "an ss.Material"
    one_ = gathering.take(one, "first", first, Material, expected)
    return one_, one_ if second is None else gathering.take(one, "second", second, Material, expected)


def _plane_modulus(first: Material, second: Material) -> float:
    """``E*``, ``1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2``."""
    return 1.0 / sum((1.0 - m.poisson**2) / m.young for m in (first, second))


def _tangential_ratio(first: Material, second: Material) -> float:
    """``kt / kn = 4 G* / E*`` of contacts that stick, ``1/G* = (2 - nu1)/G1 + (2 - nu2)/G2``."""
    G = 1.0 / sum((2.0 - m.poisson) / m.shear_modulus for m in (first, second))
    return 4.0 * G / _plane_modulus(first, second)


def _summits(power: float, h: float) -> float:
    """``int_h^inf (s - h)^n phi(s) ds`` of normally distributed heights, by parabolic cylinder functions."""
    from scipy.special import gamma, pbdv

    value, _ = pbdv(-power - 1.0, h)
    return float(gamma(power + 1.0) * np.exp(-0.25 * h * h) * value / np.sqrt(2.0 * np.pi))
