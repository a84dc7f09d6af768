"""An opened shot: its file, also from another working folder, and settings in their three forms."""

import pickle

import calmotion as cm
import pytest
from calmotion import SettingError
from calmotion.workflow.shot import read_settings
from one_hinge import ONE_HINGE


def test_settings_come_as_names_as_tables_and_as_a_file(tmp_path):
    (tmp_path / "s.toml").write_text('[fe.mesh]\nelement_size = "5mm"\n')
    expected = {"fe.mesh": {"element_size": "5mm"}}
    assert read_settings({"fe.mesh.element_size": "5mm"}) == expected
    assert read_settings({"fe.mesh": {"element_size": "5mm"}}) == expected
    assert read_settings(tmp_path / "s.toml") == expected
    assert read_settings(None) == {}


def test_a_name_without_an_operator_is_refused():
    with pytest.raises(SettingError):
        read_settings({"size": 1})


def test_a_result_is_written_of_its_shot_also_from_another_folder(tmp_path, monkeypatch):
    other = tmp_path / "other"
    other.mkdir()
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    (other / "shot.usda").write_text(ONE_HINGE.replace("endTimeCode = 24", "endTimeCode = 12"))
    monkeypatch.chdir(tmp_path)
    result = cm.simulate("shot.usda", step="10ms")
    assert result.shot.path == "shot.usda"
    monkeypatch.chdir(other)
    root = result.write("out.usda").root
    assert result.shot.path == str(tmp_path / "shot.usda")
    assert cm.simulate(root, step="10ms").times[-1] == result.times[-1] == 1.0
    assert cm.simulate("shot.usda", step="10ms").times[-1] == 0.5


def test_what_does_not_travel_between_processes_says_what_does(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    result = cm.simulate(tmp_path / "shot.usda", step="10ms")
    for held in (result, result.shot):
        with pytest.raises(TypeError, match="report\\(\\)"):
            pickle.dumps(held)
    assert pickle.loads(pickle.dumps(result.motion)).times[-1] == 1.0
    assert pickle.loads(pickle.dumps(result.report())) == result.report()
