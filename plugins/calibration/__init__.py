"""Parameters of a robot from recordings: the commands `calibrate`, `excite` and `refine`, and the same in Python."""

from collections.abc import Sequence

from calmotion.host import Operator, Property, RunContext, registration
from calmotion.model import OutputPaths
from calmotion.public_names import public_names

from .model.estimates import Calibration, CalibrationFigures


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


__getattr__, __dir__ = public_names(__name__)
