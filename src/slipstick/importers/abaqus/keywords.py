"""What becomes of each keyword of an input file (.inp) and of each element type; keywords without their blanks.

``KEYWORD_VERDICTS`` is the whole of it at a glance: read, refused, approximated, without effect. What stands nowhere is
named as not understood.
"""

from __future__ import annotations

import re

from slipstick.importers.findings import Verdict, VerdictRow, rows

_WHOLE = "is not read: the mesh would be incomplete; write one flat input file with all nodes and elements"
_TIES = "ties degrees of freedom to each other"
_REFERENCE = "couples nodes to a reference node"
_MEDIUM = "couples faces to a medium"
_DAMPING = "is not read; give the structure's loss_factor or damping_ratio"
_LINEAR = "is left out: the structure is linear, its material elastic"


def _gives(what: str) -> str:
    return f"gives {what}, elements that are not read"


_INCOMPLETE: dict[str, VerdictRow] = {
    **rows("PARAMETER", Verdict.INCOMPLETE, "is not read; write the values in place of the parameters"),
    **rows(
        "SYSTEM", Verdict.INCOMPLETE, "rotates the nodes that follow; write nodes in global rectangular coordinates"
    ),
    **rows("NGEN NFILL NCOPY NMAP ELGEN ELCOPY IMPORT IMPORTNSET IMPORTELSET", Verdict.INCOMPLETE, _WHOLE),
    **rows("SYMMETRICMODELGENERATION", Verdict.INCOMPLETE, _WHOLE),
}
_COUPLING: dict[str, VerdictRow] = {
    **rows("NETWORKMPC", Verdict.COUPLING, _TIES),
    **rows("TIEDCONTACT", Verdict.COUPLING, "glues surfaces together"),
    **rows("CONTACTPAIR CONTACT CLEARANCE", Verdict.COUPLING, "holds surfaces in contact"),
    **rows("KINEMATICCOUPLING", Verdict.COUPLING, _REFERENCE),
    **rows("EMBEDDEDELEMENT SHELLTOSOLIDCOUPLING", Verdict.COUPLING, "ties elements into others"),
    **rows("PRE-TENSIONSECTION PRETENSIONSECTION", Verdict.COUPLING, "cuts a bolt and couples its halves"),
    **rows("FASTENER", Verdict.COUPLING, "joins surfaces by fasteners"),
    **rows("RELEASE", Verdict.COUPLING, "releases rotations"),
    **rows("INERTIARELIEF", Verdict.COUPLING, "balances loads by accelerations"),
    **rows("MODELCHANGE", Verdict.COUPLING, "takes elements or contacts out or puts them in"),
    **rows("SUBMODEL", Verdict.COUPLING, "moves nodes by the results of another model"),
    **rows("FOUNDATION", Verdict.COUPLING, "supports faces by an elastic foundation"),
    **rows("IMPEDANCE SIMPEDANCE", Verdict.COUPLING, _MEDIUM),
    **rows("NONSTRUCTURALMASS", Verdict.COUPLING, "gives mass that is not read"),
    **rows("JOINT CONNECTORSECTION GAP BUSHING", Verdict.COUPLING, _gives("stiffness to gaps or connectors")),
    **rows("REBAR REBARLAYER", Verdict.COUPLING, _gives("stiffness and mass to reinforcements")),
    **rows("ACOUSTICMEDIUM", Verdict.COUPLING, _gives("stiffness and mass to a fluid")),
    **rows("USERELEMENT UELPROPERTY USERSECTION", Verdict.COUPLING, _gives("stiffness and mass to user elements")),
    **rows("SUBSTRUCTUREPROPERTY", Verdict.COUPLING, _gives("stiffness and mass to substructures")),
    **rows("MATRIX MATRIXINPUT MATRIXASSEMBLE", Verdict.COUPLING, "gives stiffness and mass by matrices"),
}
_APPROXIMATED: dict[str, VerdictRow] = {
    **rows("DAMPING MODALDAMPING GLOBALDAMPING", Verdict.APPROXIMATED, _DAMPING),
    **rows("CHANGEMATERIAL", Verdict.APPROXIMATED, "is left out: the materials of the model stay"),
    **rows("CHANGESOLIDSECTION", Verdict.APPROXIMATED, "is left out: the sections of the model stay"),
    **rows("COMPLEXFREQUENCY", Verdict.APPROXIMATED, "asks for gyroscopic terms, which are left out"),
    **rows("PLASTIC CYCLICHARDENING DEFORMATIONPLASTICITY CREEP POTENTIAL", Verdict.APPROXIMATED, _LINEAR),
    **rows("RATEDEPENDENT SWELLING ANNEALTEMPERATURE DAMAGEINITIATION DAMAGEEVOLUTION", Verdict.APPROXIMATED, _LINEAR),
    **rows("DRUCKERPRAGER CAPPLASTICITY", Verdict.APPROXIMATED, _LINEAR),
}
_LAWS = """HYPERELASTIC HYPERFOAM USERMATERIAL VISCOELASTIC POROUSELASTIC LOWDENSITYFOAM HYPOELASTIC FABRIC
    NOCOMPRESSION NOTENSION MOHRCOULOMB"""
MATERIAL_FAULTS = frozenset(_LAWS.split())
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

