"""The environment of the converters, and what they say, with scripts in their place."""

import os
import pickle
import stat
import sys
import time
from pathlib import Path

import pytest
from calmotion.errors import ShotError
from calmotion_plugins.robot_import import converters
from calmotion_plugins.robot_import.converters import BrokenMeshes, convert, converter_python
from calmotion_plugins.robot_import.description.descriptions import Description

if os.name == "nt":
    pytest.skip("scripts stand in for the converters", allow_module_level=True)

WRITE = "import os; os.mkdir(arguments[4]); open(arguments[4] + '/r.usda', 'w').write(' '.join(arguments))"


@pytest.fixture
def script(tmp_path):
    """A Python of another environment: it runs these lines with its arguments."""

    def make(lines, name="python"):
        file = tmp_path / "env" / "bin" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"#!{sys.executable}\nimport os, sys\narguments = sys.argv[1:]\n{lines}\n")
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
        return file

    return make


@pytest.mark.parametrize(("kind", "module"), [("urdf", "urdf_usd_converter"), ("mjcf", "mujoco_usd_converter")])
def test_each_kind_has_its_converter_and_packages_are_named(script, tmp_path, kind, module):
    python = script(WRITE)
    robot = Description(str(tmp_path / "r.xml"), kind, {"a": "/b"} if kind == "urdf" else {})
    written, warnings = convert(robot, str(tmp_path / "out"), str(python))
    said = open(written).read()
    assert said.startswith(f"-I -m {module}") and ("--package a=/b" in said) == (kind == "urdf") and warnings == ()


def test_warnings_are_told_and_lost_parts_refused(script, tmp_path):
    robot = Description("r.urdf", "urdf")
    said = [
        "capsule: Invalid (line: 3)",
        "capsule: Invalid (line: 9)",
        "keys are not supported",
        "it was deprecated in 3",
    ]
    harmless = script(f"{WRITE}\nfor text in {said}: print('[Warning] [some.module.function] ' + text)")
    assert convert(robot, str(tmp_path / "out"), str(harmless))[1] == ("capsule: Invalid (2 times)",)
    for number, lost in enumerate(["Failed to convert mesh: m.dae", "Invalid input_path: m.dae could not be parsed"]):
        lossy = script(f"{WRITE}\nfor k in range(5): print('[Warning] [a.b.c] {lost}', file=sys.stderr)")
        with pytest.raises(ShotError, match=lost) as refused:
            convert(robot, str(tmp_path / f"lost{number}"), str(lossy))
        assert refused.value.found.count("m.dae") == 1 and refused.value.found.endswith("2 more")


@pytest.mark.parametrize(
    "lines",
    [
        "print('Error: bad joint'); sys.exit(1)",
        "print('Error: bad joint')",
        "print('Error: bad joint'); print('Element line 3')",
    ],
)
def test_what_a_converter_refuses_is_refused_in_its_words(script, tmp_path, lines):
    with pytest.raises(ShotError, match="bad joint") as refused:
        convert(Description("copy.urdf", "urdf", original="r.urdf"), str(tmp_path / "out"), str(script(lines)))
    assert refused.value.path == "r.urdf"


def test_a_named_environment_must_have_the_converters(script, tmp_path, monkeypatch):
    python = script("sys.exit(0)")
    assert converter_python(str(tmp_path / "env"), print) == converter_python(str(python), print) == str(python)
    monkeypatch.setenv(converters.VARIABLE, str(tmp_path / "env"))
    assert converter_python(None, print) == str(python)
    script("sys.exit('No module named urdf_usd_converter')")
    with pytest.raises(ShotError, match="No module named urdf_usd_converter"):
        converter_python(None, print)


def test_an_environment_is_made_once_with_a_message(script, tmp_path, monkeypatch):
    monkeypatch.delenv(converters.VARIABLE, raising=False)
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))
    ran, told = [], []

    def run(command, **options):
        ran.append(command[1:])
        assert "venv" in command or Path(command[0]).is_relative_to(tmp_path / "cache" / "converters" / "bin")
        if "venv" in command:
            os.makedirs(command[-1])
        return converters.subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(converters.subprocess, "run", run)
    first = converter_python(None, told.append)
    assert converter_python(None, told.append) == first and first.startswith(str(tmp_path / "cache"))
    assert [command[:2] for command in ran] == [["-m", "venv"], ["-I", "-m"]] and len(told) == 1
    assert set(converters.PACKAGES) <= set(ran[1])


def test_a_converter_that_does_not_end_is_stopped(script, tmp_path, monkeypatch):
    monkeypatch.setattr(converters, "LONGEST", 0.5)
    with pytest.raises(ShotError, match="has not ended") as refused:
        convert(Description("r.urdf", "urdf"), str(tmp_path / "out"), str(script("import time; time.sleep(60)")))
    assert refused.value.path == "r.urdf" and refused.value.remedy


def test_an_environment_that_cannot_be_made_is_no_environment(tmp_path, monkeypatch):
    monkeypatch.delenv(converters.VARIABLE, raising=False)
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))

    def fail(command, **options):
        return converters.subprocess.CompletedProcess(command, int("pip" in command), "", "ERROR: no network")

    monkeypatch.setattr(converters.subprocess, "run", fail)
    for _ in range(2):
        with pytest.raises(ShotError, match="no network") as refused:
            converter_python(None, lambda text: None)
        assert "--converters" in refused.value.remedy


def test_without_a_supported_python_it_says_which(monkeypatch, tmp_path):
    monkeypatch.delenv(converters.VARIABLE, raising=False)
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(converters, "_PYTHONS", ((3, 8), (3, 9)))
    monkeypatch.setattr(converters.shutil, "which", lambda name: None)
    with pytest.raises(ShotError, match="Python 3.8 to 3.9"):
        converter_python(None, lambda text: None)


def test_imports_that_begin_at_once_make_one_environment(tmp_path, monkeypatch):
    """The second one removed what the first one was making."""
    from concurrent.futures import ThreadPoolExecutor

    folder, made = tmp_path / "deep" / "environment", []

    def make(place):
        made.append(place)
        place.mkdir()
        time.sleep(0.1)
        (place / "ready").write_text("")

    monkeypatch.delenv(converters.VARIABLE, raising=False)
    monkeypatch.setattr(converters, "environment_folder", lambda: folder)
    monkeypatch.setattr(converters, "_make", make)
    with ThreadPoolExecutor(3) as pool:
        found = list(pool.map(lambda _: converter_python(None, lambda text: None), range(3)))
    assert made == [folder] and len(set(found)) == 1


@pytest.mark.posix
def test_an_environment_that_another_user_can_write_is_made_anew(tmp_path, monkeypatch):
    """It would run what that user puts there."""
    made = []

    def make(place):
        made.append(place)
        place.chmod(0o755)

    monkeypatch.delenv(converters.VARIABLE, raising=False)
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    monkeypatch.setattr(converters, "_make", make)
    folder = tmp_path / "converters"
    folder.mkdir()
    folder.chmod(0o777)
    (folder / "ready").touch()
    for _ in range(2):
        converter_python(None, lambda text: None)
        assert made == [folder]


def test_an_error_travels_between_processes():
    error = BrokenMeshes("robot.urdf", ["a.obj", "b.obj"])
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is BrokenMeshes and back.as_dict() == error.as_dict() and back.files == error.files
