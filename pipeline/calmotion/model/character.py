"""What a character is: bodies, joints, motors, targets, materials. SI units, world axes of the stage.

Rotations are unit quaternions `(w, x, y, z)` that turn body axes into the axes of the frame they are given in.
Indices point into the character's tuples; body index -1 is the world.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model.animation import Contact
from calmotion.model.meshes import Core, Part
from calmotion.model.motor import PRESCRIBED, Motor
from calmotion.model.tempo import TempoSettings
from calmotion.model.uncertainty import Uncertainty

WORLD = -1


def prim_path(path: str) -> str:
    """The prim of a path that may have the name of an axis behind it."""
    return path.partition(".")[0]


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame fixed in a body (or in the world).

    Attributes:
        position: Origin [m], shape [3], in the axes of the carrying body.
        rotation: Unit quaternion (w, x, y, z), shape [4].
    """

    position: Array
    rotation: Array

    @property
    def axis(self) -> Array:
        """Its z axis, in the axes of the carrying body, shape [3]."""
        w, x, y, z = self.rotation
        return np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass of a body.

    Attributes:
        mass: [kg].
        center: Center of mass [m], shape [3], body frame.
        inertia: Inertia tensor about the center of mass [kg m^2], shape [3, 3], body axes.
    """

    mass: float
    center: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class ElasticMaterial:
    """Isotropic elastic material with damping.

    Attributes:
        path: Prim path of the material.
        youngs_modulus: [Pa].
        poissons_ratio: [-].
        density: [kg/m^3].
        damping_ratio: Fraction of critical damping of each mode of the character, used when `rayleigh` is None.
        rayleigh: (mass [1/s], stiffness [s]) coefficients, or None.
        core: Of a printed body, whose skin is of this material; None: it is solid.
        parts: Of a body that is made of several materials; all is in one of them. Empty: all is of this material.
    """

    path: str
    youngs_modulus: float
    poissons_ratio: float
    density: float
    damping_ratio: float = 0.01
    rayleigh: tuple[float, float] | None = None
    core: Core | None = None
    parts: tuple[Part, ...] = ()


@dataclass(frozen=True, eq=False)
class FlexibleSettings:
    """How a body is made flexible; -1 means: choose automatically.

    Attributes:
        material: Its elastic material.
        mode_count: Number of elastic coordinates to keep.
        max_frequency: Highest frequency of fixed-interface modes to keep [Hz].
        element_size: Edge length of the elements [m].
        interface_radius: Radius of the interface patch around the origin of a joint [m].
        mesh_file: External mesh file, resolved; empty when the geometry is in the shot.
        mesh_scale: Metres per unit of that file.
        elasticity: `auto`, `linear`, `stvk` or `neohookean`.
        geometry: What the solid is made of: `auto`, `visual` or `collision` surfaces, or an equivalent `beam`.
        wall_thickness: Of a hollow part whose geometry is its outer surface [m]; -1: it is solid.
        section: Of a hollow part: `closed` all around (as `auto`), or a `tube` whose ends are open.
        modes_share: Of the tolerance, that modes which are left out may take when they are chosen automatically.
        pairs_share: Of the tolerance, that quadratic strains of pairs of coordinates which are left out may take; 0
            leaves none out.
    """

    material: ElasticMaterial
    mode_count: int = -1
    max_frequency: float = -1.0
    element_size: float = -1.0
    interface_radius: float = -1.0
    mesh_file: str = ""
    mesh_scale: float = 1.0
    elasticity: str = "auto"
    geometry: str = "auto"
    wall_thickness: float = -1.0
    section: str = "auto"
    modes_share: float = 1.0
    pairs_share: float = 1.0


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """A triangulated surface carried by a body.

    Attributes:
        path: Prim path.
        points: [m], shape [n, 3], body frame.
        triangles: Shape [m, 3], int32, outward by the right-hand rule as authored.
        color: Linear RGB in 0..1, or None.
        visible: False for collision and guide geometry.
        displaced: How many of the leading points are the prim's own points, in the prim's order (0 for a cube,
            sphere and the like, whose points cannot be written back).
    """

    path: str
    points: Array
    triangles: IntArray
    color: tuple[float, float, float] | None = None
    visible: bool = True
    displaced: int = 0

    @property
    def drawn(self) -> bool:
        """Whether it appears in pictures."""
        return self.visible and len(self.triangles) > 0


@dataclass(frozen=True, eq=False)
class InterfaceSurface:
    """An interface patch: the part of a body's surface that is attached to a joint, named in the shot.

    Attributes:
        path: Prim path of the subset.
        joint: Prim path of the joint.
        triangles: Corners [m], shape [k, 3, 3], body frame, outward.
    """

    path: str
    joint: str
    triangles: Array


@dataclass(frozen=True, eq=False)
class TetGeometry:
    """Linear tetrahedra authored in the shot: `points` [m], shape [n, 3], body frame; `tets` [m, 4], int32."""

    path: str
    points: Array
    tets: IntArray


@dataclass(frozen=True, eq=False)
class Body:
    """A component: rigid, or flexible when `flexible` is given.

    Attributes:
        path: Prim path.
        rest: Pose of the body frame in the world at the first frame of the shot.
        mass: Mass properties; None for a flexible body whose mass follows from its mesh and density.
        surfaces: Geometry for pictures and meshing, body frame.
        tets: Tetrahedra authored in the shot, or None.
        flexible: Settings, or None for a rigid body.
        interfaces: Interface patches that are named in the shot.
        stiff: Whether a flexible body is simulated as rigid, as the user forces it; it then has a `mass`.
        non_rotating: Whether it does not rotate in this shot, so that its inertia is constant.
        between: Path of the joint of several axes that it is a part of, between two of them; it then is no prim, and
            its mass is that of nothing that matters. Empty for the bodies of the shot.
    """

    path: str
    rest: Frame
    mass: MassProperties | None
    surfaces: tuple[SurfaceMesh, ...] = ()
    tets: TetGeometry | None = None
    flexible: FlexibleSettings | None = None
    interfaces: tuple[InterfaceSurface, ...] = ()
    stiff: bool = False
    non_rotating: bool = False
    between: str = ""

    @property
    def simulated_flexible(self) -> bool:
        """Whether it is simulated as flexible."""
        return self.flexible is not None and not self.stiff


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint between two bodies; its axis is the z axis of both frames.

    Attributes:
        path: Prim path; of one axis of a joint of several axes with the name of the axis behind it (`/Arm/wrist.rotX`).
        kind: `revolute`, `prismatic`, `spherical`, `fixed`, or `floating` of a base that only contacts hold.
        body0, body1: Body indices, -1 for the world. The angle is that of body1 relative to body0 about z, the
            length of a prismatic joint that of frame1 beyond frame0 along z.
        frame0, frame1: The joint frame in body0 (in the world for -1) and in body1.
        lower, upper: Limits [rad or m], infinite when there are none.
        closes_chain: Whether the shot excludes this joint from the spanning tree, so that it closes a chain.
        redundant: Whether it is left out of the dynamics, since other joints impose the same constraints.
        name: As its author wrote it, where USD allows no such name of a prim; else the last part of its path.
        contact: When it holds, of a joint to the world that comes and goes; else None.
    """

    path: str
    kind: str
    body0: int
    body1: int
    frame0: Frame
    frame1: Frame
    lower: float = -np.inf
    upper: float = np.inf
    closes_chain: bool = False
    redundant: bool = False
    name: str = ""
    contact: Contact | None = None

    @property
    def prim_path(self) -> str:
        """Path of its prim, without the name of an axis."""
        return prim_path(self.path)


