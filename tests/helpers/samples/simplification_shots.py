"""Synthetic shots, each of which allows one simplification, to measure its gain and its error."""

from dataclasses import dataclass, replace

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
    TetGeometry,
)
from calmotion.model.character import WORLD
from calmotion.testing import beam_arm, beam_mesh, quintic, shot_of
from calmotion.testing.beam_arms import IDENTITY, LIFTS

_ANGLE, _LENGTH = "drive:angular:physics:targetPosition", "drive:linear:physics:targetPosition"
_SIDE = np.roll(np.array([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]), 1)  # z to x: a slider's axis along x


@dataclass(frozen=True, eq=False)
class SimplificationShot:
    """A shot with meshes for all flexible bodies."""

    name: str
    character: Character
    animation: Animation
    meshes: FEMeshes


def _swing(seconds: float = 2.0, motors: int = 2, rate: float = 24.0) -> Animation:
    move, back = quintic(0.8, 0.4, 0.2), quintic(-1.1, 0.35, 0.9)
    return shot_of(lambda t: move(t) + back(t), seconds, motors, rate)


def _with_geometry(character: Character, meshes: FEMeshes) -> Character:
    """The character with its meshes as authored tetrahedra: they determine the stiffness of a body before meshing."""
    bodies = list(character.bodies)
    for mesh in meshes.meshes:
        body = bodies[mesh.body]
        bodies[mesh.body] = replace(body, tets=TetGeometry(body.path, mesh.points, mesh.tets))
    return replace(character, bodies=tuple(bodies))


def plastic_arm(rate: float = 24.0) -> SimplificationShot:
    """Two plastic links that swing, animated at so many frames a second."""
    character, meshes = beam_arm(2, length=0.3, thickness=0.014, payload=0.2)
    return SimplificationShot("arm", _with_geometry(character, meshes), _swing(rate=rate), meshes)


def mixed_arm(cells: int = 8, across: int = 2) -> SimplificationShot:
    """A plastic link, always of the same modes, on one of thick steel, whose mesh has so many cells."""
    character, meshes = beam_arm(2, length=0.3, thickness=0.014, payload=0.2, modes=8)
    settings = FlexibleSettings(ElasticMaterial("/Arm/Steel", 2.1e11, 0.3, 7800.0))
    bodies = (replace(character.bodies[0], flexible=settings), *character.bodies[1:])
    thick = FEMesh(0, *beam_mesh(0.3, 0.08, cells, across), MeshQuality(0.0, 0.0, 0.0))
    meshes = FEMeshes((thick, meshes.meshes[1]))
    return SimplificationShot(
        "steel and plastic", _with_geometry(replace(character, bodies=bodies), meshes), _swing(), meshes
    )


def gantry(masts: int = 3) -> SimplificationShot:
    """A carriage on a slider, with plastic masts and loads on it that sway but do not rotate."""
    material = ElasticMaterial("/Gantry/Plastic", 1.8e9, 0.35, 1200.0, 0.01)
    settings = FlexibleSettings(material, mode_count=24, elasticity="linear")
    # a mast stands along z: the beam's x axis is turned there
    upright = np.roll(np.array([0.0, -np.sqrt(0.5), 0.0, np.sqrt(0.5)]), 1)
    bodies = [Body("/Gantry/Carriage", _frame(0.0), MassProperties(5.0, np.zeros(3), 0.05 * np.eye(3)))]
    joints = [Joint("/Gantry/Slider", "prismatic", WORLD, 0, _frame(0.0, rotation=_SIDE), _frame(0.0, rotation=_SIDE))]
    targets, meshes = [], []
    for k in range(masts):
        mast, load = len(bodies), len(bodies) + 1
        y = 0.1 * k
        bodies.append(Body(f"/Gantry/Mast{k}", _frame(0.0, y, 0.0, upright), None, flexible=settings))
        small = MassProperties(0.2, np.zeros(3), 5e-5 * np.eye(3))
        bodies.append(Body(f"/Gantry/Load{k}", _frame(0.0, y, 0.6, upright), small))
        joints.append(Joint(f"/Gantry/Foot{k}", "fixed", 0, mast, _frame(0.0, y, 0.0, upright), _frame(0.0)))
        joints.append(Joint(f"/Gantry/Top{k}", "fixed", mast, load, _frame(0.6), _frame(0.0)))
        targets.append(Target(f"/Gantry/Load{k}", load, _frame(0.0)))
        meshes.append(FEMesh(mast, *beam_mesh(0.6, 0.02, 12), MeshQuality(0.0, 0.0, 0.0)))
    motors = (Motor(0, joints[0].path, _LENGTH, linear=True),)
    character = Character("/Gantry", tuple(bodies), tuple(joints), motors, tuple(targets), np.array([0.0, 0.0, -9.81]))
    made = FEMeshes(tuple(meshes))
    return SimplificationShot("gantry", _with_geometry(character, made), shot_of(quintic(0.5, 0.5, 0.2), 2.0), made)


