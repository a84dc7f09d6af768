"""Parameters of a robot from recordings: the commands `calibrate`, `excite` and `refine`, and the same in Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.model.run import OutputPaths

from .model.estimates import Calibration, CalibrationFigures

if TYPE_CHECKING:
    from .identification.calibrate import CalibrationSettings, calibrate_shot
    from .identification.parameters import robot_parameters
    from .identification.robots import Robot, robot_with
    from .identification.signals import Signals, signals_of
    from .model.estimates import HIGHER_MODES
    from .workflow.calibrate import CalibratedShot, calibrate
    from .workflow.excite import ExcitedShot, excite
    from .workflow.refine import RefinedShot, refine

__all__ = [
    "HIGHER_MODES",
    "CalibratedShot",
    "Calibration",
    "CalibrationFigures",
    "CalibrationSettings",
    "ExcitedShot",
    "PlotCalibration",
    "RefinedShot",
    "Robot",
    "Signals",
    "calibrate",
    "calibrate_shot",
    "excite",
    "refine",
    "register",
    "robot_parameters",
    "robot_with",
    "signals_of",
    "unregister",
]

_HOMES = {
    ".identification.calibrate": ("CalibrationSettings", "calibrate_shot"),
    ".identification.parameters": ("robot_parameters",),
    ".identification.robots": ("Robot", "robot_with"),
    ".identification.signals": ("Signals", "signals_of"),
    ".model.estimates": ("HIGHER_MODES",),
    ".workflow.calibrate": ("CalibratedShot", "calibrate"),
    ".workflow.excite": ("ExcitedShot", "excite"),
    ".workflow.refine": ("RefinedShot", "refine"),
}


class PlotCalibration(Operator):
    """Measured against simulated signals, spectra of the residuals, and intervals of the parameters."""

    idname = "figures.calibration"
    label = "Draw the figures of the calibration"
    requires = (Calibration, OutputPaths)
    provides = (CalibrationFigures,)
    properties = (
        Property("dpi", int, 150, minimum=30, maximum=600, description="Resolution of the figures, dots per inch."),
    )

    def execute(self, context: RunContext) -> Sequence[object]:
        from .drawing import draw_calibration

        folder = context.get(OutputPaths).figures or ""
        return (CalibrationFigures(tuple(draw_calibration(folder, context.get(Calibration), context.properties.dpi))),)


register, unregister = registration(PlotCalibration)


def __getattr__(name: str) -> Any:
    from calmotion.public_names import imported

    return imported(__name__, _HOMES, name)
