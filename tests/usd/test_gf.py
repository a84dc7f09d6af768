"""Values survive the way to NumPy and back."""

import numpy as np
from calmotion.usd import gf
from pxr import Gf, Sdf, Vt


def test_a_matrix_maps_the_same_point_on_both_sides():
    value = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(1, 2, 3), 40)) * Gf.Matrix4d().SetTranslate((1, -2, 5))
    point = Gf.Vec3d(0.3, 0.2, -0.7)
    found = gf.matrix(value) @ np.append(gf.vector(point), 1.0)
    assert np.allclose(found[:3], gf.vector(value.Transform(point)), atol=1e-14)
    assert gf.to_matrix(gf.matrix(value)) == value


def test_a_quaternion_has_its_real_part_first():
    assert gf.quaternion(Gf.Quatf(1, 2, 3, 4)).tolist() == [1, 2, 3, 4]


def test_points_and_indices_keep_their_shape():
    points = gf.points(Vt.Vec3fArray([(0, 1, 2), (3, 4, 5)]))
    assert points.dtype == np.float64 and points.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert gf.points(None).shape == (0, 3)
    assert gf.indices(Vt.Vec4iArray([(0, 1, 2, 3)]), 4).tolist() == [[0, 1, 2, 3]]
    assert list(gf.to_points(points)) == [Gf.Vec3f(0, 1, 2), Gf.Vec3f(3, 4, 5)]


def test_arrays_in_layer_metadata_can_be_opened_again(tmp_path):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.customLayerData = {"calmotion": {"names": gf.to_strings(["a", "b"]), "numbers": gf.to_doubles([0.1, 2])}}
    layer.Export(str(tmp_path / "layer.usda"))
    entry = Sdf.Layer.FindOrOpen(str(tmp_path / "layer.usda")).customLayerData["calmotion"]
    assert list(entry["names"]) == ["a", "b"] and list(entry["numbers"]) == [0.1, 2.0]
