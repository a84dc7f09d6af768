"""Public names of `calmotion.tolerance`: each is imported when it is first used."""

from calmotion.tolerance.cost import expected_cost as expected_cost
from calmotion.tolerance.cost import refuse_unaffordable as refuse_unaffordable
from calmotion.tolerance.error_budget import with_budget as with_budget
from calmotion.tolerance.meshes.accurate_mesh import frames_of as frames_of
from calmotion.tolerance.meshes.body_mesh import geometry_of as geometry_of
from calmotion.tolerance.meshes.body_mesh import mesh_of as mesh_of
from calmotion.tolerance.meshes.body_mesh import twin_mesh as twin_mesh
from calmotion.tolerance.meshes.options import MeshOptions as MeshOptions
from calmotion.tolerance.meshes.options import Volume as Volume
from calmotion.tolerance.motors.backlash import with_lost_motion as with_lost_motion
from calmotion.tolerance.motors.motor_effects import effects_of_gains as effects_of_gains
from calmotion.tolerance.motors.motor_effects import with_error_shares as with_error_shares
from calmotion.tolerance.reduced_bodies import ConvergedReduction as ConvergedReduction
from calmotion.tolerance.reduced_bodies import ReducedBodies as ReducedBodies
from calmotion.tolerance.reduced_bodies import compiled_in as compiled_in
from calmotion.tolerance.reduction import converged_reduction as converged_reduction
from calmotion.tolerance.run_checks import check_simulation as check_simulation
from calmotion.tolerance.simplification.analysis import analyse as analyse
from calmotion.tolerance.simulation import found_tracks as found_tracks
from calmotion.tolerance.simulation import planned_step as planned_step
from calmotion.tolerance.simulation import simulate_to_tolerance as simulate_to_tolerance
from calmotion.tolerance.verification.parts_in_time import Elsewhere as Elsewhere
from calmotion.tolerance.verification.verify import verify as verify
