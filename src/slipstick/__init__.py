"""Steady vibration of structures that stick, slip, separate and rub.

Multiharmonic balance with exact analytical friction contact elements. Public names are loaded on first use, so that
``import slipstick`` does no work.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from slipstick.public_names import on_first_use

__version__ = "0.1.0"

_PUBLIC = {
    "Harmonics": "slipstick.trig.harmonics",
    "FrictionContact": "slipstick.contact.friction",
    "PlanarFrictionContact": "slipstick.contact.planar",
    "RubbingMotion": "slipstick.contact.rubbing",
    "SampledLaw": "slipstick.contact.sampled",
    "casing_motion": "slipstick.contact.casing",
    "common_period": "slipstick.contact.rubbing",
    "contact_forces": "slipstick.contact.friction",
    "CyclicStructure": "slipstick.structure.cyclic",
    "MatrixStructure": "slipstick.structure.matrices",
    "ModalStructure": "slipstick.structure.modal",
    "reduce": "slipstick.structure.reduction.reduce",
    "ContactPair": "slipstick.balance.contacts",
    "Load": "slipstick.balance.loads",
    "Problem": "slipstick.balance.problem",
    "import_model": "slipstick.importers.import_model",
    "at_speed": "slipstick.fem.rotation",
    "reduced_body": "slipstick.models.reduced_body",
    "reduced_blade": "slipstick.models.blade",
    "reduced_sector": "slipstick.models.reduced_sector",
    "surface_contacts": "slipstick.models.surface_contacts",
    "surface_pair": "slipstick.models.surface_pair",
    "Material": "slipstick.fem.materials",
    "Case": "slipstick.case.case",
    "load_case": "slipstick.case.case",
    "FrictionCurve": "slipstick.state.thermal.friction_curve",
    "ThermalModel": "slipstick.state.thermal.model",
    "Branch": "slipstick.branch",
    "load": "slipstick.io.loading",
    "forced_response": "slipstick.analysis.curve.response",
    "parameter_response": "slipstick.analysis.curve.response",
    "steady_response": "slipstick.analysis.curve.response",
    "linear_response": "slipstick.analysis.curve.response",
    "limit_cycles": "slipstick.analysis.self_excited.limit_cycles",
    "nonlinear_modes": "slipstick.analysis.modes.nonlinear_modes",
    "identify": "slipstick.analysis.identification.identify",
    "optimal": "slipstick.analysis.peaks.optimum",
    "track_peak": "slipstick.analysis.peaks.tracking",
    "wear": "slipstick.analysis.wear.wear",
    "LoadStep": "slipstick.analysis.preload.steps",
    "bolt": "slipstick.analysis.preload.steps",
    "preload": "slipstick.analysis.preload.preload",
    "transient": "slipstick.analysis.time_domain.transient",
    "study": "slipstick.studies.study",
    "resume": "slipstick.runs.resume",
    "Progress": "slipstick.progress",
    "InputError": "slipstick.errors",
    "Outcome": "slipstick.errors",
    "SlipstickWarning": "slipstick.errors",
}

_ROOMS = ("models", "plots", "runs")
"""Rooms that are reached by their name, as ``ss.plots.compare(...)``."""

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:  # the same names for editors and type checkers
    from slipstick import models as models
    from slipstick import plots as plots
    from slipstick import runs as runs
    from slipstick.analysis.curve.response import forced_response as forced_response
    from slipstick.analysis.curve.response import linear_response as linear_response
    from slipstick.analysis.curve.response import parameter_response as parameter_response
    from slipstick.analysis.curve.response import steady_response as steady_response
    from slipstick.analysis.identification.identify import identify as identify
    from slipstick.analysis.modes.nonlinear_modes import nonlinear_modes as nonlinear_modes
    from slipstick.analysis.peaks.optimum import optimal as optimal
    from slipstick.analysis.peaks.tracking import track_peak as track_peak
    from slipstick.analysis.preload.preload import preload as preload
    from slipstick.analysis.preload.steps import LoadStep as LoadStep
    from slipstick.analysis.preload.steps import bolt as bolt
    from slipstick.analysis.self_excited.limit_cycles import limit_cycles as limit_cycles
    from slipstick.analysis.time_domain.transient import transient as transient
    from slipstick.analysis.wear.wear import wear as wear
    from slipstick.balance.contacts import ContactPair as ContactPair
    from slipstick.balance.loads import Load as Load
    from slipstick.balance.problem import Problem as Problem
    from slipstick.branch import Branch as Branch
    from slipstick.case.case import Case as Case
    from slipstick.case.case import load_case as load_case
    from slipstick.contact.casing import casing_motion as casing_motion
    from slipstick.contact.friction import FrictionContact as FrictionContact
    from slipstick.contact.friction import contact_forces as contact_forces
    from slipstick.contact.planar import PlanarFrictionContact as PlanarFrictionContact
    from slipstick.contact.rubbing import RubbingMotion as RubbingMotion
    from slipstick.contact.rubbing import common_period as common_period
    from slipstick.contact.sampled import SampledLaw as SampledLaw
    from slipstick.errors import InputError as InputError
    from slipstick.errors import Outcome as Outcome
    from slipstick.errors import SlipstickWarning as SlipstickWarning
    from slipstick.fem.materials import Material as Material
    from slipstick.fem.rotation import at_speed as at_speed
    from slipstick.importers.import_model import import_model as import_model
    from slipstick.io.loading import load as load
    from slipstick.models.blade import reduced_blade as reduced_blade
    from slipstick.models.reduced_body import reduced_body as reduced_body
    from slipstick.models.reduced_sector import reduced_sector as reduced_sector
    from slipstick.models.surface_contacts import surface_contacts as surface_contacts
    from slipstick.models.surface_pair import surface_pair as surface_pair
    from slipstick.progress import Progress as Progress
    from slipstick.runs.resume import resume as resume
    from slipstick.state.thermal.friction_curve import FrictionCurve as FrictionCurve
    from slipstick.state.thermal.model import ThermalModel as ThermalModel
    from slipstick.structure.cyclic import CyclicStructure as CyclicStructure
    from slipstick.structure.matrices import MatrixStructure as MatrixStructure
    from slipstick.structure.modal import ModalStructure as ModalStructure
    from slipstick.structure.reduction.reduce import reduce as reduce
    from slipstick.studies.study import study as study
    from slipstick.trig.harmonics import Harmonics as Harmonics


__getattr__, __dir__ = on_first_use("slipstick", _PUBLIC, _ROOMS)
