"""Bodies that fill slits: where they are, how thick, and where there are none."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.surfaces.slits import slit_fillings


def blocks(gap, tilt=0.0, side=1.0):
    """Two cubes, one above the other, with divided faces."""
    low, high = trimesh.creation.box((1, 1, 1)), trimesh.creation.box((side, side, 1))
    high.apply_transform(trimesh.transformations.rotation_matrix(tilt, (0, 1, 0)))
    high.apply_translation((0.0, 0.0, 0.5 - high.bounds[0, 2] + gap))
    return trimesh.util.concatenate([low, high]).subdivide().subdivide().subdivide()


def fillings(mesh, widest=0.01, sink=1e-3, beside=0.0, least=0.0):
    made = slit_fillings(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64), widest, sink, beside, least)
    return [(trimesh.Trimesh(f.points, f.triangles, process=False), f.width) for f in made]


@pytest.mark.parametrize("gap", [0.0, 1e-9, 5e-3])
def test_both_sides_of_a_slit_get_a_closed_body_that_reaches_into_both(gap):
    made = fillings(blocks(gap))
    assert len(made) == 2
    for body, width in made:
        assert body.is_watertight and width == pytest.approx(gap, abs=1e-12)
        assert body.volume == pytest.approx(gap + 2e-3, rel=1e-9)
        assert body.bounds == pytest.approx(np.array([[-0.5, -0.5, 0.499], [0.5, 0.5, 0.501 + gap]]), abs=1e-12)


def test_a_filling_reaches_beyond_its_side_on_all_edges():
    for body, _ in fillings(blocks(5e-3), beside=0.02):
        assert body.is_watertight
        assert body.bounds[1, :2] == pytest.approx([0.5 + 0.02, 0.5 + 0.02], abs=0.3 * 0.02)
        assert body.volume == pytest.approx((1.0 + 4 * 0.02) * 7e-3, rel=1e-2)
