"""Public names of `calmotion_plugins.calibration`: each is imported when it is first used."""

from collections.abc import Callable

from calmotion.host import Host, Operator

from .identification.calibrate import CalibrationSettings as CalibrationSettings
from .identification.calibrate import calibrate_shot as calibrate_shot
from .identification.calibrate import calibrate_shots as calibrate_shots
from .identification.parameters import robot_parameters as robot_parameters
from .identification.robots import Robot as Robot
from .identification.robots import robot_with as robot_with
from .identification.signals import Signals as Signals
from .identification.signals import place_of as place_of
from .identification.signals import signals_of as signals_of
from .layer_metadata import prediction_errors as prediction_errors
from .layer_metadata import unexplained_share as unexplained_share
from .model.estimates import Calibration as Calibration
from .model.estimates import CalibrationFigures as CalibrationFigures
from .model.estimates import Estimate as Estimate
from .model.kinds import HIGHER_MODES as HIGHER_MODES
from .workflow.calibrate import CalibratedShot as CalibratedShot
from .workflow.calibrate import calibrate as calibrate
from .workflow.calibrate import read_performed as read_performed
from .workflow.excite import ExcitedShot as ExcitedShot
from .workflow.excite import excite as excite
from .workflow.refine import RefinedShot as RefinedShot
from .workflow.refine import refine as refine

class PlotCalibration(Operator): ...

register: Callable[[Host], None]
unregister: Callable[[Host], None]
