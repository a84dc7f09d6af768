"""The tetrahedraliser in a process of its own: what goes wrong there is told."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from mesher_links import box


@pytest.mark.parametrize(
    ("code", "limit", "problem"),
    [
        ("import time; time.sleep(60)", 0.5, "exceeded the time limit"),
        ("import os; os.abort()", 60.0, "exit status -6"),
        ("raise SystemExit('no memory')", 60.0, "no memory"),
    ],
)
def test_a_mesher_that_crashes_or_hangs_takes_only_itself_down(package, monkeypatch, tmp_path, code, limit, problem):
    tetwild = package("tetwild")
    (tmp_path / "tetwild_worker.py").write_text(code)
    monkeypatch.setattr(tetwild, "__file__", str(tmp_path / "tetwild.py"))
    cube = box()
    with pytest.raises(ShotError, match=problem) as caught:
        tetwild.tetrahedralize(np.array(cube.vertices), np.array(cube.faces), 0.01, 1e-3, "/Arm/link", limit, False)
    assert caught.value.path == "/Arm/link" and "elementSize" in caught.value.remedy


@pytest.mark.parametrize("kept", [False, True])
def test_a_mesh_with_a_flat_element_is_made_again(package, monkeypatch, tmp_path, kept):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    tetwild = package("tetwild")
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), np.array([[0, 1, 2, 3]])
    whole = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), flat[1]
    monkeypatch.setattr(tetwild.cache, "cache_key", lambda *arguments: "key")
    if kept:  # by an earlier version
        tetwild.cache.store("key", {"points": flat[0], "tets": flat[1]})
    made = [flat, whole]
    monkeypatch.setattr(tetwild, "_run", lambda *arguments: made.pop(0))
    cube = box()
    for _ in range(2):  # the second time from the cache
        points, _ = tetwild.tetrahedralize(
            np.array(cube.vertices), np.array(cube.faces), 0.01, 1e-3, "/Arm/link", 60.0, True
        )
        assert np.array_equal(points, whole[0]) and not made
