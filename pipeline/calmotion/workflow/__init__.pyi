"""Public names of `calmotion.workflow`: each is imported when it is first used."""

from calmotion.workflow.batch.workers import results_on as results_on
from calmotion.workflow.commands import optimize as optimize
from calmotion.workflow.commands import simulate as simulate
from calmotion.workflow.exporting.command_format import CommandFormat as CommandFormat
from calmotion.workflow.json_values import plain as plain
from calmotion.workflow.materials import known_materials as known_materials
from calmotion.workflow.outputs import refuse_unwritable as refuse_unwritable
from calmotion.workflow.problems import Cancelled as Cancelled
from calmotion.workflow.problems import problems_of as problems_of
from calmotion.workflow.problems import value_of as value_of
from calmotion.workflow.results import OptimizationResult as OptimizationResult
from calmotion.workflow.results import SimulationResult as SimulationResult
from calmotion.workflow.run import Hooks as Hooks
from calmotion.workflow.run import Outcome as Outcome
from calmotion.workflow.run import Progress as Progress
from calmotion.workflow.run import again as again
from calmotion.workflow.run import carry_out as carry_out
from calmotion.workflow.shot import Given as Given
from calmotion.workflow.shot import Path as Path
from calmotion.workflow.shot import Shot as Shot
from calmotion.workflow.shot import read_settings as read_settings
from calmotion.workflow.shot import with_shot as with_shot
