"""External meshes: every kind of element and of file that comes from CAD and finite-element programs."""

import sys

import meshio
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh import mesh_file as mesh_file_module
from calmotion.mesh import quadratic as cells_module
from calmotion.mesh.quadratic import quadratic_mesh
from calmotion.mesh.repair import closed_solid
from calmotion.mesh.tetrahedra import boundary_triangles, oriented_tets, surface_area, tet_volumes
from calmotion.model import Body, ElasticMaterial, FlexibleSettings, Frame, TetGeometry
from calmotion.tolerance.meshes.options import MeshOptions
from mesher_links import box, link, mesh_body, run

MATERIAL = ElasticMaterial("/Looks/Plastic", 1.8e9, 0.35, 1200.0)


def mesh(file, scale=1.0):
    """The FEMesh of a body whose geometry is a file."""
    rest = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
    body = Body("/Arm/link", rest, None, (), flexible=FlexibleSettings(MATERIAL, mesh_file=str(file), mesh_scale=scale))
    options = MeshOptions(cache=False)
    return mesh_body(body, options)


def bricks(counts=(3, 2, 2), size=(30.0, 20.0, 20.0), shuffle=0):
    """A box of hexahedra, its nodes numbered at random so that no cut is right by accident."""
    axes = [np.linspace(0.0, s, n + 1) for n, s in zip(counts, size, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([n + 1 for n in counts])
    i, j, k = np.meshgrid(*(np.arange(n) for n in counts), indexing="ij")
    shifts = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = np.stack([number[i + a, j + b, k + c].ravel() for a, b, c in shifts], axis=1)
    order = np.random.default_rng(shuffle).permutation(len(points))
    place = np.empty_like(order)
    place[order] = np.arange(len(points))
    return points[order], place[cells]


def wedges():
    points, cells = bricks()
    return points, np.vstack([cells[:, [0, 1, 2, 4, 5, 6]], cells[:, [0, 2, 3, 4, 6, 7]]])


def pyramids():
    """Each brick as six pyramids about its middle."""
    points, cells = bricks()
    middle = len(points) + np.arange(len(cells))
    faces = [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]
    made = np.vstack([np.column_stack([cells[:, face], middle]) for face in faces])
    return np.vstack([points, points[cells].mean(axis=1)]), made


@pytest.mark.parametrize(("kind", "make"), [("hexahedron", bricks), ("wedge", wedges), ("pyramid", pyramids)])
@pytest.mark.parametrize("suffix", ["vtu", "msh", "inp", "bdf"])
def test_volume_elements_are_cut_into_conforming_tetrahedra(tmp_path, kind, make, suffix):
    if (kind, suffix) in (("pyramid", "inp"), ("pyramid", "bdf")):
        pytest.skip("the format has no such element in meshio")
    points, cells = make()
    extra = {"file_format": "gmsh"} if suffix == "msh" else {}
    meshio.Mesh(points, [(kind, cells)]).write(tmp_path / f"link.{suffix}", **extra)
    made = mesh(tmp_path / f"link.{suffix}", 1e-3)
    assert made.quality.volume == pytest.approx(30.0 * 20.0 * 20.0 * 1e-9, rel=1e-6)
    assert (tet_volumes(made.points, made.tets) > 0.0).all()
    # cuts that did not agree would leave faces open inside
    area = surface_area(made.points, boundary_triangles(made.tets))
    assert area == pytest.approx(2.0 * (30.0 * 20.0 * 2.0 + 20.0 * 20.0) * 1e-6, rel=1e-6)
    assert any(f"{len(cells)} elements of type {kind}" in repair for repair in made.quality.repairs)


def tets10(bulge=0.0):
    points, cells = bricks()
    from skfem import MeshHex

    cut = MeshHex(points.T, cells[:, [0, 4, 3, 1, 7, 5, 2, 6]].T).to_meshtet()
    corners, tets = np.ascontiguousarray(cut.p.T), oriented_tets(cut.p.T, cut.t.T)[0]
    whole = quadratic_mesh(corners, tets)
    # scikit-fem: midpoints 01 12 02 03 13 23, as VTK has them
    nodes = whole.nodes.copy()
    nodes[len(corners) :, 1] += bulge
    return nodes, whole.tets


@pytest.mark.parametrize("suffix", ["vtu", "msh", "inp", "bdf"])
def test_quadratic_tetrahedra_give_their_corners_and_curved_ones_are_reported(tmp_path, suffix):
    for bulge in (0.0, 0.5):
        nodes, tets = tets10(bulge)
        extra = {"file_format": "gmsh"} if suffix == "msh" else {}
        meshio.Mesh(nodes, [("tetra10", tets)]).write(tmp_path / f"link.{suffix}", **extra)
        made = mesh(tmp_path / f"link.{suffix}", 1e-3)
        assert len(made.points) == 36 and made.quality.volume == pytest.approx(1.2e-5, rel=1e-6)
        assert any("curved" in repair for repair in made.quality.repairs) == (bulge > 0.0)


@pytest.mark.parametrize("suffix", ["vtu", "msh", "inp", "bdf"])
def test_surfaces_in_files_of_volume_formats_are_filled(tmp_path, suffix):
    points, cells = bricks()
    skin = boundary_triangles(oriented_tets(points, cells_module.tets_of("hexahedron", cells))[0])
    extra = {"file_format": "gmsh"} if suffix == "msh" else {}
    meshio.Mesh(points, [("triangle", skin)]).write(tmp_path / f"link.{suffix}", **extra)
    (surface,), repairs = mesh_file_module.read_mesh_file(str(tmp_path / f"link.{suffix}"), 1e-3, "/Arm/link")
    assert repairs == ()
    assert closed_solid.closed_solid([surface], "/Arm/link").volume == pytest.approx(1.2e-5, rel=1e-6)


def test_quadrilaterals_and_quadratic_faces_become_triangles(tmp_path):
    cut = cells_module.triangles_of
    quad = np.array([[3, 0, 1, 2]])
    assert sorted(map(sorted, cut("quad", quad).tolist())) == [[0, 1, 2], [0, 2, 3]]
    assert np.array_equal(cut("quad8", np.array([[3, 0, 1, 2, 4, 5, 6, 7]])), cut("quad", quad))
    assert cut("triangle6", np.array([[5, 6, 7, 1, 2, 3]])).tolist() == [[5, 6, 7]]


def test_a_volume_goes_before_the_faces_beside_it(tmp_path):
    points, cells = bricks()
    blocks = [("quad", cells[:2, :4]), ("line", cells[:3, :2]), ("hexahedron", cells)]
    meshio.Mesh(points, blocks).write(tmp_path / "link.vtu")
    assert mesh(tmp_path / "link.vtu").quality.volume == pytest.approx(12000.0)


def test_parts_with_nodes_of_their_own_in_one_place_are_merged(tmp_path):
    points, cells = bricks((1, 1, 1), (10.0, 10.0, 10.0))
    apart = np.vstack([points, points + [10.0, 0.0, 0.0]])
    meshio.Mesh(apart, [("hexahedron", np.vstack([cells, cells + 8]))]).write(tmp_path / "two.vtu")
    made = mesh(tmp_path / "two.vtu")
    assert len(made.points) == 12 and made.quality.volume == pytest.approx(2000.0)
    assert any("merged 4 coincident points" in repair for repair in made.quality.repairs)
    apart[8:] += [1.0, 0.0, 0.0]
    meshio.Mesh(apart, [("hexahedron", np.vstack([cells, cells + 8]))]).write(tmp_path / "gap.vtu")
    with pytest.raises(ShotError, match="are not connected"):
        mesh(tmp_path / "gap.vtu")


def test_files_with_nothing_to_mesh_are_refused(tmp_path):
    points, cells = bricks()
    meshio.Mesh(points, [("line", cells[:, :2])]).write(tmp_path / "wires.vtu")
    with pytest.raises(ShotError, match="neither volume elements nor faces") as caught:
        mesh(tmp_path / "wires.vtu")
    assert caught.value.attribute == "calm:flexible:meshFile" and caught.value.found == "line"
    points[cells[0, 0], 1] = np.nan
    meshio.Mesh(points, [("hexahedron", cells)]).write(tmp_path / "nan.vtu")
    with pytest.raises(ShotError, match="not finite"):
        mesh(tmp_path / "nan.vtu")


@pytest.mark.parametrize(
    ("file", "volume"),
    [
        ("exudyn_abaqus/blockC3D4.inp", 4.0),
        ("exudyn_abaqus/blockC3D10.inp", 4.0),
        ("exudyn_abaqus/blockC3D8.inp", 4.0),
        ("exudyn_abaqus/blockC3D20.inp", 4.0),
        ("skfem/beams.msh", None),
    ],
)
def test_decks_of_other_programs_are_read(shared_data, file, volume):
    path = shared_data / "fem" / file
    if not path.is_file():
        pytest.skip("the deck is not here")
    geometry, _ = mesh_file_module.read_mesh_file(str(path), 1.0, "/Arm/link")
    assert isinstance(geometry, TetGeometry)
    made = mesh(path)
    if volume is not None:
        assert made.quality.volume == pytest.approx(volume, rel=1e-6)


def test_a_mesh_file_is_read_in_its_own_unit(host, tmp_path):
    import meshio

    points = 1000.0 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])]).write(tmp_path / "link.vtu")
    (mesh,) = run(host, link(mesh_file=str(tmp_path / "link.vtu"), mesh_scale=1e-3))
    assert mesh.quality.volume == pytest.approx(1.0 / 6.0)


