"""What holds a solid beside another one: bridges where much of it is near, else struts at both of its ends."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.repair import closing
from calmotion.mesh.sources import bridges as bridges_module
from mesher_links import box

# in units of the size of the body, about
PLATE = box((0.9, 0.4, 0.05))


def joined(rod, how, *rest):
    part = closing.Part
    made, gap = bridges_module.__dict__[how](
        [part(np.array(m.vertices), np.array(m.faces, dtype=np.int64)) for m in (PLATE, rod)], *rest
    )
    return None if made is None else trimesh.Trimesh(made.points, made.triangles, process=False), gap


def rod(tilt=0.0, gap=0.01):
    """A rod above the plate, which one of its ends is near to where it is tilted."""
    made = trimesh.creation.cylinder(0.015, 0.4, sections=24)
    made.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2 - tilt, (0, 1, 0)))
    made.apply_translation((0.0, 0.0, 0.025 + gap - made.bounds[0, 2]))
    return made


@pytest.mark.parametrize(("degrees", "struts"), [(0.0, 2), (8.0, 2), (45.0, 1), (90.0, 1)])
def test_a_rod_gets_a_strut_at_each_end_that_is_not_too_far(degrees, struts):
    above = rod(tilt=np.radians(degrees))
    made, gap = joined(above, "strutted")
    assert made.is_watertight and made.body_count == 1 and gap == pytest.approx(0.01, abs=4e-3)
    # two struts and the rod between them are a ring
    assert made.euler_number == 4 - 2 * struts
    assert made.volume > PLATE.volume + above.volume
