"""A robot from Python alone: bodies, joints, motors and targets by their numbers, compiled to a `Model`."""

import numpy as np
from numpy.typing import ArrayLike

from calmotion.arrays import Array
from calmotion.model import WORLD, Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.model.motor import MODELS, ON_ERROR, ON_JOINT, PRESCRIBED, Rotor
from calmotion.multibody.model.model import Model, body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.support.naming import nearest

_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


class Mechanism:
    """Builds a model, placed in the pose in which all joint values are zero.

    In this pose the axes of all bodies are those of the world, which the chain of joints has to reach (`WORLD`).

    Args:
        gravity: [m/s^2], world axes.
    """

    def __init__(self, gravity: ArrayLike = (0.0, 0.0, -9.81)):
        self._gravity = np.asarray(gravity, dtype=float)
        self._bodies: list[Body] = []
        self._reduced: dict[int, ReducedBody] = {}
        self._joints: list[Joint] = []
        self._motors: list[Motor] = []
        self._targets: list[Target] = []

    def body(
        self, name: str, mass: float, center: ArrayLike, inertia: ArrayLike, position: ArrayLike = (0.0, 0.0, 0.0)
    ) -> int:
        """Add a rigid body.

        Args:
            mass: [kg].
            center: Centre of mass in its frame [m].
            inertia: About the centre, in its axes [kg m^2], shape [3, 3], or [3] for a diagonal one.
            position: Origin of its frame in the world [m].

        Returns:
            Its index, by which joints and targets name it.
        """
        about = np.asarray(inertia, dtype=float)
        properties = MassProperties(mass, np.asarray(center, dtype=float), np.diag(about) if about.ndim == 1 else about)
        return self._added(name, properties, position)

    def flexible_body(self, name: str, reduced: ReducedBody, position: ArrayLike = (0.0, 0.0, 0.0)) -> int:
        """Add a reduced body, clamped at the joint that leads to the world.

        Args:
            reduced: With a marker for each of its joints and then for each of its targets, in the order in which they
                are added.
            position: Origin of its frame in the world [m].

        Returns:
            Its index.
        """
        index = self._added(name, None, position)
        self._reduced[index] = reduced
        return index

    def _added(self, name: str, properties: MassProperties | None, position: ArrayLike) -> int:
        rest = Frame(np.asarray(position, dtype=float), _UPRIGHT)
        self._bodies.append(Body(f"/{name}", rest, properties))
        return len(self._bodies) - 1

    def joint(
        self, kind: str, body0: int, body1: int, position: ArrayLike, axis: ArrayLike = (0.0, 0.0, 1.0), name: str = ""
    ) -> int:
        """Add a joint.

        Args:
            kind: `fixed`, `revolute`, `prismatic`, `spherical` or `floating`.
            body0, body1: What it connects; its value is the motion of `body1` relative to `body0`.
            position: Where it is in the world [m].
            axis: Of a hinge or slider, world axes; any length.

        Returns:
            Its index, by which motors name it.
        """
        from scipy.spatial.transform import Rotation

        turn = Rotation.align_vectors(np.atleast_2d(np.asarray(axis, dtype=float)), [[0.0, 0.0, 1.0]])[0]
        frame0, frame1 = (
            Frame(self._inside(body, position), turn.as_quat(scalar_first=True)) for body in (body0, body1)
        )
        self._joints.append(Joint(f"/{name or f'joint{len(self._joints)}'}", kind, body0, body1, frame0, frame1))
        return len(self._joints) - 1

    def motor(
        self, joint: int, model: str = PRESCRIBED, position_gain: float = 0.0, velocity_gain: float = 0.0,
        damping_on: str = ON_ERROR, rotor: Rotor | None = None,
    ) -> int:  # fmt: skip
        """Drive a joint; `prescribed` follows its input exactly, `drive` and `servo` by gains (see `Motor`).

        Args:
            position_gain, velocity_gain: [N m/rad], [N m s/rad]; N/m and N s/m of a slider.
            damping_on: What the velocity gain multiplies: `error`, the input's rate less the joint's, or `joint`, the
                joint's own rate, as in position actuators of MuJoCo.
            rotor: Of a `servo`.

        Returns:
            Its index among the inputs of a simulation.

        Raises:
            ValueError: A model or a `damping_on` that does not exist.
        """
        for name, given, allowed in (("model", model, MODELS), ("damping_on", damping_on, (ON_JOINT, ON_ERROR))):
            if given not in allowed:
                raise ValueError(f"{name} is {given!r}. {nearest(given, allowed)}Use one of {', '.join(allowed)}")
        linear = self._joints[joint].kind == "prismatic"
        self._motors.append(
            Motor(
                joint, self._joints[joint].path, "", linear=linear, model=model, position_gain=position_gain,
                velocity_gain=velocity_gain, damping_on=damping_on, rotor=rotor or Rotor(),
            )
        )  # fmt: skip
        return len(self._motors) - 1

    def target(self, body: int, position: ArrayLike, name: str = "") -> int:
        """Follow a point of a body, given in the world [m]; returns its index among the targets."""
        frame = Frame(self._inside(body, position), _UPRIGHT)
        self._targets.append(Target(f"/{name or f'target{len(self._targets)}'}", body, frame))
        return len(self._targets) - 1

    def _inside(self, body: int, position: ArrayLike) -> Array:
        """A point of the world in the frame of a body."""
        origin = np.zeros(3) if body == WORLD else self._bodies[body].rest.position
        return np.asarray(position, dtype=float) - origin

    def compile(self) -> Model:
        """The model.

        Raises:
            ShotError: A body that no chain of joints connects to the world.
            ValueError: A reduced body with another number of markers than it has joints and targets.
        """
        character = Character(
            "/", tuple(self._bodies), tuple(self._joints), tuple(self._motors), tuple(self._targets), self._gravity
        )
        tree = span_tree(character)
        bodies = []
        for index, anchors in enumerate(body_anchors(character, tree)):
            reduced = self._reduced.get(index) or rigid_body(self._bodies[index], anchors)
            if len(reduced.markers) != len(anchors.frames):
                raise ValueError(
                    f"{self._bodies[index].path} has {len(reduced.markers)} markers, and {len(anchors.frames)} joints "
                    "and targets: reduce it with a marker for each"
                )
            bodies.append(reduced)
        return compile_model(character, tree, bodies)
