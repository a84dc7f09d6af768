"""Random robots in SI units, drawn from a seed, told in one way; `stages` writes them to USD in many."""

import random
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

WORLD = -1
TREES, LOOPS = ("chain", "branched", "stiff chain"), ("four-bar", "parallelogram")
KINDS = (*TREES, *LOOPS, "feet", "free base")


def placed(turn=None, at=(0.0, 0.0, 0.0)) -> np.ndarray:
    """A transform [4, 4] of column vectors: a rotation, then a translation [m]."""
    out = np.eye(4)
    out[:3, :3] = np.eye(3) if turn is None else turn
    out[:3, 3] = at
    return out


@dataclass
class Solid:
    """A uniform box: density [kg/m^3], edges [m], place in the body; elastic ones have a modulus [Pa] and damping."""

    density: float
    edges: np.ndarray
    place: np.ndarray
    modulus: float = 0.0
    damping: float = 0.01

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.density * np.prod(self.edges))

    @property
    def moments(self) -> np.ndarray:
        """About its centre, along its own axes [kg m^2]."""
        return self.mass / 12.0 * (np.sum(self.edges**2) - self.edges**2)


@dataclass
class Joint:
    """Frames in the two bodies; the axis is z. Values are in rad or m.

    Attributes:
        motor: `calm:motor` attributes by name, SI; None for a joint without a drive.
        drive: UsdPhysics' own stiffness, damping, ..., SI.
        keys: Times [s] and values of the curve; one key is a target position without samples.
        closes: Whether it closes a chain.
    """

    kind: str
    body0: int
    body1: int
    frame0: np.ndarray
    frame1: np.ndarray
    motor: dict | None = None
    drive: dict = field(default_factory=dict)
    limits: tuple[float, float] | None = None
    keys: tuple[np.ndarray, np.ndarray] | None = None
    closes: bool = False

    @property
    def linear(self) -> bool:
        """Whether it slides."""
        return self.kind == "prismatic"


@dataclass
class Robot:
    """Bodies at their poses in the file, joints, targets (body, place, weights) and feet (body, place, keys)."""

    kind: str
    seconds: float
    rest: list[np.ndarray]
    solids: list[Solid]
    joints: list[Joint]
    targets: list[tuple[int, np.ndarray, float, float]]
    feet: list[tuple[int, np.ndarray, str, dict[float, bool] | None]] = field(default_factory=list)
    retarget: dict = field(default_factory=dict)

    @property
    def reach(self) -> float:
        """[m]."""
        ends = [x[:3, 3] + d for x, s in zip(self.rest, self.solids, strict=True) for d in (s.edges, -s.edges)]
        return float(np.max(np.ptp(np.array(ends), axis=0)))


def turn(r: random.Random) -> np.ndarray:
    """A rotation: none, quarter turns, or any."""
    which = r.random()
    if which < 0.4:
        return np.eye(3)
    angles = [90.0 * r.randrange(4) for _ in "xyz"] if which < 0.7 else [r.uniform(-180.0, 180.0) for _ in "xyz"]
    return Rotation.from_euler("xyz", angles, degrees=True).as_matrix()


def _keys(r: random.Random, seconds: float, size: float, dense: bool):
    """Keys that start at rest, sparse or dense, some held; rarely one or two."""
    if r.random() < 0.03 and not dense:
        return np.zeros(1), np.array([r.uniform(-size, size)])
    frames = round(24 * seconds)
    if dense or r.random() < 0.4:
        k = np.arange(frames + 1)
        values = (
            r.uniform(-size, size) * np.sin(np.pi * np.clip((k - 3) / (frames - 6), 0, 1) * r.choice([1, 1, 2])) ** 2
        )
        return k / 24, r.uniform(-size, size) + values
    k = sorted(
        {0, 3, *(r.randrange(4, frames) for _ in range(r.choice([1, 2, 4]))), *([frames] if r.random() < 0.8 else [])}
    )
    values = [r.uniform(-size, size)]
    for _ in k[1:]:
        values.append(values[-1] if len(values) == 1 or r.random() < 0.2 else r.uniform(-size, size))
    return np.array(k) / 24, np.array(values)


