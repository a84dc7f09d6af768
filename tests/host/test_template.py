"""A new plugin works from the start."""

import subprocess
import sys
import tomllib

import pytest
from calmotion.host import PluginError
from calmotion.host.template import write_template
from calmotion.testing import check_plugin
from one_hinge import ONE_HINGE


def test_a_new_plugin_keeps_to_the_rules(tmp_path):
    folder = write_template("speed_watch", tmp_path)
    assert check_plugin(folder / "speed_watch") == []
    project = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["calmotion.plugins"] == {"speed_watch": "speed_watch"}


def test_its_test_passes_with_the_fixtures_that_come_with_calmotion(calmotion, repository, tmp_path):
    done = calmotion("plugins", "new", "speed_watch", "--folder", tmp_path)
    assert done.returncode == 0 and "pip install" in done.stdout
    environment = {"PYTHONPATH": str(repository / "pipeline"), "PATH": "/usr/bin:/bin"}
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "."]
    ran = subprocess.run(command, cwd=tmp_path / "speed_watch", env=environment, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout
    assert "2 passed" in ran.stdout


def test_it_runs_by_its_name_and_reports_its_results(calmotion, tmp_path):
    calmotion("plugins", "new", "speed_watch", "--folder", tmp_path)
    shot = tmp_path / "shot.usda"
    shot.write_text(ONE_HINGE)
    done = calmotion(
        "inspect", shot, "--plugins", tmp_path / "speed_watch", "--run", "speed_watch.report",
        "--set", "speed_watch.report.share=0.5",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "a second at most" in done.stderr
    wrong = calmotion("inspect", shot, "--plugins", tmp_path / "speed_watch", "--run", "speed_watch.repor")
    assert wrong.returncode == 2 and "Did you mean speed_watch.report?" in wrong.stderr


@pytest.mark.parametrize("name", ["Speed", "1x", "a-b", ""])
def test_a_wrong_name_is_refused(tmp_path, name):
    with pytest.raises(PluginError, match="not a valid name for a plugin"):
        write_template(name, tmp_path)


def test_nothing_is_written_over(tmp_path):
    write_template("speed_watch", tmp_path)
    with pytest.raises(PluginError, match="exists already"):
        write_template("speed_watch", tmp_path)


def test_a_plugin_that_cannot_be_written_leaves_no_half_of_it(tmp_path, monkeypatch):
    write, count = type(tmp_path).write_text, []

    def full(path, *arguments, **more):
        count.append(path)
        if len(count) == 3:
            raise OSError(28, "No space left on device")
        return write(path, *arguments, **more)

    monkeypatch.setattr(type(tmp_path), "write_text", full)
    with pytest.raises(PluginError, match="cannot be made"):
        write_template("speed_watch", tmp_path)
    assert len(count) == 3 and list(tmp_path.iterdir()) == []
    write_template("speed_watch", tmp_path)
    with pytest.raises(PluginError, match="exists already"):
        write_template("speed_watch", tmp_path)
