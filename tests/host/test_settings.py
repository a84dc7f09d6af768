import pytest
from calmotion.host import SettingError, merge, read_assignment, read_settings_file


def test_an_assignment_names_operator_property_and_value():
    assert read_assignment("fe.mesh.element_size=5mm") == {"fe.mesh": {"element_size": "5mm"}}


@pytest.mark.parametrize("text", ["element_size=5mm", "fe.mesh.element_size", "=5", ".size=5"])
def test_what_is_not_an_assignment_is_refused(text):
    with pytest.raises(SettingError):
        read_assignment(text)


def test_a_file_has_a_table_for_each_operator(tmp_path):
    file = tmp_path / "settings.toml"
    file.write_text('[fe.mesh]\nelement_size = "5mm"\nsmooth = true\n[usd.write]\nrate = 48\n')
    assert read_settings_file(file) == {"fe.mesh": {"element_size": "5mm", "smooth": True}, "usd.write": {"rate": 48}}


@pytest.mark.parametrize("text", ["element_size = 5\n", "[fe.mesh\n"])
def test_a_wrong_file_is_refused_by_name(tmp_path, text):
    file = tmp_path / "settings.toml"
    file.write_text(text)
    with pytest.raises(SettingError) as refused:
        read_settings_file(file)
    assert refused.value.path == str(file)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(SettingError, match="cannot be read"):
        read_settings_file(tmp_path / "absent.toml")


def test_a_later_setting_beats_an_earlier_one():
    merged = merge([{"a.b": {"x": 1, "y": 1}}, {"a.b": {"y": 2}}])
    assert merged == {"a.b": {"x": 1, "y": 2}}
