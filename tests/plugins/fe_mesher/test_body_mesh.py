"""Which of a body's surfaces count, and whether the tetrahedra fill them."""

import re

import numpy as np
import pytest
from calmotion.errors import ShotError
from mesher_links import box, link, run, solid, surface


def test_a_body_without_geometry_is_refused(host):
    with pytest.raises(ShotError, match="no geometry") as caught:
        run(host, link())
    assert caught.value.path == "/Arm/link" and caught.value.remedy


def test_an_open_mesh_is_refused_by_its_own_path(host):
    lidless = box()
    lidless.update_faces(np.arange(12) >= 2)
    with pytest.raises(ShotError, match="open surface") as caught:
        run(host, link(surface(lidless, "/Arm/link/shell")))
    assert caught.value.path == "/Arm/link/shell" and "meshFile" in caught.value.remedy


def test_hidden_geometry_stands_in_for_an_open_mesh(host):
    lidless = box()
    lidless.update_faces(np.arange(12) >= 2)
    hull = surface(box(), "/Arm/link/collision", visible=False)
    (mesh,) = run(host, link(surface(lidless, "/Arm/link/shell"), hull, element_size=0.015))
    assert mesh.quality.volume == pytest.approx(8e-5, rel=1e-2)
    assert "/Arm/link/shell" in mesh.quality.repairs[0] and "collision" in mesh.quality.repairs[0]


def test_copies_count_once_and_hidden_geometry_not_at_all(package):
    shown = surface(box(), "/a")
    made = solid(package, shown, surface(box(), "/b"))
    assert made.volume == pytest.approx(8e-5) and made.repairs == ("ignored /b, a copy of /a",)
    body = link(shown, surface(box((1.0, 1.0, 1.0)), "/c", visible=False))
    assert package("body_mesh").solid_of(body, body.surfaces).volume == pytest.approx(8e-5)


def test_tetrahedra_that_do_not_fill_the_surface_are_refused(host, package, monkeypatch):
    small = box((0.19, 0.019, 0.019))
    corners = np.array(small.vertices)
    tets = np.array([[0, 1, 2, 4], [3, 1, 7, 2], [5, 1, 4, 7], [6, 2, 7, 4], [1, 2, 4, 7]], dtype=np.int32)
    calls = []

    def shrunken(points, triangles, size, *rest):
        calls.append(size)
        return corners, tets

    monkeypatch.setattr(package("body_mesh"), "tetrahedralize", shrunken)
    with pytest.raises(ShotError, match="do not fill .* seems to intersect itself"):
        run(host, link(surface(box())))
    assert len(calls) == 3 and calls == sorted(calls, reverse=True)


@pytest.mark.parametrize("size", [1e-4, 1e-9])
def test_elements_that_are_too_many_for_the_limit_are_refused_before_the_mesher_runs(host, package, monkeypatch, size):
    monkeypatch.setattr(package("body_mesh"), "tetrahedralize", lambda *arguments: pytest.fail("meshed"))
    with pytest.raises(ShotError, match="too many") as caught:
        run(host, link(surface(box()), element_size=size))
    assert (caught.value.path, caught.value.attribute) == ("/Arm/link", "calm:flexible:elementSize")
    least = float(re.search(r"at least ([0-9.e-]+) m", caught.value.remedy).group(1))
    monkeypatch.undo()
    shape = package("body_mesh").shape_of(np.array(box().vertices), np.array(box().faces))
    assert package("body_mesh").expected_nodes(shape, 1.1 * least) * package("tetwild")._SECONDS < 300.0
