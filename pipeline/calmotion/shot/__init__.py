"""What a shot is, as plain data in SI units: read by plugins, solved by the engine, written by plugins."""

from .animation import Animation, MovingFrame, Track
from .character import (
    WORLD,
    Body,
    Character,
    ElasticMaterial,
    FlexibleSettings,
    Frame,
    InterfaceSurface,
    Joint,
    MassProperties,
    Motor,
    RetargetSettings,
    SurfaceMesh,
    Target,
    TetGeometry,
)
from .meshes import FEMesh, FEMeshes, MeshQuality
from .provenance import InputLayer, Provenance
from .result import (
    LeftOut,
    ModeTable,
    Motion,
    MotorCurve,
    OptimizerStep,
    Result,
    Simulation,
    Skin,
)

__all__ = [
    "WORLD",
    "Animation",
    "Body",
    "Character",
    "ElasticMaterial",
    "FEMesh",
    "FEMeshes",
    "FlexibleSettings",
    "Frame",
    "InputLayer",
    "InterfaceSurface",
    "Joint",
    "LeftOut",
    "MassProperties",
    "MeshQuality",
    "ModeTable",
    "Motion",
    "Motor",
    "MotorCurve",
    "MovingFrame",
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
]
