"""Plugins that fail, each in its way: the host lives, the rest is done, and the message names who and what to do."""

import json

import pytest
from small_shots import write_arm

HEAD = """
    from dataclasses import dataclass
    from calmotion.host import Operator
    from calmotion.model import Character

    @dataclass(frozen=True)
    class Mark:
        text: str

    class MakeMark(Operator):
        idname, label, requires, provides = "mark.make", "Make a mark", (Character,), (Mark,)
        def execute(self, context):
            {body}

    def register(host): host.register_operator(MakeMark)
    def unregister(host): host.unregister_operator(MakeMark)
"""

FAILING = {
    "raises": ("1 / 0", ("mark.make", "marker", "ZeroDivisionError", "maintainer", "Traceback")),
    "returns the wrong type": ("return ('a mark',)", ("mark.make", "marker", "must return (Mark)", "str for Mark")),
    "returns nothing": ("pass", ("mark.make", "marker", "sequence of (Mark)", "in the order of")),
    "imports what is missing": ("import no_such_library", ("mark.make", "marker", "no_such_library", "maintainer")),
    "exits": ("raise SystemExit(7)", ("mark.make", "marker")),
}


@pytest.fixture
def shot(tmp_path_factory):
    return write_arm(tmp_path_factory.mktemp("shot") / "arm.usda")


@pytest.mark.parametrize("how", FAILING)
def test_an_operator_that_fails_is_named_and_the_rest_is_done(calmotion, make_plugin, shot, tmp_path, how):
    body, words = FAILING[how]
    folder = make_plugin("marker", HEAD.format(body=body))
    done = calmotion(
        "simulate", shot, "-o", tmp_path / "moved.usda", "--plugins", folder, "--run", "mark.make", "--json",
        "--step", "20ms", "--set", "fe.mesh.element_size=20mm",
    )  # fmt: skip
    assert done.returncode == 1
    report = json.loads(done.stdout)
    text = json.dumps(report["errors"])
    assert all(word in text for word in words), text
    assert report["targets"] and (tmp_path / "moved.usda").is_file(), "what was computed is written"


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
