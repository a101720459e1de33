"""What a page holds of one branch: outcome, provenance, curves, and the points' coefficients and states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.contact.friction_law import FrictionLaw
from slipstick.errors import InputError
from slipstick.report.contacts import COEFFICIENTS, STATES, friction_of, orbits_of, planar_of, series_of
from slipstick.report.curves import abscissae_of, curves_of, diagram_of
from slipstick.report.encoding import Indices, fixed, packed
from slipstick.report.inputs import inputs_of
from slipstick.results.deflection import contact_nodes, contact_places, deflection_of, nearest_contacts, outward
from slipstick.results.disc import disc_of
from slipstick.results.interface import QUANTITIES, interfaces_of
from slipstick.results.peaks import peak_points
from slipstick.results.schema import POINT_KINDS, VARIABLES, branch_parts
from slipstick.results.stability import UNKNOWN
from slipstick.results.view import (
    View,
    frequency_unit,
    label_of,
    names_of,
    ranked,
    requested_dofs,
    unit_of,
    unit_shown,
    view_of,
)
from slipstick.typing import Array
from slipstick.units import Units, after_number, energy_unit, unit_of_dof

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable
    from slipstick.structure.skin import Skin


_TOLD = {"title", "author", "remarks", "case", "case_file", "warnings", "outcome", "outcome_text", "Conventions"}
"""Attributes that are shown elsewhere on the page, or are of no use to a reader."""


@np.errstate(over="ignore", invalid="ignore")  # what is no number, or beyond any machine, is not drawn
def content_of(
    branch: Solutions,
    label: str,
    *,
    contacts: int,
    dofs: int,
    tolerances: Mapping[str, float] | None = None,
    beside: Sequence[ResultTable] = (),
) -> dict[str, Any]:
    """One branch as JSON: the ``contacts`` that dissipate most and the ``dofs`` that move most.

    ``tolerances`` are shares of parameters by name, whose effect is shown on the curves. Lengths are in the unit they
    are shown in, which results ``beside`` share; what force and motion of contacts are drawn from stays in their own.

    Raises InputError where it holds no motion.
    """
    dataset = branch.table
    _check(dataset, label)
    names = names_of(dataset, "dof")
    kept = {"dof": _largest(dataset, "dof", "amplitude", dofs)}
    kept["contact"] = _largest(dataset, "contact", "dissipated_power", contacts)
    view, toleranced = view_of(dataset), {}
    factors = np.array([unit_shown(dataset, "displacement", names[d], beside)[0] for d in kept["dof"]])
    provenance = _provenance(branch)
    if tolerances is not None and len(branch):
        toleranced = {"bands": bands_of(branch, kept["dof"], tolerances, factors)}
        provenance["about"] += what_matters(branch, kept["dof"], tolerances)
    return {
        "label": label,
        **provenance,
        **toleranced,
        "states": STATES,
        "orders": list(branch.harmonics.orders),
        "points": len(branch),
        "analysis": view.name,
        "abscissae": abscissae_of(dataset, view, beside),
        "inputs": inputs_of(branch.problem, dataset.attrs, frequency_unit(dataset)),
        "companions": view.companions,
        "frequency": frequency_of(dataset),
        "omega": packed(dataset["omega"].to_numpy(), "f8"),
        **_marks(dataset),
        "dofs": _named(dataset, "dof", kept["dof"])
        | {
            **_motion(dataset, [names[d] for d in kept["dof"]], beside),
            "displacement": fixed(dataset["displacement"].to_numpy()[:, kept["dof"]] * factors[:, None], 3),
        },
        "asked": _requested_dofs(dataset, kept["dof"]),
        "notes": _notes(dataset, kept["dof"], view),
        "curves": curves_of(branch, kept, view, beside),
        "references": references_of(branch, kept["dof"], factors) if view.name == "response" else [],
        "contacts": _contacts(branch, kept["contact"]),
        "shape": shape_of(branch, beside),
        "interfaces": interfaces_content(branch),
        "disc": disc_content(branch, beside),
        "diagram": diagram_of(branch),
    }


def _check(dataset: ResultTable, label: str) -> None:
    """InputError where a dataset, which may come from anywhere, does not follow the schema."""
    if not {"omega", "amplitude", "displacement"} <= set(dataset):
        raise InputError(f"{label}: these results hold no motion of dofs; give those of a response")
    dims = {name: variable.dims for name, variable in VARIABLES.items()}
    dims |= {name: ("contact", *declared.dims) for name, declared in FrictionLaw.variables.items()}
    dims |= dict.fromkeys(COEFFICIENTS, ("contact", "coefficient"))
    for name in set(dims) & set(dataset):
        column, kinds = dataset[name], "biuf"
        if name in VARIABLES:
            kinds = "biu" if VARIABLES[name].whole else "OUS" if VARIABLES[name].texts else kinds
        if column.dims != ("point", *dims[name]) or column.to_numpy().dtype.kind not in kinds:
            wanted = ", ".join(("point", *dims[name]))
            raise InputError(f"{label}: '{name}' is not as results hold it, numbers over {wanted}; compute them again")
    labels = [str(name) for name in dataset["coefficient"].to_numpy()]
    if labels != ["0", *(f"{part}{name[1:]}" for name in labels[1::2] for part in "cs")]:
        raise InputError(f"{label}: the harmonic coefficients are not named as results name them; compute them again")
    if not (dataset["omega"].to_numpy() > 0.0).all():
        raise InputError(f"{label}: 'omega' is not a frequency at every point; compute these results again")


def frequency_of(dataset: Any) -> dict[str, Any]:
    """The units a frequency can be drawn in, with the factor from the one of the results, and the one to begin with."""
    known = Units.of_results(dataset.attrs).frequencies
    return {"unit": frequency_unit(dataset), "factors": {unit: 1.0 / size for unit, size in known.items()}}


def _largest(dataset: ResultTable, dim: str, by: str, most: int) -> Indices:
    """Ascending indices of those with the largest values anywhere along the branch."""
    if dim not in dataset.dims or by not in dataset:
        return np.arange(min(most, dataset.sizes.get(dim, 0)))
    return np.sort(ranked(dataset, dim, by)[:most])


def _named(dataset: ResultTable, dim: str, kept: Indices) -> dict[str, Any]:
    names = names_of(dataset, dim)
    return {"names": [names[i] for i in kept], "count": len(names)}


def _provenance(branch: Solutions) -> dict[str, Any]:
    dataset = branch.table
    told = provenance(dataset.attrs)
    about = told["about"]
    if "newton_iterations" in dataset and len(branch):
        about.append(["Newton iterations", str(int(dataset["newton_iterations"].to_numpy().sum()))])
    if "residual" in dataset and len(branch):
        about += _residuals(dataset)
    return told | {"outcome": {"name": branch.outcome.name, "ok": branch.outcome.ok, "text": branch.message}}


def provenance(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """What the attributes of results say about their origin, and how they ended."""
    name = str(attributes.get("outcome", ""))
    about = [[name.replace("_", " "), _text(value)] for name, value in attributes.items() if name not in _TOLD]
    return {
        **{key: str(attributes.get(key, "")) for key in ("title", "author", "remarks")},
        "outcome": {"name": name, "ok": name == "COMPLETED", "text": str(attributes.get("outcome_text", name))},
        "warnings": str(attributes.get("warnings", "")).splitlines(),
        "about": [pair for pair in about if pair[1]],
        "case": str(attributes.get("case", "")),
        "case_file": str(attributes.get("case_file", "")),
    }


def _residuals(dataset: ResultTable) -> list[list[str]]:
    """Of the points that were solved for, and of those between them."""
    residual = dataset["residual"].to_numpy()
    between = (
        dataset["kind"].to_numpy() == "interpolated" if "kind" in dataset else np.zeros(residual.shape, dtype=bool)
    )
    rows = [["largest residual", f"{float(residual[~between].max(initial=0.0)):.2g}"]]
    if between.any():
        of = f"{int(between.sum())} of {between.size}, residual up to {float(residual[between].max()):.2g}"
        rows.append(["interpolated points", of])
    return rows


def _text(value: object) -> str:
    return f"{float(value):.6g}" if isinstance(value, float | np.floating) else str(value)


def _marks(dataset: ResultTable) -> dict[str, Any]:
    """Kind of each point, the part of the branch it belongs to, and whether it is unstable (1) or nobody knows (2)."""
    count = dataset.sizes["point"]
    kinds = [str(k) for k in dataset["kind"].to_numpy()] if "kind" in dataset else [""] * count
    known = [*POINT_KINDS, ""]
    marks = {
        "kinds": known,
        "kind": packed([known.index(k) if k in known else len(POINT_KINDS) for k in kinds], "u1"),
        "part": packed(branch_parts(dataset), "u1"),
    }
    if "stable" in dataset:
        stable = dataset["stable"].to_numpy()
        marks["unstable"] = packed(np.select([stable == 0, stable == UNKNOWN], [1, 2], 0), "u1")
    return marks


def _motion(dataset: ResultTable, dofs: Sequence[str], beside: Sequence[ResultTable]) -> dict[str, Any]:
    """Label, unit of the displacements, how many of it are one of the results, and the unit of each dof."""
    factor, mixed = unit_shown(dataset, "displacement", beside=beside)
    length, units = unit_of_dof(mixed, ""), [unit_shown(dataset, "displacement", dof, beside)[1] for dof in dofs]
    label = label_of(dataset, "displacement")
    return {"label": label, "units": length, "after": after_number(length), "factor": factor, "units_of": units}


def _requested_dofs(dataset: ResultTable, kept: Indices) -> list[int]:
    """Places, among the dofs of the page, of those tracked or optimised, else of those with peaks."""
    chosen = requested_dofs(dataset)
    return [place for place, d in enumerate(kept) if d in chosen]


def _notes(dataset: ResultTable, kept: Indices, view: View) -> list[list[Any]]:
    """Point, place of the dof (-1: of none) and kind of each point that is listed: peaks, and what else is of note."""
    if "kind" not in dataset:
        return []
    place, kinds = {int(d): i for i, d in enumerate(kept)}, dataset["kind"].to_numpy()
    notes: list[list[Any]] = [
        [int(p), -1, str(kinds[p])] for p in np.flatnonzero(np.isin(kinds, np.array(view.marked, dtype=str)))
    ]
    if "peak_dof" in dataset and view.peaks:
        of = dataset["peak_dof"].to_numpy()
        notes += [[int(p), place[int(of[p])], "peak"] for p in peak_points(dataset) if int(of[p]) in place]
    return notes


def _contacts(branch: Solutions, kept: Indices) -> dict[str, Any]:
    dataset = branch.table
    friction = friction_of(dataset, branch.harmonics, kept)
    friction_places = np.array(friction["of"] if friction else [], dtype=np.intp)
    told = (
        "friction_force",
        "normal_force",
        *(n for n, v in dataset.data_vars.items() if n.endswith("_force") and v.dims),
    )
    force = next((name for name in told if name in dataset), None)
    return _named(dataset, "contact", kept) | {
        "friction": friction,
        "planar": planar_of(branch, kept),
        "orbits": orbits_of(branch, kept),
        "series": series_of(dataset, kept, friction_places) if len(kept) else [],
        "force_units": unit_of(dataset, force) if force else "",
        "force_after": after_number(unit_of(dataset, force)) if force else "",
        "energy_units": after_number(energy_unit(Units.of_results(dataset.attrs).label("force length"))),
    }


def bands_of(
    branch: Solutions, kept: Indices, tolerances: Mapping[str, float], factors: Array | float = 1.0
) -> dict[str, Any]:
    """Lower and upper amplitudes (point, dof) of the dofs of the page, and the tolerances as text."""
    from slipstick.analysis.sensitivity.tolerances import amplitude_band

    names = names_of(branch.table, "dof")
    bands = [amplitude_band(branch, names[d], tolerances) for d in kept]
    said = ", ".join(f"{name} \N{PLUS-MINUS SIGN}{100.0 * share:g} %" for name, share in tolerances.items())
    return {
        "low": packed(np.array([band.low for band in bands]).T * factors),
        "high": packed(np.array([band.high for band in bands]).T * factors),
        "said": said,
    }


def what_matters(branch: Solutions, kept: Indices, tolerances: Mapping[str, float]) -> list[list[str]]:
    """For each dof the change of its largest amplitude by each tolerance, the largest first, as rows of a table."""
    from slipstick.analysis.sensitivity.tolerances import ranked_bars

    rows, names = [], names_of(branch.table, "dof")
    for d in kept:
        size = branch.table["amplitude"].to_numpy()[:, d]
        bars = ranked_bars(branch, names[d], int(np.nanargmax(size)), tolerances)
        text = ", ".join(f"{bar.name}: {100.0 * bar.change / np.nanmax(size):+.2g} %" for bar in bars)
        rows.append([f"largest amplitude of {names[d]} with tolerances", text])
    return rows


UNSEEN = 1e-3
"""Smallest visible motion, relative to the largest."""

MOST_SHAPE_NODES = 1500
"""Of a surface, and so many contacts on it at most: a page has their motion at every point."""


def shape_of(branch: Solutions, beside: Sequence[ResultTable] = ()) -> dict[str, Any] | None:
    """Nodes, triangles, fields and their coefficients at every point; None without a surface mesh."""
    skin = None if branch.problem is None else branch.problem.structure.skin
    if skin is None or not len(branch):
        return None
    coarse = None
    if len(skin.nodes) > MOST_SHAPE_NODES:
        from slipstick.fem.boundary import thinned

        coarse = thinned(skin.nodes, skin.triangles, MOST_SHAPE_NODES)
    deflection = deflection_of(branch, small=UNSEEN, coarse=coarse)
    on = _on_surface(branch, deflection.skin, beside)
    size = float(np.abs(deflection.fields).max()) or 1.0
    return {
        "nodes": packed(deflection.skin.nodes, "f4"),
        "triangles": packed(deflection.skin.triangles, "u2"),
        "fields": packed(deflection.fields.T / size, "f4"),
        "coefficients": fixed(deflection.coefficients * size, 3),
        "less": _left_out(deflection.skin, skin, on),
        **({} if on is None else {"on": on}),
    }


def _left_out(shown: Skin, skin: Skin, on: dict[str, Any] | None) -> str:
    """Sentence on the parts of a surface that are not shown; empty where all are."""
    if len(shown.nodes) == len(skin.nodes):
        return ""
    of = f" and {on['shown']} of {on['count']} contacts" if on is not None and on["shown"] < on["count"] else ""
    return f"{len(shown.nodes)} of {len(skin.nodes)} nodes of the surface{of} are shown; save_shape writes all"


ON_SURFACE = {
    "worn_depth": "worn depth",
    "normal_load": "mean normal force",
    "normal_force": "mean normal force",
    "slip_fraction": "slip, share of the period",
    "separation_fraction": "separation, share of the period",
    "dissipated_power": "dissipated power",
}
"""Quantities of contacts that colour a surface; of a force its mean."""


def _on_surface(branch: Solutions, skin: Skin, beside: Sequence[ResultTable]) -> dict[str, Any] | None:
    """Contact shown at each node of a surface, counted from 1, 0 for none, and what they do at every point.

    Quantities are in steps of the 65535th part of their largest value anywhere.
    """
    assert branch.problem is not None
    shown = nearest_contacts(skin, contact_places(branch.problem))
    kept, place = np.unique(shown[shown >= 0], return_inverse=True)
    if not kept.size:
        return None
    contact = np.zeros(len(shown), dtype=int)
    contact[shown >= 0] = place + 1
    turn = _looking_at(outward(branch.problem, contact_nodes(branch.problem))[1])
    of = [one for name in ON_SURFACE if (one := _at_contacts(branch.table, name, kept, beside)) is not None]
    count = branch.table.sizes["contact"]
    return {"contact": packed(contact, "u2"), "turn": turn, "of": of, "shown": len(kept), "count": count}


def _at_contacts(
    dataset: ResultTable, name: str, kept: Indices, beside: Sequence[ResultTable]
) -> dict[str, Any] | None:
    """A quantity of the contacts of the page, (point, contact); None where it is missing or zero."""
    if name not in dataset or (name == "normal_force" and "normal_load" in dataset):
        return None
    values = np.nan_to_num(dataset[name].to_numpy()[:, kept], posinf=0.0, neginf=0.0)
    values = np.maximum(values[..., 0] if values.ndim == 3 else values, 0.0)
    most = float(values.max(initial=0.0))
    if not most > 0.0:
        return None
    factor, unit = unit_shown(dataset, name, beside=beside)
    said = {"key": name, "label": ON_SURFACE[name], "after": after_number(unit), "most": most * factor}
    return {**said, "values": packed(np.rint(values / most * 65535.0), "u2")}


def interfaces_content(branch: Solutions) -> list[dict[str, Any]]:
    """Flat maps of the contacts between surfaces, those of the largest areas, and what they do at every point."""
    names, units = names_of(branch.table, "contact"), Units.of_results(branch.table.attrs)
    out = []
    for joint in interfaces_of(branch) if len(branch) else ():
        kept = np.sort(np.argsort(-joint.areas, kind="stable")[:MOST_SHAPE_NODES])
        of = [
            own for key in QUANTITIES
            if (values := joint.values(branch.table, key)) is not None
            and (own := _on_interface(key, values[:, kept], units))
        ]  # fmt: skip
        if not of:
            continue
        less = (
            f"{len(kept)} of {len(joint.areas)} contacts, of the largest areas" if len(kept) < len(joint.areas) else ""
        )
        out.append({
            "name": joint.name, "axes": joint.axes, "names": [names[c] for c in joint.contacts[kept]],
            "x": packed(joint.flat[:1, kept], "f8"), "y": packed(joint.flat[1:, kept], "f8"),
            "area": packed(joint.areas[None, kept], "f8"), "after": units.after("length"),
            "area_after": units.after("length^2"), "less": less, "of": of,
            "bolts": [
                {"name": names[c], "x": x, "y": y}
                for c, x, y in zip(joint.bolts[0], *joint.bolts[1].tolist(), strict=True)
            ],
        })  # fmt: skip
    return out


def _on_interface(key: str, values: Array, units: Units) -> dict[str, Any]:
    """A quantity of the contacts of a map, (point, contact), in steps of the 65535th part of the largest."""
    label, dimension = QUANTITIES[key]
    said = {"key": key, "label": label, "after": units.after(dimension)}
    if key == "state":
        return {**said, "most": 4.0, "values": packed(values, "u1")}
    values = np.maximum(np.nan_to_num(values, posinf=0.0, neginf=0.0), 0.0)
    most = float(values.max(initial=0.0))
    return {**said, "most": most, "values": packed(np.rint(values / (most or 1.0) * 65535.0), "u2")}


_FROM_ABOVE, _ASIDE = 60.0, -35.0
"""Largest elevation of the view of a surface, and its angle from the normal; degrees."""


def _looking_at(normal: Array) -> list[int]:
    """Angles of view of a surface with this normal, degrees, with the body upright."""
    x, y, z = normal / (float(np.linalg.norm(normal)) or 1.0)
    level = float(np.hypot(x, y))
    yaw = np.degrees(np.arctan2(-x, -y)) if level > 0.1 else 0.0
    pitch = np.clip(np.degrees(np.arctan2(z, level)) + (20.0 if level > 0.9 else 0.0), -_FROM_ABOVE, _FROM_ABOVE)
    return [round((yaw + _ASIDE + 180.0) % 360.0 - 180.0), round(float(pitch))]


MOST_ON_DISC = 3
"""Dofs whose motion at every sector is in a page."""


def disc_content(branch: Solutions, beside: Sequence[ResultTable] = ()) -> dict[str, Any] | None:
    """Amplitudes and motion of the dofs of a disc that move most, of each sector or of the one of a wave."""
    disc = disc_of(branch)
    if disc is None or not disc.dofs or not len(branch):
        return None
    amplitude, motion = (branch.table[name].to_numpy() for name in ("amplitude", "displacement"))
    largest = {name: float(np.nan_to_num(amplitude[:, where]).max()) for name, where in disc.dofs.items()}
    names = sorted(sorted(largest, key=lambda name: -largest[name])[:MOST_ON_DISC], key=list(largest).index)
    kept = [place for name in names for place in disc.dofs[name][: None if disc.whole else 1]]
    every = names_of(branch.table, "dof")
    factors = np.array([unit_shown(branch.table, "amplitude", every[d], beside)[0] for d in kept])
    return {
        "sectors": disc.sectors,
        "engine_order": disc.engine_order,
        "whole": disc.whole,
        "dofs": names,
        "amplitude": packed(amplitude[:, kept] * factors),
        "displacement": fixed(motion[:, kept] * factors[:, None], 2),
    }


_MOST_PORTS = 100
"""Beyond, a limit is a large system at every frequency, and takes longer than the page is worth."""


_SECONDS = 0.2
"""About the time each limit may take."""


def references_of(branch: Solutions, kept: Indices, factors: Array | float = 1.0) -> list[dict[str, Any]]:
    """Label, frequencies and amplitudes (n, dofs) of each limit; none where the problem is not known, or is large."""
    from slipstick.analysis.curve.linear import linear_references

    problem, dataset = branch.problem, branch.table
    if problem is None or not len(branch) or not problem.contacts:
        return []
    if branch.balance.n_ports > _MOST_PORTS:
        return []
    omega = dataset["omega"].to_numpy()
    limits = linear_references(branch.balance, (float(omega.min()), float(omega.max())), seconds=_SECONDS)
    return [
        {
            "label": label,
            "omega": packed(limit.table["omega"].to_numpy(), "f8"),
            "amplitude": packed(limit.table["amplitude"].to_numpy()[:, kept] * factors),
        }
        for label, limit in limits
    ]