@pytest.mark.parametrize("name", ["link.msh", "link.stl", "link.obj"])
def test_files_of_surfaces_are_filled(host, tmp_path, name):
    import meshio

    cube = box((50.0, 20.0, 20.0))
    extra = {"file_format": "gmsh"} if name.endswith("msh") else {}
    meshio.Mesh(np.array(cube.vertices), [("triangle", np.array(cube.faces))]).write(tmp_path / name, **extra)
    (mesh,) = run(host, link(mesh_file=str(tmp_path / name), mesh_scale=1e-3, element_size=0.01))
    assert mesh.quality.volume == pytest.approx(2e-5, rel=1e-2)


@pytest.mark.parametrize(("name", "text"), [("gone.vtu", None), ("link.msh", "not a mesh"), ("link.xyz", "1 2 3")])
def test_a_mesh_file_that_cannot_be_read_is_refused(host, tmp_path, name, text):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ShotError) as caught:
        run(host, link(mesh_file=str(tmp_path / name)))
    assert caught.value.path == "/Arm/link" and caught.value.attribute == "calm:flexible:meshFile"
    assert name in str(caught.value)


def read(path):
    return mesh_file_module.read_mesh_file(str(path), 1.0, "/Arm/link")


@pytest.mark.parametrize(
    "form", [("gmsh22", False), ("gmsh22", True), ("gmsh", False), ("gmsh", True), ("ansys", True)]
)
def test_meshes_of_all_versions_of_gmsh_and_of_ansys_are_the_same(tmp_path, form):
    points, cells = bricks()
    meshio.write(tmp_path / "link.msh", meshio.Mesh(points, [("hexahedron", cells)]), form[0], binary=form[1])
    geometry, _ = read(tmp_path / "link.msh")
    assert np.abs(tet_volumes(geometry.points, geometry.tets)).sum() == pytest.approx(30.0 * 20.0 * 20.0)


