"""Bolts of a finite element model: its pre-tension sections cut, and the load steps of its file that tighten them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from slipstick.analysis.preload.steps import LoadStep, bolt
from slipstick.balance.contacts import ContactPair
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, names, one, suggestion, warn, wrong
from slipstick.fem.load_steps import StepLoad
from slipstick.fem.model import FiniteElementModel, ImportedModel
from slipstick.fem.pretension import CutSection, cut_sections

_RIGID = 1e4
"""Stiffness of the cut over that of the layer of elements beside it: what a bolt loses of its own is far below 1e-4."""

_EXPECTED = 'names of pre-tension sections, or {"bolt 1": "SECTION"}'


class PretensionBolts(list[ContactPair]):
    """Bolts of a model, a list of contacts as ``ss.bolt`` makes; made by :func:`slipstick.models.pretension_bolts`.

    Attributes
    ----------
    model
        The model with its bolts cut: what joints and reductions are made of.
    sections
        What each cut is: its dof, normal, area and stiffness.
    keep
        The dofs of their shortenings, for ``keep`` of :func:`slipstick.reduced_body`.
    steps
        Load steps of the model's file in which they are tightened; none where it loads them in none.
    notes, warnings
        What was cut; what of the file's steps is left out.
    """

    def __init__(
        self, contacts: Sequence[ContactPair], *, model: ImportedModel, sections: Sequence[CutSection],
        steps: Sequence[LoadStep], notes: Sequence[str], warnings: Sequence[str],
    ) -> None:  # fmt: skip
        super().__init__(contacts)
        self.model, self.sections, self.steps = model, tuple(sections), tuple(steps)
        self.notes, self.warnings = tuple(notes), tuple(warnings)

    @property
    def keep(self) -> list[str]:
        """Names of the dofs."""
        return [section.dof for section in self.sections]


def pretension_bolts(
    model: ImportedModel,
    sections: str | Sequence[str] | Mapping[str, str] | None = None,
    *,
    loaded: Sequence[str] | None = None,
) -> PretensionBolts:
    """Pre-tension sections of an imported model as bolts: its mesh is cut there, and its file's steps tighten them.

    The nodes of a section are doubled. Both sides move together but for the shortening of the bolt along the normal of
    the section, which is the dof of the pre-tension node. The bolt pulls with the force it is given, and then keeps its
    length; it goes slack where it would push.

    Parameters
    ----------
    model
        What :func:`import_model` returns, with ``pretension_sections``.
    sections
        Which of them, by name; with names of their own ``{"bolt 1": "SECTION"}``. None: all.
    loaded
        Bolts whose loads are those of the file, by name; None: all.

    Returns
    -------
    PretensionBolts
        The bolts, with the cut ``model``, and ``keep`` and ``steps`` for its reduction and its load steps.

    Raises
    ------
    InputError
        For sections that are not plane, do not reach through the bolt or meet another one, and whose node is used
        elsewhere; for a step of the file that pushes a bolt.

    Warns
    -----
    SlipstickWarning
        Other loads of the steps that tighten bolts, and amplitudes: they are left out.

    Notes
    -----
    In the steps of a file a force acts until the length is fixed (``*BOUNDARY, FIXED``, LOCK); then the bolt keeps its
    length. A step that follows without that has the force again.

    Examples
    --------
    A bar held at one end, cut in its middle, and tightened by its file.

    >>> import numpy as np
    >>> import slipstick as ss
    >>> from dataclasses import replace
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.interfaces import PretensionSection
    >>> from slipstick.fem.load_steps import LoadStep, StepLoad
    >>> from slipstick.fem.mesh import Surface
    >>> from slipstick.fem.model import elastic_model
    >>> mesh = box((1.0, 1.0, 4.0), (1, 1, 4), "hex8")
    >>> across = mesh.blocks["hex8"][1][[4, 5, 6, 7]]  # the upper face of the second element
    >>> mesh = replace(mesh, surfaces={**mesh.surfaces, "CUT": Surface(faces={"quad4": across[None]})})
    >>> model = elastic_model(mesh, ss.Material(young=2e11, poisson=0.3, density=7800.0), ["z0", "z1"])
    >>> pull = LoadStep(procedure="static", loads=(StepLoad(kind="bolt force", where="CUT", value=5e3),))
    >>> section = PretensionSection(node=99, normal=(0.0, 0.0, 1.0))
    >>> model = replace(model, pretension_sections={"CUT": section}, load_steps={"STEP-1": pull})
    >>> bolts = ss.models.pretension_bolts(model)
    >>> body = ss.reduced_body(bolts.model, keep=bolts.keep, modes=5)
    >>> state = ss.preload(ss.Problem(body.structure, contacts=list(bolts)), bolts.steps)
    >>> print(state.table())
    after STEP-1:
      CUT: normal 5000, open 0 %
    """
    gathering = Gathering()
    gathering.take(one, "model", model, FiniteElementModel, "what ss.import_model returns")
    chosen = gathering.take(_named, model, sections)
    gathering.end()
    assert chosen is not None
    tightened = {*chosen} if loaded is None else {*names("loaded", loaded, "names of bolts, or None")}
    if strange := sorted(tightened - {*chosen}):
        raise InputError(Fault("loaded", f"there is no bolt '{strange[0]}'", remedy=suggestion(strange[0], chosen)))
    cut, found = cut_sections(model, list(chosen.values()))
    bolts = [
        bolt(name=name, elongation={section.dof: -1.0}, stiffness=_RIGID * section.stiffness)
        for name, section in zip(chosen, found, strict=True)
    ]
    of_section = {section: name for name, section in chosen.items() if name in tightened}
    reading = _Steps(model, of_section)
    steps = list(reading)
    warn(reading.warnings)
    notes = [*cut.notes[len(model.notes) :], *reading.notes]
    cut = replace(cut, notes=(*model.notes, *notes), warnings=(*cut.warnings, *reading.warnings))
    return PretensionBolts(bolts, model=cut, sections=found, steps=steps, notes=notes, warnings=reading.warnings)


def _named(model: Any, sections: Any) -> dict[str, str]:
    known = getattr(model, "pretension_sections", {})
    if sections is None:
        if not known:
            what = "the model has no pre-tension section (*PRE-TENSION SECTION, PRETS179, BOLT)"
            raise InputError(Fault("sections", what, remedy="give head and nut of the bolts: ss.bolt"))
        return {name: name for name in known}
    if isinstance(sections, str):
        return {sections: sections}
    if isinstance(sections, Mapping):
        if not all(isinstance(word, str) for pair in sections.items() for word in pair):
            raise wrong("sections", sections, _EXPECTED)
        return dict(sections)
    listed = names("sections", sections, _EXPECTED)
    if twice := next((name for k, name in enumerate(listed) if name in listed[:k]), None):
        raise InputError(Fault(("sections", twice), "is given twice", remedy="cut each section once"))
    return {name: name for name in listed}


class _Steps:
    """Load steps of a file by the bolts they tighten; ``of_section`` has the bolt of each section."""

    def __init__(self, model: ImportedModel, of_section: Mapping[str, str]) -> None:
        self.model, self.of_section = model, of_section
        self.notes, self.warnings = list[str](), list[str]()

    def __iter__(self) -> Iterator[LoadStep]:
        forces: dict[str, float] = {}
        left_out: dict[str, list[str]] = {}
        shaped: list[str] = []
        tightened = set[str]()
        for name, step in self.model.load_steps.items():
            ours = [load for load in step.loads if load.where in self.of_section and load.kind.startswith("bolt")]
            if step.perturbation:
                if ours:
                    self.warnings.append(f"{self._in(name)} is one of small motions: its loads on bolts are left out")
                continue
            for load in step.loads:
                if not load.kind.startswith("bolt"):
                    left_out.setdefault(name, []).append(load.kind)
            shaped += [f"{load.amplitude} of {name}" for load in ours if load.amplitude]
            locked = {self.of_section[load.where] for load in ours if load.kind == "bolt locked"}
            if any(load.replaces and load.kind in ("force", "moment", "bolt force") for load in step.loads):
                forces = dict.fromkeys(forces, 0.0)
            forces |= {
                self.of_section[load.where]: self._force(name, load) for load in ours if load.kind == "bolt force"
            }
            lengths = {self.of_section[load.where]: load.value for load in ours if load.kind == "bolt shortening"}
            forces = {bolt: force for bolt, force in forces.items() if bolt not in locked | {*lengths}}
            tightened |= {*forces, *lengths}
            if forces or lengths or (tightened and ours):
                yield LoadStep(name=name, bolts=forces, shortening=lengths)
        if tightened and left_out:
            kinds = ", ".join(f"{name} ({', '.join(dict.fromkeys(kinds))})" for name, kinds in left_out.items())
            self.warnings.append(
                f"{self.model.source}: other loads of the steps that tighten bolts are left out: {kinds}"
            )
        if shaped:
            listed = ", ".join(dict.fromkeys(shaped))
            self.warnings.append(f"{self.model.source}: amplitudes of loads on bolts are taken for 1: {listed}")
        idle = sorted({*self.of_section.values()} - tightened)
        if idle:
            self.notes.append(f"{self.model.source}: no step of the file tightens {', '.join(idle)}")

    def _in(self, step: str) -> str:
        return f"{self.model.source}: step {step}"

    def _force(self, step: str, load: StepLoad) -> float:
        if load.value < 0.0:
            where = self.model.pretension_sections[load.where].place(self.model.source, load.where)
            what = f"is pushed by {-load.value:g} in step {step}"
            raise InputError(Fault(where, what, remedy="a bolt pulls: give a force >= 0"))
        return load.value
