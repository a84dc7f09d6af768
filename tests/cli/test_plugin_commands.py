"""Commands that plugins bring: listed from their manifests, imported when they are called."""

import json
import sys
import tomllib

import pytest
from calmotion.cli.commands.table import BROUGHT_BY, BUILT_IN
from calmotion.cli.main import main

PACKAGE = """
    import os

    if "FORBIDDEN" in os.environ:
        raise RuntimeError("imported")

    def register(host): ...
    def unregister(host): ...
"""
COMMAND = """
from calmotion.cli import json_option

EXAMPLES = (("calmotion greet Ada", "say hello to Ada"),)

def add_arguments(parser):
    parser.add_argument("name", help="whom to greet")
    parser.add_argument("--status", type=int, default=0)
    json_option(parser)

def run(arguments, output):
    if output.json:
        output.object({"greeted": arguments.name})
    else:
        print("hello", arguments.name, file=output.stream)
    return arguments.status
"""


@pytest.fixture
def greeter(make_plugin, monkeypatch):
    """Makes plugins with a command `greet`, or that of another name, which the command line finds."""

    def make(plugin_id, source=COMMAND, name="greet"):
        entry = {name: {"module": "command", "help": "greet somebody"}}
        folder = make_plugin(plugin_id, PACKAGE, commands=entry)
        (folder / "command.py").write_text(source)
        monkeypatch.setenv("CALMOTION_PLUGINS", str(folder.parent))
        return folder

    return make


def test_a_command_of_a_plugin_runs_as_those_of_the_engine_do(greeter, capfd):
    greeter("greeter")
    assert main(["greet", "Ada", "--status", "1"]) == 1
    assert capfd.readouterr().out == "hello Ada\n"
    assert main(["greet", "Ada", "--json"]) == 0
    assert json.loads(capfd.readouterr().out) == {"greeted": "Ada"}
    assert main(["greet"]) == 2
    assert "usage: calmotion greet NAME" in capfd.readouterr().err
    assert main(["greet", "--help"]) == 0
    shown = capfd.readouterr().out
    assert "Greet somebody." in shown and "whom to greet" in shown and "say hello to Ada" in shown


def test_a_command_of_an_installed_plugin_is_found_by_its_entry_point(greeter, capfd, monkeypatch):
    folder = greeter("anvil_of_a_package")
    monkeypatch.delenv("CALMOTION_PLUGINS")
    info = folder.parent / "anvil-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: anvil\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[calmotion.plugins]\nanvil = {folder.name}\n")
    monkeypatch.syspath_prepend(str(folder.parent))
    assert main(["greet", "Ada"]) == 0
    assert capfd.readouterr().out == "hello Ada\n"
    for name in (folder.name, f"{folder.name}.command"):
        sys.modules.pop(name)


def test_help_lists_it_without_importing_the_plugin(greeter, capfd, monkeypatch):
    greeter("greeter")
    monkeypatch.setenv("FORBIDDEN", "1")
    assert main(["--help"]) == 0
    assert "greet      greet somebody" in capfd.readouterr().out
    assert main(["gret"]) == 2
    assert "Did you mean greet?" in capfd.readouterr().err


def test_two_plugins_with_one_command_are_told(greeter, capfd):
    greeter("anvil")
    greeter("hammer")
    assert main(["greet", "Ada"]) == 1
    told = capfd.readouterr().err
    assert "the plugins anvil and hammer both bring the command greet" in told
    assert "calmotion plugins disable hammer" in told


def test_a_command_of_a_disabled_plugin_tells_how_to_enable_it(greeter, capfd, monkeypatch, tmp_path):
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path / "config"))
    greeter("anvil")
    assert main(["plugins", "disable", "anvil"]) == 0
    assert main(["--help"]) == 0
    assert "greet" not in capfd.readouterr().out
    assert main(["greet", "Ada", "--json"]) == 2
    error = json.loads(capfd.readouterr().out)["error"]
    assert error["problem"] == "the command greet is brought by the plugin anvil, which is disabled"
    assert "calmotion plugins enable anvil" in error["remedy"]
    greeter("hammer")
    assert main(["greet", "Ada"]) == 0, "that of the plugin that is enabled"


def test_a_command_of_a_bundled_plugin_that_was_deleted_is_told(monkeypatch, capfd):
    monkeypatch.setitem(BROUGHT_BY, "greet", "greeter")
    assert main(["greet"]) == 2
    assert "the command greet is brought by the plugin greeter, which is not there" in capfd.readouterr().err
    assert main(["--help"]) == 0
    assert "greet" not in capfd.readouterr().out


def test_a_plugin_does_not_replace_a_command_of_the_engine(greeter, capfd):
    folder = greeter("anvil", name="doctor")
    assert main(["doctor", "--json"]) in (0, 1)
    assert "findings" in json.loads(capfd.readouterr().out)
    assert main(["plugins", "check", str(folder)]) == 1
    assert "the command doctor is built in" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("source", "told"),
    [("1 / 0", "ZeroDivisionError"), ("def run(arguments, output): ...", "has no function add_arguments")],
)
def test_a_command_that_cannot_be_imported_names_its_plugin(greeter, capfd, source, told):
    folder = greeter("anvil", source)
    assert main(["greet"]) == 1
    said = capfd.readouterr().err
    assert told in said and str(folder) in said
    assert main(["plugins", "check", str(folder)]) == 1
    assert told in capfd.readouterr().out


def test_options_of_a_plugin_that_fail_end_in_an_error(greeter, capfd):
    greeter("anvil", "def add_arguments(parser): 1 / 0\ndef run(arguments, output): ...\n")
    assert main(["greet", "--json"]) == 1
    error = json.loads(capfd.readouterr().out)["error"]
    assert "ZeroDivisionError" in error["found"] and "command.py" in error["traceback"]


def test_plugins_list_and_check_know_commands(greeter, capfd):
    folder = greeter("greeter")
    assert main(["plugins", "check", str(folder)]) == 0
    capfd.readouterr()
    assert main(["plugins", "list", "--json"]) == 0
    plugins = {plugin["id"]: plugin for plugin in json.loads(capfd.readouterr().out)["plugins"]}
    assert plugins["greeter"]["commands"] == [{"name": "greet", "help": "greet somebody"}]
    assert main(["plugins", "list"]) == 0
    assert "calmotion greet  greet somebody" in capfd.readouterr().out


def test_commands_of_bundled_plugins_are_known_where_they_are_deleted(repository):
    brought = {
        name: manifest.parent.name
        for manifest in (repository / "plugins").glob("*/plugin.toml")
        for name in tomllib.loads(manifest.read_text()).get("commands", {})
    }
    assert brought.items() <= BROUGHT_BY.items() and not set(brought) & set(BUILT_IN)
