"""A published steel cantilever: its measured bending frequencies follow from its geometry and one modulus."""

from dataclasses import replace

import numpy as np
from calmotion.multibody import natural_modes, span_tree
from calmotion.simulation import compile_shot, reduce_bodies
from calmotion.testing import beam_arm, shot_of

LENGTH, WIDTH, THICKNESS = 0.759, 0.05066, 0.00514  # [m]
DENSITY, MODULUS = 7850.0, 2.06e11  # of steel [kg/m^3], and to begin with [Pa]
MEASURED = np.array([6.62, 41.4, 117.5])  # [Hz]


def test_three_frequencies_of_a_published_cantilever_follow_from_its_geometry_and_one_modulus():
    character, meshes = beam_arm(
        length=LENGTH, thickness=THICKNESS, youngs_modulus=MODULUS, density=DENSITY, payload=1e-6, gravity=0.0,
        elasticity="linear", modes=8, cells=48, across=2,
    )  # fmt: skip
    (mesh,) = meshes.meshes
    # beside the axis that lifts it, it is wider than it is thick
    mesh = replace(mesh, points=mesh.points * np.array([1.0, WIDTH / THICKNESS, 1.0]))
    bodies = reduce_bodies(character, span_tree(character), replace(meshes, meshes=(mesh,)))
    shot = compile_shot(character, shot_of(lambda t: 0.0 * np.asarray(t), 1.0), bodies)
    found = natural_modes(shot.model, np.zeros(1))[0]
    # those of bending are the nearest to a beam's, 1 : 6.27 : 17.55
    bending = np.array([found[np.argmin(np.abs(np.log(found / (ratio * found[0]))))] for ratio in (1.0, 6.267, 17.547)])
    factor = np.exp(np.mean(np.log(MEASURED / bending)))
    assert np.abs(factor * bending / MEASURED - 1.0).max() < 0.015
    assert 1.5e11 < factor**2 * MODULUS < 2.2e11
