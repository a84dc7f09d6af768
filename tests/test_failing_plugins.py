"""Plugins that cannot be loaded, each in its way: the host lives, and the message names them."""

import json

import pytest
from small_shots import write_arm


@pytest.fixture
def shot(tmp_path_factory):
    return write_arm(tmp_path_factory.mktemp("shot") / "arm.usda")


@pytest.mark.parametrize(
    ("source", "word"),
    [
        ("import no_such_library", "ModuleNotFoundError"),
        ("def register(host): 1 / 0\ndef unregister(host): pass", "ZeroDivisionError"),
        ("def register(host):\n    raise SystemExit(3)\ndef unregister(host): pass", "SystemExit"),
        ("x = (", "SyntaxError"),
    ],
)
def test_a_plugin_that_cannot_be_loaded_is_reported_with_its_traceback(calmotion, make_plugin, shot, source, word):
    folder = make_plugin("broken", source)
    done = calmotion("inspect", shot, "--plugins", folder, "--strict", "--json")
    assert done.returncode in (0, 1)
    assert word in done.stderr and "the plugin broken is not used" in done.stderr
    assert str(folder / "__init__.py") in done.stderr
    json.loads(done.stdout)
