"""A robot as a build script describes it, and its pose by forward kinematics. SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .shapes import Shape, volume_moments

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
AXIS_VECTORS = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Part:
    """A mesh of a body: its shape in the body frame and the name of its look."""

    name: str
    shape: Shape
    look: str


@dataclass(frozen=True)
class TargetSpec:
    """A frame that the retargeting watches: position in the body frame [m], and the weights."""

    name: str
    position: Vector
    position_weight: float = 1.0
    rotation_weight: float = 0.0


@dataclass(frozen=True)
class BodySpec:
    """A body; `mass` [kg] for a rigid one, None for a flexible one, whose mass follows from its material."""

    name: str
    parts: tuple[Part, ...]
    mass: float | None
    interface_radius: float | None = None
    targets: tuple[TargetSpec, ...] = ()


@dataclass(frozen=True)
class DriveSpec:
    """A servo: track [deg] at the frames, limits [deg], [deg/s], [deg/s^2], [N m].

    One that is named (see `calmotion motors`) gives as that motor does, and has its limits of speed and torque.
    """

    axis: str
    track: tuple[float, ...]
    lower: float
    upper: float
    max_velocity: float = math.inf
    max_acceleration: float = math.inf
    max_torque: float = math.inf
    motor: str = ""


@dataclass(frozen=True)
class JointSpec:
    """A joint; anchors are in the frames of the two bodies [m]. Parents come before children.

    One with a drive turns about the drive's axis. One with a passive axis turns as the others make it: its angles
    [deg] are then given for posing, unless its child stands already and it closes a loop.
    """

    name: str
    parent: str
    child: str
    anchor_parent: Vector
    anchor_child: Vector
    drive: DriveSpec | None = None
    passive: str | None = None
    angles: tuple[float, ...] = ()

    @property
    def axis(self) -> str | None:
        """What it turns about, if it turns."""
        return self.drive.axis if self.drive else self.passive


@dataclass(frozen=True)
class Pose:
    """A body frame in the world: position [m] and unit quaternion (w, x, y, z)."""

    position: Array
    rotation: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))


def multiply(a: Array, b: Array) -> Array:
    """Product of two quaternions (w, x, y, z)."""
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.concatenate([[a[0] * b[0] - a[1:] @ b[1:]], vector])


def turn(rotation: Array, vector: Sequence[float]) -> Array:
    """The vector turned by the unit quaternion."""
    v = np.asarray(vector, dtype=float)
    twice = 2.0 * np.cross(rotation[1:], v)
    return v + rotation[0] * twice + np.cross(rotation[1:], twice)


def pose_bodies(joints: Sequence[JointSpec], sample: int) -> dict[str, Pose]:
    """World pose of every body with the drives at one sample of their tracks."""
    poses = {"": Pose(np.zeros(3))}
    for joint in joints:
        if joint.child in poses:
            continue
        parent = poses[joint.parent]
        rotation = parent.rotation
        if joint.axis:
            half = 0.5 * np.radians((joint.drive.track if joint.drive else joint.angles)[sample])
            axis = np.array(AXIS_VECTORS[joint.axis])
            rotation = multiply(rotation, np.concatenate([[np.cos(half)], np.sin(half) * axis]))
        anchor = parent.position + turn(parent.rotation, joint.anchor_parent)
        poses[joint.child] = Pose(anchor - turn(rotation, joint.anchor_child), rotation)
    return poses


def mass_properties(body: BodySpec) -> tuple[float, Array, Array]:
    """Mass [kg], center [m] and diagonal of the inertia about it [kg m^2], the mass spread evenly over the parts."""
    if body.mass is None:
        raise ValueError(f"{body.name} is flexible: its mass follows from its material")
    moments = [volume_moments(part.shape) for part in body.parts]
    volume = sum(m[0] for m in moments)
    center = sum(m[1] for m in moments) / volume
    second = sum(m[2] for m in moments) / volume - np.outer(center, center)
    return body.mass, center, body.mass * (np.trace(second) - np.diag(second))
