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
LEFT = """
import json
import sys
from calmotion.cli.main import main
from calmotion.host import open_host
from calmotion.model import Result
from calmotion.model.outputs import WrittenLayer
from calmotion.model.run import OutputPaths, Source

shot, *commands = sys.argv[1:]
assert main(["--help"]) == 0
assert main(["inspect", shot]) == 0
assert [main([name]) for name in commands] == [2] * len(commands)
host = open_host()
plan = host.plan([Source, OutputPaths], [Result, WrittenLayer])
print(json.dumps({
    "plugins": [plugin.id for plugin in host.plugins],
    "failures": [str(plugin.error) for plugin in host.failures()],
    "steps": [operator.idname for operator in plan.operators],
}))
"""


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


@pytest.mark.parametrize("plugin", optional_plugins(REPOSITORY / "plugins"))
def test_help_and_the_plan_of_a_shot_need_no_optional_plugin(checkout, plugin):
    brought = tomllib.loads((checkout / "plugins" / plugin / "plugin.toml").read_text()).get("commands", {})
    (checkout / "plugins" / plugin).rename(checkout / plugin)
    path = os.pathsep.join([str(checkout / "pipeline"), *filter(None, sys.path)])
    command = [sys.executable, "-c", LEFT, str(checkout / "shot.usda"), *brought]
    try:
        done = subprocess.run(command, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True)
    finally:
        (checkout / plugin).rename(checkout / "plugins" / plugin)
    assert done.returncode == 0, done.stderr
    *printed, last = done.stdout.splitlines()
    left = json.loads(last)
    assert plugin not in left["plugins"] and len(left["plugins"]) > 1 and not left["failures"]
    assert {"usd.read", "usd.write"} < set(left["steps"])
    for name in brought:
        assert f"the command {name} is brought by the plugin {plugin}, which is not there" in done.stderr
        assert not any(line.startswith(f"  {name} ") for line in printed)
