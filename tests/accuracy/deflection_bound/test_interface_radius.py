"""What joints hold, against what finite elements give them."""

import numpy as np
import pytest
from calmotion.accuracy.deflection_bound.interface_radius import grip_radius
from calmotion.geometry.distances import closest_on_triangles
from calmotion.reduction.interfaces.automatic_patch import automatic_radius
from calmotion.shot import InterfaceSurface
from solids import body_of, box, prism

BAR = box((0.3, 0.04, 0.02))
PLACES = {
    "end of a bar": (BAR, (0.3, 0.02, 0.01)),
    "side of a bar": (BAR, (0.28, 0.02, 0.02)),
    "middle of a bar": (BAR, (0.28, 0.02, 0.01)),
    "plate": (box((0.3, 0.3, 0.005)), (0.28, 0.15, 0.005)),
    "end of a cylinder": (prism(60, 0.02, 0.3), (0.3, 0.0, 0.0)),
    "axis of a cylinder": (prism(60, 0.02, 0.3), (0.29, 0.0, 0.0)),
}


def grip(solid, place, room=0.25, **settings):
    return grip_radius(*solid, body_of(solid, **settings), np.array(place), room)


@pytest.mark.parametrize("solid, place", PLACES.values(), ids=PLACES.keys())
def test_joints_hold_about_as_much_as_finite_elements_give_them(solid, place):
    corners, center = solid[0][solid[1]], np.array(place)
    closest = closest_on_triangles(center, corners)
    expected = automatic_radius(center, corners, closest, np.linalg.norm(closest - center, axis=1), 0.25)
    assert grip(solid, place) == pytest.approx(expected, rel=0.05)


def test_neighbours_share_the_surface():
    assert grip(BAR, (0.28, 0.02, 0.02), room=0.01) == pytest.approx(0.0045)


def test_an_authored_radius_counts():
    assert grip(BAR, (0.28, 0.02, 0.02), interface_radius=0.003) == 0.003
    assert grip(BAR, (0.28, 0.02, 0.01), interface_radius=0.003) is None  # it touches nothing


def test_a_named_surface_counts_where_it_is_smaller():
    points, triangles = box((0.3, 0.006, 0.002))
    body = body_of(BAR)
    named = InterfaceSurface("/S", "/J", points[triangles[[8, 9]]])  # 0.3 by 0.002
    object.__setattr__(body, "interfaces", (named,))
    assert grip_radius(*BAR, body, np.array([0.3, 0.02, 0.01]), 0.25) == pytest.approx(0.003)


def test_a_joint_far_from_the_surface_has_no_interface_patch():
    assert grip(BAR, (0.5, 0.02, 0.01)) is None
