import importlib
import multiprocessing
import pickle
import sys
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from calmotion.host import Host, PluginState, SettingError, open_host
from calmotion.host.discovery import Location, discover

EMPTY = "def register(host): ...\ndef unregister(host): ...\n"
OPERATOR = """
    from calmotion.host import Operator
    from calmotion.model import Character

    class Made(Operator):
        idname, label, provides = "made.by_entry_point", "Make", (Character,)
        def execute(self, context): return ()

    def register(host): host.register_operator(Made)
    def unregister(host): host.unregister_operator(Made)
"""


def test_other_processes_import_a_bundled_plugin_by_its_name(tmp_path):
    plugin = open_host([], {}).plugin("table_writer")
    module = importlib.import_module("calmotion_plugins.table_writer.table")
    assert plugin.module is importlib.import_module("calmotion_plugins.table_writer")
    assert pickle.loads(pickle.dumps(plugin.operators[0])) is plugin.operators[0]
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as workers:
        workers.submit(module.write_table, str(tmp_path / "a.csv"), {"time_s": np.zeros(2)}).result(60)
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == "time_s"


def test_the_same_folder_of_bundled_plugins_is_one_module_wherever_it_is_named(repository):
    host = Host()
    plugin = host.add(Location(repository / "plugins" / "table_writer", "test"))
    host.load(plugin)
    assert plugin.module.__name__ == "calmotion_plugins.table_writer"


def test_folders_are_named_by_the_user_or_the_environment(make_plugin):
    first, second = make_plugin("anvil", EMPTY), make_plugin("hammer", EMPTY)
    of_user = {location.folder.name: location.origin for location in discover([first], {})}
    assert of_user["anvil"].startswith("--plugins") and "hammer" not in of_user
    named = {location.folder.name for location in discover([], {"CALMOTION_PLUGINS": str(first.parent)})}
    assert {first.name, second.name} <= named


def test_a_plugin_that_is_named_twice_is_found_once(make_plugin):
    folder = make_plugin("anvil", EMPTY)
    found = [location.folder for location in discover([folder, folder.parent], {})]
    assert found.count(folder) == 1


def test_a_folder_without_a_plugin_is_wrong_usage(tmp_path):
    with pytest.raises(SettingError, match="without a plugin"):
        discover([tmp_path], {})
    with pytest.raises(SettingError, match="CALMOTION_PLUGINS"):
        discover([], {"CALMOTION_PLUGINS": str(tmp_path / "absent")})


def test_nothing_beside_the_working_directory_is_found(make_plugin, monkeypatch):
    folder = make_plugin("anvil", EMPTY)
    monkeypatch.chdir(folder.parent)
    assert folder not in [location.folder for location in discover([], {})]


def test_an_installed_package_is_found_by_its_entry_point_without_import(make_plugin, monkeypatch, tmp_path):
    folder = make_plugin("forge", OPERATOR)
    info = folder.parent / "forge-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: forge\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[calmotion.plugins]\nforge = forge\n")
    monkeypatch.syspath_prepend(str(folder.parent))
    location = next(found for found in discover([], {}) if found.module)
    assert (location.folder, location.origin) == (folder, "entry point forge of forge")
    assert "forge" not in sys.modules
    try:
        assert "made.by_entry_point" in open_host([], {}).operators
    finally:
        sys.modules.pop("forge", None)


def test_an_entry_point_without_a_package_does_not_stop_the_others(monkeypatch, tmp_path):
    info = tmp_path / "ghost-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: ghost\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[calmotion.plugins]\nghost = ghost_that_is_not_there\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    host = open_host([], {})
    assert host.plugin("ghost").state is PluginState.FAILED
    assert host.plugin("table_writer").state is PluginState.REGISTERED