def test_elements_of_two_groups_count_once(tmp_path):
    """Gmsh 2.2 writes an element once for each of its physical groups."""
    points, cells = bricks((1, 1, 1))
    meshio.Mesh(points, [("hexahedron", cells), ("hexahedron", cells)]).write(tmp_path / "link.vtu")
    geometry, told = read(tmp_path / "link.vtu")
    assert len(geometry.tets) == 6 and any("counted 6 elements" in text for text in told)


TET = "*NODE\n1, 0,0,0\n2, 1,0,0\n3, 0,1,0\n4, 0,0,1\n*ELEMENT, TYPE=C3D4\n1, 1,2,3,4\n"
GRIDS = [f"GRID,{k + 1},{{}},{x},{y},{z}\n" for k, (x, y, z) in enumerate(([0.0, 0.0, 0.0], *np.eye(3).tolist()))]
BULK = "BEGIN BULK\n" + "".join(GRIDS) + "CTETRA,1,1,1,2,3,4\nENDDATA\n"
PASSED_OVER = {
    "two parts": (".inp", f"*PART, NAME=A\n{TET}*END PART\n*PART, NAME=B\n{TET}*END PART\n", "several parts"),
    "a part that is moved": (".inp", f"*PART, NAME=A\n{TET}*END PART\n*INSTANCE, PART=A\n 5., 0., 0.\n*END INSTANCE\n",
                             "moves its part"),
    "generated nodes": (".inp", TET + "*NGEN\n1, 4, 1\n", "generates"),
    "cylindrical coordinates": (".inp", TET.replace("*NODE", "*NODE, SYSTEM=C"), "transforms"),
    "coordinate systems": (".bdf", BULK.format(*"2222"), "coordinate systems"),
}  # fmt: skip


