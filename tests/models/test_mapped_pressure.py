"""Pressures of other codes at the points of a pair: a linear field is exact, force and moment are kept."""

from pathlib import Path

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError, SlipstickWarning
from slipstick.fem.box import box
from slipstick.fem.mesh import together
from slipstick.fem.model import elastic_model
from slipstick.models.mapped_pressure import mapped_pressure

LOW, HIGH = box((1.0, 1.0, 0.2), (5, 5, 1)), box((1.0, 1.0, 0.2), (4, 6, 1), at=(0.0, 0.0, 0.2))
MESH = together({"low": LOW, "high": HIGH})
STEEL = ss.Material(young=2e11, poisson=0.3, density=7800.0)
MODEL = elastic_model(MESH, STEEL, ["low.x0", "high.x0"])
LAW = ss.PlanarFrictionContact(kt=1e12, kn=1e12, mu=0.3, gap=0.0)
NODES = MESH.surface("high.z0").nodes


def linear(x):
    return 1e6 * (1.0 + 0.5 * x[:, 0] - 0.3 * x[:, 1])


FORCE = (0.0, 0.0, 1.1e6)
MOMENT = (-0.3e6 / 12, -0.5e6 / 12, 0.0)
"""Of the linear pressures about the middle."""


def joint(file, model=MODEL, first="low.z1", second="high.z0", **options):
    return ss.surface_pair(model, first, second, contact=LAW, pressure=file, **options)


def node_table(folder, values=linear, name="p.csv", head="Node Label,CPRESS"):
    rows = zip(MESH.labels[NODES], values(MESH.nodes[NODES]), strict=True)
    (folder / name).write_text(head + "\n" + "".join(f"{node},{value:.17g}\n" for node, value in rows))
    return folder / name


def place_table(folder, places, pressures, areas=None, name="p.csv", scale=1.0):
    columns = [*(scale * places).T, pressures] + ([] if areas is None else [areas])
    head = "x,y,z,pressure" + ("" if areas is None else ",area")
    np.savetxt(folder / name, np.stack(columns, axis=1), delimiter=",", header=head, comments="", fmt="%.17g")
    return folder / name


def grid(n):
    """Middles of cells on the surface, and their areas."""
    middles = (np.arange(n) + 0.5) / n
    x, y = (part.ravel() for part in np.meshgrid(middles, middles))
    return np.stack([x, y, np.full_like(x, 0.2)], axis=1), np.full(n * n, 1.0 / n**2)


def test_a_linear_field_at_nodes_is_exact(tmp_path):
    found = joint(node_table(tmp_path))
    np.testing.assert_allclose(found.mapped.pressures, linear(found.points.positions), rtol=1e-9)
    np.testing.assert_allclose(found.mapped.force, FORCE, rtol=1e-12, atol=1e-6)
    np.testing.assert_allclose(found.mapped.moment, MOMENT, rtol=1e-12, atol=1e-6)
    assert found.mapped.error < 1e-9


@pytest.mark.parametrize("points", [None, 9, 40])
def test_force_and_moment_of_the_table_are_kept(tmp_path, points):
    """Of a field that is not linear, whatever the points."""
    places, areas = grid(11)
    pressures = 1e6 * np.exp(-4.0 * ((places[:, 0] - 0.4) ** 2 + (places[:, 1] - 0.55) ** 2))
    found = joint(place_table(tmp_path, places, pressures, areas), points=points)
    about = np.average(found.points.positions, axis=0, weights=found.points.areas)
    force = (areas * pressures)[:, None] * np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(found.mapped.force, force.sum(axis=0), rtol=1e-12, atol=1e-6)
    moment = np.cross(places - about, force).sum(axis=0)
    np.testing.assert_allclose(found.mapped.moment, moment, rtol=1e-12, atol=1e-9 * np.abs(moment).max())
    sizes = found.mapped.pressures * found.points.areas
    np.testing.assert_allclose(sizes @ found.points.normals, found.mapped.force, rtol=1e-14, atol=1e-9)
    assert any("force and moment of p.csv are kept" in note for note in found.notes)
    assert found.mapped.error < {None: 0.02, 9: 0.25, 40: 0.1}[points]


def test_the_error_falls_with_the_table(tmp_path):
    def wave(x):
        return 1e6 * (1.0 + 0.5 * np.sin(3.0 * x[:, 0]) * np.cos(2.0 * x[:, 1]))

    errors = []
    for n in (5, 10):
        places, areas = grid(n)
        found = joint(place_table(tmp_path, places, wave(places), areas))
        exact = wave(found.points.positions)
        errors.append(np.linalg.norm(found.mapped.pressures - exact) / np.linalg.norm(exact))
    assert errors[0] > 2.0 * errors[1]


