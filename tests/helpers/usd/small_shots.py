"""A two-motor arm as a USD shot, in any units, whole or broken on purpose; authored by name, with pxr alone.

The arm in SI: a base fixed to the world at (0, 0, 1), an upper arm (box 0.4 x 0.04 x 0.04 m along x) on a hinge
about y, a forearm (mesh box of the same size) on a hinge about y at the end of the upper arm, a hand on its tip.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from calmotion.usd import schemas
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

schemas.register()

BASE, UPPER, FORE = "/Arm/base", "/Arm/upper", "/Arm/fore"
SHOULDER, ELBOW = "/Arm/joints/shoulder", "/Arm/joints/elbow"
HAND = "/Arm/fore/hand"
PLASTIC = "/Arm/materials/Plastic"
TARGET_POSITION = "drive:angular:physics:targetPosition"
FRAMES, RATE = 24, 24.0
LENGTH, WIDTH = 0.4, 0.04
BOX_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@dataclass(frozen=True)
class Scale:
    """Units of a shot: metres and kilograms per unit."""

    meters: float = 1.0
    kilograms: float = 1.0


def angles(frame: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The animation [deg] of shoulder and elbow."""
    turn = 2.0 * np.pi * np.asarray(frame) / FRAMES
    return 20.0 * np.sin(turn), 10.0 + 30.0 * (1.0 - np.cos(turn))


def write_arm(path: Path, edit: Callable[[Usd.Stage], None] | None = None, scale: Scale | None = None) -> Path:
    """Write the arm; `edit` changes the stage before it is saved."""
    scale = scale or Scale()
    stage = Usd.Stage.CreateInMemory(str(path.name))
    UsdGeom.SetStageMetersPerUnit(stage, scale.meters)
    UsdPhysics.SetStageKilogramsPerUnit(stage, scale.kilograms)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetFramesPerSecond(RATE)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(FRAMES)
    root = UsdGeom.Xform.Define(stage, "/Arm").GetPrim()
    stage.SetDefaultPrim(root)
    m = scale.meters
    _body(stage, BASE, (0.0, 0.0, 1.0), scale)
    _mass(stage, BASE, 2.0, (0.0, 0.0, 0.0), (0.01, 0.01, 0.01), scale)
    _body(stage, UPPER, (0.0, 0.0, 1.0), scale)
    cube = UsdGeom.Cube.Define(stage, f"{UPPER}/box")
    cube.CreateSizeAttr(1.0)
    cube.AddTranslateOp().Set(Gf.Vec3d(LENGTH / 2 / m, 0.0, 0.0))
    cube.AddScaleOp().Set(Gf.Vec3f(LENGTH / m, WIDTH / m, WIDTH / m))
    UsdPhysics.CollisionAPI.Apply(cube.GetPrim())
    UsdPhysics.MassAPI.Apply(cube.GetPrim()).CreateDensityAttr(1200.0 * m**3 / scale.kilograms)
    _body(stage, FORE, (LENGTH, 0.0, 1.0), scale)
    _mass(stage, FORE, 0.5, (0.2, 0.0, 0.0), (1e-4, 7e-3, 7e-3), scale)
    box(stage, f"{FORE}/skin", scale)
    hand = UsdGeom.Xform.Define(stage, HAND)
    hand.AddTranslateOp().Set(Gf.Vec3d(LENGTH / m, 0.0, 0.0))
    _joint(stage, "/Arm/joints/stand", UsdPhysics.FixedJoint, "", BASE, (0, 0, 1.0 / m), (0, 0, 0))
    _motor(stage, SHOULDER, BASE, UPPER, (0, 0, 0), 0)
    _motor(stage, ELBOW, UPPER, FORE, (LENGTH / m, 0, 0), 1)
    if edit is not None:
        edit(stage)
    stage.Export(str(path))
    return path


def box(stage, path: str, scale: Scale) -> UsdGeom.Mesh:
    """A closed box mesh of quads, 0 to `LENGTH` along x."""
    corners = np.array([[x, y, z] for x in (0.0, LENGTH) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
    corners[:, 1:] *= WIDTH / 2
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy((corners / scale.meters).astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr([4] * 6)
    mesh.CreateFaceVertexIndicesAttr([i for face in BOX_FACES for i in face])
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateDisplayColorAttr([(0.2, 0.4, 0.6)])
    return mesh


def make_flexible(stage, path: str = FORE, scale: Scale | None = None, **values: object) -> None:
    """Make a body flexible: nylon of 2 GPa, poisson 0.4, 1100 kg/m^3, bound for physics."""
    scale = scale or Scale()
    prim = stage.GetPrimAtPath(path)
    prim.AddAppliedSchema("CalmFlexibleBodyAPI")
    material = UsdShade.Material.Define(stage, PLASTIC).GetPrim()
    material.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    defaults = {
        "physics:youngsModulus": 2e9 * scale.meters / scale.kilograms,
        "physics:poissonsRatio": 0.4,
        "physics:density": 1100.0 * scale.meters**3 / scale.kilograms,
    }
    for name, value in defaults.items():
        material.CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(values.get(name.split(":")[1], value))
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material(material), materialPurpose="physics")


def make_target(stage, path: str = HAND, **weights: float) -> None:
    """Apply CalmTargetAPI."""
    prim = stage.GetPrimAtPath(path)
    prim.AddAppliedSchema("CalmTargetAPI")
    for name, value in weights.items():
        prim.CreateAttribute(f"calm:target:{name}", Sdf.ValueTypeNames.Float).Set(value)


def set_float(stage, path: str, name: str, value: float) -> None:
    """Author a float by name."""
    stage.GetPrimAtPath(path).CreateAttribute(name, Sdf.ValueTypeNames.Float).Set(value)


def clear_mass(stage, path: str) -> None:
    """Take mass, inertia and centre of mass from a body."""
    for name in ("physics:mass", "physics:diagonalInertia", "physics:centerOfMass"):
        stage.GetPrimAtPath(path).RemoveProperty(name)


def _body(stage, path: str, position, scale: Scale) -> None:
    xform = UsdGeom.Xform.Define(stage, path)
    xform.AddTranslateOp().Set(Gf.Vec3d(*(x / scale.meters for x in position)))
    UsdPhysics.RigidBodyAPI.Apply(xform.GetPrim())


def _mass(stage, path: str, mass: float, center, inertia, scale: Scale) -> None:
    api = UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath(path))
    api.CreateMassAttr(mass / scale.kilograms)
    api.CreateCenterOfMassAttr(Gf.Vec3f(*(x / scale.meters for x in center)))
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(*(x / scale.kilograms / scale.meters**2 for x in inertia)))


def _joint(stage, path: str, kind, body0: str, body1: str, at0, at1):
    joint = kind.Define(stage, path)
    if body0:
        joint.CreateBody0Rel().SetTargets([body0])
    if body1:
        joint.CreateBody1Rel().SetTargets([body1])
    joint.CreateLocalPos0Attr(Gf.Vec3f(*at0))
    joint.CreateLocalPos1Attr(Gf.Vec3f(*at1))
    return joint


def _motor(stage, path: str, body0: str, body1: str, at0, column: int) -> None:
    joint = _joint(stage, path, UsdPhysics.RevoluteJoint, body0, body1, at0, (0, 0, 0))
    joint.CreateAxisAttr("Y")
    joint.CreateLowerLimitAttr(-90.0)
    joint.CreateUpperLimitAttr(120.0)
    attribute = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "angular").CreateTargetPositionAttr()
    for frame in range(FRAMES + 1):
        attribute.Set(float(angles(frame)[column]), frame)