def clevis_arm(links: int = 6) -> SimplificationShot:
    """Rigid links whose hinges have two pins each, as drawn in CAD: one is driven, the other closes a
    chain with redundant constraints; and a plastic tool at the end."""
    arm, meshes = beam_arm(1, length=0.3, thickness=0.014, payload=0.1)
    length, width = 0.15, 0.03
    inertia = MassProperties(0.4, np.array([0.5 * length, 0.0, 0.0]), 1e-3 * np.eye(3))
    bodies = [Body(f"/Clevis/Link{k}", _frame(k * length), inertia) for k in range(links)]
    joints, motors = [], []
    for k in range(links):
        x = length if k else 0.0
        for side, y in (("Left", width), ("Right", -width)):
            path = f"/Clevis/{side}{k}"
            joints.append(Joint(path, "revolute", k - 1, k, _frame(x, y, 0.0, LIFTS), _frame(0.0, y, 0.0, LIFTS)))
        motors.append(Motor(len(joints) - 2, joints[-2].path, _ANGLE))
    end = links * length
    for body in arm.bodies:
        moved = Frame(body.rest.position + np.array([end, 0.0, 0.0]), body.rest.rotation)
        bodies.append(replace(body, path=f"/Clevis{body.path}", rest=moved))
    joints.append(Joint("/Clevis/Mount", "fixed", links - 1, links, _frame(length), _frame(0.0)))
    joints.append(Joint("/Clevis/Weld", "fixed", links, links + 1, _frame(0.3), _frame(0.0)))
    character = Character(
        "/Clevis", tuple(bodies), tuple(joints), tuple(motors), (Target("/Clevis/Arm/Load", links + 1, _frame(0.0)),),
        arm.gravity,
    )  # fmt: skip
    move, back = quintic(0.15, 0.4, 0.2), quintic(-0.2, 0.4, 0.9)
    animation = shot_of(lambda t: move(t) + back(t), 2.0, links)
    meshes = FEMeshes((replace(meshes.meshes[0], body=links),))
    return SimplificationShot("clevis arm", _with_geometry(character, meshes), animation, meshes)


def arm_with_head(features: int = 0) -> SimplificationShot:
    """The plastic arm with a head on its elbow: two motors that nod and shake it, and no target on it.

    Args:
        features: Further motors on the head, such as those of eyes, lids and jaw.
    """
    shot = plastic_arm()
    character, count = shot.character, len(shot.character.bodies)
    skull = MassProperties(0.02, np.array([0.03, 0.0, 0.0]), 1e-5 * np.eye(3))
    small = MassProperties(1e-3, np.zeros(3), 1e-7 * np.eye(3))
    bodies = (
        *character.bodies, Body("/Arm/Neck", _frame(0.3), skull), Body("/Arm/Head", _frame(0.3), skull),
        *(Body(f"/Arm/Feature{k}", _frame(0.3), small) for k in range(features)),
    )  # fmt: skip
    joints = [
        *character.joints,
        Joint("/Arm/Nod", "revolute", 0, count, _frame(0.3, rotation=LIFTS), _frame(0.0, rotation=LIFTS)),
        Joint("/Arm/Shake", "revolute", count, count + 1, _frame(0.0), _frame(0.0)),
    ]
    joints += [
        Joint(f"/Arm/Turn{k}", "revolute", count + 1, count + 2 + k, _frame(0.0), _frame(0.0)) for k in range(features)
    ]
    added = range(len(character.joints), len(joints))
    motors = (*character.motors, *(Motor(k, joints[k].path, _ANGLE) for k in added))
    character = replace(character, bodies=bodies, joints=tuple(joints), motors=motors)
    return SimplificationShot("arm with a head", character, _swing(motors=len(motors)), shot.meshes)


def _frame(x: float, y: float = 0.0, z: float = 0.0, rotation: Array = IDENTITY) -> Frame:
    return Frame(np.array([x, y, z]), rotation)
