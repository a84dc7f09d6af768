"""The same robot authored in metres or centimetres, kilograms or grams, with z or y up, is the same to 1e-9.

USD keeps masses, lengths of joints and gravity in single precision, so a robot is the same in other units only as far
as its numbers are, which for most is to 6e-8. Here every number is one that single precision holds in each of the
units: short binary fractions of metres and kilograms, which stay short when multiplied by hundreds and thousands.
"""

from dataclasses import dataclass, replace

import numpy as np
from calmotion.model import FEMesh, FEMeshes, MeshQuality
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.testing import beam_mesh
from calmotion.usd import schemas
from calmotion.usd.reading import read_shot
from hypothesis import given
from hypothesis import strategies as st
from likenesses import apart, reach
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt
from random_shots import quaternion
from scipy.spatial.transform import Rotation

schemas.register()

SAME = 1e-9
CELL, THICKNESS = 0.125, 0.0625  # of a flexible link [m]
FRAMES = 12
Z_TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
BACK = Rotation.from_matrix(Z_TO_Y_UP).inv()


@dataclass(frozen=True)
class Stage:
    """Units [m], [kg] of a stage, and the axis that is up."""

    meters: float
    kilograms: float
    up: str


@dataclass(frozen=True)
class Part:
    """A link along x on a motor about an axis: mass [kg], length [m], inertia [kg m^2], and its motor's swing [deg].

    A flexible link has mass and inertia of its tetrahedra instead.
    """

    mass: float
    length: float
    inertia: float
    axis: str
    swing: float
    flexible: bool


def whole(low: int, high: int, over: float):
    """Multiples of a binary fraction."""
    return st.integers(low, high).map(lambda n: n / over)


PARTS = st.builds(
    Part, whole(1, 16, 4.0), whole(2, 4, 8.0), whole(1, 32, 1024.0), st.sampled_from("XYZ"), whole(-160, 160, 4.0),
    st.booleans(),
)  # fmt: skip
STAGES = st.builds(Stage, st.sampled_from((1.0, 0.01, 0.5)), st.sampled_from((1.0, 0.001)), st.sampled_from("YZ"))


def write(path, parts, units: Stage) -> None:
    """Author an arm of these parts from the world outwards, its target at the end."""
    stage = Usd.Stage.CreateInMemory()
    m, kg = units.meters, units.kilograms
    UsdGeom.SetStageMetersPerUnit(stage, m)
    UsdPhysics.SetStageKilogramsPerUnit(stage, kg)
    UsdGeom.SetStageUpAxis(stage, units.up)
    stage.SetTimeCodesPerSecond(24.0)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(FRAMES)
    UsdPhysics.Scene.Define(stage, "/Scene").CreateGravityMagnitudeAttr(9.75 / m)
    root = UsdGeom.Xform.Define(stage, "/Arm")
    stage.SetDefaultPrim(root.GetPrim())
    if units.up == "Y":
        turn = np.eye(4)
        turn[:3, :3] = Z_TO_Y_UP.T  # of row vectors
        root.AddTransformOp().Set(Gf.Matrix4d(*turn.ravel()))
    at, end = 0.0, 0.0
    for k, part in enumerate(parts):
        body = UsdGeom.Xform.Define(stage, f"/Arm/B{k}")
        body.AddTranslateOp().Set(Gf.Vec3d(at / m, 0.0, 0.0))
        UsdPhysics.RigidBodyAPI.Apply(body.GetPrim())
        if part.flexible:
            _flexible(stage, body.GetPrim(), part.length, units)
        else:
            mass = UsdPhysics.MassAPI.Apply(body.GetPrim())
            mass.CreateMassAttr(part.mass / kg)
            mass.CreateCenterOfMassAttr(Gf.Vec3f(0.5 * part.length / m, 0.0, 0.0))
            mass.CreateDiagonalInertiaAttr(Gf.Vec3f(*[part.inertia / (kg * m * m)] * 3))
        joint = UsdPhysics.RevoluteJoint.Define(stage, f"/Arm/J{k}")
        # the first hangs from the character's own prim, which turns with what is up
        joint.CreateBody0Rel().SetTargets([f"/Arm/B{k - 1}" if k else "/Arm"])
        joint.CreateBody1Rel().SetTargets([f"/Arm/B{k}"])
        joint.CreateLocalPos0Attr(Gf.Vec3f(end / m, 0.0, 0.0))
        joint.CreateLocalPos1Attr(Gf.Vec3f(0.0, 0.0, 0.0))
        joint.CreateAxisAttr(part.axis)
        drive = UsdPhysics.DriveAPI.Apply(joint.GetPrim(), "angular").CreateTargetPositionAttr()
        for frame in range(FRAMES + 1):
            drive.Set(part.swing * np.sin(np.pi * frame / FRAMES) ** 4, frame)
        at, end = at + part.length, part.length
    tip = UsdGeom.Xform.Define(stage, f"/Arm/B{len(parts) - 1}/Tip")
    tip.AddTranslateOp().Set(Gf.Vec3d(end / m, 0.0, 0.0))
    tip.GetPrim().AddAppliedSchema("CalmTargetAPI")
    stage.Export(str(path))