def test_without_areas_no_resultant_is_known(tmp_path):
    places, _ = grid(8)
    found = joint(place_table(tmp_path, places, linear(places)))
    np.testing.assert_allclose(found.mapped.pressures, linear(found.points.positions), rtol=1e-9)
    assert any("p.csv has no area: force and moment are those of the interpolated pressures" in n for n in found.notes)


def test_values_of_elements(tmp_path):
    """Each at the middle of its face: a linear field is exact."""
    elements = range(len(LOW.blocks["hex20"]) + 1, len(MESH.blocks["hex20"]) + 1)
    middles = MESH.nodes[MESH.blocks["hex20"][[e - 1 for e in elements]]].mean(axis=1)
    rows = "".join(f"{e},{v:.17g}\n" for e, v in zip(elements, linear(middles), strict=True))
    (tmp_path / "e.csv").write_text("Element Label,CONT PRES\n" + rows)
    found = joint(tmp_path / "e.csv")
    np.testing.assert_allclose(found.mapped.pressures, linear(found.points.positions), rtol=5e-2)
    np.testing.assert_allclose(found.mapped.force, FORCE, rtol=1e-12, atol=1e-6)


REPORT = """********************************************************************************
Field Output Report, written Thu Nov 26 10:00:00 2026

Source 1
---------

   ODB: job.odb
   Step: Step-1
   Frame: Increment      1: Step Time =    1.000

Loc 1 : Nodal values from source 1

Output sorted by column "Node Label".

Field Output reported at nodes for part: HIGH

            Node          CPRESS           COPEN
           Label          @Loc 1          @Loc 1
---------------------------------------------------
{rows}

  Minimum                 -0.               0.
      At Node             12              12

  Total               4.E+06              0.
"""
PRINTED = """

                    N O D E   O U T P U T


   THE FOLLOWING TABLE IS PRINTED FOR NODES BELONGING TO SURFACE HIGH

       NODE FOOT-   CPRESS         COPEN
            NOTE

{rows}

 MAXIMUM           1.500D+06     0.
 AT NODE             12            3
"""


@pytest.mark.parametrize(("name", "text"), [("p.rpt", REPORT), ("p.dat", PRINTED)])
def test_reports_of_abaqus(tmp_path, name, text):
    values = zip(MESH.labels[NODES], linear(MESH.nodes[NODES]), strict=True)
    rows = "\n".join(f"  {node:10d}   {value:.12E}   {0.0:.4E}".replace("E+06", "D+06") for node, value in values)
    (tmp_path / name).write_text(text.format(rows=rows))
    found = joint(tmp_path / name)
    np.testing.assert_allclose(found.mapped.force, FORCE, rtol=1e-9, atol=1e-3)
    np.testing.assert_allclose(found.mapped.pressures, linear(found.points.positions), rtol=1e-8)


@pytest.mark.parametrize("of_cells", [False, True])
def test_a_mesh_of_faces(tmp_path, of_cells):
    meshio = pytest.importorskip("meshio")
    faces = MESH.surface("high.z0").faces["quad8"][:, :4]
    used, cells = np.unique(faces, return_inverse=True)
    points, cells = MESH.nodes[used], cells.reshape(faces.shape)
    if of_cells:
        data = {"cell_data": {"CPRESS": [linear(points[cells].mean(axis=1))]}}
    else:
        data = {"point_data": {"CPRESS": linear(points)}}
    meshio.write(tmp_path / "p.vtu", meshio.Mesh(points, [("quad", cells)], **data))
    found = joint(tmp_path / "p.vtu")
    np.testing.assert_allclose(found.mapped.force, FORCE, rtol=1e-12, atol=1e-6)
    if not of_cells:
        np.testing.assert_allclose(found.mapped.moment, MOMENT, rtol=1e-12, atol=1e-6)
        np.testing.assert_allclose(found.mapped.pressures, linear(found.points.positions), rtol=1e-9)


def test_curved_surfaces_keep_all_six(tmp_path):
    """A pressure between two rings that is not the same all around: its force is sideways."""
    rings = [_ring(inner, inner + 0.3, n) for inner, n in ((1.0, 16), (1.3, 20))]
    mesh = together({"in": rings[0], "out": rings[1]})
    model = elastic_model(mesh, STEEL, ["in.z0", "out.z0"])
    nodes = mesh.surface("out.x0").nodes
    x = mesh.nodes[nodes]
    pressures = 1e6 * (1.0 + 0.4 * x[:, 0] / 1.3 + 0.2 * x[:, 2])
    rows = "".join(f"{n},{p:.17g}\n" for n, p in zip(mesh.labels[nodes], pressures, strict=True))
    (tmp_path / "p.csv").write_text("node,pressure\n" + rows)
    found = joint(tmp_path / "p.csv", model, "in.x1", "out.x0", points=60)
    sizes = found.mapped.pressures * found.points.areas
    np.testing.assert_allclose(sizes @ found.points.normals, found.mapped.force, rtol=1e-12, atol=1e-6)
    wanted = np.pi * 1.3 * 0.4 * 0.4e6  # int p n dS along x: radius times height times pi times 0.4 MPa
    assert found.mapped.force[0] == pytest.approx(wanted, rel=0.02)
    assert abs(found.mapped.force[1:]).max() < 0.01 * wanted