@dataclass(frozen=True, eq=False)
class Target:
    """A frame whose error is measured.

    Attributes:
        path: Prim path.
        body: Body index.
        frame: The target's frame in that body, undeformed.
        position_weight, rotation_weight: Weights of the squared position error [1/m^2] and rotation error [1/rad^2].
    """

    path: str
    body: int
    frame: Frame
    position_weight: float = 1.0
    rotation_weight: float = 0.0


DEFAULT_TOLERANCE = 1e-3  # accuracy of the simulation at the targets where none is given [m]


@dataclass(frozen=True, eq=False)
class RetargetSettings:
    """The shot's settings of the optimisation; None: chosen automatically.

    Attributes:
        tolerance: Accuracy of the simulation at the targets [m].
        goal: Error that is accepted at the targets after optimising [m].
        time_step: Step of the simulation [s].
        knot_spacing: Distance of the spline's knots [s].
        smoothness: Weight of the regulariser.
        reference: `rigid` or `static`.
        endpoints: `free` or `kept`.
        cyclic: Whether the shot is cyclic.
        uncertainty: What is not known exactly of the robot.
        tempo: How the tempo may change where that is asked for.
    """

    tolerance: float | None = None
    time_step: float | None = None
    knot_spacing: float | None = None
    smoothness: float | None = None
    reference: str = "rigid"
    endpoints: str = "free"
    cyclic: bool = False
    uncertainty: Uncertainty = Uncertainty()
    tempo: TempoSettings = TempoSettings()
    goal: float | None = None


@dataclass(frozen=True, eq=False)
class Character:
    """A robotic character, SI.

    Attributes:
        path: Prim path of its root.
        gravity: [m/s^2], shape [3], world.
        notes: Assumptions of the reader where the shot does not say, as sentences for the user.
        scenery: Still geometry near the robot that is drawn and has no part in the physics; world axes [m].
    """

    path: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    motors: tuple[Motor, ...]
    targets: tuple[Target, ...]
    gravity: Array
    retarget: RetargetSettings = field(default_factory=RetargetSettings)
    notes: tuple[str, ...] = ()
    scenery: tuple[SurfaceMesh, ...] = ()


def contact_joints(character: Character) -> list[int]:
    """The joints that come and go."""
    return [k for k, joint in enumerate(character.joints) if joint.contact is not None]


def switched_motors(character: Character) -> list[int]:
    """The motors that are switched off and on."""
    return [k for k, motor in enumerate(character.motors) if motor.powered is not None]


def motors_give(character: Character) -> bool:
    """Whether a joint does not follow the curve of its motor exactly."""
    return any(motor.model != PRESCRIBED for motor in character.motors)


def with_ideal_motors(character: Character) -> Character:
    """The character whose joints follow the curves of their motors exactly; itself where they do already."""
    if not motors_give(character):
        return character
    return replace(character, motors=tuple(replace(motor, model=PRESCRIBED) for motor in character.motors))


def with_settings(character: Character, change: Callable[[FlexibleSettings], FlexibleSettings]) -> Character:
    """The character, with the settings of its flexible bodies changed."""
    bodies = tuple(
        body if body.flexible is None else replace(body, flexible=change(body.flexible)) for body in character.bodies
    )
    return replace(character, bodies=bodies)
