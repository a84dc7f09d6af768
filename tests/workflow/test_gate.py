"""What must hold before a result is published."""

import json
import shutil

import calmotion as cm
import pytest
from calmotion.model.run import OutputPaths
from one_hinge import ONE_HINGE

STRICT = ONE_HINGE.replace('def Xform "Robot"', 'def PhysicsScene "Scene"\n{\n}\n\ndef Xform "Robot"')


@pytest.fixture(scope="module")
def result_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("result")
    (folder / "shot.usda").write_text(STRICT)
    outputs = OutputPaths(layer=str(folder / "calm.usda"))
    result = cm.optimize(folder / "shot.usda", step="10ms", tolerance="1mm", outputs=outputs)
    cm.write_manifest(result, folder / "calm.manifest.json")
    return folder


@pytest.fixture
def result(result_folder, tmp_path):
    """A copy that a test may change; its manifest."""
    shutil.copytree(result_folder, tmp_path / "copy")
    return tmp_path / "copy" / "calm.manifest.json"


def change(path, **verdict):
    """Change the verdict of a manifest."""
    manifest = json.loads(path.read_text())
    manifest["verdict"] |= verdict
    path.write_text(json.dumps(manifest))


def test_a_good_result_may_be_published_also_from_another_folder(result):
    assert cm.publishing_problems(result) == []


@pytest.mark.parametrize(
    ("verdict", "problem"),
    [
        ({"tolerance_kept": False}, "does not keep the tolerance"),
        ({"tolerance_kept": None}, "does not keep the tolerance"),
        ({"interrupted": True}, "interrupted"),
        ({"improved": False}, "worse than the animated"),
        ({"exceeded_limits": [{"path": "/Robot/Hinge", "quantity": "velocity"}]}, "limits of motors are exceeded"),
    ],
)
def test_a_bad_verdict_is_refused(result, verdict, problem):
    change(result, **verdict)
    (error,) = cm.publishing_problems(result)
    assert problem in error.message() and error.remedy


def test_a_shot_that_has_changed_is_refused(result):
    shot = result.parent / "shot.usda"
    shot.write_text(shot.read_text() + "\n")
    (error,) = cm.publishing_problems(result)
    assert "has changed" in error.message() and error.path == str(shot)


def test_findings_of_the_strict_inspection_are_refused(result):
    shot = result.parent / "shot.usda"
    text = shot.read_text().replace("rel physics:body1 = </Robot/Link>", "rel physics:body1 = </Robot/Gone>")
    shot.write_text(text)
    manifest = json.loads(result.read_text())
    from calmotion.workflow.manifest import sha256_of

    manifest["inputs"][0]["sha256"] = sha256_of(shot)
    result.write_text(json.dumps(manifest))
    assert any("Gone" in str(error) for error in cm.publishing_problems(result))
    assert cm.publishing_problems(result, strict=False) == []