def _ring(inner, outer, count):
    """A ring of height 0.4, whose surfaces are x0 (inside) and x1 (outside)."""
    from dataclasses import replace

    flat = box((outer - inner, 2.0 * np.pi, 0.4), (1, count, 2), "hex20")
    radius, angle, height = flat.nodes.T
    around = np.stack([(inner + radius) * np.cos(angle), (inner + radius) * np.sin(angle), height], axis=1)
    return replace(flat, nodes=around)


def test_contacts_carry_the_pressures_at_rest(tmp_path):
    """With the loads of the pair, although the bodies are soft and the pressures uneven."""
    pair = joint(node_table(tmp_path), points=4)
    body = ss.reduced_body(MODEL, pairs=pair, base="z", modes=8, loss_factor=0.01)
    shaken = ss.Load(base="z", motion="acceleration", cos=1e-3)
    problem = ss.Problem(body.structure, contacts=pair, loads=[*pair.loads, shaken], harmonics=range(6))
    curve = ss.forced_response(problem, omega=(400.0, 401.0))
    wanted = pair.mapped.pressures * pair.points.areas
    np.testing.assert_allclose(curve.dataset["normal_force"].values[0, :, 0], wanted, rtol=1e-6)


def test_gaps_where_nothing_presses(tmp_path):
    rows = zip(MESH.labels[NODES], MESH.nodes[NODES], strict=True)
    lines = "".join(f"{n},{max(1e6 * (0.5 - x[0]), 0.0)},{max(1e-3 * (x[0] - 0.5), 0.0)}\n" for n, x in rows)
    (tmp_path / "p.csv").write_text("Node,CPRESS,COPEN\n" + lines)
    pair = joint(tmp_path / "p.csv")
    x = pair.points.positions[:, 0]
    gaps = np.array([contact.contact.gap for contact in pair])
    far = x > 0.8
    np.testing.assert_allclose(gaps[far], 1e-3 * (x[far] - 0.5), rtol=1e-9)
    assert np.all(pair.mapped.pressures[far] == 0.0)
    assert len({load.dof.rstrip("xyz") for load in pair.loads}) == np.count_nonzero(pair.mapped.pressures)


def test_units_of_a_column(tmp_path):
    from dataclasses import replace

    table = node_table(tmp_path, lambda x: linear(x) / 1e6, head="Node Label,CPRESS [MPa]")
    found = joint(table, replace(MODEL, units="N, m, kg, s"))
    np.testing.assert_allclose(found.mapped.force, FORCE, rtol=1e-12, atol=1e-6)
    with pytest.warns(SlipstickWarning, match="is in MPa, and the model does not say its units"):
        joint(table)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        ("Node,Mises\n1,2.0\n", {}, "has no column of pressures; its columns are Node, Mises"),
        ("id,CPRESS\n1,2.0\n", {}, "does not say where its pressures are; its columns are id, CPRESS"),
        ("Node,CPRESS\n9001,2.0\n9002,1.0\n", {}, "names nodes (9001, 9002, ...) of which neither surface has any"),
        ("Element,CPRESS\n9001,2.0\n", {}, "names elements (9001, ...) that have no face on either surface"),
        ("x,y,z,p\n0.5,0.5,9.0,1.0\n", {}, "lies at least 8.8 from the surfaces, more than 0.208"),
        ("x,y,z,p\n0.5,0.5,0.2,-1.0\n", {}, "has no pressure above 0: its pressures go from -1 to -1"),
        ("x,y,z,p\n0.5,0.5,0.2,\n", {}, "has no pressure that is a finite number"),
        ("x,y,z,p,area\n0.5,0.5,0.2,1.0,-1.0\n", {}, "has areas below 0"),
        ("x,y,z,p,area\n0.5,0.5,0.2,1.0,0.0\n", {}, "has no area above 0"),
        ("x,y,z,p,area\n0.5,0.5,0.2,1.0,0.0\n0.2,0.5,0.2,0.0,1.0\n", {}, "has no pressure on an area"),
        ("x,y,z,p\n,0.5,0.2,1.0\n", {}, "has places or areas that are no finite numbers"),
        ("x,y,z,p [furlong]\n0.5,0.5,0.2,1.0\n", {"units": "SI"}, "found the unit 'furlong'"),
        ("x,y,z,p\n0.5,0.5,0.2,1.0\n", {"columns": {"pressure": "q"}}, "there is no column 'q'"),
        ("x,y,z,p\n0.5,0.5,0.2,high\n", {}, "p.csv"),
        ("", {}, "p.csv"),
        ("x,y,z,p\n0.5,0.5,0.2,1e200\n", {}, "pressure, p.csv, line 2: p: found 1e+200; expected a number"),
        (
            "x,y,z,p,area\n0.01,0.01,0.2,9.0,1.0\n0.9,0.9,0.2,1.0,0.01\n0.1,0.9,0.2,1.0,0.01\n0.9,0.1,0.2,1.0,0.01\n",
            {"points": 4},
            "has a force and moment that no pressures",
        ),
    ],
)
def test_faults(tmp_path, text, options, said):
    from dataclasses import replace

    (tmp_path / "p.csv").write_text(text)
    model = replace(MODEL, units=options.pop("units", MODEL.units))
    with pytest.raises(InputError) as caught:
        joint(tmp_path / "p.csv", model, **options)
    assert said in str(caught.value)
    assert str(caught.value).startswith("columns" if "columns" in options else "pressure")
    assert str(tmp_path) not in str(caught.value)


