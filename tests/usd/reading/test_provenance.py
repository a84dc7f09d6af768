"""What is told of results that a shot carries."""

import pytest
from calmotion.usd.reading import read_shot
from calmotion.usd.writing import write_result
from performing import result_with
from posed_shots import posed
from pxr import Usd, UsdUtils
from small_shots import write_arm


def with_result(tmp_path, edit=None):
    shot = write_arm(tmp_path / "shot.usda", edit)
    character, animation, provenance = read_shot(str(shot))
    result = result_with(character, animation, {0: 0.1, 1: 0.1})
    return shot, write_result(character, animation, provenance, result, str(tmp_path / "calm.usda"))[1]


def notes(path):
    return [note for note in read_shot(str(path))[0].notes if "results" in note]


@pytest.mark.parametrize("edit", [None, posed], ids=["drives", "bodies"])
def test_results_are_told_once_and_have_all_of_their_prims(tmp_path, edit):
    shot, root = with_result(tmp_path, edit)
    (note,) = notes(root)
    assert "calm.usda" in note and notes(shot) == []


def test_results_of_prims_that_were_renamed_are_told(tmp_path):
    shot, root = with_result(tmp_path)
    shot.write_text(shot.read_text().replace("/Arm/joints", "/Arm/motors").replace('"joints"', '"motors"'))
    _, changed, lost = notes(root)
    assert "another version of shot.usda" in changed
    assert lost.startswith("calm.usda: the shot has no /Arm/joints/") and "1 more" in lost


def test_results_of_a_shot_that_has_changed_since_are_told(tmp_path):
    shot, root = with_result(tmp_path)
    character, animation, provenance = read_shot(str(root))
    again = result_with(character, animation, {0: 0.2})
    root = write_result(character, animation, provenance, again, str(tmp_path / "again.usda"))[1]
    (tmp_path / "calm_root.usda").write_text((tmp_path / "calm_root.usda").read_text() + "\n")
    assert len(notes(root)) == 1  # a root layer of ours that was written anew is no change
    shot.write_text(shot.read_text().replace("endTimeCode = 24", "endTimeCode = 23"))
    _, changed = notes(root)
    assert changed.startswith("again.usda") and "another version of shot.usda" in changed


def test_a_package_of_a_result_and_its_shot_is_no_other_version(tmp_path):
    _, root = with_result(tmp_path)
    assert UsdUtils.CreateNewUsdzPackage(root, str(tmp_path / "both.usdz"))
    assert len(notes(tmp_path / "both.usdz")) == 1


def test_a_flattened_result_says_what_its_curves_are(tmp_path):
    _, root = with_result(tmp_path)
    Usd.Stage.Open(root).Export(str(tmp_path / "flat.usda"))
    (note,) = notes(tmp_path / "flat.usda")
    assert note.startswith("flat.usda") and "flattened" in note
