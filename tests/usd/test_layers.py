"""Atomic writes."""

import os
import subprocess
import sys

import pytest
from calmotion import ShotError
from calmotion.usd.layers import refuse_input_as_output, write_layer
from pxr import Sdf


def small_layer(name: str):
    layer = Sdf.Layer.CreateAnonymous(".usda")
    Sdf.CreatePrimInLayer(layer, f"/{name}")
    return layer


@pytest.mark.parametrize("lost", ["timeCodesPerSecond", "customLayerData"])
def test_a_layer_that_is_opened_again_with_another_rate_or_origin_is_refused(tmp_path, monkeypatch, lost):
    layer = small_layer("A")
    layer.timeCodesPerSecond, layer.customLayerData = 30.0, {"calmotion": {"role": "curves"}}
    write_layer(layer, str(tmp_path / "out.usda"))
    opened = Sdf.Layer.OpenAsAnonymous(str(tmp_path / "out.usda"))
    opened.pseudoRoot.ClearInfo(lost)
    monkeypatch.setattr("pxr.Sdf.Layer.OpenAsAnonymous", lambda path: opened)
    with pytest.raises(ShotError, match=f"{lost} is not what was written"):
        write_layer(layer, str(tmp_path / "other.usda"))


@pytest.mark.parametrize("name", ["out.usda", "out.usdc", "out.usd", "new/folder/out.usda"])
def test_the_written_layer_opens_again_and_no_other_file_is_left(tmp_path, name):
    output = tmp_path / name
    write_layer(small_layer("A"), str(output))
    assert Sdf.Layer.FindOrOpen(str(output)).GetPrimAtPath("/A")
    assert [p.name for p in output.parent.iterdir()] == [output.name]


def test_what_usd_says_of_a_spline_that_it_writes_is_kept_from_the_user(tmp_path):
    """It says so once in a process, hence in one of its own."""
    program = f"""
from calmotion.usd.layers import write_layer
from calmotion.usd.writing.splines import bezier
from calmotion.usd.writing.curves import attribute_spec
from pxr import Sdf
import numpy as np
layer, ends = Sdf.Layer.CreateAnonymous(".usda"), np.array([0.0, 1.0])
attribute_spec(layer, "/A.size", Sdf.ValueTypeNames.Float).SetSpline(bezier(ends, ends, ends, ends, "float"))
write_layer(layer, {str(tmp_path / "out.usda")!r})
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
    assert "spline" in (tmp_path / "out.usda").read_text()


@pytest.mark.parametrize("lost", ["value", "sample", "attribute"])
def test_a_layer_that_is_opened_again_without_a_value_or_a_sample_is_refused(tmp_path, monkeypatch, lost):
    layer = small_layer("A")
    spec = Sdf.AttributeSpec(layer.GetPrimAtPath("/A"), "size", Sdf.ValueTypeNames.Float)
    spec.default = 0.1
    for code in (1.0, 2.0):
        layer.SetTimeSample(spec.path, code, code)
    write_layer(layer, str(tmp_path / "out.usda"))
    opened = Sdf.Layer.OpenAsAnonymous(str(tmp_path / "out.usda"))
    again = opened.GetAttributeAtPath("/A.size")
    if lost == "value":
        again.default = 0.2
    elif lost == "sample":
        opened.EraseTimeSample(again.path, 1.0)
    else:
        opened.GetPrimAtPath("/A").RemoveProperty(again)
    monkeypatch.setattr("pxr.Sdf.Layer.OpenAsAnonymous", lambda path: opened)
    with pytest.raises(ShotError, match="/A.size is not what was written"):
        write_layer(layer, str(tmp_path / "other.usda"))
    assert os.listdir(tmp_path) == ["out.usda"]


def test_a_failed_validation_keeps_the_old_file(tmp_path):
    output = tmp_path / "out.usda"
    write_layer(small_layer("Old"), str(output))
    before = output.read_bytes()

    def refuse(path: str) -> None:
        raise ShotError("not good")

    with pytest.raises(ShotError, match="not good"):
        write_layer(small_layer("New"), str(output), refuse)
    assert output.read_bytes() == before
    assert os.listdir(tmp_path) == ["out.usda"]


def test_an_open_layer_is_not_stale_after_a_write(tmp_path):
    output = str(tmp_path / "out.usda")
    write_layer(small_layer("Old"), output)
    opened = Sdf.Layer.FindOrOpen(output)
    write_layer(small_layer("New"), output)
    assert opened.GetPrimAtPath("/New") and not opened.GetPrimAtPath("/Old")


def test_a_folder_that_cannot_be_written_is_an_error_with_a_remedy(tmp_path):
    blocker = tmp_path / "file"
    blocker.write_text("")
    with pytest.raises(ShotError, match="cannot be written") as caught:
        write_layer(small_layer("A"), str(blocker / "out.usda"))
    assert caught.value.remedy


@pytest.mark.posix
def test_an_input_is_never_an_output(tmp_path):
    shot = tmp_path / "shot.usda"
    shot.write_text("#usda 1.0\n")
    (tmp_path / "link.usda").symlink_to(shot)
    os.link(shot, tmp_path / "hard.usda")
    for name in ("shot.usda", "link.usda", "hard.usda", "../" + tmp_path.name + "/shot.usda"):
        with pytest.raises(ShotError, match="never written"):
            refuse_input_as_output(str(tmp_path / name), [str(shot)])
    refuse_input_as_output(str(tmp_path / "other.usda"), [str(shot)])


@pytest.mark.parametrize("name", ["out.txt", "out", "out.usdz"])
def test_an_output_is_named_like_a_layer(tmp_path, name):
    with pytest.raises(ShotError, match="not named like a USD layer"):
        refuse_input_as_output(str(tmp_path / name), [])
