"""Groups, distances from the world, and leaves."""

import numpy as np
from calmotion.model import Frame
from calmotion.usd.reading.joints.joint_prims import JointPrim
from calmotion.usd.reading.joints.topology import bridges, common_path, components, distances, leaves


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


def test_joints_of_closed_chains_are_no_bridges_also_where_the_world_closes_them():
    four_bar = [joint("a", "left"), joint("a", "right"), joint("left", "top"), joint("right", "top")]
    hung = joint("top", "rope")
    assert bridges([*CHAIN, *four_bar, hung]) == [*CHAIN, hung]
    assert bridges([*CHAIN, joint("", "d")]) == [CHAIN[2]]
    assert bridges([joint("", "a"), joint("", "a"), joint("a", "b")])[0].body1 == "b", "two pins are a closed chain"
    assert bridges([]) == []


def test_random_bridges_are_the_joints_whose_removal_parts_the_graph():
    random = np.random.default_rng(3)
    for _ in range(30):
        names = ["", *"abcdefg"]
        joints = [
            joint(*(names[k] for k in random.choice(8, 2, replace=False))) for _ in range(int(random.integers(3, 11)))
        ]
        parted = [one for one in joints if _parts([j for j in joints if j is not one]) > _parts(joints)]
        assert bridges(joints) == parted


def _parts(joints) -> int:
    """Number of parts of the graph of eight bodies, by the rank of its Laplacian."""
    laplacian = np.zeros((8, 8))
    for one in joints:
        row = np.zeros(8)
        row["abcdefg".find(one.body0) if one.body0 else 7] += 1.0
        row["abcdefg".find(one.body1) if one.body1 else 7] -= 1.0
        laplacian += np.outer(row, row)
    return 8 - int(np.linalg.matrix_rank(laplacian))


def test_the_common_path_is_the_deepest_that_contains_all():
    assert common_path(["/a/b/c", "/a/b/d"]) == "/a/b"
    assert common_path(["/a/b", "/a/bc"]) == "/a"
    assert common_path(["/a/b"]) == "/a/b"
    assert common_path(["/a", "/b"]) == "/"
