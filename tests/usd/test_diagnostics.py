"""Messages of USD stay off stderr, and lose what says nothing to a user."""

import pytest
from calmotion.usd.diagnostics import one_line, quiet, with_places
from pxr import Tf, Usd, UsdGeom


def test_warnings_are_kept_once_and_not_printed(capfd):
    with quiet() as messages:
        Tf.Warn("something odd")
        Tf.Warn("something odd")
        Tf.Status("a status")
    assert messages == ["something odd", "a status"]
    assert capfd.readouterr().err == ""


def test_they_are_kept_when_the_block_fails():
    with pytest.raises(ValueError), quiet() as messages:
        Tf.Warn("before")
        raise ValueError
    assert messages == ["before"]


@pytest.mark.parametrize(
    "text, line",
    [
        ("two\n  lines ", "two lines"),
        ("No (good) (instantiating stage on stage @/a/b.usda@ <0x55>)", "No (good)"),
        ("In @/a.usda@,@anon:0x5:a-session.usda@</A>: bad", "In @/a.usda@</A>: bad"),
    ],
)
def test_addresses_and_session_layers_go(text, line):
    assert one_line(text) == line


@pytest.mark.parametrize(
    "message, place",
    [
        ("In </Robot/Arm>: bad", "/Robot/Arm"),
        ("attribute </Robot/Arm.size> is odd", "/Robot/Arm"),
        ("at /Robot/Arm in @x@", "/Robot/Arm"),
        ("at /nowhere in @x@", "shot"),
        ("nothing is named", "shot"),
    ],
)
def test_a_message_has_the_prim_that_it_names(message, place):
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Xform.Define(stage, "/Robot/Arm")
    where = stage.GetRootLayer().identifier if place == "shot" else place
    assert with_places([message], stage, stage.Traverse()) == [(where, f"USD reports: {message}")]
