"""Shots that are broken on purpose, each in one way: `python tests/helpers/usd/broken_shots.py FOLDER` writes them all.

Most are the arm of `small_shots` with an edit; the others are files that are damaged afterwards. Each ends in an error
that names its place, or, where it says so, in a repair that is told.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import posed_shots
import small_shots as shots
from pxr import Gf, Sdf, UsdGeom, UsdPhysics, Vt
from shot_edits import (
    SKIN,
    Edit,
    a_foreign_joint,
    applied,
    attribute,
    both,
    close_samples,
    connected,
    flexible,
    gear,
    gears_in_a_circle,
    half_turns,
    kinematic,
    massless,
    material,
    mesh,
    mesh_file,
    moving_root,
    no_bodies,
    number,
    one_sample,
    retarget,
    rotations,
    sample,
    second_motor,
    skel_joint,
    stage_metadata,
    target,
    targets,
    tet_mesh,
    times,
    transform,
    unanimated,
    undriven,
    vector,
    without_order,
)
from small_shots import BASE, ELBOW, FORE, HAND, PLASTIC, SHOULDER, TARGET_POSITION, UPPER


@dataclass(frozen=True)
class Case:
    """One broken shot.

    Attributes:
        make: Writes it into a folder; its file.
        place: What the error's place must hold; prim path, attribute or file.
        repaired: What a note must hold, where the shot is processed all the same; empty where it is refused.
    """

    make: Callable[[Path], Path]
    place: tuple[str, ...] = ()
    repaired: str = ""


def edited(edit: Edit, *place: str, repaired: str = "") -> Case:
    """The arm with an edit."""
    return Case(lambda folder: shots.write_arm(folder / "shot.usda", edit), place, repaired)


def of_text(change: Callable[[str], str], *place: str, repaired: str = "", name: str = "shot.usda") -> Case:
    """The arm with its text changed."""

    def make(folder: Path) -> Path:
        text = shots.write_arm(folder / "shot.usda").read_text()
        (folder / "shot.usda").unlink()
        (folder / name).write_text(change(text))
        return folder / name

    return Case(make, place, repaired)


def of_fore(metadata: str, *place: str, repaired: str = "") -> Case:
    """The arm with more metadata of its outer link, as text."""
    head = 'def Xform "fore" (\n'
    return of_text(lambda text: text.replace(head, f"{head}{metadata}\n", 1), *place, repaired=repaired)


def of_bytes(content: bytes, name: str, *place: str) -> Case:
    """A file of one's own."""

    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return Case(make, place or (name,))


def of_layer(change: Callable[[Sdf.Layer], None], *place: str, more: dict[str, str] | None = None) -> Case:
    """The arm with its layer changed, and other files beside it."""

    def make(folder: Path) -> Path:
        shot = shots.write_arm(folder / "shot.usda")
        for name, text in (more or {}).items():
            (folder / name).write_text(text)
        layer = Sdf.Layer.OpenAsAnonymous(str(shot))
        change(layer)
        layer.Export(str(shot))
        return shot

    return Case(make, place)


def too_many_samples(count: int) -> Case:
    def make(folder: Path) -> Path:
        layer = Sdf.Layer.FindOrOpen(str(shots.write_arm(folder / "arm.usda")))
        shot = Sdf.Layer.CreateNew(str(folder / "shot.usdc"))
        shot.TransferContent(layer)
        path = f"{SHOULDER}.{TARGET_POSITION}"
        with Sdf.ChangeBlock():
            for code in np.linspace(0.0, 24.0, count):
                shot.SetTimeSample(path, float(code), 1.0)
        shot.Save()
        del shot
        (folder / "arm.usda").unlink()
        return folder / "shot.usdc"

    return Case(make, (SHOULDER, TARGET_POSITION))


def unicode_names(text: str) -> str:
    return (
        text.replace('"Arm"', '"机械臂"')
        .replace("/Arm", "/机械臂")
        .replace("upper", "плечо")
        .replace("fore", "avant_bras_é")
    )


NAN, INF = math.nan, math.inf
SHEAR = Gf.Matrix4d(1, 0.5, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.4, 0, 1, 1)
TWISTED = Vt.Vec3fArray([Gf.Vec3f(x, y if x else -y, 0) for x in (0, 0.4) for y in (-0.02, 0.02) for _ in range(2)])
SQUARE = [Gf.Vec3f(*p) for p in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))]

