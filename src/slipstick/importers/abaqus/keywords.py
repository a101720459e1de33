"""What becomes of each keyword of an input file (.inp) and of each element type; keywords without their blanks.

``KEYWORDS`` is the whole of it: read, refused, approximated, without effect. What stands nowhere is
named as not understood.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from slipstick.importers.findings import Table, Verdict

_WHOLE = "is not read: the mesh would be incomplete; write one flat input file with all nodes and elements"
_TIES = "ties degrees of freedom to each other"
_REFERENCE = "couples nodes to a reference node"
_MEDIUM = "couples faces to a medium"
_DAMPING = "is not read; give the structure's loss_factor or damping_ratio"
_LINEAR = "is left out: the structure is linear, its material elastic"


def _gives(what: str) -> str:
    return f"gives {what}, elements that are not read"


LAWS = """HYPERELASTIC HYPERFOAM USERMATERIAL VISCOELASTIC POROUSELASTIC LOWDENSITYFOAM HYPOELASTIC FABRIC
    NOCOMPRESSION NOTENSION MOHRCOULOMB"""
"""Laws that make a material unusable; refused where a section uses it."""

_LOADS = """BOUNDARYF TRANSFORMF EQUATIONF VIEWFACTOR FLUIDSECTIONS
    CLOAD DSLOAD DSFLUX TEMPERATURE FIELD CFLUX DFLUX FILM SFILM CFILM RADIATE SRADIATE CRADIATE
    MASSFLOW BASEMOTION PRESSURESTRESS FILMPROPERTY AMPLITUDE TIMEPOINTS LOADCASE ENDLOADCASE PSD-DEFINITION
    CORRELATION"""
_DEFINITIONS = """HEADING PREPRINT ASSEMBLY ENDASSEMBLY ENDPART ENDINSTANCE ENDSTEP DISTRIBUTION
    DISTRIBUTIONTABLE EXPANSION SPECIFICHEAT LATENTHEAT HEATGENERATION DEPVAR USEROUTPUTVARIABLES
    PHYSICALCONSTANTS  VALUESATINFINITY SURFACEINTERACTION SURFACEBEHAVIOR FRICTION CHANGEFRICTION
    GAPCONDUCTANCE GAPHEATGENERATION CONTACTDAMPING CONTACTINCLUSIONS CONTACTPROPERTYASSIGNMENT
    CONTACTCONTROLS CONTACTFORMULATION SURFACEPROPERTYASSIGNMENT CONTACTINITIALIZATIONASSIGNMENT
    CONTACTINITIALIZATIONDATA CONTACTEXCLUSIONS CHANGESURFACEBEHAVIOR CHANGECONTACTTYPE FLUIDCONSTANTS
    FLUIDSECTION SPECIFICGASCONSTANT ELECTRICALCONDUCTIVITY MAGNETICPERMEABILITY SECTIONCONTROLS
    HOURGLASSSTIFFNESS NORMAL NODALTHICKNESS TRANSVERSESHEARSTIFFNESS CONNECTORBEHAVIOR CONNECTORELASTICITY
    CONNECTORDAMPING CHANGEPLASTIC"""
_PROCEDURES = """MODALDYNAMIC STEADYSTATEDYNAMICS BUCKLE GREEN HEATTRANSFER ELECTROMAGNETICS CFD SENSITIVITY
    RANDOMRESPONSE RESPONSESPECTRUM SUBSTRUCTUREGENERATE RETAINEDNODALDOFS SUBSTRUCTUREMATRIXOUTPUT
    MATRIXGENERATE MATRIXOUTPUT ELEMENTMATRIXOUTPUT SELECTEIGENMODES DESIGNVARIABLES
    DESIGNRESPONSE OBJECTIVE CONSTRAINT FEASIBLEDIRECTION FILTER ROBUSTDESIGN RANDOMFIELD CORRELATIONLENGTH
    CRACKPROPAGATION REFINEMESH NOANALYSIS RESTART CONTROLS SOLUTIONTECHNIQUE"""
_OUTPUT = """NODEPRINT NODEFILE NODEOUTPUT ELPRINT ELFILE ELEMENTOUTPUT OUTPUT CONTACTPRINT CONTACTFILE CONTACTOUTPUT
    SECTIONPRINT SECTIONFILE FACEPRINT FILEFORMAT MONITOR MODALFILE MODALPRINT ENERGYPRINT ENERGYFILE
    ENERGYOUTPUT PRINT FILEOUTPUT RADIATIONOUTPUT INTEGRATEDOUTPUTSECTION INTEGRATEDOUTPUT DIAGNOSTICS"""

LOADING = "STATIC DYNAMIC VISCO COUPLEDTEMPERATURE-DISPLACEMENT UNCOUPLEDTEMPERATURE-DISPLACEMENT"
"""Procedures after which the model is loaded: small motions about that state are stiffened by it."""

OTHER_SECTIONS = """SHELLSECTION SHELLGENERALSECTION BEAMSECTION BEAMGENERALSECTION FRAMESECTION
    MEMBRANESECTION SURFACESECTION GASKETSECTION COHESIVESECTION"""
"""Sections of elements that are no solids: refused where these share nodes with solids, else listed."""

KEYWORDS = Table(
    ("PARAMETER", Verdict.INCOMPLETE, "is not read; write the values in place of the parameters"),
    ("SYSTEM", Verdict.INCOMPLETE, "rotates the nodes that follow; write nodes in global rectangular coordinates"),
    ("NGEN NFILL NCOPY NMAP ELGEN ELCOPY IMPORT IMPORTNSET IMPORTELSET", Verdict.INCOMPLETE, _WHOLE),
    ("SYMMETRICMODELGENERATION", Verdict.INCOMPLETE, _WHOLE),
    ("NETWORKMPC", Verdict.COUPLING, _TIES),
    ("TIEDCONTACT", Verdict.COUPLING, "glues surfaces together"),
    ("CONTACTPAIR CONTACT CLEARANCE", Verdict.COUPLING, "holds surfaces in contact"),
    ("KINEMATICCOUPLING", Verdict.COUPLING, _REFERENCE),
    ("EMBEDDEDELEMENT SHELLTOSOLIDCOUPLING", Verdict.COUPLING, "ties elements into others"),
    ("PRE-TENSIONSECTION PRETENSIONSECTION", Verdict.COUPLING, "cuts a bolt and couples its halves"),
    ("FASTENER", Verdict.COUPLING, "joins surfaces by fasteners"),
    ("RELEASE", Verdict.COUPLING, "releases rotations"),
    ("INERTIARELIEF", Verdict.COUPLING, "balances loads by accelerations"),
    ("MODELCHANGE", Verdict.COUPLING, "takes elements or contacts out or puts them in"),
    ("SUBMODEL", Verdict.COUPLING, "moves nodes by the results of another model"),
    ("FOUNDATION", Verdict.COUPLING, "supports faces by an elastic foundation"),
    ("IMPEDANCE SIMPEDANCE", Verdict.COUPLING, _MEDIUM),
    ("NONSTRUCTURALMASS", Verdict.COUPLING, "gives mass that is not read"),
    ("JOINT CONNECTORSECTION GAP BUSHING", Verdict.COUPLING, _gives("stiffness to gaps or connectors")),
    ("REBAR REBARLAYER", Verdict.COUPLING, _gives("stiffness and mass to reinforcements")),
    ("ACOUSTICMEDIUM", Verdict.COUPLING, _gives("stiffness and mass to a fluid")),
    ("USERELEMENT UELPROPERTY USERSECTION", Verdict.COUPLING, _gives("stiffness and mass to user elements")),
    ("SUBSTRUCTUREPROPERTY", Verdict.COUPLING, _gives("stiffness and mass to substructures")),
    ("MATRIX MATRIXINPUT MATRIXASSEMBLE", Verdict.COUPLING, "gives stiffness and mass by matrices"),
    ("DAMPING MODALDAMPING GLOBALDAMPING", Verdict.APPROXIMATED, _DAMPING),
    ("CHANGEMATERIAL", Verdict.APPROXIMATED, "is left out: the materials of the model stay"),
    ("CHANGESOLIDSECTION", Verdict.APPROXIMATED, "is left out: the sections of the model stay"),
    ("COMPLEXFREQUENCY", Verdict.APPROXIMATED, "asks for gyroscopic terms, which are left out"),
    ("PLASTIC CYCLICHARDENING DEFORMATIONPLASTICITY CREEP POTENTIAL", Verdict.APPROXIMATED, _LINEAR),
    ("RATEDEPENDENT SWELLING ANNEALTEMPERATURE DAMAGEINITIATION DAMAGEEVOLUTION", Verdict.APPROXIMATED, _LINEAR),
    ("DRUCKERPRAGER CAPPLASTICITY", Verdict.APPROXIMATED, _LINEAR),
    (" ".join((_LOADS, _DEFINITIONS, _PROCEDURES, _OUTPUT)), Verdict.HARMLESS, ""),
)
"""Every keyword: those that are read are entered by the functions that read them."""


@dataclass(frozen=True, kw_only=True)
class ElementType:
    """Our element for a solid; whether both integrate alike; whether theirs has one point."""

    kind: str
    same: bool = False
    one_point: bool = False


ELEMENT_TYPES = {
    "C3D4": ElementType(kind="tet4", same=True),
    "C3D5": ElementType(kind="pyramid5"),
    "C3D6": ElementType(kind="wedge6"),
    "C3D8": ElementType(kind="hex8"),
    "C3D8R": ElementType(kind="hex8", one_point=True),
    "C3D10": ElementType(kind="tet10", same=True),
    "C3D15": ElementType(kind="wedge15", same=True),
    "C3D20": ElementType(kind="hex20", same=True),
    "C3D20R": ElementType(kind="hex20r", same=True),
}
"""Solids. With other letters (C3D8I, C3D10M, DC3D8) they have the same nodes and another integration."""


def solid_type(name: str) -> ElementType | None:
    """What is known of an element type; None for what is no solid.

    >>> solid_type("C3D20RH")
    ElementType(kind='hex20r', same=False, one_point=False)
    >>> solid_type("DC3D8").kind, solid_type("S8R")
    ('hex8', None)
    """
    match = re.fullmatch(r"D?(C3D\d+)([A-Z]*)", name)
    if name in ELEMENT_TYPES or match is None:
        return ELEMENT_TYPES.get(name)
    reduced = f"{match[1]}R" if "R" in match[2] else match[1]
    like = ELEMENT_TYPES.get(reduced, ELEMENT_TYPES.get(match[1]))
    return None if like is None else replace(like, same=False)
