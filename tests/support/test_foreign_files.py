"""A robot or a table in the place of a shot, a motion or settings is named, with what to do with it."""

import os

import pytest
from calmotion.catalogs.materials import read_materials
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.host.errors import PluginError
from calmotion.host.manifest import FILE_NAME as MANIFEST
from calmotion.host.manifest import read_manifest
from calmotion.host.settings import FILE_NAME as DISABLED
from calmotion.host.settings import configuration_folder, disabled_plugins, read_settings_file
from calmotion.support.foreign_files import forbidden_place, kind_of, read_toml, refuse_lfs_pointers, remedy_for
from calmotion.usd.stages import open_layer

FILES = {
    "robot.urdf": ('<?xml version="1.0"?>\n<!-- made by hand -->\n<robot name="arm">', "urdf"),
    "robot.xml": ('<mujoco model="arm">', "mjcf"),
    "indented.mjcf": ('\n  <mujoco model="arm">', "mjcf"),
    "table.csv": ("time_s,/Robot/Tip.x\n0,1\n", "table"),
    "shot.usda": ("time_s,/Robot/Tip.x\n0,1\n", "table"),
    "dance.bvh": ("HIERARCHY\nROOT hips\n", "bvh"),
    "pointer.usdc": ("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n", "lfs"),
}


@pytest.mark.parametrize("name", FILES)
def test_a_foreign_file_is_named_in_the_remedy(name, tmp_path):
    text, kind = FILES[name]
    path = tmp_path / name
    path.write_text(text)
    assert kind_of(path) == kind
    with pytest.raises(ShotError) as shot:
        open_layer(str(path))
    with pytest.raises(SettingError) as settings:
        read_settings_file(path)
    assert shot.value.remedy == settings.value.remedy == remedy_for(path)


@pytest.mark.parametrize("text", ["", "<html>", "x,y\n", "[fe.mesh]\n"])
def test_other_files_have_no_such_remedy(text, tmp_path):
    path = tmp_path / "file"
    path.write_text(text)
    assert remedy_for(path) is None and remedy_for(tmp_path) is None and remedy_for(tmp_path / "none") is None


FORBIDDEN = ("http://host/a.usda", "HTTPS://host/a.usda", "file:///a.usda", "//host/share/a.usda", "\\\\host\\a.usda",
             "/dev/zero", "/proc/self/mem", "/sys/a", "/dev/../dev/null", "smb:a", "/tmp/../dev/null")  # fmt: skip


@pytest.mark.parametrize("path", FORBIDDEN)
def test_the_network_and_devices_are_forbidden_places(path):
    assert forbidden_place(path)


@pytest.mark.parametrize(
    "path", ["a.usda", "./dev/a.usda", "/home/dev/a.usda", "C:/a.usda", "asset:a", "/dev/shm/a.usda"]
)
def test_files_are_allowed_places(path):
    assert forbidden_place(path) is None


@pytest.mark.posix
def test_a_link_counts_as_what_it_leads_to(tmp_path):
    (tmp_path / "a.usda").symlink_to("/dev/zero")
    assert forbidden_place(str(tmp_path / "a.usda"))


@pytest.mark.parametrize(
    ("name", "content"), [("a.usda", b"#usda 1.0\n"), ("a.usd", b"PXR-USDC\0\0"), ("a.usdz", b"PK\3\4")]
)
def test_a_shot_is_named_everywhere_but_in_the_place_of_a_shot(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert "This is a USD file" in (remedy_for(tmp_path / name) or "")
    assert remedy_for(tmp_path / name, "usd") is None


def test_a_shot_in_the_place_of_settings_needs_no_import(tmp_path):
    (tmp_path / "shot.usda").write_text('#usda 1.0\ndef Xform "Robot" {}\n')
    with pytest.raises(SettingError, match="It needs no import"):
        read_settings_file(tmp_path / "shot.usda")


def test_pointers_of_git_lfs_are_named_four_of_them(tmp_path):
    names = [tmp_path / f"{k}.stl" for k in range(6)]
    for name in names[1:]:
        name.write_text(FILES["pointer.usdc"][0])
    (tmp_path / "mesh.stl").write_text("solid\n")
    refuse_lfs_pointers([names[0], tmp_path / "mesh.stl", tmp_path])
    with pytest.raises(ShotError, match="Git LFS pointer") as refused:
        refuse_lfs_pointers([*names, names[1]], path="robot.urdf", attribute="mesh")
    assert refused.value.path == "robot.urdf" and "git lfs pull" in refused.value.remedy
    assert refused.value.found == f"{', '.join(map(str, names[1:5]))}, and 1 more"


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
