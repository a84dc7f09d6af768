"""What a shot is, as plain data in SI units: read by plugins, solved by the engine, written by plugins."""

from calmotion.shot.animation import Animation, FreeTrack, MotorTracks, MovingFrame, Track, WeightTrack
from calmotion.shot.character import (
    WORLD,
    Body,
    Character,
    ElasticMaterial,
    FlexibleSettings,
    Frame,
    InterfaceSurface,
    Joint,
    MassProperties,
    RetargetSettings,
    SurfaceMesh,
    Target,
    TetGeometry,
)
from calmotion.shot.meshes import FEMesh, FEMeshes, MeshQuality
from calmotion.shot.model_choice import ModelChoice, ModelChoices
from calmotion.shot.motor import Follows, Motor
from calmotion.shot.outputs import Finding, Findings
from calmotion.shot.provenance import InputLayer, Provenance
from calmotion.shot.result import (
    Accuracy,
    LimitUse,
    ModeTable,
    Motion,
    MotorCurve,
    OptimizerStep,
    Result,
    Simplification,
    Simulation,
    Skin,
)

__all__ = [
    "WORLD",
    "Accuracy",
    "Animation",
    "Body",
    "Character",
    "ElasticMaterial",
    "FEMesh",
    "FEMeshes",
    "FlexibleSettings",
    "Finding",
    "Findings",
    "Follows",
    "Frame",
    "FreeTrack",
    "InputLayer",
    "InterfaceSurface",
    "Joint",
    "Simplification",
    "LimitUse",
    "MassProperties",
    "MeshQuality",
    "ModeTable",
    "Motion",
    "Motor",
    "MotorCurve",
    "MotorTracks",
    "MovingFrame",
    "ModelChoice",
    "ModelChoices",
    "OptimizerStep",
    "Provenance",
    "Result",
    "RetargetSettings",
    "Simulation",
    "Skin",
    "SurfaceMesh",
    "Target",
    "TetGeometry",
    "Track",
    "WeightTrack",
]
