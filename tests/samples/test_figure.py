"""The figure that drums and boxes: one layer of its own, and two shots that reference it."""

import importlib
import json
from pathlib import Path

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from pxr import Sdf, Usd, UsdGeom, UsdPhysics

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
FIGURE = SAMPLES / "figure" / "figure.usda"
each_shot = pytest.mark.parametrize("name", ["drummer", "boxer"])


def shot_of(name: str) -> Path:
    return SAMPLES / name / f"{name}.usda"


def test_it_is_as_tall_as_a_child_and_stands_on_the_ground():
    stage = Usd.Stage.Open(str(FIGURE))
    cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    extent = cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange()
    low, high = extent.GetMin(), extent.GetMax()
    assert abs(low[2]) < 0.001 and 1.1 < high[2] < 1.25


def test_it_holds_a_pose_and_no_animation():
    stage = Usd.Stage.Open(str(FIGURE))
    assert not stage.HasAuthoredTimeCodeRange()
    assert not [a for p in stage.Traverse() for a in p.GetAttributes() if a.ValueMightBeTimeVarying()]


@each_shot
def test_a_shot_references_the_figure_and_holds_no_part_of_it(name):
    layer = Sdf.Layer.FindOrOpen(str(shot_of(name)))
    root = layer.GetPrimAtPath(f"/{layer.defaultPrim}")
    assert [reference.assetPath for reference in root.referenceList.prependedItems] == ["../figure/figure.usda"]
    figure = Sdf.Layer.FindOrOpen(str(FIGURE))
    shared = {child.name for child in figure.GetPrimAtPath("/Figure").nameChildren if child.typeName == "Xform"}
    assert all(child.specifier == Sdf.SpecifierOver for child in root.nameChildren if child.name in shared)


@each_shot
def test_thirteen_motors_and_four_flexible_links(name):
    character, _, _ = read_shot(str(shot_of(name)))
    assert len(character.motors) == 13
    assert sum(body.flexible is not None for body in character.bodies) == 4


@each_shot
def test_a_body_in_a_hand_has_its_own_mass_and_the_target(name):
    stage = Usd.Stage.Open(str(shot_of(name)))
    prop, mass = {"drummer": ("Stick", 0.055), "boxer": ("Glove", 0.2)}[name]
    for side in ("Left", "Right"):
        held = stage.GetDefaultPrim().GetChild(f"{side}{prop}")
        assert UsdPhysics.MassAPI(held).GetMassAttr().Get() == pytest.approx(mass)
        assert [child.GetName() for child in held.GetChildren() if child.HasAPI("CalmTargetAPI")]


def test_a_jab_is_straight_and_lands_within_six_frames(monkeypatch):
    monkeypatch.syspath_prepend(str(SAMPLES))
    shot, motion, robot = (importlib.import_module(m) for m in ("boxer.build", "boxer.motion", "kit.robot"))
    glove = next(body for body in shot.SHOT.props if body.name == "LeftGlove")

    def knuckles(frame: int):
        pose = robot.pose_bodies(shot.SHOT.joints, motion.FRAMES.index(frame))["LeftGlove"]
        return pose.position + robot.turn(pose.rotation, glove.targets[0].position)

    landing = motion.JABS[0]
    path = np.array([knuckles(frame) for frame in range(landing - 6, landing + 1)])
    way = path[-1] - path[0]
    length = np.linalg.norm(way)
    along = (path - path[0]) @ way / length
    off = np.linalg.norm(path - path[0] - np.outer(along, way / length), axis=1)
    assert length > 0.35 and off.max() < 0.2 * length
    assert np.all(np.diff(along) > 0.0)


@pytest.mark.long
@each_shot
def test_the_lowest_frequency_of_the_character_is_between_two_and_ten_hertz(name, calmotion):
    run = calmotion("inspect", shot_of(name), "--json")
    assert run.returncode == 0, run.stderr
    assert 2.0 < json.loads(run.stdout)["system_frequencies_hz"][0] < 10.0
