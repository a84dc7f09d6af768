import sys

import pytest
from calmotion.host import Host, PluginError, PluginState, Property, SettingError
from calmotion.host.discovery import Location
from fakes import Coal, Iron, Ore, host_of, operator

HEAD = """
    from calmotion.host import Operator
    from calmotion.model import Character

    class First(Operator):
        idname, label, provides = "smithy.first", "First", (Character,)
        def execute(self, context): return ()
"""
GOOD = (
    HEAD
    + """
    def register(host): host.register_operator(First)
    def unregister(host): host.unregister_operator(First)
"""
)


def load(*folders):
    host = Host()
    for folder in folders:
        host.load(host.add(Location(folder, "test")))
    return host


def test_a_plugin_registers_and_unregisters(make_plugin):
    host = load(make_plugin("anvil", GOOD))
    plugin = host.plugin("anvil")
    assert plugin.state is PluginState.REGISTERED and list(host.operators) == ["smithy.first"]
    assert host.unload(plugin) == ()
    assert plugin.state is PluginState.FOUND and not host.operators
    host.load(plugin)
    assert list(host.operators) == ["smithy.first"]


def test_a_plugin_that_raises_at_import_is_named_with_its_traceback_and_others_go_on(make_plugin):
    broken = make_plugin("broken", "import json\njson.loads('{')")
    host = load(broken, make_plugin("anvil", GOOD))
    plugin = host.plugin("broken")
    assert plugin.state is PluginState.FAILED
    assert str(broken / "__init__.py") in plugin.traceback and "JSONDecodeError" in plugin.traceback
    assert list(host.operators) == ["smithy.first"]
    assert not [name for name in sys.modules if name.startswith("calmotion_plugin_broken")]


def test_a_plugin_that_exits_does_not_end_the_host(make_plugin):
    assert load(make_plugin("quitter", "raise SystemExit(3)")).plugin("quitter").state is PluginState.FAILED


def test_a_bad_manifest_is_a_state_and_nothing_is_imported(make_plugin):
    folder = make_plugin("anvil", "raise SystemExit('imported')", version="one")
    plugin = load(folder).plugin("anvil")
    assert plugin.state is PluginState.FAILED and "is not a version" in str(plugin.error)


def test_a_missing_requirement_is_found_before_import(make_plugin):
    folder = make_plugin("anvil", "raise SystemExit('imported')", requires=["no-such-distribution-here"])
    assert "not installed" in str(load(folder).plugin("anvil").error)


def test_registration_is_all_or_nothing(make_plugin):
    source = (
        HEAD
        + """
    def register(host):
        host.register_operator(First)
        raise RuntimeError("halfway")
    def unregister(host): ...
    """
    )
    host = load(make_plugin("halfway", source))
    assert not host.operators and host.plugin("halfway").state is PluginState.FAILED
    assert list(load(make_plugin("anvil", GOOD)).operators) == ["smithy.first"]


def test_an_idname_that_is_taken_is_refused_and_the_owner_named(make_plugin):
    host = load(make_plugin("anvil", GOOD), make_plugin("copycat", GOOD))
    assert host.plugin("anvil").state is PluginState.REGISTERED
    assert "smithy.first is already taken by the plugin anvil" in str(host.plugin("copycat").error)


def test_an_id_that_is_taken_is_refused(make_plugin, tmp_path):
    folder = make_plugin("anvil", GOOD)
    other = tmp_path / "elsewhere" / "anvil"
    other.parent.mkdir()
    other.mkdir()
    for name in ("plugin.toml", "__init__.py"):
        (other / name).write_text((folder / name).read_text())
    host = load(folder, other)
    assert [plugin.state for plugin in host.plugins] == [PluginState.REGISTERED, PluginState.FAILED]
    assert str(folder) in str(host.plugins[1].error)


def test_two_hosts_share_nothing(make_plugin):
    folder = make_plugin("anvil", GOOD)
    one, other = load(folder), load(folder)
    one.unload(one.plugin("anvil"))
    assert not one.operators and other.operators


def test_a_plugin_imports_its_own_modules(make_plugin):
    folder = make_plugin("anvil", GOOD.replace("def register", "from .parts import PART\n    def register", 1))
    (folder / "parts.py").write_text("PART = 1\n")
    assert load(folder).plugin("anvil").state is PluginState.REGISTERED


def test_operators_are_only_registered_by_a_plugin():
    with pytest.raises(PluginError, match="outside register"):
        Host().register_operator(operator("smithy.melt", provides=[Iron]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"idname": "melt"}, "idname"),
        ({"label": ""}, "label"),
        ({"provides": ()}, "provides is empty"),
        ({"requires": (Iron,)}, "two of requires"),
        ({"requires": [Ore]}, "tuple of types"),
        ({"uses": ("Coal",)}, "tuple of types"),
        ({"properties": (Property("heat", float, "hot"),)}, "heat"),
        ({"poll": classmethod(lambda cls: None)}, "poll has a wrong signature"),
        ({"execute": lambda self: ()}, "execute has a wrong signature"),
        ({"__init__": lambda self, heat: None}, "without arguments"),
    ],
)
def test_an_operator_that_is_not_well_formed_is_refused(change, message):
    host = host_of()
    host._registering = host.plugins[0]
    good = operator("smithy.melt", provides=[Iron], requires=[Ore], uses=[Coal])
    with pytest.raises(PluginError, match=message):
        host.register_operator(type("Changed", (good,), change))
    host.register_operator(good)
    assert list(host.operators) == ["smithy.melt"]


def test_settings_for_an_operator_that_is_not_there_are_refused():
    host = host_of(operator("smithy.melt", provides=[Iron], properties=[Property("heat", float, 1.0)]))
    assert host.properties({"smithy.melt": {"heat": "2"}})["smithy.melt"].heat == 2.0
    with pytest.raises(SettingError, match="are: smithy.melt"):
        host.properties({"smithy.mellt": {"heat": "2"}})