@pytest.mark.parametrize("case", PASSED_OVER)
def test_decks_of_which_meshio_passes_something_over_are_refused(tmp_path, case):
    suffix, text, problem = PASSED_OVER[case]
    (tmp_path / f"link{suffix}").write_text(text)
    with pytest.raises(ShotError, match=problem) as caught:
        read(tmp_path / f"link{suffix}")
    assert "Export the part alone" in caught.value.remedy


def test_decks_of_one_part_in_its_place_are_read(tmp_path):
    (tmp_path / "a.inp").write_text(f"*PART, NAME=A\n{TET}*END PART\n*INSTANCE, PART=A\n*END INSTANCE\n")
    (tmp_path / "b.bdf").write_text(BULK.format("", "0", "", "0"))
    for name in ("a.inp", "b.bdf"):
        geometry, _ = read(tmp_path / name)
        assert tet_volumes(geometry.points, geometry.tets) == pytest.approx([1.0 / 6.0])


@pytest.mark.parametrize(
    ("name", "text", "remedy"),
    [("a.step", "ISO-10303-21;", "mesh a CAD file"), ("a.msh", "hello", "cut off, damaged"),
     ("a", "", "without a suffix"), ("a.msh", "$MeshFormat\n3.0 0 8\n$EndMeshFormat\n", "export it again"),
     ("a.med", "x", "h5py")],
)  # fmt: skip
def test_the_remedy_for_a_mesh_says_what_it_lacks(tmp_path, capfd, monkeypatch, name, text, remedy):
    monkeypatch.setitem(sys.modules, "h5py", None)  # as where it is not installed
    (tmp_path / name).write_text(text)
    with pytest.raises(ShotError, match="cannot be read") as caught:
        read(tmp_path / name)
    assert remedy in caught.value.remedy
    assert capfd.readouterr().out == ""  # stdout is for JSON alone


@pytest.mark.parametrize("name", ["link.stl", "link.obj", "link.msh", "link.vtu", "link.ply"])
def test_a_pointer_of_git_lfs_is_no_mesh(host, tmp_path, name):
    (tmp_path / name).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n")
    with pytest.raises(ShotError, match="Git LFS pointer") as caught:
        run(host, link(mesh_file=str(tmp_path / name)))
    assert caught.value.path == "/Arm/link" and caught.value.attribute == "calm:flexible:meshFile"
    assert name in caught.value.found and "git lfs pull" in caught.value.remedy
