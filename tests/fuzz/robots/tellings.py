"""In how many ways a robot is told in USD that mean the same."""

import random
from dataclasses import dataclass, field, replace

import numpy as np
from robots import Joint, Robot, Solid, placed, turn
from scipy.spatial.transform import Rotation

COMPOSED = ("flat", "reference", "payload", "sublayer", "variant", "inherit", "instance")
MASSES = ("explicit", "density", "material", "geometry")
OPERATIONS = ("orient", "matrix", "euler", "pivot")
# Exponents of length, mass and angle of a revolute motor's attributes; a sliding one has two lengths fewer, no angle.
_UNITS = {
    "positionGain": (2, 1, -1), "velocityGain": (2, 1, -1), "gearStiffness": (2, 1, -1), "gearDamping": (2, 1, -1),
    "viscousFriction": (2, 1, -1), "armature": (2, 1, 0), "friction": (2, 1, 0), "maxTorque": (2, 1, 0),
    "friction:stribeck": (2, 1, 0), "friction:motorQuadratic": (-2, -1, 0), "frictionSpeed": (0, 0, 1),
    "noLoadSpeed": (0, 0, 1), "maxVelocity": (0, 0, 1), "maxAcceleration": (0, 0, 1), "maxJerk": (0, 0, 1),
    "backlash": (0, 0, 1), "stiffness": (2, 1, -1), "damping": (2, 1, -1), "maxForce": (2, 1, 0),
    "targetVelocity": (0, 0, 1),
}  # fmt: skip
_FEWER = {
    "positionGain": 2,
    "velocityGain": 2,
    "gearStiffness": 2,
    "gearDamping": 2,
    "viscousFriction": 2,
    "armature": 2,
    "stiffness": 2,
    "damping": 2,
}


@dataclass(frozen=True)
class Telling:
    """How a robot is told; the defaults are the plainest way."""

    meters: float = 1.0
    kilograms: float = 1.0
    up: str = "Z"
    rate: float = 24.0
    start: float = 0.0
    place: np.ndarray = field(default_factory=lambda: np.eye(4))
    scale: float = 1.0
    nested: bool = False
    scoped: bool = False
    operations: str = "orient"
    composed: str = "flat"
    mass: str = "explicit"
    exchanged: frozenset[int] = frozenset()
    rolled: float = 0.0
    axes: str = "Z"
    welded: bool = False
    geometry: str = "tets"
    cubes: bool = False  # rigid bodies are cubes with a scale
    anchored: bool = False  # joints name prims below the bodies
    several: bool = False  # joints with six limits in place of hinges and slides
    posed: bool = False  # transforms of bodies are animated, not drives
    rooted: bool = False  # joints to the world name the prim of the robot
    shifted: bool = False  # time codes of the layer are other than those of the shot
    held: str = ""  # a base without a joint: kinematic, or with a fixed joint

    @property
    def world(self) -> np.ndarray:
        """Where the robot stands: z is up in it, before it is turned with gravity."""
        up = Rotation.from_euler("x", -90, degrees=True).as_matrix() if self.up == "Y" else np.eye(3)
        return placed(up) @ self.place

    def number(self, name: str, value: float, linear: bool) -> float:
        """An attribute of a motor in stage units."""
        length, mass, angle = _UNITS.get(name, (0, 0, 0))
        if linear and name in _UNITS:
            length, angle = (1, 0) if angle == 1 else (0 if name in _FEWER else np.sign(length), 0)
        return float(value * self.meters**-length * self.kilograms**-mass * np.degrees(1.0) ** angle)


