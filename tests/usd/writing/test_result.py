"""Layers that are written: what they hold, that they read back, and that nothing else is touched."""

import dataclasses
import hashlib

import numpy as np
import pytest
import small_shots as shots
from calmotion import ShotError
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import RunSettings, simulate_shot
from calmotion.usd.reading import read_shot
from calmotion.usd.writing import WriteOptions, write_result
from performing import curves_of, performed, tracks_of
from pxr import Sdf, Usd, UsdGeom


@dataclasses.dataclass
class Written:
    shot: object
    character: object
    animation: object
    provenance: object
    result: object

    def write(self, name="calm.usda", **options):
        folder = self.shot.parent
        return write_result(
            self.character, self.animation, self.provenance, self.result, str(folder / name), WriteOptions(**options)
        )


def with_curves(character, animation, result):
    """A result whose shoulder curve changed by a bump, and whose elbow did not."""
    curves = curves_of(animation, {0: 0.1})
    return dataclasses.replace(
        result, after=result.before, curves=curves, objective_after=0.0,
        performed=performed(character, animation, tracks_of(animation, curves)),
    )  # fmt: skip


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("writing")
    shot = shots.write_arm(folder / "shot.usda")
    character, animation, provenance = read_shot(str(shot))
    result = simulate_shot(
        compile_shot(character, animation, None), RunSettings(step=1 / 120), lambda fraction, message: None
    )
    return shot, character, animation, provenance, result


@pytest.fixture
def optimised(simulated, tmp_path):
    _, character, animation, _, result = simulated
    shot = shots.write_arm(tmp_path / "shot.usda")
    _, _, provenance = read_shot(str(shot))
    return Written(shot, character, animation, provenance, with_curves(character, animation, result))


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def test_only_changed_motors_are_written_and_the_shot_is_not_touched(optimised):
    before = digest(optimised.shot)
    layer_path, _ = optimised.write()
    assert digest(optimised.shot) == before
    layer = Sdf.Layer.FindOrOpen(layer_path)
    names = []
    layer.Traverse(Sdf.Path.absoluteRootPath, lambda path: names.append(str(path)) if path.IsPropertyPath() else None)
    assert names == [f"{shots.SHOULDER}.{shots.TARGET_POSITION}"]
    samples = layer.ListTimeSamplesForPath(names[0])
    assert samples == list(range(shots.FRAMES + 1))


def test_root_layer_opens_and_reads_back_as_intent_and_current(optimised):
    _, root = optimised.write()
    character, animation, provenance = read_shot(root)
    for track, meant in zip(animation.tracks, optimised.animation.tracks, strict=True):
        assert np.array_equal(track.values, meant.values)
    curve = optimised.result.curves[0]
    assert np.abs(animation.current[0].values - curve.frame_values).max() < 1e-6
    assert np.array_equal(animation.current[1].values, animation.tracks[1].values)
    assert provenance.earlier_layers and len(character.motors) == 2


def test_root_layer_has_units_and_time_and_relative_paths_of_its_layers(optimised):
    _, root = optimised.write()
    layer = Sdf.Layer.FindOrOpen(root)
    assert [path.lstrip("./") for path in layer.subLayerPaths] == ["calm.usda", "shot.usda"]
    stage = Usd.Stage.Open(root)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, float(shots.FRAMES))
    assert stage.GetTimeCodesPerSecond() == shots.RATE and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and layer.defaultPrim == "Arm"


def test_metadata_contain_version_hashes_and_errors(optimised):
    layer_path, _ = optimised.write()
    data = Sdf.Layer.FindOrOpen(layer_path).customLayerData["calmotion"]
    assert data["version"] and list(data["sha256"]) == [digest(optimised.shot)]
    assert list(data["errors"]["targets"]) == [target.path for target in optimised.character.targets]
    assert len(data["errors"]["max_error_before_m"]) == len(optimised.character.targets)


def test_denser_samples_follow_the_same_curve(optimised):
    layer_path, _ = optimised.write(samples_per_second=96.0)
    layer = Sdf.Layer.FindOrOpen(layer_path)
    path = f"{shots.SHOULDER}.{shots.TARGET_POSITION}"
    assert len(layer.ListTimeSamplesForPath(path)) == 4 * shots.FRAMES + 1
    at_frames = [layer.QueryTimeSample(path, frame) for frame in range(shots.FRAMES + 1)]
    assert np.abs(np.deg2rad(at_frames) - optimised.result.curves[0].frame_values).max() < 1e-6


def test_baked_motors_move_the_bodies_as_the_new_curves_say(optimised):
    _, root = optimised.write(bake="motors")
    stage = Usd.Stage.Open(root)
    for frame in (0, 7, 24):
        world = np.array(UsdGeom.XformCache(frame).GetLocalToWorldTransform(stage.GetPrimAtPath(shots.UPPER)))
        angle = optimised.result.curves[0].frame_values[frame]
        # the hinge is y: x turns towards -z
        assert world[0, :3] == pytest.approx([np.cos(angle), 0.0, -np.sin(angle)], abs=1e-6)


def test_baked_simulation_is_the_predicted_motion(simulated, tmp_path):
    _, character, animation, _, result = simulated
    shot = shots.write_arm(tmp_path / "shot.usda")
    _, _, provenance = read_shot(str(shot))
    _, root = Written(shot, character, animation, provenance, result).write("moved.usda")
    stage = Usd.Stage.Open(root)
    motion = result.before.motion
    frames = np.searchsorted(motion.times, animation.frame_times - 1e-9)
    for frame in (0, 11, 24):
        for index, body in enumerate(character.bodies):
            world = np.array(UsdGeom.XformCache(frame).GetLocalToWorldTransform(stage.GetPrimAtPath(body.path)))
            assert world[3, :3] == pytest.approx(motion.positions[frames[frame], index], abs=1e-9)


def test_an_input_is_never_the_output(optimised):
    before = digest(optimised.shot)
    with pytest.raises(ShotError):
        optimised.write("shot.usda")
    assert digest(optimised.shot) == before


def test_a_folder_that_cannot_be_made_leaves_no_file(optimised):
    (optimised.shot.parent / "taken").write_text("a file where a folder should be")
    with pytest.raises(ShotError) as error:
        write_result(
            optimised.character, optimised.animation, optimised.provenance, optimised.result,
            str(optimised.shot.parent / "taken" / "calm.usda"),
        )  # fmt: skip
    assert "taken" in str(error.value) and error.value.remedy
    assert sorted(path.name for path in optimised.shot.parent.iterdir()) == ["shot.usda", "taken"]


def test_writing_again_replaces_the_old_result(optimised):
    first, _ = optimised.write()
    size = digest(optimised.shot.parent / "calm.usda")
    second, _ = optimised.write()
    assert first == second and digest(optimised.shot.parent / "calm.usda") == size
