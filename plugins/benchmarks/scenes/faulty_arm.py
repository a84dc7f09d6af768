"""Random arms with a known fault, as their model has them, and what is wrong with the real ones."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from calmotion.arrays import Array
from calmotion.model import (
    DRIVE,
    PRESCRIBED,
    WORLD,
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
from calmotion.multibody import span_tree
from calmotion.simulation import CompiledShot, compile_shot, reduce_bodies
from calmotion.testing import beam_mesh
from scipy.interpolate import CubicSpline

FAULTS = ("links", "servo_gains", "backlash", "friction", "stream", "delay", "base", "ripple")
# weak, medium and strong: frequency of the fore link [Hz]; damping ratio of a loop; play [rad]; friction over gain
# [rad]; length of gaps [s]; delay [s]; frequency of the base [Hz]; amplitude of a ripple [rad]
STRENGTHS: dict[str, tuple[float, float, float]] = {
    "links": (14.0, 9.0, 5.0), "servo_gains": (0.3, 0.15, 0.07), "backlash": (0.004, 0.012, 0.03),
    "friction": (0.006, 0.015, 0.04), "stream": (0.04, 0.07, 0.12), "delay": (0.02, 0.05, 0.12),
    "base": (12.0, 8.0, 4.5), "ripple": (0.002, 0.005, 0.012),
}  # fmt: skip
RATE = 60.0  # frames a second
STIFF = 40.0  # frequency of a fore link that does not shake [Hz]
DENSITY, POISSON = 1200.0, 0.35
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
LIFTS = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])  # joint axis z along -y: a positive angle lifts the arm


@dataclass(frozen=True, eq=False)
class FaultyArm:
    """An arm: a turning post, an upper link that lifts, a flexible fore link that lifts, with a load at its end.

    Attributes:
        upper, fore: Lengths [m].
        thickness: Of both links [m].
        load: [kg].
        frequency: Of the fore link, clamped at its root and without the rest [Hz], as the real one has it.
        loops: Frequency of each joint's loop [Hz], shape [3].
        times, command: Intended motion on a fine grid [s], [rad], shapes [T] and [T, 3].
        faults: What is wrong, with its size (`STRENGTHS`).
        gives: Whether the shot knows the gains.
        misjudged: Factor of the fore link's frequency in the model.
        seed: Of all that is random besides.
    """

    upper: float
    fore: float
    thickness: float
    load: float
    frequency: float
    loops: Array
    times: Array
    command: Array
    faults: dict[str, float]
    gives: bool
    misjudged: float
    seed: int

    DAMPING, HEALTHY, POST = 0.015, 0.8, 1.0  # of the link, of the loops; mass of the post [kg]

    @cached_property
    def modulus(self) -> float:
        """Young's modulus that gives the fore link its frequency [Pa]: of a cantilever with a load (Rayleigh)."""
        section = self.thickness**4 / 12.0
        beam = DENSITY * self.thickness**2 * self.fore
        return float((2.0 * np.pi * self.frequency) ** 2 * self.fore**3 * (self.load + 0.2357 * beam) / 3.0 / section)

    @cached_property
    def gains(self) -> tuple[Array, Array]:
        """Of the loops as the model has them [N m/rad], [N m s/rad], by the inertia of the stretched arm."""
        reach, m = self.upper + self.fore, self.link_masses
        about = np.array(
            [
                self.load * reach**2 + m[1] * (self.upper + 0.5 * self.fore) ** 2 + m[0] * self.upper**2 / 3.0,
                self.load * reach**2 + m[1] * (self.upper + 0.5 * self.fore) ** 2 + m[0] * self.upper**2 / 3.0,
                self.load * self.fore**2 + m[1] * self.fore**2 / 3.0,
            ]
        )
        gain = (2.0 * np.pi * self.loops) ** 2 * about
        return gain, 2.0 * self.HEALTHY * np.sqrt(gain * about)

    @property
    def link_masses(self) -> tuple[float, float]:
        """Of the upper and the fore link [kg]."""
        area = DENSITY * self.thickness**2
        return area * self.upper, area * self.fore

    def shot(self, cells: int = 12, across: int = 2, real: bool = False) -> CompiledShot:
        """The arm in our engine.

        Args:
            cells, across: Elements along and across the fore link.
            real: With the real modulus and gains that act, else as the model knows it.
        """
        modulus = self.modulus * (1.0 if real else self.misjudged**2)
        material = ElasticMaterial("/Arm/Plastic", modulus, POISSON, DENSITY, self.DAMPING)
        m, L, t = self.link_masses[0], self.upper, self.thickness
        across_it, along = m * (L**2 + t**2) / 12.0, m * t**2 / 6.0
        none = np.zeros(3)
        bodies = [
            Body("/Arm/Post", _at(0.0), MassProperties(self.POST, none, 1e-3 * np.eye(3))),
            Body(
                "/Arm/Upper",
                _at(0.0),
                MassProperties(m, np.array([0.5 * L, 0.0, 0.0]), np.diag([along, across_it, across_it])),
            ),
            Body("/Arm/Fore", _at(L), None, flexible=FlexibleSettings(material, elasticity="linear")),
            Body(
                "/Arm/Load",
                _at(L + self.fore),
                MassProperties(self.load, none, self.load * 4.0 * t**2 / 6.0 * np.eye(3)),
            ),
        ]
        joints = [
            Joint("/Arm/Yaw", "revolute", WORLD, 0, _at(0.0), _at(0.0)),
            Joint("/Arm/Shoulder", "revolute", 0, 1, _at(0.0, LIFTS), _at(0.0, LIFTS)),
            Joint("/Arm/Elbow", "revolute", 1, 2, _at(L, LIFTS), _at(0.0, LIFTS)),
            Joint("/Arm/Weld", "fixed", 2, 3, _at(self.fore), _at(0.0)),
        ]
        gain, damping = self.gains
        model = DRIVE if self.gives or real else PRESCRIBED
        motors = [
            Motor(k, joints[k].path, "", model=model, position_gain=gain[k] if model == DRIVE else 0.0,
                  velocity_gain=damping[k] if model == DRIVE else 0.0, damping_on="joint")
            for k in range(3)
        ]  # fmt: skip
        target = Target("/Arm/Load", 3, _at(0.0))
        down = np.array([0.0, 0.0, -9.81])
        character = Character("/Arm", tuple(bodies), tuple(joints), tuple(motors), (target,), down)
        points, tets = beam_mesh(self.fore, t, cells, across)
        meshes = FEMeshes((FEMesh(2, points, tets, MeshQuality(0.0, 0.0, 0.0)),))
        frames = _frames(self.times)
        tracks = tuple(Track(frames, np.interp(frames, self.times, column)) for column in self.command.T)
        return compile_shot(
            character, Animation(frames, tracks, tracks), reduce_bodies(character, span_tree(character), meshes)
        )


