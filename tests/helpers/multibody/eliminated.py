"""Step matrices of small systems, eliminated and dense."""

import numpy as np
from calmotion.multibody.kernels.assembly import assemble
from calmotion.multibody.kernels.work import allocate_work
from calmotion.multibody.linear_solver import elimination
from calmotion.multibody.linear_solver.step_matrix import step_matrix
from calmotion.multibody.model.system import Blocks, Integrator, allocate_blocks
from dense import constrains, dense_matrix, multipliers
from particles import random_state
from trees import put_world, tree


def eliminated(name):
    system = tree(name, 2)
    state = random_state(np.random.default_rng(2), system)
    Hv = np.zeros((len(system.parent), 4, 4))
    Hv[:, 0, 0] = 50.0
    Hv[:, 1:, 1:] = 50.0 * np.eye(3)
    blocks = allocate_blocks(system)
    zero, vector = np.zeros((len(system.parent), system.size)), np.zeros(len(system.rows))
    work = allocate_work(system)
    put_world(work, np.random.default_rng(4))
    state.lam[~constrains(system)] = 0.0
    integrator = Integrator(50.0, 50.0, 1.0, 100.0)
    assemble(system, integrator, state, zero, vector, vector, Hv, True, work, blocks)
    A = dense_matrix(system, Blocks(*[part.copy() for part in blocks]))
    for joint, constrained in enumerate(constrains(system)):
        for k in np.flatnonzero(~constrained) + multipliers(system, joint).start:
            A[k, k] = 1.0
    matrix = step_matrix(system, blocks)
    assert elimination.factor(system, blocks, matrix, np.zeros(system.size)) == -1
    return system, blocks, matrix, A
