"""A performance at another tempo in USD: its map, its length, what else moves, and how it is read back."""

import dataclasses

import numpy as np
import pytest
import small_shots as shots
from calmotion.model.curves import held_curve, retimed
from calmotion.model.result import Retimed
from calmotion.model.tempo import TempoReport, TimeMap
from calmotion.usd.reading import read_shot
from calmotion.usd.writing import WriteOptions, write_result
from performing import result_with
from pxr import Sdf, Usd, UsdGeom

LATER = 12  # frames


def with_scene(stage):
    """A camera that flies, a lamp that is switched, a prop on a spline, and a sound."""
    camera = UsdGeom.Xform.Define(stage, "/Camera")
    translate = camera.AddTranslateOp()
    translate.Set((0.0, 0.0, 0.0), 0.0)
    translate.Set((24.0, 0.0, 0.0), 24.0)
    lamp = stage.DefinePrim("/Lamp")
    lit = lamp.CreateAttribute("lit", Sdf.ValueTypeNames.Bool)
    lit.Set(False, 0.0)
    lit.Set(True, 12.0)
    sound = stage.DefinePrim("/Sound", "SpatialAudio")
    sound.CreateAttribute("startTime", Sdf.ValueTypeNames.TimeCode).Set(Sdf.TimeCode(12.0))


@pytest.fixture
def written(tmp_path):
    shot = shots.write_arm(tmp_path / "shot.usda", with_scene)
    character, animation, provenance = read_shot(str(shot))
    times = np.linspace(0.0, 1.0, 30)
    tempo = TimeMap(times, times + LATER / 24.0 * np.sin(0.5 * np.pi * times) ** 2)
    performance = retimed(animation, tempo, np.arange(25 + LATER) / 24.0)
    result = dataclasses.replace(
        result_with(character, performance, {0: 0.1}),
        retimed=Retimed(performance, character, TempoReport(0, 0, (), ())),
    )

    def write(**options):
        return write_result(
            character, animation, provenance, result, str(tmp_path / "calm.usda"), WriteOptions(**options)
        )

    return write, tempo, performance, result


def test_the_performance_is_read_back_with_its_tempo(written):
    write, tempo, performance, result = written
    _, root = write()
    stage = Usd.Stage.Open(root)
    assert stage.GetEndTimeCode() == pytest.approx(24 + LATER)
    pairs = np.array(stage.GetPrimAtPath("/Arm").GetAttribute("calm:retime:map").Get())
    assert pairs == pytest.approx(24.0 * np.stack([tempo.animation, tempo.performance], axis=1))
    _, animation, provenance = read_shot(root)
    assert provenance.end_time_code == pytest.approx(24 + LATER)
    assert animation.frame_times == pytest.approx(performance.frame_times)
    for one, other in zip(animation.tracks, performance.tracks, strict=True):
        assert one.values == pytest.approx(other.values, abs=1e-6)
    end = animation.frame_times[-1]
    for curve, track in zip(result.curves, animation.current, strict=True):  # motors that did not change as well
        assert held_curve(track, end)(animation.frame_times, 0) == pytest.approx(curve.frame_values, abs=1e-6)


def test_cameras_lamps_and_sounds_follow(written):
    write, tempo, _, _ = written
    _, root = write()
    stage = Usd.Stage.Open(root)
    for code in (0.0, 10.0, 20.0, 36.0):
        place = stage.GetPrimAtPath("/Camera").GetAttribute("xformOp:translate").Get(code)
        assert place[0] == pytest.approx(24.0 * tempo.animated(np.array([code / 24.0]))[0], abs=1e-6)
    switched = 24.0 * tempo.performed(np.array([0.5]))[0]
    lit = stage.GetPrimAtPath("/Lamp").GetAttribute("lit")
    assert lit.GetTimeSamples() == pytest.approx([0.0, switched])
    assert stage.GetPrimAtPath("/Sound").GetAttribute("startTime").Get().GetValue() == pytest.approx(switched)


def test_the_scene_may_keep_its_tempo(written):
    layer, _ = written[0](retime_scene=False)
    found = Sdf.Layer.FindOrOpen(layer)
    assert not found.GetPrimAtPath("/Camera") and not found.GetPrimAtPath("/Lamp") and not found.GetPrimAtPath("/Sound")
    assert found.GetAttributeAtPath("/Arm.calm:retime:map")


def test_settings_of_the_tempo_are_read(tmp_path):
    def with_settings(stage):
        prim = stage.GetPrimAtPath("/Arm")
        prim.AddAppliedSchema("CalmRetargetAPI")
        prim.CreateAttribute("calm:retime:slowest", Sdf.ValueTypeNames.Float).Set(1.5)
        prim.CreateAttribute("calm:retime:pinned", Sdf.ValueTypeNames.DoubleArray).Set([24.0, 12.0])

    character, _, _ = read_shot(str(shots.write_arm(tmp_path / "shot.usda", with_settings)))
    tempo = character.retarget.tempo
    assert (tempo.slowest, tempo.fastest, tempo.pinned) == (1.5, 1.0, (0.5, 1.0))
