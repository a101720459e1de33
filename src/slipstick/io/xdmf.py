"""XDMF files for ParaView: the surface of a body over a period, wear and stresses over points; tables of stresses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import whole, wrong
from slipstick.replacing import XML, writing
from slipstick.results.contacts import states_at
from slipstick.results.interface import interfaces_of
from slipstick.results.saved_table import write_table
from slipstick.results.stress import PLACE, chosen_places, strains_of, stress_of
from slipstick.typing import AnyArray, Points

if TYPE_CHECKING:
    import xarray

    from slipstick.results.solutions import Solutions
    from slipstick.structure.strains import StrainPlaces


MOST_FRAMES = 1000
_FIRST = '<xi:include xpointer="xpointer(/Xdmf/Domain/Grid/Grid[1]/*[self::Topology or self::Geometry])"/>'
"""Reference to the mesh of the first frame."""


def write_shape(branch: Solutions, path: str | Path, point: int, *, frames: int = 36) -> Path:
    """Write the motion of a body's surface at a point of a branch as XDMF with times in units of time; the path.

    In ParaView: open it, add the filter "Warp By Vector", play. Nodes round each contact, where it lies on the surface,
    show its ``contact_state`` (1 stick, 2 slip, 3 separation, 4 unknown, 0 no contact) and its forces, such as
    ``normal_force`` and ``friction_force``, at each time, ``slip_fraction`` and ``separation_fraction`` of the period,
    ``dissipated_power``, and ``worn_depth`` where there is one. Contacts between two surfaces show ``pressure`` at
    each time and the ``dissipated_energy`` of a period, per area.

    Raises
    ------
    InputError
        If the file cannot be written, the surface is not known, or there is no such point.
    """
    from slipstick.results.deflection import contact_places, deflection_of, nearest_contacts

    target = path_of("shape", path, "the path of a file such as shape.xdmf")
    frames = whole("shape frames", frames, 1, MOST_FRAMES)
    d = branch.point(point)
    omega = float(d["omega"])
    at = int(d["point"])
    deflection = deflection_of(branch, points=[at])
    tau = np.arange(frames) * (2.0 * np.pi / frames)
    H, displacement = branch.harmonics.H_minus(tau), deflection.at(0)
    title = str(branch.dataset.attrs.get("title", "")) or "shape"
    assert branch.problem is not None
    shown = nearest_contacts(deflection.skin, contact_places(branch.problem))
    still: dict[str, AnyArray] = {}
    moving: dict[str, AnyArray] = {}
    if (shown >= 0).any():
        still = {name: _at_nodes(d[name].values, shown) for name in (POWER, *SHARES, WORN) if name in d}
        moving = {STATE: _states(branch, at, tau), **{name: H @ d[name].values.T for name in _forces(branch)}}
        areas = _areas(branch)
        if np.isfinite(areas).any():
            still["dissipated_energy"] = _at_nodes(d[POWER].values * (2.0 * np.pi / omega) / areas, shown)
            if NORMAL in moving:
                moving["pressure"] = moving[NORMAL] / areas
    frames_of = (
        {"displacement": displacement @ h, **{name: _at_nodes(of[k], shown) for name, of in moving.items()}, **still}
        for k, h in enumerate(H)
    )
    _written(
        target, _lines(title, deflection.skin.nodes, _triangles(deflection.skin.triangles), tau / omega, frames_of)
    )
    return target


STATE, POWER, WORN, NORMAL = "contact_state", "dissipated_power", "worn_depth", "normal_force"
SHARES = ("slip_fraction", "separation_fraction")
_NUMBERS = {"stick": 1, "slip": 2, "separation": 3}
_UNKNOWN = 4


def _areas(branch: Solutions) -> AnyArray:
    """Areas of contacts between surfaces (n_contacts,), nan of others."""
    areas = np.full(branch.dataset.sizes["contact"], np.nan)
    for joint in interfaces_of(branch):
        areas[joint.contacts] = joint.areas
    return areas


def _forces(branch: Solutions) -> list[str]:
    """Names of the forces of contacts in results, (point, contact, coefficient)."""
    of_contacts = ("point", "contact", "coefficient")
    return [str(name) for name, v in branch.dataset.items() if str(name).endswith("_force") and v.dims == of_contacts]


def _states(branch: Solutions, point: int, tau: AnyArray) -> AnyArray:
    """Numbers of the states of all contacts at times (n_frames, n_contacts)."""
    out = np.full((len(tau), branch.dataset.sizes["contact"]), _UNKNOWN)
    try:
        told = states_at(branch, point)
    except InputError:  # no law has states
        return out
    for c, name in enumerate(branch.dataset["contact"].values):
        for start, end, state in told.get(str(name), ()):
            inside = (tau - start) % (2.0 * np.pi) < (end - start)
            out[inside, c] = _NUMBERS.get(state.rstrip("+-"), _UNKNOWN)
    return out


def _at_nodes(values: AnyArray, shown: AnyArray) -> AnyArray:
    """Of contacts (n_contacts,) at the nodes that show one, 0 elsewhere."""
    return np.where(shown >= 0, np.nan_to_num(np.asarray(values, dtype=float))[np.maximum(shown, 0)], 0.0)


def write_wear(branch: Solutions, path: str | Path) -> Path:
    """Write the worn depth on the surface of a body as XDMF, a frame for each point of ``ss.wear``, its time cycles.

    Nodes round each contact show its ``worn_depth``, ``normal_load`` and ``dissipated_power``; ``displacement`` is the
    motion of harmonic 1 at the phase of its cosine.

    Raises
    ------
    InputError
        If the file cannot be written, the results are not of wear, the surface is not known, or no contact lies on it.
    """
    from slipstick.results.deflection import contact_places, deflection_of, nearest_contacts
    from slipstick.results.view import analysis_of

    target = path_of("wear", path, "the path of a file such as wear.xdmf")
    data = branch.dataset
    if analysis_of(data) != "wear":
        raise InputError("these results are not of wear over cycles; give those of ss.wear")
    deflection = deflection_of(branch)
    assert branch.problem is not None
    shown = nearest_contacts(deflection.skin, contact_places(branch.problem))
    if not (shown >= 0).any():
        raise InputError("no contact lies on the surface of the body: none has its place near a node of it")
    names = [name for name in (WORN, "normal_load", POWER) if name in data]
    first = branch.harmonics.index(1, "c") if 1 in branch.harmonics.orders else 0
    frames = (
        {"displacement": deflection.at(k)[..., first],
         **{name: _at_nodes(data[name].values[k], shown) for name in names}}
        for k in range(len(branch))
    )  # fmt: skip
    title = str(data.attrs.get("title", "")) or "wear"
    topology = _triangles(deflection.skin.triangles)
    _written(target, _lines(title, deflection.skin.nodes, topology, data["cycles"].values, frames))
    return target


def write_preload(data: xarray.Dataset, path: str | Path) -> Path:
    """Write the points of joints as XDMF, a frame for each load step: pressure, traction, gap, slip, state.

    ``data`` is that of ``ss.preload``; states are 0 open, 1 stick, 2 slip, 3 closed without friction.

    Raises
    ------
    InputError
        If the file cannot be written, or no contact has a known place.
    """
    target = path_of("preload", path, "the path of a file such as preload.xdmf")
    known = np.isfinite(data["position"].to_numpy()).all(axis=1) if "position" in data else np.zeros(1, dtype=bool)
    if not known.any():
        raise InputError("no contact has a known place: give ss.preload the pairs of surfaces")
    part = data.isel(contact=np.flatnonzero(known))
    codes = {"open": 0, "stick": 1, "slip": 2, "closed": 3}

    def size(name: str, k: int) -> AnyArray:
        return np.sqrt(np.nansum(part[name].to_numpy()[k] ** 2, axis=-1))

    frames = (
        {"pressure": part["pressure"].to_numpy()[k], "traction": size("traction", k), "gap": part["gap"].to_numpy()[k],
         "slip": size("slip", k), "state": np.array([codes[str(s)] for s in part["state"].to_numpy()[k]], dtype=float),
         "normal": part["normal"].to_numpy()}
        for k in range(data.sizes["step"])
    )  # fmt: skip
    nodes = part["position"].to_numpy()
    count = len(nodes)
    topology = f'<Topology TopologyType="Polyvertex" NumberOfElements="{count}">{_item(np.arange(count))}</Topology>'
    title = str(data.attrs.get("title", "")) or "preload"
    _written(target, _lines(title, nodes, topology, np.arange(1.0, data.sizes["step"] + 1.0), frames))
    return target


_TYPES = {"tet4": 6, "pyramid5": 7, "wedge6": 8, "hex8": 9}
"""Numbers of solids in a mixed topology of XDMF."""

STRESSES = (
    "von_mises_largest", "von_mises_amplitude", "von_mises_static", "stress_mean", "stress_alternating",
)  # fmt: skip


def write_stress_shape(places: StrainPlaces, stress: xarray.Dataset, times: AnyArray, path: Path) -> Path:
    """Write the elements of places as XDMF, coloured by their stresses, a frame for each point; the path.

    Elements have straight edges between their corners. Raises InputError if the file cannot be written.
    """
    rows = [np.column_stack([np.full(len(block), _TYPES[kind]), block]).ravel() for kind, block in places.cells.items()]
    count = sum(map(len, places.cells.values()))
    topology = f'<Topology TopologyType="Mixed" NumberOfElements="{count}">{_item(np.concatenate(rows))}</Topology>'
    frames = ({name: stress[name].to_numpy()[k] for name in STRESSES} for k in range(stress.sizes["point"]))
    center = "Cell" if places.at == "elements" else "Node"
    title = str(stress.attrs.get("title", "")) or "stress"
    _written(path, _lines(title, places.nodes, topology, times, frames, center))
    return path


def _triangles(triangles: AnyArray) -> str:
    return f'<Topology TopologyType="Triangle" NumberOfElements="{len(triangles)}">{_item(triangles)}</Topology>'


def _written(target: Path, lines: Iterator[str]) -> None:
    with writing(target, XML) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.writelines(f"{line}\n" for line in lines)


def _lines(
    title: str,
    nodes: AnyArray,
    topology: str,
    times: AnyArray,
    frames: Iterable[Mapping[str, AnyArray]],
    center: str = "Node",
) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="utf-8"?>'
    yield '<Xdmf Version="3.0" xmlns:xi="http://www.w3.org/2001/XInclude"><Domain>'
    yield f'<Grid Name={quoteattr(title)} GridType="Collection" CollectionType="Temporal">'
    mesh = f'{topology}<Geometry GeometryType="XYZ">{_item(nodes)}</Geometry>'
    for time, values in zip(times, frames, strict=True):
        yield f'<Grid Name="surface" GridType="Uniform">{mesh}<Time Value="{time:.9g}"/>'
        for name, numbers in values.items():
            kind = "Vector" if numbers.ndim == 2 else "Scalar"
            yield f'<Attribute Name="{name}" AttributeType="{kind}" Center="{center}">{_item(numbers)}</Attribute>'
        yield "</Grid>"
        mesh = _FIRST
    yield "</Grid></Domain></Xdmf>"


def _item(values: AnyArray) -> str:
    """Numbers (n, 3) or (n,) as a data item."""
    counted = values.dtype.kind in "iu"
    rows = values.reshape(len(values), -1)
    numbers = "\n".join(" ".join(("%d" if counted else "%.6g") % value for value in row) for row in rows.tolist())
    kind = 'DataType="Int"' if counted else 'DataType="Float" Precision="8"'
    shape = " ".join(map(str, values.shape))
    return f'<DataItem {kind} Dimensions="{shape}" Format="XML">\n{numbers}\n</DataItem>'


_ENDINGS = (".xdmf", ".csv", ".mat")


def write_stress(branch: Solutions, path: str | Path, points: Points = None, at: Any = None) -> Path:
    """See ``Branch.save_stress``."""
    target = path_of("stress", path, "the path of a file such as stress.xdmf, stress.csv or stress.mat")
    if target.suffix.lower() not in _ENDINGS:
        raise wrong("stress", str(target), "a name that ends with .xdmf, .csv or .mat")
    found = stress_of(branch, points, at)
    if target.suffix.lower() == ".mat":
        return write_table(found, target)
    if target.suffix.lower() == ".csv":
        return write_table(_in_each_line(found), target, f"point,{PLACE}")
    places = strains_of(branch).places
    kept, order = np.unique(chosen_places(places, at), return_index=True)
    if at is not None:
        places, found = places.part(kept), found.isel({PLACE: order})
    return write_stress_shape(places, found, found[branch.followed].to_numpy(), target)


def _in_each_line(found: Any) -> Any:
    """The stresses with frequency and position repeated for every line of a table: each point at each place."""
    sizes = {dim: found.sizes[dim] for dim in ("point", PLACE)}
    known = found.set_coords([name for name in found.data_vars if PLACE not in found[name].dims])
    each = {
        name: value.variable.set_dims({**sizes, **dict(value.sizes)}).transpose("point", PLACE, ...)
        for name, value in sorted(known.coords.items(), key=lambda item: item[1].dims != (PLACE,))
        if name not in known.dims and {*value.dims} & {*sizes}
    }
    columns = {**each, **{name: value.variable for name, value in known.data_vars.items()}}
    labels = {dim: known[dim].variable for dim in known.dims if dim in known.coords}
    return type(found)(columns, coords={**labels, "axis": ["x", "y", "z"]}, attrs=found.attrs)
