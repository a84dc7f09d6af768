"""Public names of `calmotion.reduction`: each is imported when it is first used."""

from calmotion.reduction.basis.natural_modes import clamped_modes as clamped_modes
from calmotion.reduction.cache import cache_key as cache_key
from calmotion.reduction.cache import recomputed as recomputed
from calmotion.reduction.damping import modal_damping as modal_damping
from calmotion.reduction.discretization_error import frequency_errors as frequency_errors
from calmotion.reduction.elements.assembly import FEModel as FEModel
from calmotion.reduction.elements.assembly import assemble as assemble
from calmotion.reduction.inertia import inertia_integrals as inertia_integrals
from calmotion.reduction.load_envelope import LoadEnvelope as LoadEnvelope
from calmotion.reduction.mesh_refinement import MeshController as MeshController
from calmotion.reduction.mesh_refinement import root_at as root_at
from calmotion.reduction.reduce import LinearModes as LinearModes
from calmotion.reduction.reduced_body import Invariants as Invariants
from calmotion.reduction.reduced_body import ReducedBody as ReducedBody
from calmotion.reduction.scaled_stiffness import with_graded_stiffness as with_graded_stiffness
from calmotion.reduction.scaled_stiffness import with_mode_stiffness as with_mode_stiffness
from calmotion.reduction.scaled_stiffness import with_scaled_density as with_scaled_density
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness as with_scaled_stiffness
from calmotion.reduction.sections.estimate import estimated_body as estimated_body
from calmotion.reduction.soft_bodies import refuse_soft_bodies as refuse_soft_bodies
