"""Layers over a shot with another motion and other settings: read back as they were meant, in any units."""

import numpy as np
import pytest
from calmotion.model.curves import held_curve
from calmotion.usd.reading.shot import read_shot
from calmotion.usd.writing.root import write_performance
from small_shots import HAND, Scale, make_target, write_arm


@pytest.mark.parametrize("scale", [Scale(), Scale(0.01, 0.001)])
def test_motion_length_and_settings_are_read_back(tmp_path, scale):
    def edit(stage):
        make_target(stage, HAND, positionWeight=1.0)

    shot = str(write_arm(tmp_path / "arm.usda", edit, scale))
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
