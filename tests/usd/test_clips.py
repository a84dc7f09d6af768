"""Value clips: files that USD would wait for, and templates that ask for more files than anybody has."""

from __future__ import annotations

import math
import os

import pytest
from calmotion import ShotError
from calmotion.usd.layers import refuse_input_as_output
from calmotion.usd.stages import open_stage


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
    "clips",
    ["asset[] assetPaths = [@pipe.usda@]", "asset manifestAssetPath = @pipe.usda@", template(0.0, 9.0, 1.0)],
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
