"""Small characters for tests: pendulums and planar arms, rigid."""

import numpy as np
from calmotion.model import Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
Z_TO_Y = np.array([np.cos(np.pi / 4), -np.sin(np.pi / 4), 0.0, 0.0])  # joint axis z along the body's y


def frame(x=0.0, y=0.0, z=0.0, rotation=IDENTITY):
    return Frame(np.array([x, y, z]), rotation)


def chain(links: int, driven=(), length=1.0, mass=1.0, flipped=()) -> Character:
    """Links along x, hinged about y, each a point-like mass at its end; gravity along -z."""
    inertia = 1e-9 * np.eye(3)
    bodies = tuple(
        Body(f"/C/L{k}", frame(k * length), MassProperties(mass, np.array([length, 0.0, 0.0]), inertia))
        for k in range(links)
    )
    joints = []
    for k in range(links):
        near, far = frame(length if k else 0.0, rotation=Z_TO_Y), frame(rotation=Z_TO_Y)
        pair = (k, k - 1, far, near) if k in flipped else (k - 1, k, near, far)
        joints.append(Joint(f"/C/J{k}", "revolute", *pair))
    motors = tuple(Motor(k, f"/C/J{k}", "drive:angular:physics:targetPosition") for k in driven)
    target = Target(f"/C/L{links - 1}/tip", links - 1, frame(length))
    return Character("/C", bodies, tuple(joints), motors, (target,), np.array([0.0, 0.0, -9.81]))


def compiled(character: Character):
    tree = span_tree(character)
    return compile_model(
        character,
        tree,
        [rigid_body(body, a) for body, a in zip(character.bodies, body_anchors(character, tree), strict=True)],
    )
