"""Files that a shot names in places that are never opened."""

import math
import os

import pytest
import small_shots
from calmotion import ShotError
from calmotion.usd.layers import refuse_input_as_output
from calmotion.usd.reading import read_shot
from calmotion.usd.stages import open_stage
from pxr import Sdf, Vt

PLACES = ("http://host/robot.usda", "file:///robot.usda", "//host/share/robot.usda", "/dev/zero", "/proc/self/mem")


def sublayer(layer, prim, place):
    layer.subLayerPaths.append(place)


def reference(layer, prim, place):
    prim.referenceList.prependedItems.append(Sdf.Reference(place))


def payload(layer, prim, place):
    prim.payloadList.prependedItems.append(Sdf.Payload(place))


def clips(layer, prim, place):
    values = {
        "assetPaths": Sdf.AssetPathArray([Sdf.AssetPath(place)]), "primPath": small_shots.FORE,
        "active": Vt.Vec2dArray([(0.0, 0.0)]), "times": Vt.Vec2dArray([(0.0, 0.0), (24.0, 24.0)]),
    }  # fmt: skip
    prim.SetInfo("clips", {"default": values})


def mesh_file(layer, prim, place):
    Sdf.AttributeSpec(prim, "calm:flexible:meshFile", Sdf.ValueTypeNames.Asset).default = Sdf.AssetPath(place)


@pytest.mark.parametrize("name", [sublayer, reference, payload, clips, mesh_file])
def test_places_of_the_network_and_of_devices_are_refused(tmp_path, name):
    path = small_shots.write_arm(tmp_path / "arm.usda", small_shots.make_flexible)
    for place in PLACES:
        layer = Sdf.Layer.OpenAsAnonymous(str(path))
        name(layer, layer.GetPrimAtPath(small_shots.FORE), place)
        broken = tmp_path / "broken.usda"
        layer.Export(str(broken))
        with pytest.raises(ShotError) as caught:
            read_shot(str(broken))
        assert "not opened" in caught.value.problem and place in str(caught.value.found) and caught.value.remedy


def test_a_clip_inside_a_variant_is_refused(tmp_path):
    path = small_shots.write_arm(tmp_path / "arm.usda")
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    layer.GetPrimAtPath(small_shots.FORE).variantSetNameList.Prepend("level")  # else USD does not look at the set
    choices = Sdf.VariantSetSpec(layer.GetPrimAtPath(small_shots.FORE), "level")
    clips(layer, Sdf.VariantSpec(choices, "high").primSpec, "/dev/zero")
    layer.Export(str(tmp_path / "broken.usda"))
    with pytest.raises(ShotError, match="not opened"):
        read_shot(str(tmp_path / "broken.usda"))


def test_a_clip_that_is_no_usd_file_is_an_error_with_a_remedy(tmp_path):
    path = small_shots.write_arm(tmp_path / "arm.usda")
    (tmp_path / "clip.txt").write_text("no layer")
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    clips(layer, layer.GetPrimAtPath(small_shots.FORE), "./clip.txt")
    layer.Export(str(tmp_path / "broken.usda"))
    with pytest.raises(ShotError) as caught:
        read_shot(str(tmp_path / "broken.usda"))
    assert caught.value.remedy and "clip.txt" in str(caught.value.found)


@pytest.mark.parametrize("name", [sublayer, reference, payload, clips])
def test_layers_that_are_pointers_of_git_lfs_are_refused(tmp_path, name):
    path = small_shots.write_arm(tmp_path / "arm.usda", small_shots.make_flexible)
    pointer = tmp_path / "link.usdc"
    pointer.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n")
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    name(layer, layer.GetPrimAtPath(small_shots.FORE), str(pointer))
    layer.Export(str(tmp_path / "broken.usda"))
    with pytest.raises(ShotError, match="Git LFS pointer") as caught:
        read_shot(str(tmp_path / "broken.usda"))
    assert caught.value.found == str(pointer) and "git lfs pull" in caught.value.remedy


def shot_with(folder, clips: str):
    """A prim in a variant, with one set of clips."""
    clips = f'clips = {{\ndictionary default = {{\n{clips}\nstring primPath = "/A"\n}}\n}}'
    head = 'def "A" (\nvariants = { string v = "a" }\nprepend variantSets = "v"\n)\n'
    body = f'{{\nvariantSet "v" = {{\n"a" (\n{clips}\n) {{\n}}\n}}\n}}\n'
    (folder / "shot.usda").write_text(f"#usda 1.0\n{head}{body}")
    return str(folder / "shot.usda")


def template(start: float, end: float, stride: float) -> str:
    numbers = zip(("StartTime", "EndTime", "Stride"), (start, end, stride), strict=True)
    lines = "\n".join(f"double template{name} = {number!r}" for name, number in numbers)
    return f'string templateAssetPath = "./pipe.#.usda"\n{lines}'


@pytest.mark.parametrize(
    "clips", ["asset[] assetPaths = [@pipe.usda@]", "asset manifestAssetPath = @pipe.usda@", template(0.0, 9.0, 1.0)]
)
def test_a_named_pipe_as_a_value_clip_is_refused(tmp_path, clips):
    for name in ("pipe.usda", "pipe.3.usda"):
        os.mkfifo(tmp_path / name)
    with pytest.raises(ShotError, match="named pipe"):
        open_stage(shot_with(tmp_path, clips))


@pytest.mark.parametrize("numbers", [(0.0, 1e300, 1e-300), (0.0, 1e9, 1.0), (0.0, 1.0, 0.0), (0.0, math.nan, 1.0)])
def test_more_value_clips_than_anybody_has_are_refused(tmp_path, numbers):
    with pytest.raises(ShotError, match="too many files") as error:
        open_stage(shot_with(tmp_path, template(*numbers)))
    assert error.value.path == "/A{v=a}" and error.value.remedy


@pytest.mark.parametrize(
    "clips", ["", "asset[] assetPaths = []", "string templateAssetPath = ''", "int assetPaths = 3"]
)
def test_clips_without_files_are_left_alone(tmp_path, clips):
    assert open_stage(shot_with(tmp_path, clips)).GetPrimAtPath("/A")


@pytest.mark.parametrize("letter", ["\n", "\t", "\x7f"])
def test_an_output_with_a_control_character_is_refused(letter):
    with pytest.raises(ShotError, match="control character") as error:
        refuse_input_as_output(f"a{letter}b.usda", ())
    assert letter not in error.value.path and error.value.remedy
