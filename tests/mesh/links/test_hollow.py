"""Hollow parts that are modelled by their outer surfaces."""

import numpy as np
import pytest
import trimesh
from calmotion.errors import ShotError
from calmotion.mesh.sources import hollow
from calmotion.mesh.surfaces.closed_surfaces import boundary_walks
from mesher_links import box, solid, surface


@pytest.fixture
def hollowed():
    return lambda mesh, wall, section="closed": hollow.hollowed(solid(surface(mesh)), wall, section, "/Arm/link")


def test_a_box_has_a_cavity_with_walls_of_the_thickness(hollowed):
    made = hollowed(box((0.2, 0.04, 0.03)), 2e-3)
    assert made.volume == pytest.approx(0.2 * 0.04 * 0.03 - 0.196 * 0.036 * 0.026, rel=1e-7)
    assert boundary_walks(made.triangles) == [] and len(made.triangles) == 24
    assert "wall of 2 mm: 23.6% of the volume" in made.repairs[-1]


def test_a_box_open_at_both_ends_is_a_rectangular_tube(hollowed):
    made = hollowed(box((0.2, 0.04, 0.03)), 2e-3, "tube")
    assert made.volume == pytest.approx(0.2 * (0.04 * 0.03 - 0.036 * 0.026), rel=1e-7)
    assert "open at both ends" in made.repairs[-1]


def test_a_round_bar_becomes_a_round_tube(hollowed):
    bar = trimesh.creation.cylinder(0.02, 0.3, sections=48)
    made = hollowed(bar, 2e-3, "tube")
    polygon = 48 * np.tan(np.pi / 48)  # area of a polygon around a circle of radius one
    outer = 0.02 * np.cos(np.pi / 48)  # radius of the circle inside the polygon
    assert made.volume == pytest.approx(0.3 * polygon * (outer**2 - (outer - 2e-3) ** 2), rel=1e-6)


def test_a_ball_becomes_a_shell(hollowed):
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    made = hollowed(ball, 3e-3)
    assert made.volume == pytest.approx(4.0 / 3.0 * np.pi * (0.05**3 - 0.047**3), rel=5e-3)


def test_a_part_with_thin_ribs_and_small_radii_is_solid_there(hollowed):
    """A block with a rib that is thinner than two walls, and edges rounder than the wall is thick."""
    block = trimesh.creation.capsule(0.06, 0.02, count=[24, 24])
    rib = box((0.002, 0.06, 0.03), at=(0.0, 0.0, 0.03))
    whole = trimesh.boolean.union([block, rib], engine="manifold")
    made = hollowed(whole, 3e-3)
    inner = trimesh.creation.capsule(0.06, 0.017, count=[24, 24])
    expected = whole.volume - inner.volume
    assert made.volume == pytest.approx(expected, rel=0.05)
    assert boundary_walks(made.triangles) == []


def test_a_wall_that_leaves_no_cavity_is_refused(hollowed):
    with pytest.raises(ShotError, match="nowhere thick enough") as caught:
        hollowed(box(), 0.011)
    assert caught.value.attribute == "calm:flexible:wallThickness"
