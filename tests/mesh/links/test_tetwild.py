"""The tetrahedraliser in a process of its own: what goes wrong there is told."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.mesh.tetrahedralize import tetwild as tetwild_module
from mesher_links import box


@pytest.mark.parametrize(
    ("code", "limit", "problem"),
    [
        ("while True: pass", 1.0, "exceeded the limit of processor time"),
        ("import time; time.sleep(600)", 0.1, "does not end"),
        # a busy machine takes longer, but no more processor time
        ("import time; time.sleep(1.5); raise SystemExit('done')", 0.1, "done"),
        ("import os; os.abort()", 60.0, "exit status -6"),
        ("raise SystemExit('no memory')", 60.0, "no memory"),
    ],
)
def test_a_mesher_that_crashes_or_hangs_takes_only_itself_down(monkeypatch, tmp_path, code, limit, problem):
    tetwild = tetwild_module
    (tmp_path / "tetwild_worker.py").write_text(code)
    monkeypatch.setattr(tetwild, "__file__", str(tmp_path / "tetwild.py"))
    # a busy machine takes long for a second
    monkeypatch.setattr(tetwild, "_PATIENCE", 1.0 if problem == "does not end" else 600.0)
    cube = box()
    with pytest.raises(ShotError, match=problem) as caught:
        tetwild.tetrahedralize(
            np.array(cube.vertices), np.array(cube.faces), 0.01, 1e-3, "/Arm/link", tetwild.ProcessorTime(limit), False
        )
    assert caught.value.path == "/Arm/link" and "elementSize" in caught.value.remedy


def test_the_limit_is_that_of_all_meshes_of_a_body():
    tetwild, cube = tetwild_module, box()
    time = tetwild.ProcessorTime(60.0)
    surface = np.array(cube.vertices), np.array(cube.faces)
    spent = [0.0]
    for size in (0.02, 0.019):
        tetwild.tetrahedralize(*surface, size, 1e-3, "/Arm/link", time, False)
        spent.append(time.used)
    assert 0.0 < spent[1] < spent[2] < 60.0
    time.limit = time.used  # what is left is not enough to load the libraries for a fine mesh
    with pytest.raises(ShotError, match="processor time") as caught:
        tetwild.tetrahedralize(*surface, 0.001, 1e-4, "/Arm/link", time, False)
    assert "time_limit=" in caught.value.remedy and "12 triangles" in str(caught.value)


@pytest.mark.parametrize("kept", [False, True])
def test_a_mesh_with_a_flat_element_that_no_move_helps_is_made_again(monkeypatch, tmp_path, kept):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    tetwild = tetwild_module
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]), np.array([[0, 1, 2, 3]])
    whole = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), flat[1]
    monkeypatch.setattr(tetwild, "key_of", lambda *arguments: "-".join(["key", *arguments[3:]]))
    if kept:  # by an earlier version
        tetwild.store_arrays("meshes", "key", {"points": flat[0], "tets": flat[1]})
    made = [flat, whole]
    monkeypatch.setattr(tetwild, "_run", lambda *arguments: made.pop(0))
    cube = box()
    for _ in range(2):  # the second time from the cache
        points, _ = tetwild.tetrahedralize(
            np.array(cube.vertices), np.array(cube.faces), 0.01, 1e-3, "/Arm/link", tetwild.ProcessorTime(60.0), True
        )
        assert np.array_equal(points, whole[0]) and not made


def test_a_surface_has_one_mesh():
    tetwild, cube = tetwild_module, box()
    meshes = [
        tetwild.tetrahedralize(
            np.array(cube.vertices), np.array(cube.faces), 0.01, 1e-3, "/Arm/link", tetwild.ProcessorTime(60.0), False
        )
        for _ in range(2)
    ]
    assert len(meshes[0][1]) > 20
    assert all(np.array_equal(one, other) for one, other in zip(*meshes, strict=True))


def test_a_mesh_that_took_too_long_is_not_tried_again_unless_it_may_take_longer(monkeypatch):
    tetwild, cube, tries = tetwild_module, box(), []

    def run(points, triangles, settings, path, time):
        tries.append(time.limit)
        raise tetwild._out_of_time("12 triangles", path, time)

    monkeypatch.setattr(tetwild, "_run", run)
    for limit in (5.0, 5.0, 4.0, 9.0, 9.0):
        time = tetwild.ProcessorTime(limit)
        with pytest.raises(tetwild.OutOfTime, match="limit of processor time"):
            tetwild.tetrahedralize(np.array(cube.vertices), np.array(cube.faces), 0.01, 1e-3, "/Arm/link", time, True)
    assert tries == [5.0, 9.0]
