"""Public names of `calmotion.multibody`: each is imported when it is first used."""

from calmotion.model.character import WORLD as WORLD
from calmotion.multibody.analysis.kinematics import rigid_poses as rigid_poses
from calmotion.multibody.analysis.reactions import reactions as reactions
from calmotion.multibody.failure import NOWHERE as NOWHERE
from calmotion.multibody.failure import Reason as Reason
from calmotion.multibody.failure import SimulationFailure as SimulationFailure
from calmotion.multibody.integrators.coefficients import IMPLICIT as IMPLICIT
from calmotion.multibody.integrators.workspace import Workspace as Workspace
from calmotion.multibody.mechanism import Mechanism as Mechanism
from calmotion.multibody.model.joint_arrays import body_anchors as body_anchors
from calmotion.multibody.model.model import Model as Model
from calmotion.multibody.model.model import compile_model as compile_model
from calmotion.multibody.model.model import moves_freely as moves_freely
from calmotion.multibody.model.system import State as State
from calmotion.multibody.model.topology import Tree as Tree
from calmotion.multibody.model.topology import span_tree as span_tree
from calmotion.multibody.motors.drives import joint_values as joint_values
from calmotion.multibody.parallel import in_parallel as in_parallel
from calmotion.multibody.runs import LinearizedRun as LinearizedRun
from calmotion.multibody.runs import ModelRun as ModelRun
from calmotion.multibody.runs import linearize as linearize
from calmotion.multibody.runs import natural_modes as natural_modes
from calmotion.multibody.runs import simulate as simulate
from calmotion.reduction.reduced_body import ReducedBody as ReducedBody