def any_telling(seed: int) -> Telling:
    """A random one."""
    r = random.Random(seed)
    out = Telling(
        meters=r.choice([1.0, 0.01, 0.001]), kilograms=r.choice([1.0, 0.001]), up=r.choice("YZ"),
        rate=r.choice([24.0, 25.0, 30.0, 60.0]), start=r.choice([0.0, 1.0, -20.0, 1001.0]),
        place=placed(turn(r), [r.uniform(-1, 1) for _ in "xyz"]), scale=r.choice([1.0, 1.0, 0.01, 2.5]),
        nested=r.random() < 0.3, scoped=r.random() < 0.3, operations=r.choice(OPERATIONS),
        composed=r.choice(COMPOSED), mass=r.choice(MASSES), rolled=r.choice([0.0, 0.4]), axes=r.choice("XYZ"),
        exchanged=frozenset(k for k in range(6) if r.random() < 0.3), welded=r.random() < 0.2,
        geometry=r.choice(["tets", "mesh", "cube"]), cubes=r.random() < 0.15, anchored=r.random() < 0.2,
        several=r.random() < 0.2, rooted=r.random() < 0.2, shifted=r.random() < 0.2,
        held=r.choice(["", "kinematic", "fixed"]),
    )  # fmt: skip
    shifted = out.shifted and out.composed not in ("flat", "inherit")
    return replace(out, nested=out.nested and not out.cubes, shifted=shifted)


def welded(robot: Robot) -> Robot:
    """The robot whose last rigid link is two halves that a fixed joint holds together."""
    k = max((k for k, s in enumerate(robot.solids) if not s.modulus), default=None)
    if k is None:
        return robot
    old = robot.solids[k]
    half = old.edges * [0.5, 1.0, 1.0]
    near, far = (placed(at=(x * old.edges[0] / 4, 0, 0)) for x in (-1, 1))
    solids = [*robot.solids, Solid(old.density, half, far)]
    solids[k] = Solid(old.density, half, old.place @ near)
    joint = Joint("fixed", k, len(robot.solids), old.place, np.eye(4))
    return replace(robot, rest=[*robot.rest, robot.rest[k] @ old.place], solids=solids, joints=[*robot.joints, joint])


def reframed(robot: Robot) -> Robot:
    """The robot whose rigid bodies have the frames of their boxes."""
    into = [np.eye(4) if s.modulus else np.linalg.inv(s.place) for s in robot.solids] + [np.eye(4)]  # -1: the world
    solids = [s if s.modulus else replace(s, place=np.eye(4)) for s in robot.solids]
    joints = [replace(j, frame0=into[j.body0] @ j.frame0, frame1=into[j.body1] @ j.frame1) for j in robot.joints]
    rest = [x @ np.linalg.inv(into[k]) for k, x in enumerate(robot.rest)]
    targets, feet = (
        [(k, into[k] @ place, *more) for k, place, *more in marks] for marks in (robot.targets, robot.feet)
    )
    return replace(robot, solids=solids, joints=joints, rest=rest, targets=targets, feet=feet)


CHANGES: dict[str, dict] = {
    "centimetres": {"meters": 0.01}, "millimetres": {"meters": 0.001}, "grams": {"kilograms": 0.001},
    "Y up": {"up": "Y"}, "rate": {"rate": 60.0}, "start": {"start": -20.0}, "turned": {}, "scale": {"scale": 0.01},
    "nested": {"nested": True}, "scoped": {"scoped": True}, "exchanged": {"exchanged": frozenset(range(9))},
    "rolled": {"rolled": 0.4}, "axes": {"axes": "X"}, "axis Y": {"axes": "Y"}, "welded": {"welded": True},
    **{how: {"operations": how} for how in OPERATIONS[1:]}, **{how: {"composed": how} for how in COMPOSED[1:-1]},
    **{f"mass by {how}": {"mass": how} for how in MASSES[1:]}, "cubes": {"cubes": True},
    "cubes by density": {"cubes": True, "mass": "density"}, "anchored": {"anchored": True},
    "several": {"several": True, "axes": "Y"}, "posed": {"posed": True}, "rooted": {"rooted": True},
    "shifted": {"shifted": True, "composed": "reference"},
    "shifted sublayer": {"shifted": True, "composed": "sublayer", "rate": 30.0},
    "kinematic": {"held": "kinematic"}, "fixed": {"held": "fixed"}, "all": {},
}  # fmt: skip


def changed(name: str, seed: int) -> Telling:
    """The plainest telling with one change, or with all."""
    if name == "all":
        any_ = any_telling(seed)
        return replace(any_, composed="reference" if any_.composed == "instance" else any_.composed)
    if name == "turned":
        turn = Rotation.from_rotvec([0.5, -0.7, 1.1]).as_matrix()
        return Telling(place=placed(turn, (0.3, -0.2, 0.5)))
    return Telling(**CHANGES[name])
