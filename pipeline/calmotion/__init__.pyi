"""Public names of `calmotion`: each is imported when it is first used."""

from calmotion.cli.pages import write_page as write_page
from calmotion.errors import ShotError as ShotError
from calmotion.host.errors import SettingError as SettingError
from calmotion.model.run import OutputPaths as OutputPaths
from calmotion.version import __version__ as __version__
from calmotion.workflow.commands import inspect as inspect
from calmotion.workflow.commands import optimize as optimize
from calmotion.workflow.commands import rig as rig
from calmotion.workflow.commands import simulate as simulate
from calmotion.workflow.commands import verify as verify
from calmotion.workflow.inspection import Inspection as Inspection
from calmotion.workflow.manifest import publishing_problems as publishing_problems
from calmotion.workflow.manifest import write_manifest as write_manifest
from calmotion.workflow.problems import Cancelled as Cancelled
from calmotion.workflow.problems import RunError as RunError
from calmotion.workflow.results import MotorMotion as MotorMotion
from calmotion.workflow.results import OptimizationResult as OptimizationResult
from calmotion.workflow.results import RobotMotion as RobotMotion
from calmotion.workflow.results import SimulationResult as SimulationResult
from calmotion.workflow.results import TargetMotion as TargetMotion
from calmotion.workflow.run import Progress as Progress
from calmotion.workflow.shot import Shot as Shot
from calmotion.workflow.shot import open_shot as open_shot
from calmotion.workflow.warmup import Warmup as Warmup
from calmotion.workflow.warmup import warmup as warmup