def _calm_motor(r: random.Random, inertia: float) -> dict:
    """A compliant motor of some Hz at this load, which MuJoCo has as well."""
    speed = 2 * np.pi * r.choice([4, 8, 15, 40])
    armature = inertia * r.choice([0.0, 0.05, 1.0])
    gain = (inertia + armature) * speed**2
    out = {"model": r.choice(["drive", "servo"]), "positionGain": gain, "dampingOn": r.choice(["joint", "error"])}
    out["velocityGain"] = 2 * r.choice([0.05, 0.3, 0.8]) * gain / speed
    if out["model"] == "servo":
        out["armature"] = armature
        out["viscousFriction"] = r.choice([0.0, 0.1]) * gain / speed
    return out


def _wild_motor(r: random.Random, inertia: float) -> dict:
    """Any attributes."""
    out = {"model": r.choice(["servo", "servo", "servo", "drive", "prescribed", "auto"])}
    gain = out["positionGain"] = inertia * (2 * np.pi * r.choice([0.5, 3, 10, 50, 500])) ** 2
    J = inertia
    for name, values, share in (
        ("velocityGain", [0, 0.001 * gain, 0.05 * gain, gain], 0.8), ("armature", [0, 1e-9, 0.1 * J, J, 10 * J], 0.6),
        ("gearStiffness", [0.1 * gain, gain, 100 * gain], 0.5), ("gearDamping", [0, 1e-3 * gain], 0.4),
        ("friction", [0, 1e-3 * gain, 0.1 * gain], 0.4), ("frictionSpeed", [1e-4, 0.05, 1], 0.2),
        ("viscousFriction", [0, 1e-3 * gain, 0.1 * gain], 0.4), ("maxTorque", [0.03 * gain, gain, 1e4 * gain], 0.4),
        ("noLoadSpeed", [0.5, 10, 100], 0.3), ("torqueSpeedKnee", [0, 0.3, 0.9], 0.2), ("delay", [0, 0.003, 0.05], 0.3),
        ("backlash", [0, 0.01], 0.2), ("maxVelocity", [0.5, 5, 50], 0.3), ("maxAcceleration", [5, 100, 1e4], 0.3),
        ("maxJerk", [1e3, 1e6], 0.15), ("optimize", [False], 0.1), ("dampingOn", ["joint", "error"], 0.3),
    ):  # fmt: skip
        if r.random() < share:
            out[name] = r.choice(values)
    if r.random() < 0.3:
        law = out["frictionModel"] = r.choice(["stribeck", "load", "stribeckLoad", "directional", "quadratic"])
        extra = {
            "stribeck": 1e-3 * gain,
            "load": 0.2,
            "motorLoad": 0.1,
            "jointLoad": 0.1,
            "motorQuadratic": 0.01 / gain,
        }
        of = {"stribeck": ("stribeck",), "load": ("load",), "stribeckLoad": ("stribeck", "load")}
        for name in of.get(law, ("motorLoad", "jointLoad") + (("motorQuadratic",) if law == "quadratic" else ())):
            out[f"friction:{name}"] = extra[name]
    if out["model"] == "servo" and r.random() < 0.15:
        out["powered"] = {0.0: True, 0.25: False, 0.5: True}
    return out


def _driven(r: random.Random, joint: Joint, seconds: float, inertia: float, wild: bool, dense: bool) -> None:
    """Make a joint a motor: with a curve, and gains, limits and laws."""
    size = 0.05 if joint.linear else 0.6
    joint.keys, joint.motor = _keys(r, seconds, size, dense), {}
    if r.random() < 0.5:
        joint.motor = (_wild_motor if wild else _calm_motor)(r, inertia)
    if wild and r.random() < 0.3:
        joint.drive = {"stiffness": inertia * 1e3, "damping": r.choice([0.0, inertia * 10.0])}
        if r.random() < 0.3:
            joint.drive["type"] = r.choice(["force", "acceleration"])
        if r.random() < 0.3:
            joint.drive["targetVelocity"] = r.choice([0.0, 0.1])
        if r.random() < 0.3:
            joint.drive["maxForce"] = inertia * 1e3
    if r.random() < 0.3:
        joint.limits = (-3.0 * size, (0.5 if wild else 3.0) * size)


