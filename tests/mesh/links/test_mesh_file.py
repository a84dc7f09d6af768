"""Bodies whose geometry is a file: in its own unit, filled where it is a surface, refused where it cannot be read."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from mesher_links import box, link, run


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


@pytest.mark.parametrize("name", ["link.stl", "link.obj", "link.msh", "link.vtu", "link.ply"])
def test_a_pointer_of_git_lfs_is_no_mesh(host, tmp_path, name):
    (tmp_path / name).write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n")
    with pytest.raises(ShotError, match="Git LFS pointer") as caught:
        run(host, link(mesh_file=str(tmp_path / name)))
    assert caught.value.path == "/Arm/link" and caught.value.attribute == "calm:flexible:meshFile"
    assert name in caught.value.found and "git lfs pull" in caught.value.remedy
