"""The guide for authors of plugins, followed word by word: its commands, in its order, in an empty folder."""

import os
import re
import subprocess
import sys
from pathlib import Path

import calmotion.cli as shared
import pytest
from calmotion.host import Operator, Outcome, RunContext
from calmotion.model import Result
from calmotion.model.run import RunSettings, Source
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import check_plugin, derivative_error, host_with, run_operator, small_shot

GUIDE = Path(__file__).resolve().parents[1] / "docs" / "writing_a_plugin.md"
INTERFACE = GUIDE.parent / "reference" / "plugins.md"


def commands() -> str:
    """The shell blocks of the guide, one after the other."""
    return "\n".join(re.findall(r"```sh\n(.*?)```", GUIDE.read_text(), re.DOTALL))


def test_the_guide_names_what_there_is(calmotion):
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


def test_limits_and_residuals_of_plugins_count_in_a_search(make_plugin, repository):
    sources = re.findall(r"```python\n(.*?)```", (GUIDE.parent / "three_plugins.md").read_text(), re.DOTALL)
    folders = [make_plugin(*plugin) for plugin in zip(("soft_start", "slow_target"), sources, strict=False)]
    assert [check_plugin(folder) for folder in folders] == [[], []]
    character, animation = small_shot()
    host = host_with(repository / "plugins/vibration_optimizer", *folders)
    given = [character, animation, compile_shot(character, animation), Source("a", "optimize", RunSettings(step=0.02))]
    ask = {"soft_start.limit": {"largest": 2.5}, "slow_target.residual": {"target": character.targets[0].path}}

    def optimized(idname):
        run = host.run(given, [Result], settings={idname: ask[idname]}).finish()
        assert run.results[-1].outcome is Outcome.DONE, run.results[-1].traceback
        return run.get(Result).terms[0], [record.text for record in run.results[-1].records]

    limit, told = optimized("soft_start.limit")
    assert 2.49 < abs(limit.after) <= 2.5 and "exceeds" not in str(told)
    assert limit.label in {motor.path for motor in character.motors}
    residual, _ = optimized("slow_target.residual")
    assert residual.after < 0.8 * residual.before
    for idname in ask:
        values = [character] if host.operators[idname].requires else []
        (made,) = run_operator(host, idname, values, {idname: ask[idname]})
        assert derivative_error(made.terms[0], character, animation) < 1e-6
    wrong = host.run(given, [Result], settings={"slow_target.residual": {"target": "/Arm/Tip"}}).finish()
    outcomes = {step.idname: step.outcome for step in wrong.results}
    assert outcomes["slow_target.residual"] is Outcome.FAILED
    assert outcomes["retarget.optimize"] is Outcome.BLOCKED, "not left out silently"


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
