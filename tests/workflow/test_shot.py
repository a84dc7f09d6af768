"""Settings of an opened shot in their three forms."""

import pytest
from calmotion import SettingError
from calmotion.workflow.shot import read_settings


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