def _flexible(stage, prim, length: float, units: Stage) -> None:
    """Make a link a beam of its own tetrahedra; plastic of 2.1 GPa and 1250 kg/m^3."""
    prim.AddAppliedSchema("CalmFlexibleBodyAPI")
    prim.CreateAttribute("calm:flexible:modeCount", Sdf.ValueTypeNames.Int).Set(6)
    points, tets = beam_mesh(length, THICKNESS, round(length / CELL))
    mesh = UsdGeom.TetMesh.Define(stage, f"{prim.GetPath()}/Tets")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy((points / units.meters).astype(np.float32)))
    mesh.CreateTetVertexIndicesAttr(Vt.Vec4iArray.FromNumpy(tets))
    stuff = UsdShade.Material.Define(stage, "/Arm/Plastic")
    stuff.GetPrim().AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    values = {
        "youngsModulus": 2.0**31 * units.meters / units.kilograms, "poissonsRatio": 0.375,
        "density": 1250.0 * units.meters**3 / units.kilograms,
    }  # fmt: skip
    for name, value in values.items():
        stuff.GetPrim().CreateAttribute(f"physics:{name}", Sdf.ValueTypeNames.Float).Set(value)
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(stuff, materialPurpose="physics")


def performed(path):
    """What a shot performs, as read; the meshes of its flexible links are those it brings."""
    character, animation, _ = read_shot(str(path))
    none = MeshQuality(0.0, 0.0, 0.0)
    meshes = FEMeshes(
        tuple(FEMesh(k, body.tets.points, body.tets.tets, none) for k, body in enumerate(character.bodies) if body.tets)
    )
    bodies = reduce_bodies(character, span_tree(character), meshes)
    result = simulate_shot(
        compile_shot(character, animation, bodies), RunSettings(step=1 / 240), lambda fraction, message: None
    )
    return character, result.before.motion


# a kilogram over a cubic centimetre has no short number for the density of plastic
@given(
    st.lists(PARTS, min_size=1, max_size=3),
    STAGES.filter(lambda stage: stage.meters != 0.01 or stage.kilograms == 0.001),
)
def test_units_and_the_axis_that_is_up_do_not_matter(tmp_path_factory, parts, units):
    folder = tmp_path_factory.mktemp("units")
    write(folder / "si.usda", parts, Stage(1.0, 1.0, "Z"))
    write(folder / "other.usda", parts, units)
    (character, one), (_, other) = performed(folder / "si.usda"), performed(folder / "other.usda")
    if units.up == "Y":
        other = replace(
            other,
            target_positions=other.target_positions @ Z_TO_Y_UP,
            target_rotations=quaternion(BACK * Rotation.from_quat(other.target_rotations[:, 0], scalar_first=True))[
                :, None
            ],
        )
    off = apart(character, one, other, reach(character))
    assert max(off.values()) < SAME, off
