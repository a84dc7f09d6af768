"""A slender arm given as a surface of twelve triangles, simulated to a tolerance, against the theory of beams.

The mesher, the choice of the elements, the reduction and the step are those of the program. Without Poisson's ratio a
bar that is clamped at its end is the beam of the theory.
"""

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from beams import pushed_beam
from calmotion.accuracy.converged_reduction import converged_reduction
from calmotion.accuracy.simulate_to_tolerance import simulate_to_tolerance
from calmotion.benchmarks.scenes.beam_arm import beam_arm, shot_of
from calmotion.shot import FEMeshes, SurfaceMesh
from calmotion.shot.run import RunSettings
from calmotion.simulation.body_reduction import reduction_for
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import host_with, run_operator
from mesher_links import PLUGIN

LENGTH, THICKNESS, MODULUS = 0.6, 0.02, 1.8e9
LOAD, GRAVITY = 1.0, 9.81  # [kg], [m/s^2]; the arm itself weighs next to nothing


def quiet(fraction, message):
    pass


@pytest.fixture(scope="module")
def arm():
    """The arm with its box, and the mesh of the box."""
    character, _ = beam_arm(length=LENGTH, thickness=THICKNESS, youngs_modulus=MODULUS, density=1.0, payload=LOAD)
    box = trimesh.creation.box((LENGTH, THICKNESS, THICKNESS))
    box.apply_translation((0.5 * LENGTH, 0.0, 0.0))
    surface = SurfaceMesh("/Arm/Link0/Box", np.array(box.vertices), np.array(box.faces, dtype=np.int32))
    flexible = character.bodies[0].flexible
    settings = replace(flexible, material=replace(flexible.material, poissons_ratio=0.0))
    bodies = (replace(character.bodies[0], surfaces=(surface,), flexible=settings), *character.bodies[1:])
    character = replace(character, bodies=bodies)
    (meshes,) = run_operator(host_with(PLUGIN), "fe.mesh", [character], {})
    assert isinstance(meshes, FEMeshes)
    return character, meshes


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_it_hangs_as_far_as_the_beam(arm, tolerance):
    """By 29 mm, which its first mesh misses by a quarter of a millimetre."""
    character, meshes = arm
    animation, options = shot_of(lambda t: 0.0 * t, 0.125), RunSettings(tolerance=tolerance)
    reduction = reduction_for(character, animation, meshes, options, repeats=True)
    first = compile_shot(character, animation, reduction.bodies(tolerance))
    converged = converged_reduction(first, reduction, options)
    result = simulate_to_tolerance(converged.shot, options, quiet, converged.error_m, converged.known)
    x, _, z = result.before.motion.target_positions[-1, 0]
    area, second = THICKNESS**2, THICKNESS**4 / 12.0
    stretch, shear, bend = MODULUS * area, 10.0 / 12.0 * MODULUS / 2.0 * area, MODULUS * second
    along, across, _ = pushed_beam(LOAD * GRAVITY, LENGTH, stretch, shear, bend)
    error = np.hypot(x - LENGTH - along, -z - across)
    accuracy = result.accuracy
    assert 0.025 < across < 0.035
    assert error < tolerance and error < 1.5 * (accuracy.estimated_m + accuracy.mesh_m)