def _flexible(r: random.Random, solid: Solid) -> None:
    solid.modulus, solid.damping = r.choice([2e8, 2e9, 7e10]), r.choice([0.005, 0.02])


def draw(seed: int, wild: bool, kind: str | None = None, dense: bool = False) -> Robot:
    """A random robot.

    Args:
        wild: With motors of any attributes, and passive joints; else of such as MuJoCo has as well.
        kind: One of `KINDS`; None: any.
        dense: Curves have keys at all frames.
    """
    r = random.Random(seed)
    kind = kind or r.choices(KINDS, (3, 2, 2, 1.5, 0.7, 1, 1))[0]
    seconds = r.choice([0.5, 1.0, 1.0, 1.5])
    if kind in LOOPS:
        robot = _linkage(r, kind, seconds)
    else:
        robot = _tree(r, kind, seconds, wild)
    if wild:
        for name, values, share in (
            ("reference", ["static"], 0.15), ("endpoints", ["kept"], 0.15), ("tolerance", [1e-4, 1e-2], 0.2),
            ("goal", [1e-3], 0.1), ("knotSpacing", [0.1], 0.1), ("smoothness", [1e-3], 0.1), ("cyclic", [True], 0.05),
        ):  # fmt: skip
            if r.random() < share:
                robot.retarget[name] = r.choice(values)
    inertia = 0.01 * sum(s.mass for s in robot.solids) * robot.reach**2
    for joint in robot.joints:
        if joint.motor is not None:
            load = sum(s.mass for s in robot.solids[joint.body1 :]) if joint.linear else inertia * 10
            _driven(r, joint, seconds, load, wild, dense)
    return robot


def _tree(r: random.Random, kind: str, seconds: float, wild: bool) -> Robot:
    """Links along one another; of feet, two legs below a body; a free base has no joint to the world."""
    size, density = r.choice([0.1, 0.4, 0.4, 1.0]), r.choice([300.0, 1200.0, 7800.0])
    count = 3 if kind == "feet" else r.choice([1, 2, 2, 3, 3, 4, 5]) + (kind == "free base")
    rest, solids, joints, feet, used = [], [], [], [], set()
    heading = Rotation.from_euler("xyz", [r.uniform(-3, 3) for _ in "xyz"]).as_matrix() if kind != "feet" else np.eye(3)
    for k in range(count):
        length, thick = size * r.uniform(0.4, 1.0), size * r.choice([0.06, 0.1, 0.15])
        edges = np.array([length, thick, thick * r.choice([1.0, 1.0, 0.5])])
        parent = 0 if kind == "feet" and k else r.randrange(-1 if k == 0 else 0, k) if kind == "branched" else k - 1
        if kind == "feet":
            edges = np.array([thick, thick, length]) if k else np.array([size, size, 0.1 * size])
            near = placed(at=(0, (k - 1.5) * 0.6 * size, -edges[2] / 2 if k == 0 else -0.05 * size))
            box = placed(at=(0, 0, -length / 2) if k else (0, 0, 0))
        else:
            near = (
                placed(at=(solids[parent].edges[0], 0, 0))
                if parent != WORLD
                else placed(heading, [r.uniform(-1, 1) * size for _ in "xyz"])
            )
            near = near @ placed(Rotation.from_euler("xyz", [0, 0, r.choice([0, 0, 1.2, -1.2])]).as_matrix())
            box = placed(at=(length / 2, 0, 0))
        frame = placed(turn(r)) if kind != "feet" else placed(Rotation.from_euler("x", -90, degrees=True).as_matrix())
        here = (rest[parent] if parent != WORLD else np.eye(4)) @ near
        rest.append(here)
        solid = Solid(density * r.choice([1, 1, 0.3]), edges, box)
        if kind not in ("stiff chain", "feet") and r.random() < 0.35:
            _flexible(r, solid)
        elif kind != "feet" and r.random() < 0.4:  # no symmetric box on the axis
            solid.place = box @ placed(turn(r), [0.2 * thick * r.uniform(-1, 1) for _ in "xyz"])
        solids.append(solid)
        if not (k == 0 and kind in ("feet", "free base")):
            what = (
                "revolute"
                if kind == "feet"
                else r.choices(("revolute", "prismatic", "fixed", "spherical"), (6, 1.5, 1, 0.5 * wild))[0]
            )
            if k == count - 1 and not any(joint.motor is not None for joint in joints):
                what = "revolute"
            passive = what in ("fixed", "spherical") or (wild and k < count - 1 and r.random() < 0.12)
            joints.append(Joint(what, parent, k, near @ frame, frame, None if passive else {}))
        used.add(parent)
    if kind == "feet":
        for k in (1, 2):
            # ideal motors between two feet that are held contradict each other
            lifted = None if k == 1 or r.random() < 0.2 * wild else {0.0: False}
            feet.append((k, placed(at=(0, 0, -solids[k].edges[2])), "sole", lifted))
    leaves = [k for k in range(count) if k not in used] or [0]
    targets = [(k, placed(at=solids[k].place[:3, 3] * 2), 1.0, r.choice([0.0, 0.0, 0.05])) for k in leaves]
    if kind == "feet":
        targets = [(0, placed(at=(0.3 * size, 0, 0)), 1.0, 0.0)]
    return Robot(kind, seconds, rest, solids, joints, targets, feet)


