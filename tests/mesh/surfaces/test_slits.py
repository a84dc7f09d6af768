"""Bodies that fill slits: where they are, how thick, and where there are none."""

import numpy as np
import pytest
import trimesh
from calmotion.mesh.surfaces.slits import slit_fillings, slit_widths


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


def test_wider_gaps_and_corners_have_no_fillings():
    assert fillings(blocks(0.02)) == []
    assert fillings(trimesh.creation.box((1, 1, 1)).subdivide()) == []
    assert fillings(blocks(0.0, tilt=np.radians(45.0))) == []


def test_a_slit_that_opens_is_filled_to_the_limit_and_the_filling_follows_the_other_side():
    mesh = blocks(0.0, tilt=np.radians(2.0))
    below, width = max(fillings(mesh), key=lambda made: made[0].bounds[1, 2])
    extent = 0.01 / np.tan(np.radians(2.0))
    assert below.extents[0] == pytest.approx(extent, abs=0.13) and 0.005 < width <= 0.01
    x = below.vertices[below.vertices[:, 2] > 0.5]
    edge = mesh.vertices[mesh.vertices[:, 2] > 0.4999][:, 0].max()
    assert np.isfinite(edge) and x[:, 2].max() - 0.5 > 0.005


def test_only_the_part_that_faces_another_side_counts_and_small_ones_do_not():
    made = fillings(blocks(5e-3, side=0.5))
    assert [body.extents[:2] == pytest.approx([0.5, 0.5], abs=0.13) for body, _ in made] == [True, True]
    assert fillings(blocks(5e-3, side=0.5), least=0.5) == []
    assert len(fillings(blocks(5e-3, side=0.5), least=0.2)) == 2


def test_a_filling_reaches_beyond_its_side_on_all_edges():
    for body, _ in fillings(blocks(5e-3), beside=0.02):
        assert body.is_watertight
        assert body.bounds[1, :2] == pytest.approx([0.5 + 0.02, 0.5 + 0.02], abs=0.3 * 0.02)
        assert body.volume == pytest.approx((1.0 + 4 * 0.02) * 7e-3, rel=1e-2)


def test_a_hole_thinner_than_the_limit_has_no_filling_that_turns_over():
    hole = trimesh.creation.cylinder(0.004, 2.0, sections=12)
    for body, _ in fillings(trimesh.creation.box((1, 1, 1)).difference(hole)):
        assert body.volume > 0.0


def test_what_faces_another_side_within_the_width():
    mesh = blocks(5e-3, side=0.5)
    x = np.array(mesh.triangles)
    middle, normal = x.mean(axis=1), np.array(mesh.face_normals)
    faced = np.isfinite(slit_widths(middle, normal, x, 0.01))
    under = (np.abs(middle[:, 2] - 0.5) < 0.01) & (np.abs(middle[:, :2]).max(axis=1) < 0.25)
    assert np.array_equal(faced, under) and faced.any()
    assert not np.isfinite(slit_widths(middle, normal, x, 4e-3)).any()
