"""Meshes that were made once are kept, and belong to exactly what they were made of."""

import numpy as np
import pytest
from calmotion.mesh.tetrahedralize import tetwild
from mesher_links import box, link, run, surface


def test_a_mesh_is_made_once_and_then_read_from_the_cache(host, own_cache, monkeypatch):
    body = link(surface(box()), element_size=0.02)
    (first,) = run(host, body)
    (kept,) = own_cache.iterdir()
    monkeypatch.setattr(tetwild, "_run", lambda *arguments: pytest.fail("meshed again"))
    (again,) = run(host, body)
    assert np.array_equal(first.points, again.points) and np.array_equal(first.tets, again.tets)
    kept.write_bytes(b"torn")
    monkeypatch.undo()
    monkeypatch.setenv("CALMOTION_CACHE", str(own_cache.parent))
    (third,) = run(host, body)
    assert third.quality.volume == pytest.approx(first.quality.volume, rel=1e-3)
    assert [path.suffix for path in own_cache.iterdir()] == [".npz"]


def test_a_cache_that_cannot_be_written_is_not_an_error(host, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "file"))
    assert len(run(host, link(surface(box((0.05, 0.02, 0.02))), element_size=0.01))) == 1
