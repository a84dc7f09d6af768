"""Planar mechanisms of rigid bars with hinges about y, for reference problems."""

import numpy as np
from arms import Z_TO_Y, frame
from calmotion.model import WORLD, Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from scipy.spatial.transform import Rotation


def quaternion(rotation):
    return np.roll(rotation.as_quat(), 1)


def mechanism(points, bars, joints, driven=(), gravity=9.81, target=0):
    """Uniform bars of mass and density 1 kg/m between points of the x-z plane, hinged together.

    Args:
        points: Coordinates (x, z) [m].
        bars: Pairs of points.
        joints: (bar or WORLD, bar, point) each.
        driven: Numbers of the joints with a motor.
        gravity: Down the z axis [m/s^2].
        target: Bar whose far end is watched.

    Returns:
        The compiled model.
    """
    at = [np.array([x, 0.0, z]) for x, z in points]
    bodies = []
    for k, (i, j) in enumerate(bars):
        along = at[j] - at[i]
        length = float(np.linalg.norm(along))
        turn = Rotation.from_euler("y", np.arctan2(-along[2], along[0]))
        inertia = np.diag([1e-9, length**3 / 12.0, length**3 / 12.0])
        mass = MassProperties(length, np.array([length / 2.0, 0.0, 0.0]), inertia)
        bodies.append(Body(f"/C/Bar{k}", Frame(at[i], quaternion(turn)), mass))

    def side(bar, point):
        axis = Rotation.from_quat(np.roll(Z_TO_Y, -1))
        if bar == WORLD:
            return Frame(at[point], Z_TO_Y)
        rest = bodies[bar].rest
        back = Rotation.from_quat(np.roll(rest.rotation, -1)).inv()
        return Frame(back.apply(at[point] - rest.position), quaternion(back * axis))

    items = [
        Joint(f"/C/Joint{n}", "revolute", one, other, side(one, point), side(other, point))
        for n, (one, other, point) in enumerate(joints)
    ]
    motors = tuple(Motor(n, f"/C/Joint{n}", "drive:angular:physics:targetPosition") for n in driven)
    i, j = bars[target]
    tip = Target("/C/tip", target, frame(float(np.linalg.norm(at[j] - at[i]))))
    character = Character("/C", tuple(bodies), tuple(items), motors, (tip,), np.array([0.0, 0.0, -gravity]))
    tree = span_tree(character)
    anchors = body_anchors(character, tree)
    return compile_model(character, tree, [rigid_body(b, a) for b, a in zip(bodies, anchors, strict=True)])
