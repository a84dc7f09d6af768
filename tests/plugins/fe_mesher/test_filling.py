"""A limit of time or a thin connection gives a worse mesh with a message, never none."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from calmotion.errors import ShotError
from mesher_links import box, link, run, surface


def test_a_mesh_that_takes_too_long_is_made_again_with_larger_elements(host, package, monkeypatch):
    filling, sizes = package("filling"), []
    make = filling.tetrahedralize

    def slow(points, triangles, size, envelope, path, time, use_cache):
        sizes.append((size, time.limit))
        if len(sizes) == 1:
            raise package("tetwild").OutOfTime("took too long", path=path)
        return make(points, triangles, size, envelope, path, time, use_cache)

    monkeypatch.setattr(filling, "tetrahedralize", slow)
    (mesh,) = run(host, link(surface(box()), element_size=0.02), time_limit=50.0)
    assert sizes[1][0] == pytest.approx(1.6 * sizes[0][0])
    # the first one may not use all the time
    assert sizes[0][1] == pytest.approx(30.0) and sizes[1][1] == pytest.approx(50.0)
    assert any("1.6 times as large" in text for text in mesh.quality.repairs)
    assert mesh.quality.volume == pytest.approx(8e-5, rel=1e-2) and mesh.quality.frequency_error > 0.0


def test_a_coarser_mesh_that_takes_too_long_as_well_is_an_error(host, package, monkeypatch):
    def stuck(points, triangles, size, envelope, path, time, use_cache):
        raise package("tetwild").OutOfTime("took too long", path=path)

    monkeypatch.setattr(package("filling"), "tetrahedralize", stuck)
    with pytest.raises(ShotError, match="too long"):
        run(host, link(surface(box())))


@pytest.mark.parametrize(("size", "lost"), [(0.01, True), (0.05, False)])
def test_small_parts_that_hang_on_nothing_are_left_out(host, package, monkeypatch, size, lost):
    """As where the mesh did not follow a thread of a hundredth of a millimetre between two parts."""
    filling, mesh_of = package("filling"), package("filling").tetrahedralize

    def with_part(points, triangles, *rest):
        made, tets = mesh_of(points, triangles, *rest)
        corner = size * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]) + [0.0, 0.1, 0.0]
        return np.vstack([made, corner]), np.vstack([tets, len(made) + np.arange(4)]).astype(np.int32)

    monkeypatch.setattr(filling, "tetrahedralize", with_part)
    body = link(surface(box()), element_size=0.02)
    if lost:
        (mesh,) = run(host, body)
        assert mesh.quality.volume == pytest.approx(8e-5, rel=1e-2) and mesh.points[:, 1].max() < 0.05
        assert any("loose parts" in text for text in mesh.quality.repairs)
    else:
        with pytest.raises(ShotError, match="not connected|do not fill"):
            run(host, body)


def test_separate_solids_are_joined_by_struts_where_all_else_fails(package):
    parts = surface(box(), "/a"), surface(box(at=(0.0, 0.05, 0.0)), "/b")
    with pytest.raises(ShotError, match="do not touch"):
        package("repair").closed_solid(parts, "/Arm/link")
    body = link(*parts)
    made = package("sources.choice").solid_of(body, body.surfaces)
    assert trimesh.Trimesh(made.points, made.triangles).body_count == 1
    assert 1.6e-4 < made.volume < 1.7e-4
    assert any("struts across gaps of up to 30 mm" in text for text in made.repairs)