def test_other_units_of_length_are_suspected(tmp_path):
    places, areas = grid(8)
    with pytest.raises(InputError, match=r"they span 875, the contact points .*: are they in mm, not m\?"):
        joint(place_table(tmp_path, places, linear(places), areas, scale=1000.0))


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.csv", None, "no such file"),
        ("p.vtu", b"<VTKFile>", "is damaged or not a mesh that meshio reads"),
        ("p.rpt", b"nothing here\n", "holds no table that is understood"),
        ("p.rpt", b"a b c\n1 2 3\n1 2 3 4\n", "has a row of 4 numbers below 3 names"),
        ("p.csv", b"\xff\xfe\x00", "cannot be read as text"),
    ],
)
def test_files_that_are_no_tables(tmp_path, name, content, said):
    if name.endswith("vtu"):
        pytest.importorskip("meshio")
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=said):
        joint(tmp_path / name)


def test_what_is_given_together(tmp_path):
    table = node_table(tmp_path)
    pressed = LAW.changed(gap=-1e-6)
    with pytest.raises(InputError, match="pressure is given together with a gap or normal load of the contact"):
        ss.surface_pair(MODEL, "low.z1", "high.z0", contact=pressed, pressure=table)
    for wrong, said in (
        ({"pressure": 3}, "pressure: found 3; expected the path of a file"),
        ({"columns": 3}, "columns: found 3; expected names of columns"),
        ({"columns": {"pressure": 3}}, "columns, pressure: found 3"),
        ({"columns": {"force": "CPRESS"}}, 'found .force.; expected "x" or "y"'),
    ):
        with pytest.raises(InputError, match=said):
            ss.surface_pair(MODEL, "low.z1", "high.z0", contact=LAW, **{"pressure": table, **wrong})
    with pytest.raises(InputError, match="columns: belongs to a file of pressures"):
        ss.surface_pair(MODEL, "low.z1", "high.z0", contact=LAW, columns={"pressure": "p"})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda x: linear(x) - 1.0e6, "are below 0, down to"),
        (lambda x: np.where(x[:, 0] > 0.9, np.nan, linear(x)), "lacks|no value"),
    ],
)
def test_doubtful_rows_are_told(tmp_path, change, said):
    with pytest.warns(SlipstickWarning, match=said):
        joint(node_table(tmp_path, change))


def test_rows_of_another_joint_are_left_out(tmp_path):
    places, areas = grid(8)
    far = places + np.array([0.0, 0.0, 5.0])
    both = place_table(tmp_path, np.concatenate([places, far]), np.tile(linear(places), 2), np.tile(areas, 2))
    with pytest.warns(
        SlipstickWarning, match="64 of 128 rows of p.csv lie more than 0.208 from the surfaces: left out"
    ):
        found = joint(both)
    np.testing.assert_allclose(found.mapped.force, FORCE, rtol=1e-12, atol=1e-6)


def test_it_can_be_called_for_points_alone(tmp_path):
    pair = joint(node_table(tmp_path))
    surfaces = (MESH.surface("low.z1"), MESH.surface("high.z0"))
    again = mapped_pressure(MODEL, surfaces, pair.points, Path(node_table(tmp_path)), within=0.1)
    np.testing.assert_allclose(again.pressures, pair.mapped.pressures, rtol=1e-14)