LOADING = ("STATIC", "DYNAMIC", "VISCO", "COUPLEDTEMPERATURE-DISPLACEMENT", "UNCOUPLEDTEMPERATURE-DISPLACEMENT")
"""Procedures after which the model is loaded: small motions about that state are stiffened by it."""

OTHER_SECTIONS = (
    *("SHELLSECTION", "SHELLGENERALSECTION", "BEAMSECTION", "BEAMGENERALSECTION", "FRAMESECTION"),
    *("MEMBRANESECTION", "SURFACESECTION", "GASKETSECTION", "COHESIVESECTION"),
)
"""Sections of elements that are no solids: refused where these share nodes with solids, else listed."""

_READ = """PART INSTANCE NODE ELEMENT NSET ELSET SURFACE MATERIAL ELASTIC DENSITY CONDUCTIVITY SOLIDSECTION STEP
    INITIALCONDITIONS DLOAD TRANSFORM ORIENTATION BOUNDARY EQUATION MPC RIGIDBODY COUPLING KINEMATIC DISTRIBUTING
    DISTRIBUTINGCOUPLING MASS ROTARYINERTIA SPRING DASHPOT TIE SELECTCYCLICSYMMETRYMODES CYCLICSYMMETRYMODEL
    FREQUENCY"""

KEYWORD_VERDICTS: dict[str, VerdictRow] = {
    **rows(" ".join((_READ, *LOADING, *OTHER_SECTIONS, *sorted(MATERIAL_FAULTS))), Verdict.READ),
    **_INCOMPLETE,
    **_COUPLING,
    **_APPROXIMATED,
    **rows(" ".join((_LOADS, _DEFINITIONS, _PROCEDURES, _OUTPUT)), Verdict.HARMLESS),
}

KEYWORD_PARAMETERS = {
    "NODE": {"NSET", "SYSTEM", "INPUT"},
    "ELEMENT": {"TYPE", "ELSET", "INPUT"},
    "NSET": {"NSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED", "ELSET"},
    "ELSET": {"ELSET", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED"},
    "SURFACE": {"NAME", "TYPE", "INTERNAL"},
    "MATERIAL": {"NAME", "RTOL"},
    "ELASTIC": {"TYPE"},
    "DENSITY": set(),
    "CONDUCTIVITY": {"TYPE"},
    "SOLIDSECTION": {"ELSET", "MATERIAL", "ORIENTATION", "CONTROLS", "COMPOSITE", "NODALTHICKNESS"},
    "BOUNDARY": {"OP", "AMPLITUDE", "TYPE", "FIXED", "USER", "SUBMODEL", "LOADCASE", "TIMEDELAY", "STEP", "REGIONTYPE"},
    "TRANSFORM": {"NSET", "TYPE"},
    "INITIALCONDITIONS": {"TYPE"},
    "PART": {"NAME"},
    "INSTANCE": {"NAME", "PART"},
    "EQUATION": {"REMOVE", "REMOVEALL"},
    "MPC": set(),
    "TIE": {"NAME", "POSITIONTOLERANCE", "ADJUST", "CYCLICSYMMETRY", "MULTISTAGE", "TYPE", "NOROTATION"},
    "CYCLICSYMMETRYMODEL": {"N", "NGRAPH", "TIE", "ELSET", "CHECK"},
    "SELECTCYCLICSYMMETRYMODES": {"NMIN", "NMAX"},
    "RIGIDBODY": {"NSET", "ELSET", "REFNODE", "ROTNODE"},
    "COUPLING": {"REFNODE", "SURFACE", "CONSTRAINTNAME", "ORIENTATION"},
    "KINEMATIC": set(),
    "DISTRIBUTING": {"CYCLICSYMMETRY"},
    "DISTRIBUTINGCOUPLING": {"ELSET"},
    "ORIENTATION": {"NAME", "SYSTEM", "DEFINITION"},
    "MASS": {"ELSET", "TYPE"},
    "ROTARYINERTIA": {"ELSET", "ORIENTATION"},
    "SPRING": {"ELSET", "NONLINEAR", "ORIENTATION", "COMPLEXSTIFFNESS"},
    "DASHPOT": {"ELSET"},
}
"""Parameters that are understood; the others of these keywords are named."""

_SOLIDS = {4: "tet4", 5: "pyramid5", 6: "wedge6", 8: "hex8", 10: "tet10", 15: "wedge15", 20: "hex20"}
_REDUCED = {"hex20": "hex20r"}
_SAME = {"C3D4", "C3D10", "C3D15", "C3D20", "C3D20R"}


def solid_type(name: str) -> tuple[str, bool] | None:
    """Our element for an element type, and whether it is the same; None for what is no solid.

    >>> solid_type("C3D20"), solid_type("C3D20R"), solid_type("DC3D8"), solid_type("S8R")
    (('hex20', True), ('hex20r', True), ('hex8', False), None)
    """
    match = re.fullmatch(r"D?C3D(\d+)([A-Z]*)", name)
    kind = _SOLIDS.get(int(match.group(1))) if match else None
    if match is None or kind is None:
        return None
    return _REDUCED.get(kind, kind) if "R" in match.group(2) else kind, name in _SAME
