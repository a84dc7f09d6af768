"""The host of plugins: it finds and registers them, orders their operators by data, and runs what is needed."""

from .errors import HostError, PlanError, PluginError, SettingError
from .manifest import Manifest, read_manifest
from .operators import NotAsked, Operator, Record, RunContext
from .plan import Plan
from .properties import Property, PropertyValues, nearest
from .registry import Host, Plugin, PluginState, open_host
from .run import OperatorResult, Outcome, Run
from .settings import Settings, merge, read_assignment, read_settings_file
from .units import parse_quantity
from .values import (
    CsvFile,
    Figures,
    ModeShapes,
    OutputPaths,
    PlannedStep,
    Recording,
    ReducedBodies,
    Rig,
    RiggedJoint,
    ShapedTracks,
    Source,
    SystemModes,
    Verification,
    WrittenLayer,
)

__all__ = [
    "CsvFile",
    "Figures",
    "ModeShapes",
    "Host",
    "HostError",
    "Manifest",
    "NotAsked",
    "Operator",
    "OperatorResult",
    "Outcome",
    "OutputPaths",
    "PlannedStep",
    "Plan",
    "PlanError",
    "Plugin",
    "PluginError",
    "PluginState",
    "Property",
    "PropertyValues",
    "Record",
    "Recording",
    "ReducedBodies",
    "Rig",
    "RiggedJoint",
    "ShapedTracks",
    "Run",
    "RunContext",
    "SettingError",
    "Settings",
    "Source",
    "SystemModes",
    "Verification",
    "WrittenLayer",
    "merge",
    "nearest",
    "open_host",
    "parse_quantity",
    "read_assignment",
    "read_manifest",
    "read_settings_file",
]
