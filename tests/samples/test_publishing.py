"""The example of a publish step: good results become versions, others are refused with the reason."""

import importlib.util
import json

import calmotion as cm
import pytest
from calmotion.model.run import OutputPaths
from one_hinge import ONE_HINGE

pytest.importorskip("pyblish.api")


@pytest.fixture
def step(repository):
    spec = importlib.util.spec_from_file_location(
        "calmotion_publish", repository / "samples" / "publishing" / "calmotion_publish.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def results(tmp_path, monkeypatch):
    folder = tmp_path / "results"
    folder.mkdir()
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    outputs = OutputPaths(layer=str(folder / "shot_calm.usda"))
    result = cm.optimize(tmp_path / "shot.usda", step="10ms", tolerance="1mm", outputs=outputs)
    cm.write_manifest(result, folder / "shot_calm.manifest.json")
    monkeypatch.setenv("CALMOTION_RESULTS", str(folder))
    monkeypatch.setenv("CALMOTION_PUBLISHED", str(tmp_path / "published"))
    return folder


def errors_of(context):
    return [str(result["error"]) for result in context.data["results"] if result["error"]]


def test_a_good_result_becomes_a_new_version_each_time(step, results, tmp_path):
    for number in (1, 2):
        context = step.publish()
        assert errors_of(context) == []
        version = tmp_path / "published" / "shot_calm" / f"v00{number}"
        names = sorted(path.name for path in version.iterdir())
        assert names == ["shot_calm.manifest.json", "shot_calm.usda", "shot_calm_root.usda"]
        assert (version / "shot_calm.usda").read_bytes() == (results / "shot_calm.usda").read_bytes()


def test_a_result_that_misses_its_tolerance_or_was_edited_is_not_published(step, results, tmp_path):
    path = results / "shot_calm.manifest.json"
    manifest = json.loads(path.read_text())
    manifest["verdict"]["tolerance_kept"] = False
    path.write_text(json.dumps(manifest))
    layer = results / "shot_calm.usda"
    layer.write_text(layer.read_text() + "\n")
    (error,) = errors_of(step.publish())
    assert "does not keep the tolerance" in error and "has changed" in error
    assert not (tmp_path / "published").exists()
