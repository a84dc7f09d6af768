"""A four-bar with a flexible coupler, a synthetic closed chain for benchmarks and tests."""

import numpy as np
from calmotion.arrays import Array
from calmotion.model import (
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
)
from calmotion.model.character import WORLD
from calmotion.testing import beam_mesh
from calmotion.testing.beam_arms import LIFTS
from scipy.spatial.transform import Rotation

# crank, coupler, rocker and ground [m]: a crank-rocker (Grashof: 0.12 + 0.5 < 0.4 + 0.42)
CRANK, COUPLER, ROCKER, GROUND = 0.12, 0.42, 0.4, 0.5


def corners() -> Array:
    """Hinges in the first pose, crank upright: ground, crank's end, rocker's end, ground; shape [4, 3] [m]."""
    first, last = np.array([0.0, 0.0, CRANK]), np.array([GROUND, 0.0, 0.0])
    between = last - first
    distance = float(np.linalg.norm(between))
    along = (distance**2 + COUPLER**2 - ROCKER**2) / (2.0 * distance)
    across = np.array([-between[2], 0.0, between[0]]) / distance
    third = first + along * between / distance + np.sqrt(COUPLER**2 - along**2) * across
    return np.array([np.zeros(3), first, third, last])


def _pose(at: Array, to: Array) -> Frame:
    along = to - at
    turn = Rotation.from_euler("y", np.arctan2(-along[2], along[0]))
    return Frame(at, np.roll(turn.as_quat(), 1))


def four_bar(
    youngs_modulus: float = 2.0e9, density: float = 1200.0, thickness: float = 0.012, modes: int = 6,
    elasticity: str = "linear", damping: float = 0.01,
) -> tuple[Character, FEMeshes]:  # fmt: skip
    """Crank (driven), flexible coupler and rocker, on hinges about -y; gravity down z.

    Args:
        youngs_modulus, density: Of the coupler [Pa], [kg/m^3].
        thickness: Of the coupler, square [m].
        modes, elasticity, damping: See `FlexibleSettings` and `ElasticMaterial`.
    """
    points = corners()
    material = ElasticMaterial("/Bars/Plastic", youngs_modulus, 0.35, density, damping)
    settings = FlexibleSettings(material, mode_count=modes, elasticity=elasticity)
    names = ("Crank", "Coupler", "Rocker")
    bodies = []
    for k, (name, length, mass) in enumerate(zip(names, (CRANK, COUPLER, ROCKER), (0.05, 0.0, 0.15), strict=True)):
        start, end = (points[k], points[k + 1]) if name != "Rocker" else (points[3], points[2])
        inertia = mass * length**2 / 12.0 * np.diag([0.01, 1.0, 1.0])
        properties = MassProperties(mass, np.array([0.5 * length, 0.0, 0.0]), inertia)
        flexible = settings if name == "Coupler" else None
        bodies.append(Body(f"/Bars/{name}", _pose(start, end), None if flexible else properties, flexible=flexible))
    axis = Rotation.from_quat(np.roll(LIFTS, -1))

    def side(body: int, point: Array) -> Frame:
        if body == WORLD:
            return Frame(point, LIFTS)
        rest = bodies[body].rest
        back = Rotation.from_quat(np.roll(rest.rotation, -1)).inv()
        return Frame(back.apply(point - rest.position), np.roll((back * axis).as_quat(), 1))

    pairs = ((WORLD, 0), (0, 1), (1, 2), (WORLD, 2))
    joints = tuple(
        Joint(f"/Bars/Hinge{k}", "revolute", one, other, side(one, points[k]), side(other, points[k]))
        for k, (one, other) in enumerate(pairs)
    )
    motors = (Motor(0, joints[0].path, "drive:angular:physics:targetPosition"),)
    target = Target("/Bars/Coupler/Middle", 1, Frame(np.array([0.5 * COUPLER, 0.0, 0.0]), np.array([1.0, 0, 0, 0])))
    mesh = FEMesh(1, *beam_mesh(COUPLER, thickness, 10), MeshQuality(0.0, 0.0, 0.0))
    gravity = np.array([0.0, 0.0, -9.81])
    return Character("/Bars", tuple(bodies), joints, motors, (target,), gravity), FEMeshes((mesh,))
