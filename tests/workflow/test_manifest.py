"""The manifest of a result: files with hashes, versions, verdict; and what has changed since."""

import json
import shutil

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
    manifest["inputs"][0]["sha256"] = sha256_of(shot)
    result.write_text(json.dumps(manifest))
    assert any("Gone" in str(error) for error in cm.publishing_problems(result))
    assert cm.publishing_problems(result, strict=False) == []