def _linkage(r: random.Random, kind: str, seconds: float) -> Robot:
    """A planar crank, coupler and rocker whose crank is driven; pins along z of a plane that lies anyhow."""
    size = r.choice([0.2, 0.5])
    a, b, c, d = size * np.array([0.25, 1.0, 0.8, 1.1]) if kind == "four-bar" else size * np.array([0.4, 1.0, 0.4, 1.0])
    angle = r.uniform(0.8, 1.6)
    A = a * np.array([np.cos(angle), np.sin(angle)])
    to = np.array([d, 0.0]) - A
    far = np.linalg.norm(to)
    along = (b * b - c * c + far * far) / (2 * far)
    B = A + along * to / far + np.sqrt(b * b - along**2) * np.array([-to[1], to[0]]) / far
    plane = placed(turn(r), [r.uniform(-1, 1) * size for _ in "xyz"])
    ends = [(np.zeros(2), A), (A, B), (B, np.array([d, 0.0]))]
    rest, solids, joints = [], [], []
    for k, (start, end) in enumerate(ends):
        v = end - start
        length = float(np.linalg.norm(v))
        here = placed(Rotation.from_rotvec([0, 0, np.arctan2(v[1], v[0])]).as_matrix(), (*start, 0.0))
        rest.append(plane @ here)
        solids.append(Solid(1200.0, length * np.array([1.0, 0.08, 0.08]), placed(at=(length / 2, 0, 0))))
        if k == 1 and r.random() < 0.4:
            _flexible(r, solids[-1])
        near = (
            placed(at=(0, 0, 0))
            if k == 0
            else placed(Rotation.from_rotvec([0, 0, 0]).as_matrix(), (solids[k - 1].edges[0], 0, 0))
        )
        carrier = plane if k == 0 else near
        aligned = np.linalg.inv(plane if k == 0 else rest[k - 1] @ near) @ rest[k]  # so that the frames agree at rest
        joints.append(Joint("revolute", k - 1, k, carrier @ aligned, np.eye(4), {} if k == 0 else None))
    end = placed(at=(solids[2].edges[0], 0, 0))
    joints.append(Joint("revolute", WORLD, 2, rest[2] @ end, end, closes=r.random() < 0.5))
    target = (1, placed(at=(solids[1].edges[0] / 2, 0.1 * size, 0)), 1.0, 0.0)
    return Robot(kind, seconds, rest, solids, joints, [target])
