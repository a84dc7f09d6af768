"""A synthetic arm with a closed chain: a four-bar linkage drives the elbow from the shoulder, as on the rapper."""

import numpy as np
from calmotion.arrays import Array
from calmotion.model import (
    Animation,
    Body,
    Character,
    ElasticMaterial,
    FEMesh,
    FEMeshes,
    FlexibleSettings,
    Frame,
    Joint,
    MassProperties,
    MeshQuality,
    Motor,
    Target,
    Track,
)
from calmotion.model.character import WORLD
from calmotion.testing import beam_mesh
from calmotion.testing.beam_arms import IDENTITY, LIFTS
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation

UPPER, FORE, CRANK = 0.32, 0.28, 0.06  # shoulder to elbow, elbow to hand, shoulder to the rod's pin [m]
SOFT = 0.0095  # thickness of links that sway at 3 Hz [m]; the usual ones sway at 5
BENT = np.radians(60.0)  # of the elbow in the first pose, in which crank and lever stand across the upper arm
_TRACK = "drive:angular:physics:targetPosition"


def _at(x: float, z: float = 0.0, rotation: Array = IDENTITY) -> Frame:
    return Frame(np.array([x, 0.0, z]), rotation)


def _rod(mass: float, length: float) -> MassProperties:
    across = mass * length**2 / 12.0
    return MassProperties(mass, np.array([0.5 * length, 0.0, 0.0]), np.diag([1e-2 * across, across, across]))


def linkage_arm(
    youngs_modulus: float = 1.9e9, thickness: float = 0.013, hand: float = 0.25, modes: int = -1,
) -> tuple[Character, FEMeshes]:  # fmt: skip
    """Waist, shoulder and elbow motor; the elbow's sits at the shoulder and turns the forearm through a rod.

    Args:
        youngs_modulus: Of both links [Pa].
        thickness: Of both links, square [m].
        hand: Mass at the end [kg].
        modes: See `FlexibleSettings`.
    """
    plastic = ElasticMaterial("/Rapper/Nylon", youngs_modulus, 0.38, 1080.0, 0.015)
    settings = FlexibleSettings(plastic, mode_count=modes)
    fore = np.roll(Rotation.from_euler("y", -BENT).as_quat(), 1)
    reach = FORE * np.array([np.cos(BENT), 0.0, np.sin(BENT)])
    small = MassProperties(0.06, np.zeros(3), 2e-5 * np.eye(3))
    ball = MassProperties(hand, np.zeros(3), 0.4 * hand * 0.04**2 * np.eye(3))
    bodies = (
        Body("/Rapper/Chest", _at(0.0), MassProperties(3.0, np.zeros(3), 0.02 * np.eye(3))),
        Body("/Rapper/UpperArm", _at(0.0), None, flexible=settings),
        Body("/Rapper/Lever", _at(UPPER), small),
        Body("/Rapper/Forearm", _at(UPPER, rotation=fore), None, flexible=settings),
        Body("/Rapper/Hand", Frame(np.array([UPPER, 0.0, 0.0]) + reach, fore), ball),
        Body("/Rapper/Crank", _at(0.0), small),
        Body("/Rapper/Rod", _at(0.0, -CRANK), _rod(0.05, UPPER)),
    )

    def hinge(name: str, body0: int, body1: int, at0: Frame, at1: Frame, closes: bool = False) -> Joint:
        return Joint(f"/Rapper/{name}", "revolute", body0, body1, at0, at1, closes_chain=closes)

    pin = _at(0.0, -CRANK, LIFTS)
    joints = (
        hinge("Waist", WORLD, 0, _at(0.0), _at(0.0)),
        hinge("Shoulder", 0, 1, _at(0.0, rotation=LIFTS), _at(0.0, rotation=LIFTS)),
        hinge("ElbowHinge", 1, 2, _at(UPPER, rotation=LIFTS), _at(0.0, rotation=LIFTS)),
        Joint("/Rapper/ForearmMount", "fixed", 2, 3, _at(0.0, rotation=fore), _at(0.0)),
        Joint("/Rapper/HandMount", "fixed", 3, 4, _at(FORE), _at(0.0)),
        hinge("Elbow", 0, 5, _at(0.0, rotation=LIFTS), _at(0.0, rotation=LIFTS)),
        hinge("CrankPin", 5, 6, pin, _at(0.0, rotation=LIFTS)),
        hinge("RodPin", 6, 2, _at(UPPER, rotation=LIFTS), pin, closes=True),
    )
    motors = tuple(Motor(joint, joints[joint].path, _TRACK) for joint in (0, 1, 5))
    # three motors hold the hand; what they leave of the elbow counts little
    targets = (Target("/Rapper/Lever/Elbow", 2, _at(0.0), 0.05), Target("/Rapper/Hand/Palm", 4, _at(0.0)))
    meshes = tuple(
        FEMesh(body, *beam_mesh(length, thickness, 8), MeshQuality(0.0, 0.0, 0.0))
        for body, length in ((1, UPPER), (3, FORE))
    )
    return Character("/Rapper", bodies, joints, motors, targets, np.array([0.0, 0.0, -9.81])), FEMeshes(meshes)


# keys in seconds and degrees: raise, throw the hand out, two beats, a sweep across, back
_WAIST = ((0.25, 0.0), (0.6, 30.0), (1.3, 30.0), (1.7, -35.0), (2.4, -35.0), (2.9, 0.0))
_SHOULDER = ((0.2, 0.0), (0.6, 35.0), (0.9, 5.0), (1.2, 30.0), (1.5, 0.0), (1.8, 25.0), (2.2, 25.0), (2.8, 0.0))
_ELBOW = ((0.2, 0.0), (0.55, 30.0), (0.85, -35.0), (1.15, 25.0), (1.45, -30.0), (1.85, 30.0), (2.3, 30.0), (2.8, 0.0))


def performance(seconds: float = 4.0, rate: float = 24.0) -> Animation:
    """The arm's motion, from rest to rest; the elbow's crank turns with the upper arm, as on the robot."""
    times = np.arange(round(seconds * rate) + 1) / rate

    def sampled(keys: tuple[tuple[float, float], ...]) -> Array:
        at, values = np.array([(0.0, 0.0), *keys, (keys[-1][0] + 1.0, keys[-1][1])]).T
        angles: Array = np.radians(PchipInterpolator(at, values)(np.minimum(times, at[-1])))
        return angles

    waist, shoulder, elbow = map(sampled, (_WAIST, _SHOULDER, _ELBOW))
    tracks = tuple(Track(times, values) for values in (waist, shoulder, shoulder + elbow))
    return Animation(times, tracks, tracks)
