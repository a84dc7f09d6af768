"""Which joints share a patch, and the balls that patches keep to."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion.mesh.patches.joint_places import nearest_apart
from calmotion.mesh.tetrahedra import boundary_triangles


def test_slender_bodies_tell_near_joints_apart_and_stout_ones_do_not(helpers):
    def apart(length, radius=-1.0):
        points, tets = helpers.box((4, 1, 1), (length, 0.02, 0.02))
        return nearest_apart(points[boundary_triangles(tets)], radius)

    assert 0.002 < apart(0.6) < 0.003  # an eighth of the width
    assert apart(0.02) == pytest.approx(0.05 / 0.45 * 0.02 * np.sqrt(3.0))
    assert apart(0.6, radius=0.01) == pytest.approx(1e-6 * 0.6, rel=0.01)
