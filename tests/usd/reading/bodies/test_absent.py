"""Why a shot has no bodies: the error names the prim that would have them and what to do about it."""

from __future__ import annotations

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading import read_shot
from pxr import Usd
from small_shots import BASE, FORE, UPPER, write_arm

HEAD = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n    startTimeCode = 0\n    endTimeCode = 24\n)\n'
BODY = '(prepend apiSchemas = ["PhysicsRigidBodyAPI"])'


def refused(path):
    with pytest.raises(ShotError, match="no bodies") as caught:
        read_shot(str(path))
    return caught.value


def written(tmp_path, text):
    path = tmp_path / "shot.usda"
    path.write_text(HEAD + text)
    return path


@pytest.mark.parametrize(
    ("text", "place", "remedy"),
    [
        ('over "Robot"\n{\n    over "Link"\n    {\n    }\n}\n', "/Robot", "subLayers"),
        (f'over "Robot" {BODY}\n{{\n}}\n', "/Robot", "subLayers"),
        (
            f'def Xform "Robot" (active = false)\n{{\n    def Xform "Link" {BODY}\n    {{\n    }}\n}}\n',
            "/Robot",
            "Activate",
        ),
        (f'class Xform "Robot"\n{{\n    def Xform "Link" {BODY}\n    {{\n    }}\n}}\n', "/Robot/Link", "Inherit"),
        ('def Xform "Robot"\n{\n}\n', "shot.usda", "Apply PhysicsRigidBodyAPI"),
    ],
)
def test_the_prim_that_would_have_them_is_named(tmp_path, text, place, remedy):
    error = refused(written(tmp_path, text))
    assert error.path.endswith(place) and remedy in error.remedy


def test_bodies_that_are_switched_off_are_named_with_their_attribute(tmp_path):
    path = write_arm(tmp_path / "arm.usda")
    stage = Usd.Stage.Open(str(path))
    for prim in stage.Traverse():
        if "PhysicsRigidBodyAPI" in prim.GetAppliedSchemas():
            prim.GetAttribute("physics:rigidBodyEnabled").Set(False)
    stage.Save()
    error = refused(path)
    assert error.attribute == "physics:rigidBodyEnabled" and error.path in (
        UPPER,
        FORE,
        BASE,
    )
