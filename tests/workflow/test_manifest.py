"""The manifest of a result: files with hashes, versions, verdict; and what has changed since."""

import json

import calmotion as cm
import pytest
from calmotion.model.run import OutputPaths
from calmotion.workflow.manifest import changed_files, read_manifest, sha256_of
from one_hinge import ONE_HINGE


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    """A folder with a shot of two layers and its result."""
    folder = tmp_path_factory.mktemp("published")
    (folder / "robot.usda").write_text(ONE_HINGE)
    (folder / "shot.usda").write_text(
        "#usda 1.0\n(\n"
        '    defaultPrim = "Robot"\n    endTimeCode = 24\n    kilogramsPerUnit = 1\n    metersPerUnit = 1\n'
        '    startTimeCode = 0\n    timeCodesPerSecond = 24\n    upAxis = "Z"\n    subLayers = [@robot.usda@]\n)\n'
    )
    outputs = OutputPaths(layer=str(folder / "out" / "calm.usda"), csv=str(folder / "out" / "calm.csv"))
    settings = {"retarget.optimize.max_iterations": 5}
    result = cm.optimize(folder / "shot.usda", step="10ms", tolerance="1mm", outputs=outputs, settings=settings)
    return folder, cm.write_manifest(result, folder / "out" / "calm.manifest.json")


def test_a_manifest_names_inputs_outputs_request_and_verdict(published):
    folder, path = published
    manifest = read_manifest(path)
    assert [(row["path"], row["role"]) for row in manifest["inputs"]] == [
        ("../shot.usda", "shot"), ("../robot.usda", "layer of the shot"),
    ]  # fmt: skip
    roles = {row["role"]: folder / "out" / row["path"] for row in manifest["outputs"]}
    assert set(roles) == {"layer", "root layer", "table"} and all(path.exists() for path in roles.values())
    for row in (*manifest["inputs"], *manifest["outputs"]):
        assert row["sha256"] == sha256_of(folder / "out" / row["path"])
    assert manifest["request"]["step"] == 0.01 and manifest["request"]["tolerance"] == 0.001
    assert manifest["request"]["operators"]["retarget.optimize"] == {"max_iterations": 5}
    assert manifest["verdict"]["tolerance_kept"] and manifest["verdict"]["tolerance_m"] == 0.001
    assert manifest["versions"]["calmotion"] == cm.__version__ and "numpy" in manifest["versions"]
    assert changed_files(manifest, folder / "out") == []


@pytest.mark.parametrize(
    ("name", "problem"), [("robot.usda", "layer of the shot has changed"), ("out/calm.csv", "table is missing")]
)
def test_files_that_have_changed_are_named(published, name, problem):
    folder, path = published
    before = (folder / name).read_bytes()
    try:
        if "missing" in problem:
            (folder / name).unlink()
        else:
            (folder / name).write_bytes(before + b"\n")
        (error,) = changed_files(read_manifest(path), folder / "out")
        assert problem in error.message() and error.path.endswith(name.split("/")[-1]) and error.remedy
    finally:
        (folder / name).write_bytes(before)


@pytest.mark.parametrize("text", ["{", "[]", '{"format": 1}', '{"format": 99}', "null"])
def test_what_is_no_manifest_is_refused(tmp_path, text):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(cm.ShotError, match="manifest"):
        read_manifest(tmp_path / "m.json")
    with pytest.raises(cm.ShotError, match="cannot be read"):
        read_manifest(tmp_path / "missing.json")


def test_rows_of_another_kind_are_refused(published, tmp_path):
    manifest = json.loads(open(published[1]).read())
    (tmp_path / "m.json").write_text(json.dumps(manifest | {"outputs": [{"path": 1}]}))
    with pytest.raises(cm.ShotError, match="no manifest"):
        read_manifest(tmp_path / "m.json")


def test_the_command_line_writes_it(calmotion, tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    path = tmp_path / "shot.manifest.json"
    run = calmotion("simulate", tmp_path / "shot.usda", "--step", "10ms", "--manifest", path, "--json", "--quiet")
    assert run.returncode == 0 and json.loads(run.stdout)["manifest"] == str(path)
    assert read_manifest(path)["command"] == "simulate" and read_manifest(path)["outputs"] == []


def test_a_file_of_settings_is_an_input(tmp_path):
    shot, settings = tmp_path / "shot.usda", tmp_path / "settings.toml"
    shot.write_text(ONE_HINGE)
    settings.write_text('["retarget.simulate"]\n')
    result = cm.simulate(cm.open_shot(shot, settings=settings), step="10ms")
    manifest = read_manifest(cm.write_manifest(result, tmp_path / "m.json"))
    assert changed_files(manifest, tmp_path) == []
    settings.write_text('["fe.mesh"]\nelement_size = 0.01\n')
    (error,) = changed_files(manifest, tmp_path)
    assert "file of settings has changed" in error.message()


@pytest.mark.parametrize("name", ["shot.usda", "calm.usda", "calm_root.usda"])
def test_it_is_never_written_over_what_is_read_or_another_output(tmp_path, name):
    shot = tmp_path / "shot.usda"
    shot.write_text(ONE_HINGE)
    result = cm.simulate(shot, step="10ms", outputs=OutputPaths(layer=str(tmp_path / "calm.usda")))
    before = (tmp_path / name).read_bytes()
    with pytest.raises(cm.SettingError, match="overwritten|output"):
        cm.write_manifest(result, tmp_path / name)
    assert (tmp_path / name).read_bytes() == before
