"""A published steel cantilever: three frequencies from its geometry and one modulus.

The strip is 759 mm long, 50.66 mm wide and 5.14 mm thick; its bending frequencies were measured as 6.62, 41.4 and
117.5 Hz.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from calmotion.arrays import Array
from calmotion.multibody import natural_modes, span_tree
from calmotion.simulation import compile_shot, reduce_bodies
from calmotion.testing import beam_arm, shot_of

LENGTH, WIDTH, THICKNESS = 0.759, 0.05066, 0.00514  # [m]
DENSITY, MODULUS = 7850.0, 2.06e11  # of steel [kg/m^3], and to begin with [Pa]
MEASURED = (6.62, 41.4, 117.5)  # [Hz]
CELLS = 48  # of the mesh along the strip


def cantilever() -> tuple[Array, float]:
    """Its bending frequencies [Hz], shape [3], with the modulus [Pa] that fits the measured ones best."""
    character, meshes = beam_arm(
        length=LENGTH, thickness=THICKNESS, youngs_modulus=MODULUS, density=DENSITY, payload=1e-6, gravity=0.0,
        elasticity="linear", modes=8, cells=CELLS, across=2,
    )  # fmt: skip
    (mesh,) = meshes.meshes
    # beside the axis that lifts it, it is wider than it is thick
    mesh = replace(mesh, points=mesh.points * np.array([1.0, WIDTH / THICKNESS, 1.0]))
    bodies = reduce_bodies(character, span_tree(character), replace(meshes, meshes=(mesh,)))
    shot = compile_shot(character, shot_of(lambda t: 0.0 * np.asarray(t), 1.0), bodies)
    found = natural_modes(shot.model, np.zeros(1))[0]
    # those of bending are the nearest to a beam's, 1 : 6.27 : 17.55
    bending = np.array([found[np.argmin(np.abs(np.log(found / (ratio * found[0]))))] for ratio in (1.0, 6.267, 17.547)])
    factor = float(np.exp(np.mean(np.log(np.array(MEASURED) / bending))))
    return factor * bending, factor**2 * MODULUS
