"""Trees of particle bodies with all kinds of joints and laws, by name."""

import numpy as np
from calmotion.multibody.model.system import LINEAR, NEOHOOKEAN, STVK
from particles import nonlinear, particle_system, without_rotation
from scipy.spatial.transform import Rotation

TREES = {
    "one rigid body": ([-1], [0], [6]),
    "flexible chain": ([-1, 0, 1], [2, 3, 1], [6, 6, 6]),
    "branches, hinges, rigid among flexible": ([-1, 0, 1, 0, 3], [2, 0, 3, 4, 1], [6, 5, 6, 6, 5]),
    "two roots, one floating": ([-1, -1, 0], [2, 1, 2], [6, 0, 5]),
    "bodies of large deflection": ([-1, 0, 1, 0], [2, 3, 0, 2], [6, 5, 6, 6]),
    "balls and sliders": ([-1, 0, 1, 0, -1], [0, 2, 3, 1, 2], [6, 3, 6, 6, 3], [0, 2, 3]),
    "free sliders": ([-1, 0, 1, 0, -1], [1, 2, 3, 1, 2], [6, 5, 6, 5, 5], [1, 2, 3, 4]),
    "loops of free sliders": ([-1, 0, 1, 0], [1, 2, 0, 2], [6, 5, 3, 3], [1, 4, 5], [(2, 3, 5), (-1, 2, 5)]),
    "moving roots": ([-1, -1, 0, -1, -1], [2, 0, 1, 1, 2], [6, 5, 5, 3, 5], [0, 4], [(-1, 2, 3)], [0, 1, 4, 3, 5]),
    "some bodies do not rotate": ([-1, 0, 1, 0], [2, 3, 0, 2], [6, 5, 6, 6]),
    "no body rotates": ([-1, 0, 1, 0], [2, 3, 0, 2], [6, 6, 6, 6], [0, 2]),
    "loops": ([-1, 0, 1, 0], [1, 2, 0, 2], [5, 3, 3, 3], [6], [(2, 3, 3), (-1, 2, 5), (1, 3, 6)]),
}
LARGE = [STVK, NEOHOOKEAN, LINEAR, LINEAR]
LAWS = {"bodies of large deflection": LARGE, "no body rotates": LARGE}
NONROTATING = {"some bodies do not rotate": (1, 2), "no body rotates": (0, 1, 2, 3)}


def tree(name, seed):
    parents, elastic, rows, *more = TREES[name]
    rng = np.random.default_rng(seed)
    system, _ = particle_system(rng, parents, elastic, rows, 50.0, *more)
    system = without_rotation(system, NONROTATING.get(name, ()))
    return nonlinear(system, LAWS[name], rng) if name in LAWS else system


def put_world(work, rng):
    """Moving markers of the world in a random motion."""
    count = len(work.world)
    work.world[:, :9] = rng.normal(size=(count, 9))
    if count:
        work.world[:, 9:] = Rotation.random(count, random_state=5).as_matrix().reshape(count, 9)
