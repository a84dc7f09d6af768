"""Calmotion: vibration-minimising motion retargeting for robotic characters.

    import calmotion as cm

    shot = cm.open_shot("bartender.usda")
    result = cm.optimize(shot, tolerance="1mm")
    result.write("calm.usda")

Each name is imported when it is first used.
"""

from typing import TYPE_CHECKING, Any

from calmotion.errors import ShotError
from calmotion.version import __version__

if TYPE_CHECKING:
    from calmotion.host.errors import SettingError
    from calmotion.model.run import OutputPaths
    from calmotion.workflow.batch.report import BatchResult, JobResult
    from calmotion.workflow.batch.run import batch
    from calmotion.workflow.commands import inspect, optimize, rig, simulate, verify
    from calmotion.workflow.exporting.export import Export, export
    from calmotion.workflow.inspection import Inspection
    from calmotion.workflow.installation.warmup import Warmup, warmup
    from calmotion.workflow.problems import Cancelled, RunError
    from calmotion.workflow.publishing.gate import publishing_problems
    from calmotion.workflow.publishing.manifest import write_manifest
    from calmotion.workflow.results import MotorMotion, OptimizationResult, RobotMotion, SimulationResult, TargetMotion
    from calmotion.workflow.run import Progress
    from calmotion.workflow.sequence.run import Repertoire, sequence
    from calmotion.workflow.shot import Shot, open_shot

__all__ = [
    "BatchResult",
    "Cancelled",
    "Export",
    "Inspection",
    "JobResult",
    "MotorMotion",
    "OptimizationResult",
    "OutputPaths",
    "Progress",
    "Repertoire",
    "RobotMotion",
    "RunError",
    "SettingError",
    "Shot",
    "ShotError",
    "SimulationResult",
    "TargetMotion",
    "Warmup",
    "__version__",
    "batch",
    "export",
    "inspect",
    "open_shot",
    "optimize",
    "publishing_problems",
    "rig",
    "sequence",
    "simulate",
    "verify",
    "warmup",
    "write_manifest",
]

_HOMES = {
    "host.errors": ("SettingError",),
    "model.run": ("OutputPaths",),
    "workflow.batch.report": ("BatchResult", "JobResult"),
    "workflow.batch.run": ("batch",),
    "workflow.commands": ("inspect", "optimize", "rig", "simulate", "verify"),
    "workflow.exporting.export": ("Export", "export"),
    "workflow.inspection": ("Inspection",),
    "workflow.installation.warmup": ("Warmup", "warmup"),
    "workflow.problems": ("Cancelled", "RunError"),
    "workflow.publishing.gate": ("publishing_problems",),
    "workflow.publishing.manifest": ("write_manifest",),
    "workflow.results": ("MotorMotion", "OptimizationResult", "RobotMotion", "SimulationResult", "TargetMotion"),
    "workflow.run": ("Progress",),
    "workflow.sequence.run": ("Repertoire", "sequence"),
    "workflow.shot": ("Shot", "open_shot"),
}


def __getattr__(name: str) -> Any:
    from calmotion.public_names import imported

    return imported(__name__, _HOMES, name)


def __dir__() -> list[str]:
    return sorted(__all__)
