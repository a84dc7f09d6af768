"""Groups, distances from the world, and leaves."""

from __future__ import annotations

import numpy as np
from calmotion.shot import Frame
from calmotion.usd.reading.joints import JointPrim
from calmotion.usd.reading.topology import common_path, components, distances, leaves


def joint(body0: str, body1: str) -> JointPrim:
    frame = Frame(np.zeros(3), np.array([1.0, 0, 0, 0]))
    return JointPrim(None, f"{body0}-{body1}", "revolute", body0, body1, frame, frame)


CHAIN = [joint("", "a"), joint("a", "b"), joint("b", "c"), joint("b", "d")]


def test_the_world_joins_nothing():
    joints = [*CHAIN, joint("", "x"), joint("x", "y")]
    assert components(list("abcdxyz"), joints) == [["a", "b", "c", "d"], ["x", "y"], ["z"]]


def test_distances_count_joints_from_the_world_outwards():
    assert distances(list("dcba"), CHAIN) == {"a": 1, "b": 2, "c": 3, "d": 3}
    assert list(distances(list("dcba"), CHAIN))[0] == "a"


def test_leaves_are_the_outermost_bodies_also_in_closed_chains():
    assert leaves(list("abcd"), CHAIN) == ["c", "d"]
    four_bar = [joint("", "base"), joint("base", "left"), joint("base", "right"), joint("left", "top"),
                joint("right", "top")]  # fmt: skip
    assert leaves(["base", "left", "right", "top"], four_bar) == ["top"]
    five_bar = [*four_bar[:3], joint("left", "one"), joint("right", "two"), joint("one", "two")]
    assert leaves(["base", "left", "right", "one", "two"], five_bar) == ["one"], "two are equally far"


def test_the_common_path_is_the_deepest_that_contains_all():
    assert common_path(["/a/b/c", "/a/b/d"]) == "/a/b"
    assert common_path(["/a/b", "/a/bc"]) == "/a"
    assert common_path(["/a/b"]) == "/a/b"
    assert common_path(["/a", "/b"]) == "/"
