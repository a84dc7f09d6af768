"""Opening shots, broken ones too, and telling our own layers."""

import hashlib
import os
import subprocess
import sys

import pytest
from calmotion import ShotError
from calmotion.usd import stages
from pxr import Sdf
from small_shots import write_arm

SPECIAL = """
import sys
from calmotion import ShotError
from calmotion.usd import stages
for path in sys.argv[1:]:
    try:
        stages.open_stage(path)
    except ShotError as error:
        print(error.path, error.found, sep="\t")
"""


@pytest.mark.posix
def test_a_named_pipe_is_refused_wherever_it_is_named(tmp_path):
    pipe = tmp_path / "pipe.usda"
    os.mkfifo(pipe)
    contents = {
        "sublayer.usda": "(\n subLayers = [@./pipe.usda@]\n)",
        "reference.usda": 'def "A" (references = @./pipe.usda@</X>) {}',
        "payload.usda": 'def "A" (payload = @./pipe.usda@) {}',
        "variant.usda": 'def "A" (\nvariantSets = "v"\n) {\nvariantSet "v" = {\n'
        '"x" (\nreferences = @./pipe.usda@\n) {\n}\n}\n}',
        "deep.usda": "(\n subLayers = [@./reference.usda@]\n)",
    }
    for name, text in contents.items():
        (tmp_path / name).write_text(f"#usda 1.0\n{text}\n")
    command = [sys.executable, "-c", SPECIAL, str(pipe), *(str(tmp_path / name) for name in contents), "/dev/null"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    lines = [line.rsplit("\t", 1) for line in done.stdout.splitlines()]
    named = [str(pipe), *(str(tmp_path / n) for n in ("sublayer.usda", "reference.usda", "payload.usda"))]
    named += [str(tmp_path / "variant.usda"), str(tmp_path / "reference.usda"), "/dev/null"]
    assert [path for path, _ in lines] == named, done.stderr
    assert {found for _, found in lines[1:-1]} == {str(pipe)}


def test_a_missing_layer_deep_in_a_reference_names_the_prim_of_the_shot(tmp_path):
    robot = '#usda 1.0\ndef Xform "R"\n{\n def "arm" (references = @./mesh.usd@</M>)\n {\n }\n}\n'
    (tmp_path / "robot.usda").write_text(robot)
    (tmp_path / "shot.usda").write_text('#usda 1.0\ndef Xform "A" (references = @./robot.usda@</R>) {}\n')
    with pytest.raises(ShotError) as caught:
        stages.open_stage(str(tmp_path / "shot.usda"))
    assert caught.value.path.endswith("/arm")
    assert "mesh.usd" in caught.value.found and "robot.usda" in caught.value.found


@pytest.mark.parametrize("arc", ["references", "payload"])
def test_looks_that_usd_cannot_read_are_left_out(tmp_path, arc):
    """Documents of MaterialX, which USD from PyPI does not open, whether they are there or not."""
    (tmp_path / "look.mtlx").write_text('<?xml version="1.0"?>\n<materialx version="1.38"/>\n')
    looks = (
        f'def "Looks" ({arc} = @./look.mtlx@</MaterialX>) {{}}\ndef "More" ({arc} = @./gone.mtlx@</MaterialX>) {{}}\n'
    )
    (tmp_path / "shot.usda").write_text(f'#usda 1.0\n{looks}def Xform "A" {{}}\n')
    assert stages.open_stage(str(tmp_path / "shot.usda")).GetPrimAtPath("/A")


@pytest.mark.parametrize(
    ("content", "remedy"),
    [("Ogawa", "convert it to .usd"), ("version https://git-lfs.github.com/spec/v1\n", "git lfs pull")],
)
@pytest.mark.parametrize("arc", ["references", "sublayers"])
def test_a_file_that_is_there_and_that_usd_cannot_read_is_told_as_that(tmp_path, arc, content, remedy):
    (tmp_path / "mesh.abc").write_text(content)
    text = "(subLayers = [@./mesh.abc@])" if arc == "sublayers" else 'def "A" (references = @./mesh.abc@</M>) {}'
    (tmp_path / "shot.usda").write_text(f"#usda 1.0\n{text}\n")
    with pytest.raises(ShotError) as caught:
        stages.open_stage(str(tmp_path / "shot.usda"))
    assert remedy in caught.value.remedy and "mesh.abc" in caught.value.found


def test_the_file_on_disk_counts_not_what_was_opened_before(tmp_path):
    shot = tmp_path / "shot.usda"
    shot.write_text('#usda 1.0\ndef Xform "Old" {}\n')
    kept = stages.open_stage(str(shot))
    shot.write_text('#usda 1.0\ndef Xform "New" {}\ndef Xform "More" {}\n')
    assert stages.open_stage(str(shot)).GetPrimAtPath("/New")
    del kept


def test_inputs_are_listed_with_their_hashes_the_shot_first(tmp_path):
    write_arm(tmp_path / "[v2] robot.usda")  # brackets, as of a file within a package
    (tmp_path / "shots").mkdir()
    shot = tmp_path / "shots" / "a.usda"
    shot.write_text("#usda 1.0\n(subLayers = [@../[v2] robot.usda@])\n")
    layers = stages.input_layers(stages.open_stage(str(shot)), str(shot))
    assert [layer.path for layer in layers] == ["a.usda", "../[v2] robot.usda"]
    assert layers[0].sha256 == hashlib.sha256(shot.read_bytes()).hexdigest()


def test_a_layer_that_calmotion_wrote_is_recognised_by_its_role_and_refused_as_a_shot(tmp_path):
    layer = Sdf.Layer.CreateNew(str(tmp_path / "ours.usda"))
    layer.customLayerData = {"calmotion": {"role": "curves"}}
    layer.Save()
    assert stages.role_of(layer) == stages.CURVES
    (tmp_path / "root.usda").write_text("#usda 1.0\n(subLayers = [@./ours.usda@])\n")
    found = stages.earlier_layers(stages.open_stage(str(tmp_path / "root.usda")))
    assert [stages.display_name(name, str(tmp_path / "root.usda")) for name in found] == ["ours.usda"]
    with pytest.raises(ShotError, match="written by Calmotion"):
        stages.refuse_result_layer(stages.open_stage(str(tmp_path / "ours.usda")), "ours.usda")


@pytest.mark.parametrize("data", [{}, {"calmotion": "text"}, {"calmotion": {"other": 1}}])
def test_layer_data_of_other_programs_is_ignored(data):
    layer = Sdf.Layer.CreateAnonymous()
    layer.customLayerData = data
    assert stages.role_of(layer) == ""


@pytest.mark.posix
@pytest.mark.parametrize("leads_to", ["gone.usda", "shot.usda", "/nowhere/at/all.usda"])
def test_a_link_to_nothing_is_named_as_such(tmp_path, leads_to):
    os.symlink(leads_to, tmp_path / "shot.usda")
    with pytest.raises(ShotError, match="a symbolic link to a file that does not exist") as caught:
        stages.open_stage(str(tmp_path / "shot.usda"))
    assert caught.value.found == leads_to and "Did you mean" not in caught.value.remedy


def test_a_folder_names_the_shots_in_it(tmp_path):
    with pytest.raises(ShotError, match="this is a folder") as caught:
        stages.open_layer(str(tmp_path))
    assert caught.value.remedy.startswith("Name the .usda")
    for name in ("shot.usda", "shot.png"):
        (tmp_path / name).write_text("")
    with pytest.raises(ShotError, match="this is a folder") as caught:
        stages.open_layer(str(tmp_path))
    assert caught.value.remedy == f"Name the file of the shot: {tmp_path / 'shot.usda'}"
    with pytest.raises(ShotError, match="does not exist") as caught:
        stages.open_layer(str(tmp_path / "shot"))
    assert str(tmp_path / "shot.usda") in caught.value.remedy


def test_a_layer_that_was_opened_and_is_damaged_since_is_refused(tmp_path):
    path = tmp_path / "shot.usda"
    path.write_text('#usda 1.0\ndef Xform "A"\n{\n}\n')
    kept = stages.open_stage(str(path))
    path.write_text('#usda 1.0\n(\n    framesPerSecond = "no"\n)\ndef Xform "A"\n{\n}\n')
    with pytest.raises(ShotError, match="damaged") as caught:
        stages.open_stage(str(path))
    assert caught.value.path == str(path) and "shot.usda:3" in str(caught.value.found)
    del kept
