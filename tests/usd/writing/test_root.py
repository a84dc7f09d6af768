"""Root layers, and results over results."""

import shutil

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model.curves import held_curve
from calmotion.usd import stages
from calmotion.usd.reading import read_shot
from calmotion.usd.writing.root import keeps_earlier_curves, root_path, shot_layers, write_performance, write_root
from pxr import Sdf, Usd
from small_shots import HAND, SHOULDER, TARGET_POSITION, Scale, make_target, write_arm


def layer_of_ours(path, role: str, value: float):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.customLayerData = {"calmotion": {"role": role}}
    prim = Sdf.CreatePrimInLayer(layer, SHOULDER)
    attribute = Sdf.AttributeSpec(prim, TARGET_POSITION, Sdf.ValueTypeNames.Float)
    for frame in range(25):
        layer.SetTimeSample(attribute.path, frame, value)
    layer.Export(str(path))
    return str(path)


def root_over(shot, path, role: str, value: float) -> str:
    """Write a layer of ours and its root layer; returns the root's path."""
    _, _, provenance = read_shot(str(shot))
    return write_root(layer_of_ours(path, role, value), provenance, role)


def first_value(root: str) -> float:
    stage = Usd.Stage.Open(root)
    return stage.GetAttributeAtPath(f"{SHOULDER}.{TARGET_POSITION}").Get(12)


def names(paths) -> list[str]:
    return [str(path).split("/")[-1] for path in paths]


def test_the_root_stands_beside_its_layer_and_can_be_moved_with_the_shot(tmp_path):
    (tmp_path / "here" / "out").mkdir(parents=True)
    shot = write_arm(tmp_path / "here" / "arm.usda")
    root = root_over(shot, tmp_path / "here" / "out" / "calm.usda", stages.CURVES, 5.0)
    assert root == root_path(str(tmp_path / "here" / "out" / "calm.usda")) and root.endswith("calm_root.usda")
    assert list(Sdf.Layer.FindOrOpen(root).subLayerPaths) == ["./calm.usda", "../arm.usda"]
    shutil.move(tmp_path / "here", tmp_path / "there")
    assert first_value(str(tmp_path / "there" / "out" / "calm_root.usda")) == 5.0


def test_new_curves_replace_earlier_ones_and_the_intent_stays(tmp_path):
    shot = write_arm(tmp_path / "arm.usda")
    first = root_over(shot, tmp_path / "one.usda", stages.CURVES, 5.0)
    second = root_over(first, tmp_path / "two.usda", stages.CURVES, 7.0)
    assert names(Sdf.Layer.FindOrOpen(second).subLayerPaths) == ["two.usda", "arm.usda"]
    intent = read_shot(str(shot))[1].tracks
    _, animation, provenance = read_shot(second)
    assert np.array_equal(animation.tracks[0].values, intent[0].values)
    assert np.allclose(animation.current[0].values, np.deg2rad(7.0))
    assert provenance.earlier_layers == ("two.usda",)
    assert not keeps_earlier_curves(provenance)


def test_a_motion_over_a_result_keeps_its_curves(tmp_path):
    shot = write_arm(tmp_path / "arm.usda")
    calm = root_over(shot, tmp_path / "calm.usda", stages.CURVES, 5.0)
    layer = layer_of_ours(tmp_path / "moved.usda", stages.MOTION, 5.0)
    moved = write_root(layer, read_shot(calm)[2], stages.MOTION)
    assert names(Sdf.Layer.FindOrOpen(moved).subLayerPaths) == ["moved.usda", "calm.usda", "arm.usda"]
    assert names(shot_layers(moved, (stages.CURVES, stages.MOTION))) == ["arm.usda"]
    assert names(shot_layers(moved, (stages.MOTION,))) == ["calm.usda", "arm.usda"]


def test_curves_that_were_copied_into_another_shot_are_noticed(tmp_path):
    write_arm(tmp_path / "arm.usda")
    layer_of_ours(tmp_path / "calm.usda", stages.CURVES, 5.0)
    own = tmp_path / "own.usda"
    own.write_text(
        "#usda 1.0\n(\n startTimeCode = 0\n endTimeCode = 24\n timeCodesPerSecond = 24\n metersPerUnit = 1\n"
        " subLayers = [@./calm.usda@, @./arm.usda@]\n)\n"
    )
    _, animation, provenance = read_shot(str(own))
    assert provenance.earlier_layers == ("calm.usda",) and keeps_earlier_curves(provenance)
    assert np.ptp(animation.tracks[0].values) > 0.1 and np.ptp(animation.current[0].values) == 0.0


def test_a_root_that_does_not_compose_is_not_left_behind(tmp_path):
    shot = write_arm(tmp_path / "arm.usda")
    _, _, provenance = read_shot(str(shot))
    with pytest.raises(ShotError):
        write_root(str(tmp_path / "never_written.usda"), provenance, stages.CURVES)
    assert names(tmp_path.iterdir()) == ["arm.usda"]


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001)])
def test_motion_length_and_settings_are_read_back(tmp_path, scale):
    shot = str(write_arm(tmp_path / "arm.usda", lambda stage: make_target(stage, HAND, positionWeight=1.0), scale))
    character, _, provenance = read_shot(shot)
    times = np.arange(40) / 24.0
    values = np.stack([0.3 * times, 0.1 - 0.2 * times**2], axis=1)
    output = str(tmp_path / "below" / "other.usda")
    settings = {"calm:retarget:endpoints": "kept", "calm:retarget:reference": "static"}
    write_performance(output, provenance, character, (times, values), settings)
    again, animation, found = read_shot(output)
    assert animation.frame_times == pytest.approx(times) and found.meters_per_unit == scale.meters
    assert again.retarget.endpoints == "kept" and again.retarget.reference == "static"
    for track, column in zip(animation.tracks, values.T, strict=True):
        np.testing.assert_allclose(held_curve(track, times[-1])(times, 0), column, atol=1e-6)
    assert [layer.path for layer in found.layers] == ["other.usda", "../arm.usda"]


def test_without_a_motion_the_shot_keeps_its_own(tmp_path):
    shot = str(write_arm(tmp_path / "arm.usda"))
    character, animation, provenance = read_shot(shot)
    output = write_performance(str(tmp_path / "other.usda"), provenance, character, None, {})
    again = read_shot(output)[1]
    for one, two in zip(animation.tracks, again.tracks, strict=True):
        np.testing.assert_array_equal(one.values, two.values)
