"""Writes a robot into a stage: bodies, meshes, joints, drives and materials, with UsdPhysics and the calm schemas.

The calm schemas and the deformable material are applied by name, so building needs no schema registration.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics, UsdShade, Vt

from .robot import BodySpec, DriveSpec, JointSpec, Part, Pose, TargetSpec, mass_properties

DIGITS = 6


@dataclass(frozen=True)
class Look:
    """A plain surface: linear RGB, roughness, metalness."""

    color: tuple[float, float, float]
    roughness: float = 0.5
    metallic: float = 0.0


@dataclass(frozen=True)
class Plastic:
    """An elastic material, SI."""

    name: str
    youngs_modulus: float
    poissons_ratio: float
    density: float
    damping_ratio: float


def new_stage(root: str, frames: Sequence[int], rate: float, up: str = "Z", unit: float = 1.0) -> Usd.Stage:
    """An empty stage in kilograms and units of `unit` metres, with its root as default prim and gravity."""
    stage = Usd.Stage.CreateInMemory(".usda")
    UsdGeom.SetStageUpAxis(stage, up)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    if frames:
        stage.SetStartTimeCode(frames[0])
        stage.SetEndTimeCode(frames[-1])
    prim = UsdGeom.Xform.Define(stage, f"/{root}").GetPrim()
    Usd.ModelAPI(prim).SetKind("assembly")
    stage.SetDefaultPrim(prim)
    scene = UsdPhysics.Scene.Define(stage, "/PhysicsScene")
    scene.CreateGravityDirectionAttr(Gf.Vec3f(0, 0, -1) if up == "Z" else Gf.Vec3f(0, -1, 0))
    scene.CreateGravityMagnitudeAttr(9.81 * per_metre(stage))
    return stage


def per_metre(stage: Usd.Stage) -> float:
    """Stage units in a metre. Everything here is given in SI and written in the stage's units."""
    return float(round(1.0 / UsdGeom.GetStageMetersPerUnit(stage)))


