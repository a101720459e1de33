"""The moving surface of a body as XDMF, for ParaView: one text file, a frame for each of many times of the period."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import numpy as np

from slipstick.errors import InputError
from slipstick.faults import path as path_of
from slipstick.faults import whole
from slipstick.replacing import replacing
from slipstick.typing import AnyArray

if TYPE_CHECKING:
    from slipstick.branch import Branch

MOST_FRAMES = 1000
_FIRST = '<xi:include xpointer="xpointer(/Xdmf/Domain/Grid/Grid[1]/*[self::Topology or self::Geometry])"/>'
"""The mesh of the first frame again."""


def write_shape(branch: Branch, path: str | Path, point: int, *, frames: int = 36) -> Path:
    """Write the motion of a body's surface at a point of a branch as XDMF with times in units of time; the path.

    In ParaView: open it, add the filter "Warp By Vector", play.

    Raises
    ------
    InputError
        If the file cannot be written, the surface is not known, or there is no such point.
    """
    from slipstick.results.deflection import deflection_of

    target = path_of("shape", path, "the path of a file such as shape.xdmf")
    frames = whole("shape frames", frames, 1, MOST_FRAMES)
    d = branch.point(point)
    omega = float(d["omega"])
    deflection = deflection_of(branch)
    tau = np.arange(frames) * (2.0 * np.pi / frames)
    motion = np.einsum("ndl,tl->tnd", deflection.at(int(d["point"])), branch.harmonics.H_minus(tau))
    title = str(branch.dataset.attrs.get("title", "")) or "shape"
    text = "\n".join(_lines(title, deflection.skin.nodes, deflection.skin.triangles, tau / omega, motion))
    try:
        with replacing(target) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{target}: the shape cannot be written ({reason}); choose another place") from None
    return target


def _lines(title: str, nodes: AnyArray, triangles: AnyArray, times: AnyArray, motion: AnyArray) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="utf-8"?>'
    yield '<Xdmf Version="3.0" xmlns:xi="http://www.w3.org/2001/XInclude"><Domain>'
    yield f'<Grid Name={quoteattr(title)} GridType="Collection" CollectionType="Temporal">'
    topology = f'<Topology TopologyType="Triangle" NumberOfElements="{len(triangles)}">{_item(triangles)}</Topology>'
    mesh = f'{topology}<Geometry GeometryType="XYZ">{_item(nodes)}</Geometry>'
    for time, displacement in zip(times, motion, strict=True):
        yield f'<Grid Name="surface" GridType="Uniform">{mesh}<Time Value="{time:.9g}"/>'
        yield f'<Attribute Name="displacement" AttributeType="Vector" Center="Node">{_item(displacement)}</Attribute>'
        yield "</Grid>"
        mesh = _FIRST
    yield "</Grid></Domain></Xdmf>"


def _item(values: AnyArray) -> str:
    """Numbers (n, 3) as a data item."""
    counted = values.dtype.kind in "iu"
    numbers = "\n".join(" ".join(("%d" if counted else "%.6g") % value for value in row) for row in values.tolist())
    kind = 'DataType="Int"' if counted else 'DataType="Float" Precision="8"'
    return f'<DataItem {kind} Dimensions="{len(values)} 3" Format="XML">\n{numbers}\n</DataItem>'
