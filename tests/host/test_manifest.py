from importlib import invalidate_caches

import pytest
from calmotion.host import PluginError, read_manifest
from calmotion.host.manifest import check_requirements

EMPTY = "def register(host): ...\ndef unregister(host): ...\n"


def test_a_manifest_is_read_without_importing_the_plugin(make_plugin):
    folder = make_plugin("anvil", "raise SystemExit('imported')", tags=["iron"], requires=["numpy>=2"])
    manifest = read_manifest(folder)
    assert (manifest.id, manifest.tags, manifest.requires) == ("anvil", ("iron",), ("numpy>=2",))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("id", "hammer"),
        ("id", "Anvil"),
        ("version", "one"),
        ("version", None),
        ("name", 3),
        ("tagline", ""),
        ("tags", "iron"),
        ("calmotion", "about 1"),
        ("requires", ["numpy >"]),
        ("colour", "red"),
    ],
)
def test_a_wrong_field_is_named(make_plugin, field, value):
    folder = make_plugin("anvil", EMPTY, **{field: value})
    with pytest.raises(PluginError) as refused:
        read_manifest(folder)
    assert refused.value.attribute == field
    assert refused.value.path == str(folder / "plugin.toml")


@pytest.mark.parametrize(
    ("commands", "attribute", "told"),
    [
        (["greet"], "commands", "must be tables"),
        ({"Greet": {"module": "command", "help": "greet"}}, "commands.Greet", "lower-case"),
        ({"greet": "command"}, "commands.greet", "module and help"),
        ({"greet": {"module": "command"}}, "commands.greet", "module and help"),
        ({"greet": {"module": "command", "help": "greet", "colour": "red"}}, "commands.greet", "module and help"),
        ({"greet": {"module": "command", "help": ""}}, "commands.greet.help", "line of text"),
        ({"greet": {"module": "absent", "help": "greet"}}, "commands.greet.module", "no such module"),
    ],
)
def test_a_wrong_command_is_named_with_its_remedy(make_plugin, commands, attribute, told):
    folder = make_plugin("anvil", EMPTY, commands=commands)
    (folder / "command.py").write_text("")
    with pytest.raises(PluginError, match=told) as refused:
        read_manifest(folder)
    assert (refused.value.attribute, refused.value.path) == (attribute, str(folder / "plugin.toml"))
    assert refused.value.remedy


def test_a_manifest_that_is_not_toml_is_refused(make_plugin):
    folder = make_plugin("anvil", EMPTY)
    (folder / "plugin.toml").write_text("id = anvil")
    with pytest.raises(PluginError, match="not valid TOML"):
        read_manifest(folder)


def test_what_is_installed_is_checked_without_importing(make_plugin):
    check_requirements(read_manifest(make_plugin("fits", EMPTY, requires=["numpy>=1"])), "0.1.0")
    for index, requires in enumerate((["no-such-distribution-here"], ["numpy>=999"])):
        with pytest.raises(PluginError, match="pip install"):
            check_requirements(read_manifest(make_plugin(f"lacks{index}", EMPTY, requires=requires)), "0.1.0")
    with pytest.raises(PluginError, match=r"needs Calmotion >=7"):
        check_requirements(read_manifest(make_plugin("newer", EMPTY, calmotion=">=7")), "0.1.0")


def test_what_was_installed_since_the_last_check_is_found(make_plugin, tmp_path, monkeypatch):
    def install(version):
        for folder in tmp_path.glob("late_tongs-*"):
            folder.rename(tmp_path / "gone")
        folder = tmp_path / f"late_tongs-{version}.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: late-tongs\nVersion: {version}\n")
        invalidate_caches()

    monkeypatch.syspath_prepend(tmp_path)
    manifest = read_manifest(make_plugin("anvil", EMPTY, requires=["late-tongs>=2"]))
    with pytest.raises(PluginError, match="not installed"):
        check_requirements(manifest, "0.1.0")
    install("1.5")
    with pytest.raises(PluginError, match=r"1\.5"):
        check_requirements(manifest, "0.1.0")
    install("2.0")
    check_requirements(manifest, "0.1.0")


def test_a_requirement_for_another_system_does_not_count(make_plugin):
    manifest = read_manifest(make_plugin("anvil", EMPTY, requires=["nothing; sys_platform == 'beos'"]))
    check_requirements(manifest, "0.1.0")
