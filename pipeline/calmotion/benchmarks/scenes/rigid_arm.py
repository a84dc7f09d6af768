"""An arm of rigid links whose hinges turn about two axes in alternation, as on a serial robot, and its motion."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.shot import Animation, Body, Character, Frame, Joint, MassProperties, Motor, Target, Track

_LENGTH, _MASS = 0.2, 1.0  # of a link [m], [kg]
_TRACK = "drive:angular:physics:targetPosition"


def rigid_arm(links: int, seconds: float = 2.0, rate: float = 30.0) -> tuple[Character, Animation]:
    """A chain of links along z, the hinges about z and y in turn, and smooth tracks from rest to rest."""
    straight = np.array([1.0, 0.0, 0.0, 0.0])
    across = np.roll(Rotation.from_euler("x", -90.0, degrees=True).as_quat(), 1)  # turns z to y
    slender = np.diag([_MASS * _LENGTH**2 / 12.0] * 2 + [2e-4])
    bodies, joints, motors, tracks = [], [], [], []
    times = np.arange(round(seconds * rate) + 1) / rate
    for k in range(links):
        path = f"/Arm/Link{k}"
        start, base = Frame(np.zeros(3), straight), np.array([0.0, 0.0, _LENGTH if k else 0.0])
        bodies.append(Body(path, start, MassProperties(_MASS, np.array([0.0, 0.0, 0.5 * _LENGTH]), slender)))
        axis = across if k % 2 else straight
        joints.append(Joint(f"/Arm/Hinge{k}", "revolute", k - 1, k, Frame(base, axis), Frame(np.zeros(3), axis)))
        motors.append(Motor(k, f"/Arm/Hinge{k}", _TRACK))
        tracks.append(Track(times, (0.4 + 0.1 * k) * np.sin(np.pi * times / seconds) ** 4))
    target = Target("/Arm/Tool", links - 1, Frame(np.array([0.0, 0.0, _LENGTH]), straight))
    gravity = np.array([0.0, 0.0, -9.81])
    character = Character("/Arm", tuple(bodies), tuple(joints), tuple(motors), (target,), gravity)
    return character, Animation(times, tuple(tracks), tuple(tracks))
