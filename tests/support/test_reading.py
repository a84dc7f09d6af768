"""Texts that users name: what is no file is refused at once, in every place that reads one."""

from __future__ import annotations

import os

import pytest
from calmotion import ShotError
from calmotion.catalogs.materials import read_materials
from calmotion.host import SettingError
from calmotion.host.errors import PluginError
from calmotion.host.manifest import FILE_NAME as MANIFEST
from calmotion.host.manifest import read_manifest
from calmotion.host.settings import FILE_NAME as DISABLED
from calmotion.host.settings import configuration_folder, disabled_plugins, read_settings_file
from calmotion.support.foreign_files import read_toml


def disabled(folder):
    environment = {"XDG_CONFIG_HOME": str(folder)}
    place = configuration_folder(environment)
    place.mkdir(parents=True, exist_ok=True)
    (folder / "file").rename(place / DISABLED)
    return disabled_plugins(environment)


def manifest(folder):
    (folder / "file").rename(folder / MANIFEST)
    return read_manifest(folder)


READERS = {
    "settings": lambda folder: read_settings_file(folder / "file"),
    "disabled plugins": disabled,
    "a manifest": manifest,
    "materials": lambda folder: read_materials(folder / "file"),
}


@pytest.mark.parametrize("name", READERS)
def test_a_named_pipe_is_refused(tmp_path, name):
    os.mkfifo(tmp_path / "file")
    with pytest.raises((SettingError, PluginError, ShotError)) as error:
        READERS[name](tmp_path)
    assert "named pipe" in error.value.message()


@pytest.mark.parametrize("name", READERS)
def test_values_that_are_nested_too_deeply_are_refused(tmp_path, name):
    (tmp_path / "file").write_text("a = " + 100_000 * "[")
    with pytest.raises((SettingError, PluginError, ShotError)) as error:
        READERS[name](tmp_path)
    assert "nested" in error.value.message()


def test_a_table_is_read(tmp_path):
    (tmp_path / "file").write_text('["é"]\na = 1\n', encoding="utf-8")
    assert read_toml(tmp_path / "file") == {"é": {"a": 1}}
    (tmp_path / "of_windows.toml").write_bytes(b"\xef\xbb\xbf[fe.mesh]\r\nsize = 1\r\n")
    assert read_toml(tmp_path / "of_windows.toml") == {"fe": {"mesh": {"size": 1}}}
