"""What is left where the folder of an optional plugin is deleted: it works, and what the plugin brought is told."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from floors import optional_plugins
from one_hinge import ONE_HINGE

REPOSITORY = Path(__file__).resolve().parents[2]
# Each plugin is taken away for a process of its own, which is forked where it can be: imports take longest.
LEFT = """
import io, json, os, sys
from contextlib import redirect_stderr, redirect_stdout
from calmotion.cli.main import main
from calmotion.host import open_host
from calmotion.model import Result
from calmotion.model.outputs import WrittenLayer
from calmotion.model.run import OutputPaths, Source
import calmotion.simulation, calmotion.usd, calmotion.tolerance.simulation

def left(plugin, commands):
    with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
        statuses = [main(words) for words in (["--help"], ["inspect", "shot.usda"], *([name] for name in commands))]
        host = open_host()
        plan = host.plan([Source, OutputPaths], [Result, WrittenLayer])
    print(json.dumps({
        "plugin": plugin, "statuses": statuses, "out": out.getvalue(), "err": err.getvalue(),
        "plugins": [plugin.id for plugin in host.plugins],
        "failures": [str(plugin.error) for plugin in host.failures()],
        "steps": [operator.idname for operator in plan.operators],
    }), flush=True)

assert not [name for name in sys.modules if name.startswith("calmotion_plugins.")]
for plugin, commands in json.loads(sys.argv[1]).items():
    os.rename(f"plugins/{plugin}", plugin)
    if len(json.loads(sys.argv[1])) == 1:
        left(plugin, commands)
    elif not (child := os.fork()):
        left(plugin, commands)
        os._exit(0)
    else:
        assert os.waitpid(child, 0)[1] == 0, plugin
    os.rename(plugin, f"plugins/{plugin}")
"""
OPTIONAL = optional_plugins(REPOSITORY / "plugins")


@pytest.fixture(scope="module")
def checkout(tmp_path_factory):
    """Copies of the bundled plugins, which `calmotion_plugins` names, and a shot."""
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "pyproject.toml").touch()
    caches = shutil.ignore_patterns("__pycache__")
    shutil.copytree(REPOSITORY / "pipeline" / "calmotion_plugins", folder / "pipeline" / "calmotion_plugins")
    shutil.copytree(REPOSITORY / "plugins", folder / "plugins", ignore=caches)
    (folder / "shot.usda").write_text(ONE_HINGE)
    return folder


@pytest.fixture(scope="module")
def brought():
    """The commands of each optional plugin."""
    texts = {plugin: (REPOSITORY / "plugins" / plugin / "plugin.toml").read_text() for plugin in OPTIONAL}
    return {plugin: list(tomllib.loads(text).get("commands", {})) for plugin, text in texts.items()}


@pytest.fixture(scope="module")
def left(checkout, brought):
    """What is left without each optional plugin."""
    path = os.pathsep.join([str(checkout / "pipeline"), *filter(None, sys.path)])
    rows = []
    for part in [brought] if hasattr(os, "fork") else [{plugin: names} for plugin, names in brought.items()]:
        command = [sys.executable, "-c", LEFT, json.dumps(part)]
        settings = {"cwd": checkout, "env": os.environ | {"PYTHONPATH": path}, "capture_output": True, "text": True}
        done = subprocess.run(command, **settings)
        assert done.returncode == 0, done.stdout + done.stderr
        rows += map(json.loads, done.stdout.splitlines())
    return {row["plugin"]: row for row in rows}


@pytest.mark.parametrize("plugin", OPTIONAL)
def test_help_and_the_plan_of_a_shot_need_no_optional_plugin(left, brought, plugin):
    found = left[plugin]
    assert found["statuses"] == [0, 0] + [2] * len(brought[plugin]), found["err"]
    assert plugin not in found["plugins"] and len(found["plugins"]) > 1 and not found["failures"]
    assert {"usd.read", "usd.write"} < set(found["steps"])
    for name in brought[plugin]:
        assert f"the command {name} is brought by the plugin {plugin}, which is not there" in found["err"]
        assert not any(line.startswith(f"  {name} ") for line in found["out"].splitlines())
