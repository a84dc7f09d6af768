"""Public names of `calmotion.retargeting`: each is imported when it is first used."""

from calmotion.retargeting.checkpoint import checkpoint_path as checkpoint_path
from calmotion.retargeting.checkpoint import remove_checkpoint as remove_checkpoint
from calmotion.retargeting.found_curves import best_so_far as best_so_far
from calmotion.retargeting.optimize import optimize_shot as optimize_shot
from calmotion.retargeting.problem.offset_basis import OffsetBasis as OffsetBasis
from calmotion.retargeting.problem.offset_basis import make_basis as make_basis
from calmotion.retargeting.problem.offset_space import OffsetSpace as OffsetSpace
from calmotion.retargeting.problem.posing import CLOSENESS as CLOSENESS
from calmotion.retargeting.problem.posing import SMOOTHNESS as SMOOTHNESS
from calmotion.retargeting.problem.problem import Evaluation as Evaluation
from calmotion.retargeting.problem.problem import RetargetProblem as RetargetProblem
from calmotion.retargeting.retiming.retime import optimize_with_tempo as optimize_with_tempo
from calmotion.retargeting.retiming.rigid_robot import tempo_input as tempo_input
from calmotion.retargeting.retiming.settings import pinned_times as pinned_times
from calmotion.retargeting.retiming.tempo import find_tempo as find_tempo
from calmotion.retargeting.robust.measure import errors_on as errors_on
from calmotion.retargeting.robust.scenarios import payload_bodies as payload_bodies
from calmotion.retargeting.robust.scenarios import random_scenarios as random_scenarios
from calmotion.retargeting.robust.scenarios import uncertain_parameters as uncertain_parameters
from calmotion.retargeting.run_checks import check_search as check_search
from calmotion.retargeting.solver.damping_homotopy import damping_homotopy as damping_homotopy
from calmotion.retargeting.solver.gauss_newton import Ends as Ends
from calmotion.retargeting.solver.gauss_newton import Search as Search
from calmotion.retargeting.solver.gauss_newton import minimize as minimize
from calmotion.retargeting.to_tolerance import optimize_to_tolerance as optimize_to_tolerance
