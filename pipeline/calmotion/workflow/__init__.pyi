"""Public names of `calmotion.workflow`: each is imported when it is first used."""

from calmotion.workflow.commands import optimize as optimize
from calmotion.workflow.commands import simulate as simulate
from calmotion.workflow.json_values import plain as plain
from calmotion.workflow.outputs import refuse_layers as refuse_layers
from calmotion.workflow.outputs import refuse_overwriting as refuse_overwriting
from calmotion.workflow.outputs import refuse_unwritable as refuse_unwritable
from calmotion.workflow.problems import Cancelled as Cancelled
from calmotion.workflow.problems import problems_of as problems_of
from calmotion.workflow.problems import value_of as value_of
from calmotion.workflow.publishing.manifest import changed_files as changed_files
from calmotion.workflow.publishing.manifest import read_manifest as read_manifest
from calmotion.workflow.publishing.manifest import sha256_of as sha256_of
from calmotion.workflow.results import OptimizationResult as OptimizationResult
from calmotion.workflow.results import SimulationResult as SimulationResult
from calmotion.workflow.run import Hooks as Hooks
from calmotion.workflow.run import Outcome as Outcome
from calmotion.workflow.run import Progress as Progress
from calmotion.workflow.run import again as again
from calmotion.workflow.run import carry_out as carry_out
from calmotion.workflow.run import compiled_run as compiled_run
from calmotion.workflow.run import no_input as no_input
from calmotion.workflow.shot import Given as Given
from calmotion.workflow.shot import Path as Path
from calmotion.workflow.shot import Shot as Shot
from calmotion.workflow.shot import read_settings as read_settings
from calmotion.workflow.shot import with_shot as with_shot