def author_looks(stage: Usd.Stage, scope: str, looks: Mapping[str, Look]) -> None:
    """One UsdPreviewSurface material for each look."""
    UsdGeom.Scope.Define(stage, scope)
    for name, look in looks.items():
        material = UsdShade.Material.Define(stage, f"{scope}/{name}")
        shader = UsdShade.Shader.Define(stage, f"{scope}/{name}/Surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*look.color))
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(look.roughness)
        shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(look.metallic)
        surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
        material.CreateSurfaceOutput().ConnectToSource(surface)


def author_plastic(stage: Usd.Stage, scope: str, plastic: Plastic) -> None:
    """A material for the `physics` purpose: elasticity by the names of the deformable proposal, and damping."""
    prim = UsdShade.Material.Define(stage, f"{scope}/{plastic.name}").GetPrim()
    prim.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    prim.AddAppliedSchema("CalmDampingAPI")
    create(prim, "physics:youngsModulus", plastic.youngs_modulus / per_metre(stage))
    create(prim, "physics:poissonsRatio", plastic.poissons_ratio)
    create(prim, "physics:density", plastic.density / per_metre(stage) ** 3)
    create(prim, "calm:damping:ratio", plastic.damping_ratio)


def create(prim: Usd.Prim, name: str, value: float) -> None:
    """A schema's float attribute, by name; ours are uniform, but for the weights of a target."""
    fixed = name.startswith("calm:") and not name.startswith("calm:target:")
    variability = Sdf.VariabilityUniform if fixed else Sdf.VariabilityVarying
    prim.CreateAttribute(name, Sdf.ValueTypeNames.Float, False, variability).Set(value)


def create_token(prim: Usd.Prim, name: str, value: str) -> None:
    """A schema's uniform token, by name."""
    prim.CreateAttribute(name, Sdf.ValueTypeNames.Token, False, Sdf.VariabilityUniform).Set(value)


def author_part(stage: Usd.Stage, path: str, part: Part, looks: Mapping[str, Look], scope: str) -> UsdGeom.Mesh:
    """A mesh with its display color and its look."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = (np.round(part.shape.points * per_metre(stage), DIGITS) + 0.0).astype(np.float32)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr([len(face) for face in part.shape.faces])
    mesh.CreateFaceVertexIndicesAttr([index for face in part.shape.faces for index in face])
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.stack([points.min(axis=0), points.max(axis=0)])))
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*looks[part.look].color)])
    material = UsdShade.Material.Get(stage, f"{scope}/{part.look}")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    return mesh


def author_body(
    stage: Usd.Stage, root: str, body: BodySpec, pose: Pose, looks: Mapping[str, Look], scope: str, plastic: Plastic,
    motion: Mapping[int, Pose] | None = None,
) -> None:  # fmt: skip
    """A body at its pose, or moving through poses by frame, with its meshes, mass or elastic material, and targets."""
    scale, xform = per_metre(stage), UsdGeom.Xform.Define(stage, f"{root}/{body.name}")
    author_pose(xform, pose, scale, motion)
    prim = xform.GetPrim()
    UsdPhysics.RigidBodyAPI.Apply(prim)
    for part in body.parts:
        author_part(stage, f"{root}/{body.name}/{part.name}", part, looks, scope)
    if body.mass is None:
        prim.AddAppliedSchema("CalmFlexibleBodyAPI")
        if body.interface_radius is not None:
            create(prim, "calm:flexible:interfaceRadius", body.interface_radius * scale)
        binding = UsdShade.MaterialBindingAPI.Apply(prim)
        material = UsdShade.Material.Get(stage, f"{scope}/{plastic.name}")
        binding.Bind(material, UsdShade.Tokens.weakerThanDescendants, "physics")
    else:
        mass, center, inertia = mass_properties(body)
        api = UsdPhysics.MassAPI.Apply(prim)
        api.CreateMassAttr(mass)
        api.CreateCenterOfMassAttr(Gf.Vec3f(*(np.round(center * scale, DIGITS) + 0.0).tolist()))
        api.CreateDiagonalInertiaAttr(Gf.Vec3f(*(float(f"{value * scale**2:.4g}") for value in inertia)))
        api.CreatePrincipalAxesAttr(Gf.Quatf(1.0))  # USD's validators want both or neither
    for target in body.targets:
        author_target(stage, f"{root}/{body.name}/{target.name}", target)


def author_pose(
    xform: UsdGeom.Xformable, pose: Pose, scale: float, motion: Mapping[int, Pose] | None = None
) -> None:  # fmt: skip
    """Where a body stands, and its poses by frame if it is animated."""
    place, orient = xform.AddTranslateOp(), xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)
    set_pose(place, orient, pose, scale, Usd.TimeCode.Default())
    for frame, there in (motion or {}).items():
        set_pose(place, orient, there, scale, frame)


def set_pose(
    place: UsdGeom.XformOp, orient: UsdGeom.XformOp, pose: Pose, scale: float, time: Usd.TimeCode | int
) -> None:
    """Author a pose, rounded so that every machine writes the same."""
    turn = pose.rotation / np.linalg.norm(pose.rotation)
    place.Set(Gf.Vec3d(*(np.round(pose.position * scale, 9) + 0.0).tolist()), time)
    orient.Set(Gf.Quatd(*(np.round(turn, 12) + 0.0).tolist()), time)


def author_target(stage: Usd.Stage, path: str, target: TargetSpec) -> None:
    """A target frame below its body."""
    xform = UsdGeom.Xform.Define(stage, path)
    xform.AddTranslateOp().Set(Gf.Vec3d(*(value * per_metre(stage) for value in target.position)))
    xform.GetPrim().AddAppliedSchema("CalmTargetAPI")
    create(xform.GetPrim(), "calm:target:positionWeight", target.position_weight)
    create(xform.GetPrim(), "calm:target:rotationWeight", target.rotation_weight)


def author_joint(stage: Usd.Stage, root: str, scope: str, joint: JointSpec) -> None:
    """A weld, a passive hinge, or one with a drive."""
    path, scale = f"{scope}/{joint.name}", per_metre(stage)
    kind = UsdPhysics.RevoluteJoint if joint.axis else UsdPhysics.FixedJoint
    prim = kind.Define(stage, path)
    if joint.parent:
        prim.CreateBody0Rel().SetTargets([f"{root}/{joint.parent}"])
    prim.CreateBody1Rel().SetTargets([f"{root}/{joint.child}"])
    prim.CreateLocalPos0Attr(Gf.Vec3f(*(value * scale for value in joint.anchor_parent)))
    prim.CreateLocalRot0Attr(Gf.Quatf(1.0))
    prim.CreateLocalPos1Attr(Gf.Vec3f(*(value * scale for value in joint.anchor_child)))
    prim.CreateLocalRot1Attr(Gf.Quatf(1.0))
    if joint.axis:
        prim.CreateAxisAttr(joint.axis)
    if joint.drive is None:
        return
    prim.CreateLowerLimitAttr(joint.drive.lower)
    prim.CreateUpperLimitAttr(joint.drive.upper)
    drive = UsdPhysics.DriveAPI.Apply(prim.GetPrim(), UsdPhysics.Tokens.angular)
    drive.CreateTypeAttr(UsdPhysics.Tokens.force)
    if joint.drive.motor:
        prim.GetPrim().AddAppliedSchema("CalmMotorAPI")
        create_token(prim.GetPrim(), "calm:motor:type", joint.drive.motor)
        create_token(prim.GetPrim(), "calm:motor:model", "servo")
        create(prim.GetPrim(), "calm:motor:maxAcceleration", joint.drive.max_acceleration)
        return
    drive.CreateMaxForceAttr(joint.drive.max_torque * scale**2)
    drive.CreateStiffnessAttr(50.0 * scale**2)
    drive.CreateDampingAttr(0.5 * scale**2)
    prim.GetPrim().AddAppliedSchema("CalmMotorAPI")
    create(prim.GetPrim(), "calm:motor:maxVelocity", joint.drive.max_velocity)
    create(prim.GetPrim(), "calm:motor:maxAcceleration", joint.drive.max_acceleration)
    create(prim.GetPrim(), "calm:motor:maxTorque", joint.drive.max_torque * scale**2)


def author_track(prim: Usd.Prim, drive: DriveSpec, frames: Sequence[int]) -> None:
    """The animation of a drive; without frames the angle that it holds."""
    target = UsdPhysics.DriveAPI(prim, UsdPhysics.Tokens.angular).CreateTargetPositionAttr()
    if not frames:
        target.Set(drive.track[0])
        return
    for frame, value in zip(frames, drive.track, strict=True):
        target.Set(value, frame)


def save(layer: Sdf.Layer, path: Path) -> None:
    """Export beside the destination, then rename."""
    partial = path.with_name(f".{path.stem}.partial.usda")
    if not layer.Export(str(partial)):
        raise OSError(f"cannot write {partial}")
    os.replace(partial, path)