CASES: dict[str, Case] = {
    # files
    "a file that is not USD": of_bytes(b"BVH is not USD", "shot.usda"),
    "an empty file": of_bytes(b"", "shot.usda"),
    "a binary file of noise": of_bytes(bytes(range(256)) * 8, "shot.usdc"),
    "a binary header and nothing else": of_bytes(b"PXR-USDC" + bytes(80), "shot.usdc"),
    "a package that is no archive": of_bytes(b"PK\x03\x04 and then nothing", "shot.usdz"),
    "text that stops in the middle": of_text(lambda text: text[: len(text) // 2], "shot.usda"),
    "a brace too many": of_text(lambda text: text + "}\n", "shot.usda"),
    "a rate that text cannot hold": of_text(
        lambda text: text.replace("framesPerSecond = 24", "framesPerSecond = nan"), "framesPerSecond"
    ),
    # composition
    "a reference by an expression without its variable": of_fore("references = @`${WHICH}`@", FORE, "WHICH"),
    "a variant by an expression without its variable": of_fore(
        'variants = { string v = "`${WHICH}`" }\nprepend variantSets = "v"', FORE, "WHICH"
    ),
    "a missing sublayer": of_layer(lambda layer: layer.subLayerPaths.append("./gone.usda"), "gone.usda"),
    "a missing reference": of_layer(
        lambda layer: layer.GetPrimAtPath(FORE).referenceList.Prepend(Sdf.Reference("./gone.usda")), FORE, "gone.usda"
    ),
    "a missing payload": of_layer(
        lambda layer: layer.GetPrimAtPath(FORE).payloadList.Prepend(Sdf.Payload("./gone.usda")), FORE, "payload"
    ),
    "a reference to a prim that is not there": of_layer(
        lambda layer: layer.GetPrimAtPath(FORE).referenceList.Prepend(Sdf.Reference("./other.usda", "/Gone")),
        FORE,
        more={"other.usda": '#usda 1.0\ndef "There" {}\n'},
    ),
    "a reference out of the folder": of_layer(
        lambda layer: layer.GetPrimAtPath(FORE).referenceList.Prepend(Sdf.Reference("../../../../../../etc/passwd")),
        FORE,
    ),
    "a prim that references itself": of_layer(
        lambda layer: layer.GetPrimAtPath(FORE).referenceList.Prepend(Sdf.Reference("", "/Arm")), "/Arm"
    ),
    "files that reference each other": of_layer(
        lambda layer: layer.GetPrimAtPath(FORE).referenceList.Prepend(Sdf.Reference("./other.usda", "/Arm")),
        "/Arm",
        more={"other.usda": '#usda 1.0\ndef "Arm" (references = @./shot.usda@</Arm>) {}\n'},
    ),
    "a layer that is its own sublayer": of_layer(lambda layer: layer.subLayerPaths.append("./shot.usda"), "shot.usda"),
    # the stage
    "no length of a unit": edited(stage_metadata("metersPerUnit", 0.0), "metersPerUnit"),
    "a length of a unit that is no number": edited(stage_metadata("metersPerUnit", NAN), "metersPerUnit"),
    "a negative mass of a unit": edited(stage_metadata("kilogramsPerUnit", -1.0), "kilogramsPerUnit"),
    "no time codes in a second": edited(lambda stage: stage.SetTimeCodesPerSecond(0.0), "timeCodesPerSecond"),
    "an end before the start": edited(times(10.0, 3.0), "endTimeCode"),
    "time codes beyond rounding": edited(times(1e16, 1e16 + 24), "endTimeCode"),
    "one sample and no range": edited(one_sample, "endTimeCode"),
    "gravity that is no number": edited(
        both(lambda s: UsdPhysics.Scene.Define(s, "/Arm/scene").CreateGravityMagnitudeAttr(NAN)), "/Arm/scene"
    ),
    # bodies
    "no bodies": edited(no_bodies, "shot.usda"),
    "a body without mass": edited(massless, FORE, "physics:mass"),
    "a mass of zero and nothing else": edited(both(massless, number(FORE, "physics:mass", 0.0)), FORE, "physics:mass"),
    "a negative mass": edited(number(FORE, "physics:mass", -1.0), FORE, "physics:mass"),
    "a mass that is no number": edited(number(FORE, "physics:mass", NAN), FORE, "physics:mass"),
    "an infinite mass": edited(number(FORE, "physics:mass", INF), FORE, "physics:mass"),
    "a mass of a wrong type": edited(attribute(FORE, "physics:mass", "String", "heavy"), FORE, "physics:mass"),
    "a negative inertia": edited(vector(FORE, "physics:diagonalInertia", -1, 1, 1), FORE, "physics:diagonalInertia"),
    "an inertia of zero about an axis": edited(vector(FORE, "physics:diagonalInertia", 1, 0, 1), FORE, "Inertia"),
    "a negative density": edited(number(f"{UPPER}/box", "physics:density", -2.0), f"{UPPER}/box", "physics:density"),
    "an inertia that is no number": edited(vector(FORE, "physics:diagonalInertia", NAN, 1, 1), FORE, "Inertia"),
    "a transform that is no number": edited(transform(FORE, Gf.Matrix4d(NAN)), FORE),
    "an infinite transform": edited(transform(FORE, Gf.Matrix4d(1).SetTranslate(Gf.Vec3d(INF, 0, 0))), FORE),
    "a scale of zero": edited(transform(FORE, Gf.Matrix4d(0).SetScale(Gf.Vec3d(1, 0, 1))), FORE),
    "a transform that shears": edited(transform(FORE, SHEAR), FORE),
    "a root that is held and moves": edited(moving_root, BASE),
    "a kinematic forearm": edited(kinematic(FORE), FORE, "physics:kinematicEnabled"),
    "all bodies kinematic and animated": edited(
        both(posed_shots.posed, kinematic(BASE, UPPER, FORE)), "physics:kinematicEnabled"
    ),
    "animated bodies without an order of operations": edited(without_order, UPPER, "xformOpOrder"),
    # joints
    "no joints": edited(lambda stage: stage.RemovePrim("/Arm/joints"), "/Arm"),
    "a joint between a body and itself": edited(targets(ELBOW, "physics:body0", FORE), ELBOW, "physics:body"),
    "a joint to a prim that is not there": edited(targets(ELBOW, "physics:body0", "/Arm/gone"), ELBOW, "physics:body0"),
    "a joint end on two bodies": edited(targets(ELBOW, "physics:body0", UPPER, BASE), ELBOW, "physics:body0"),
    "a joint to an attribute": edited(targets(ELBOW, "physics:body0", f"{UPPER}.physics:mass"), ELBOW, "physics:body0"),
    "a joint on a material": edited(flexible(targets(ELBOW, "physics:body1", PLASTIC)), ELBOW, PLASTIC, "transform"),
    "a joint on another joint": edited(targets(ELBOW, "physics:body1", SHOULDER), ELBOW, SHOULDER, "no transform"),
    "an axis that is none": edited(attribute(ELBOW, "physics:axis", "Token", "W"), ELBOW, "physics:axis"),
    "an axis of a wrong type": edited(attribute(ELBOW, "physics:axis", "Float", 1.0), ELBOW, "physics:axis"),
    "a rotation of length zero": edited(
        lambda stage: stage.GetPrimAtPath(ELBOW).GetAttribute("physics:localRot0").Set(Gf.Quatf(0)),
        ELBOW,
        "physics:localRot0",
    ),
    "a position that is no number": edited(vector(ELBOW, "physics:localPos0", NAN, 0, 0), ELBOW, "physics:localPos0"),
    "a position of a wrong type": edited(attribute(ELBOW, "physics:localPos0", "String", "here"), ELBOW, "localPos0"),
    "a limit that is no number": edited(number(ELBOW, "physics:lowerLimit", NAN), ELBOW, "physics:lowerLimit"),
    "a joint of a kind that is not supported": edited(a_foreign_joint, ELBOW),
    "two motors on one hinge": edited(second_motor, "elbow"),
    # motors
    "no motors": edited(undriven, "/Arm"),
    "motors without animation": edited(unanimated, SHOULDER, TARGET_POSITION),
    "a fixed joint as a motor": edited(applied("/Arm/joints/stand", "CalmMotorAPI"), "/Arm/joints/stand"),
    "an animation without a drive": edited(
        lambda s: s.GetPrimAtPath(ELBOW).RemoveAppliedSchema("PhysicsDriveAPI:angular"), ELBOW, TARGET_POSITION
    ),
    "a sample that is no number": edited(sample(SHOULDER, NAN), SHOULDER, TARGET_POSITION, "time code"),
    "an infinite sample": edited(sample(SHOULDER, INF), SHOULDER, TARGET_POSITION),
    "a sample that is blocked": edited(sample(SHOULDER, Sdf.ValueBlock()), SHOULDER, "a block at time code"),
    "a track of a wrong type": edited(attribute(SHOULDER, TARGET_POSITION, "String", "up"), SHOULDER, TARGET_POSITION),
    "half turns between frames": edited(half_turns, SHOULDER, TARGET_POSITION),
    "more samples than anybody means": too_many_samples(1_100_000),
    "a negative limit of effort": edited(number(ELBOW, "drive:angular:physics:maxForce", -1.0), ELBOW, "maxForce"),
    "a limit of speed of zero": edited(
        both(applied(ELBOW, "CalmMotorAPI"), number(ELBOW, "calm:motor:maxVelocity", 0.0)), ELBOW, "maxVelocity"
    ),
    "a gear to itself": edited(gear(ELBOW), ELBOW, "newton:mimicJoint"),
    "a gear to nothing": edited(gear("/Arm/joints/gone"), ELBOW, "newton:mimicJoint"),
    "gears in a circle": edited(gears_in_a_circle, "/Arm/joints"),
    "a joint of a skeleton that is not there": edited(skel_joint, ELBOW, "calm:motor:skelJoint"),
    "a target position by a connection": edited(connected, ELBOW, "/Arm/control.angle", "connection"),
    "a skeleton with too few rotations": edited(rotations(lambda own: own[:1]), posed_shots.ANIMATION, "time code 5"),
    "rotations of length two": edited(
        rotations(lambda own: [2.0 * one for one in own]), posed_shots.ANIMATION, "unit length", "time code 5"
    ),
    # targets and settings
    "a target on no body": edited(applied("/Arm", "CalmTargetAPI"), "/Arm"),
    "a target without a transform": edited(
        both(lambda s: s.DefinePrim(f"{FORE}/part", "Scope"), applied(f"{FORE}/part", "CalmTargetAPI")), f"{FORE}/part"
    ),
    "a target without weight": edited(target(positionWeight=0.0), HAND, "calm:target:positionWeight"),
    "a negative weight": edited(target(positionWeight=-1.0), HAND, "calm:target:positionWeight"),
    "a weight that is no number": edited(target(rotationWeight=NAN), HAND, "calm:target:rotationWeight"),
    "a negative tolerance": edited(retarget("tolerance", "Float", -5.0), "/Arm", "calm:retarget:tolerance"),
    "knots apart by no number": edited(retarget("knotSpacing", "Float", NAN), "/Arm", "calm:retarget:knotSpacing"),
    "a negative smoothness": edited(retarget("smoothness", "Float", -3.0), "/Arm", "calm:retarget:smoothness"),
    "a negative uncertainty": edited(retarget("uncertainty:payload", "Float", -0.5), "/Arm", "uncertainty:payload"),
    "an infinite uncertainty": edited(retarget("uncertainty:modulus", "Float", INF), "/Arm", "uncertainty:modulus"),
    "a step that is no number": edited(retarget("timeStep", "Float", NAN), "/Arm", "calm:retarget:timeStep"),
    "a reference that is none": edited(retarget("reference", "Token", "soft"), "/Arm", "calm:retarget:reference"),
    "a loop that does not close": edited(
        both(retarget("cyclic", "Bool", True), sample(SHOULDER, 90.0, 24.0)), SHOULDER
    ),
    # flexible bodies
    "no elastic material": edited(applied(FORE, "CalmFlexibleBodyAPI"), FORE, "material:binding:physics"),
    "a negative stiffness": edited(material(youngsModulus=-1.0), PLASTIC, "physics:youngsModulus"),
    "a ratio that is no number": edited(material(poissonsRatio=NAN), PLASTIC, "physics:poissonsRatio"),
    "elements of no size": edited(flexible(number(FORE, "calm:flexible:elementSize", 0.0)), FORE, "elementSize"),
    "a negative radius": edited(flexible(number(FORE, "calm:flexible:interfaceRadius", -3.0)), FORE, "interfaceRadius"),
    "a frequency that is no number": edited(flexible(number(FORE, "calm:flexible:maxFrequency", NAN)), FORE, "maxFreq"),
    "a wall of no thickness": edited(flexible(number(FORE, "calm:flexible:wallThickness", 0.0)), FORE, "wallThickness"),
    "a stiffness of zero": edited(material(youngsModulus=0.0), PLASTIC, "physics:youngsModulus"),
    "an incompressible material": edited(material(poissonsRatio=0.5), PLASTIC, "physics:poissonsRatio"),
    "a density of zero": edited(material(density=0.0), PLASTIC, "physics:density"),
    "damping beyond critical": edited(
        flexible(both(applied(PLASTIC, "CalmDampingAPI"), number(PLASTIC, "calm:damping:ratio", 1.5))), PLASTIC
    ),
    "an elasticity that is none": edited(
        flexible(attribute(FORE, "calm:flexible:elasticity", "Token", "rubbery")), FORE, "calm:flexible:elasticity"
    ),
    "points that are no numbers": edited(mesh("points", Vt.Vec3fArray([Gf.Vec3f(NAN)] * 8)), SKIN, "points"),
    "corners that are not there": edited(mesh("faceVertexIndices", Vt.IntArray([99] * 24)), SKIN, "faceVertexIndices"),
    "negative corners": edited(mesh("faceVertexIndices", Vt.IntArray([-1] * 24)), SKIN, "faceVertexIndices"),
    "faces of another number of corners": edited(
        mesh("faceVertexCounts", Vt.IntArray([3] * 6)), SKIN, "faceVertexCounts"
    ),
    "a box twisted by half a turn, which encloses nothing": edited(mesh("points", TWISTED), SKIN),
    "a mesh without points": edited(mesh("points", Vt.Vec3fArray()), SKIN),
    "tetrahedra of points that are not there": edited(tet_mesh(SQUARE, [(0, 1, 2, 9)]), f"{FORE}/tets"),
    "no tetrahedra": edited(tet_mesh(SQUARE, []), f"{FORE}/tets", "tetVertexIndices"),
    "two meshes of tetrahedra": edited(
        both(tet_mesh(SQUARE, [(0, 1, 2, 3)]), lambda s: UsdGeom.TetMesh.Define(s, f"{FORE}/more")), "one TetMesh"
    ),
    "a flat tetrahedron": edited(tet_mesh([*SQUARE[:3], Gf.Vec3f(1, 1, 0)], [(0, 1, 2, 3)]), f"{FORE}/tets"),
    "a mesh file that is missing": edited(mesh_file("./gone.msh"), FORE, "calm:flexible:meshFile"),
    "a mesh file out of the folder": edited(mesh_file("../../../../../../etc/passwd"), FORE, "calm:flexible:meshFile"),
    # what can be repaired
    "names in other scripts": of_text(unicode_names, repaired="机械臂"),
    "clips whose manifest is missing": of_fore(
        'clips = { dictionary default = { asset[] assetPaths = [@gone.usda@]\n string primPath = "/A"\n'
        " double2[] active = [(0, 0)]\n double2[] times = [(0, 0)]\n asset manifestAssetPath = @gone.usda@ } }",
        repaired=f"{FORE}: USD reports: Unable to open clip layer @gone.usda@",
    ),
    "an applied schema without its instance": of_text(
        lambda text: text.replace('"PhysicsRigidBodyAPI"]', '"PhysicsRigidBodyAPI", "PhysicsLimitAPI"]', 1),
        repaired=f"{UPPER}: USD reports: API schema 'PhysicsLimitAPI'",
    ),
    "samples at nearly the same time": edited(close_samples, repaired=SHOULDER),
    "a body that nothing holds": edited(
        lambda s: s.GetPrimAtPath("/Arm/joints/stand").GetAttribute("physics:jointEnabled").Set(False), repaired=BASE
    ),
    "limits the wrong way round": edited(
        both(number(ELBOW, "physics:lowerLimit", 90.0), number(ELBOW, "physics:upperLimit", -90.0)), repaired=""
    ),
}


def write_all(folder: Path) -> None:
    """Write every case into a folder of its name."""
    for name, case in CASES.items():
        own = folder / name.replace(" ", "_")
        own.mkdir(parents=True, exist_ok=True)
        print(case.make(own))


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