def _at(x: float, rotation: Array = IDENTITY) -> Frame:
    return Frame(np.array([x, 0.0, 0.0]), rotation)


def faulty_arm(seed: int, faults: dict[str, int]) -> FaultyArm:
    """The arm of a seed with some faults, each at a strength of 0, 1 or 2."""
    rng = np.random.default_rng([seed, 72])
    sizes = {name: STRENGTHS[name][strength] * rng.uniform(0.85, 1.15) for name, strength in faults.items()}
    times = np.arange(0.0, rng.uniform(6.0, 9.0), 5e-4)
    return FaultyArm(
        upper=rng.uniform(0.15, 0.35), fore=rng.uniform(0.2, 0.4), thickness=rng.uniform(0.018, 0.028),
        load=rng.uniform(0.1, 0.5), frequency=sizes.get("links", STIFF), loops=rng.uniform(6.0, 14.0, 3),
        times=times, command=_motion(times, rng), faults=sizes, gives=bool(rng.uniform() < 0.7),
        misjudged=float(np.exp(rng.normal(0.0, 0.05))), seed=seed,
    )  # fmt: skip


def _motion(times: Array, rng: np.random.Generator) -> Array:
    """Moves of all joints between poses, some with rests between, the last at rest."""
    command = np.zeros((len(times), 3))
    low, high = np.array([-1.2, 0.1, -1.2]), np.array([1.2, 1.2, 0.9])
    pose = rng.uniform(low, high)
    command[:] = pose
    t = 0.3
    while t < times[-1] - 1.2:
        length = rng.uniform(0.35, 1.3)
        goal = rng.uniform(low, high)
        largest = np.abs(goal - pose).max()
        goal = pose + (goal - pose) * min(1.0, 2.2 * length / max(largest, 1e-9))
        s = np.clip((times - t) / length, 0.0, 1.0)
        command += np.outer(s**3 * (10.0 - 15.0 * s + 6.0 * s * s), goal - pose)
        pose, t = goal, t + length + (rng.uniform(0.1, 0.5) if rng.uniform() < 0.4 else 0.0)
    frames = _frames(times)
    smooth = CubicSpline(frames, np.stack([np.interp(frames, times, column) for column in command.T], axis=1))
    return np.asarray(smooth(np.minimum(times, frames[-1])))


def _frames(times: Array) -> Array:
    """Times of the shot's frames."""
    return np.arange(0.0, times[-1] + 1e-9, 1.0 / RATE)


def played(arm: FaultyArm) -> Array:
    """What reaches the joints of a command: late, or with gaps or in coarse steps, shape [T, 3]."""
    rng = np.random.default_rng([arm.seed, 73])
    command, times = arm.command, arm.times
    if "stream" in arm.faults:
        length = arm.faults["stream"]
        if rng.uniform() < 0.5:
            phase = rng.uniform()
            ticks = (np.floor(times / length + phase) - phase) * length
            command = np.stack([np.interp(ticks, times, column) for column in command.T], axis=1)
        else:
            command = command.copy()
            for _ in range(rng.integers(4, 9)):
                own = int(length * rng.uniform(0.8, 1.3) / (times[1] - times[0]))
                first = _moving(arm.command, own, rng)
                command[first : first + own] = command[first]
    late = arm.faults.get("delay", 0.0)
    return np.stack([np.interp(times - late, times, column) for column in command.T], axis=1)


def _moving(command: Array, length: int, rng: np.random.Generator) -> int:
    """An instant at which the arm moves."""
    speed = np.abs(np.diff(command, axis=0)).max(axis=1)
    fast = np.flatnonzero(speed[:-length] > 0.3 * speed.max())
    return int(rng.choice(fast))
