"""Motion of a patch."""

import numpy as np
from calmotion.reduction.elements.rigid_patch import rigid_patch
from scipy.spatial.transform import Rotation


def test_it_is_a_small_rigid_motion_about_the_center():
    rng = np.random.default_rng(0)
    nodes, center, move, turn = rng.normal(size=(9, 3)), rng.normal(size=3), rng.normal(size=3), rng.normal(size=3)
    e = 1e-6
    moved = center + e * move + Rotation.from_rotvec(e * turn).apply(nodes - center)
    assert np.allclose(rigid_patch(nodes, center) @ np.concatenate([move, turn]), (moved - nodes) / e, atol=1e-4)
