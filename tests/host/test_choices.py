"""Plugins that the user disabled stay so, and only for that user."""

import pytest
from calmotion.host import PluginState, SettingError, open_host
from calmotion.host.settings import FILE_NAME, choose, configuration_folder, disabled_plugins


@pytest.fixture
def environment(tmp_path):
    return {"CALMOTION_CONFIG": str(tmp_path / "config")}


def test_a_disabled_plugin_is_remembered_and_enabled_again(environment):
    assert disabled_plugins(environment) == frozenset()
    file = choose("figures", False, environment)
    choose("rerun_logger", False, environment)
    assert disabled_plugins(environment) == {"figures", "rerun_logger"}
    choose("figures", True, environment)
    assert disabled_plugins(environment) == {"rerun_logger"} and file.name == FILE_NAME
    assert {path.name for path in file.parent.iterdir()} == {FILE_NAME, ".lock"}


def test_choices_that_are_made_at_once_are_all_kept(environment):
    from concurrent.futures import ThreadPoolExecutor

    names = [f"plugin{k}" for k in range(12)]
    with ThreadPoolExecutor(6) as pool:
        list(pool.map(lambda name: choose(name, False, environment), names))
    assert disabled_plugins(environment) == set(names)


def test_a_disabled_plugin_is_not_imported_and_its_operators_are_not_there(environment, make_plugin):
    make_plugin("anvil", "raise SystemExit('imported')")
    folder = make_plugin("smithy", "raise SystemExit('imported')").parent
    choose("anvil", False, environment)
    host = open_host([folder], environment)
    assert host.plugin("anvil").state is PluginState.DISABLED
    assert host.plugin("smithy").state is PluginState.FAILED


def test_missing_requirements_of_a_disabled_plugin_are_reported(environment):
    from calmotion.host import PlanError
    from calmotion.model import Character
    from calmotion.model.run import Source

    choose("usd_reader", False, environment)
    with pytest.raises(PlanError) as refused:
        open_host([], environment).run([Source("shot.usda", "inspect")], [Character])
    assert "usd_reader (disabled)" in refused.value.remedy


@pytest.mark.parametrize("text", ["disabled = 3", "disabled = [3]", "disabled = [", "\xff"])
def test_a_broken_file_is_refused_with_its_place(environment, tmp_path, text):
    (tmp_path / "config").mkdir()
    (tmp_path / "config" / FILE_NAME).write_bytes(text.encode("latin-1"))
    with pytest.raises(SettingError) as refused:
        disabled_plugins(environment)
    assert FILE_NAME in refused.value.path and refused.value.remedy


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(SettingError) as refused:
        choose("figures", False, {"CALMOTION_CONFIG": str(tmp_path / "taken" / "config")})
    assert "CALMOTION_CONFIG" in refused.value.remedy


def test_the_folder_is_where_the_system_keeps_such_things(tmp_path):
    assert configuration_folder({"XDG_CONFIG_HOME": str(tmp_path)}).is_relative_to(tmp_path)
    assert configuration_folder({}).name == "calmotion"
    assert configuration_folder({"XDG_CONFIG_HOME": "here"}) == configuration_folder({})


def test_the_command_line_keeps_the_choice(calmotion_process, tmp_path):
    import os

    env = os.environ | {"CALMOTION_CONFIG": str(tmp_path), "PYTHONPATH": os.pathsep.join(["pipeline"])}

    def run(*arguments):
        return calmotion_process(*arguments, env=env, cwd=os.path.dirname(os.path.dirname(os.path.dirname(__file__))))

    assert run("plugins", "disable", "figures").returncode == 0
    assert "figures 1.0.0: disabled" in run("plugins", "list").stdout
    wrong = run("plugins", "disable", "figurs")
    assert wrong.returncode == 2 and "Did you mean figures?" in wrong.stderr
    assert run("plugins", "enable", "figures").returncode == 0
    assert "figures 1.0.0: registered" in run("plugins", "list").stdout
