"""What users build with: structures from meshes with contacts on a surface, blades, rotors, modal tests, further laws.

Rotors, modal tests and further contact laws are reached as ``ss.models.beam_rotor(...)``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from slipstick.public_names import on_first_use

_PUBLIC = {
    "at_temperature": "slipstick.fem.expansion",
    "campbell": "slipstick.structure.campbell",
    "beam_rotor": "slipstick.models.rotor",
    "craig_bampton": "slipstick.structure.reduction.craig_bampton",
    "free_structure": "slipstick.structure.free",
    "modal_analysis": "slipstick.models.modal_test",
    "tabulated_structure": "slipstick.models.modal_test",
    "interference": "slipstick.structure.interference",
    "jeffcott_rotor": "slipstick.models.rotor",
    "Bearing": "slipstick.models.rotor",
    "Disc": "slipstick.models.rotor",
    "Receptance": "slipstick.structure.receptance",
    "Shaft": "slipstick.models.rotor",
    "Structure": "slipstick.structure.protocol",
    "StatorContact": "slipstick.contact.stator",
    "BoucWenContact": "slipstick.contact.hysteresis",
    "DahlContact": "slipstick.contact.hysteresis",
    "IwanContact": "slipstick.contact.hysteresis",
    "StribeckContact": "slipstick.contact.velocity_friction",
    "bladed_sector": "slipstick.models.parametric_sector",
    "pretension_bolts": "slipstick.models.bolts",
    "straight_contacts": "slipstick.models.straight",
    "greenwood_williamson": "slipstick.models.contact_stiffness",
    "hertz_mindlin": "slipstick.models.contact_stiffness",
    "penalty_stiffness": "slipstick.models.contact_stiffness",
}

__all__ = sorted(_PUBLIC)

if TYPE_CHECKING:  # the same names for editors and type checkers
    from slipstick.contact.hysteresis import BoucWenContact as BoucWenContact
    from slipstick.contact.hysteresis import DahlContact as DahlContact
    from slipstick.contact.hysteresis import IwanContact as IwanContact
    from slipstick.contact.stator import StatorContact as StatorContact
    from slipstick.contact.velocity_friction import StribeckContact as StribeckContact
    from slipstick.fem.expansion import at_temperature as at_temperature
    from slipstick.models.bolts import pretension_bolts as pretension_bolts
    from slipstick.models.contact_stiffness import greenwood_williamson as greenwood_williamson
    from slipstick.models.contact_stiffness import hertz_mindlin as hertz_mindlin
    from slipstick.models.contact_stiffness import penalty_stiffness as penalty_stiffness
    from slipstick.models.modal_test import modal_analysis as modal_analysis
    from slipstick.models.modal_test import tabulated_structure as tabulated_structure
    from slipstick.models.parametric_sector import bladed_sector as bladed_sector
    from slipstick.models.rotor import Bearing as Bearing
    from slipstick.models.rotor import Disc as Disc
    from slipstick.models.rotor import Shaft as Shaft
    from slipstick.models.rotor import beam_rotor as beam_rotor
    from slipstick.models.rotor import jeffcott_rotor as jeffcott_rotor
    from slipstick.models.straight import straight_contacts as straight_contacts
    from slipstick.structure.campbell import campbell as campbell
    from slipstick.structure.free import free_structure as free_structure
    from slipstick.structure.interference import interference as interference
    from slipstick.structure.protocol import Structure as Structure
    from slipstick.structure.receptance import Receptance as Receptance
    from slipstick.structure.reduction.craig_bampton import craig_bampton as craig_bampton


__getattr__, __dir__ = on_first_use("slipstick.models", _PUBLIC)
