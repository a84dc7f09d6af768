"""The guide for authors of plugins, followed word by word: its commands, in its order, in an empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

GUIDE = Path(__file__).resolve().parents[1] / "docs" / "writing_a_plugin.md"
INTERFACE = GUIDE.parent / "reference" / "plugins.md"


def commands() -> str:
    """The shell blocks of the guide, one after the other."""
    return "\n".join(re.findall(r"```sh\n(.*?)```", GUIDE.read_text(), re.DOTALL))


def test_the_guide_names_what_there_is(calmotion):
    from calmotion.host import Operator, RunContext

    text = INTERFACE.read_text()
    for name in ("idname", "label", "requires", "uses", "provides", "properties", "poll", "execute"):
        assert f"`{name}" in text and hasattr(Operator, name)
    for name in ("get", "progress", "report"):
        assert f"context.{name}(" in text and hasattr(RunContext, name)
    listed = calmotion("plugins", "list").stdout
    steps = [line.split("|")[2] for line in text.splitlines() if line.startswith("| `") and line.count("|") == 4]
    idnames = [name for step in steps for name in re.findall(r"`([a-z]+\.[a-z]+)`", step)]
    assert len(idnames) > 5 and all(f"    {name}  " in listed for name in idnames)


def test_the_command_of_the_guide_runs(calmotion, make_plugin, monkeypatch):
    import calmotion.cli as shared

    page = INTERFACE.read_text().split("## A command of the command line")[1].split("\n## ")[0]
    names = re.findall(r"`(\w+)", page.split("| --- | --- |")[1].split("\n\n")[0])
    assert len(names) > 15 and set(names) - {"arguments", "console", "report"} <= set(shared.__all__) | {"show"}
    entry, source = (re.search(rf"```{language}\n(.*?)```", page, re.DOTALL)[1] for language in ("toml", "python"))
    folder = make_plugin("speed_watch", "def register(host): ...\ndef unregister(host): ...\n")
    (folder / "command.py").write_text(source)
    manifest = folder / "plugin.toml"
    manifest.write_text(f"{manifest.read_text()}\n{entry}")
    monkeypatch.setenv("CALMOTION_PLUGINS", str(folder))
    assert calmotion("speed", "a.usda", "--json").stdout.split() == ["{", '"shot":', '"a.usda"', "}"]
    assert "list the fastest moments of a shot" in calmotion("--help").stdout


@pytest.mark.long
def test_the_guide_leads_from_an_empty_folder_to_an_installed_wheel(repository, tmp_path):
    wheels = tmp_path / "wheels"
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", wheels, repository],
        check=True,
        timeout=600,
    )
    (wheel,) = wheels.glob("calmotion-*.whl")
    work = tmp_path / "work"
    work.mkdir()
    script = (
        commands()
        .replace("pip install /path/to/checkout ", f"pip install {wheel} ")
        .replace("python3 -m venv", f"{sys.executable} -m venv")
    )
    hidden = ("PYTHONPATH", "VIRTUAL_ENV", "CALMOTION_PLUGINS")
    environment = {key: value for key, value in os.environ.items() if key not in hidden}
    environment["CALMOTION_CONFIG"] = str(tmp_path / "config")
    # the build takes what it needs from the environment's index, as pip does
    done = subprocess.run(
        ["bash", "-e", "-c", script], cwd=work, env=environment, capture_output=True, text=True, timeout=1800
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert ": OK" in done.stdout and "2 passed" in done.stdout
    assert "speed_watch 0.1.0: registered (entry point speed_watch of calmotion-speed-watch)" in done.stdout
    assert "speed_watch is disabled" in done.stdout and "speed_watch is enabled" in done.stdout
    assert (work / "dist" / "calmotion_speed_watch-0.1.0-py3-none-any.whl").is_file()
