import dataclasses

import pytest
from arms import chain
from calmotion import ShotError
from calmotion.multibody.model.topology import span_tree


def test_parents_come_before_children_whatever_the_order_of_bodies_and_joints():
    character = chain(4, flipped=(2,))
    order = [2, 0, 3, 1]
    place = {old: new for new, old in enumerate(order)} | {-1: -1}
    shuffled = dataclasses.replace(
        character,
        bodies=tuple(character.bodies[k] for k in order),
        joints=tuple(
            dataclasses.replace(j, body0=place[j.body0], body1=place[j.body1]) for j in reversed(character.joints)
        ),
    )
    tree = span_tree(shuffled)
    assert [shuffled.bodies[b].path for b in tree.body] == ["/C/L0", "/C/L1", "/C/L2", "/C/L3"]
    assert tree.parent == (-1, 0, 1, 2)
    assert tree.flipped == (False, False, True, False)


def test_the_loosest_joint_closes_a_chain():
    character = chain(3, driven=(0, 2))
    closing = dataclasses.replace(character.joints[1], path="/C/Extra", body0=0, body1=2)
    ball = dataclasses.replace(closing, path="/C/Ball", kind="spherical")
    tree = span_tree(dataclasses.replace(character, joints=(*character.joints, closing)))
    assert sorted(tree.joint) == [0, 1, 2] and tree.closing == (3,)
    # a ball before a hinge, and whatever the shot asks for before all others
    swapped = dataclasses.replace(character, joints=(ball, *character.joints), motors=())
    assert span_tree(swapped).closing == (0,)
    asked = dataclasses.replace(character.joints[2], closes_chain=True)
    wanted = dataclasses.replace(character, joints=(*character.joints[:2], asked, ball), motors=())
    assert span_tree(wanted).closing == (2,)


def test_a_body_without_a_way_to_the_world_is_refused():
    character = chain(3)
    with pytest.raises(ShotError) as error:
        span_tree(dataclasses.replace(character, joints=character.joints[:2]))
    assert error.value.path == "/C/L2"
