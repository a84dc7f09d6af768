"""The rigid robot as an approximation of the flexible one: gradient and preconditioner without a simulation."""

from functools import cached_property

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.analysis.rigid_response import RigidResponse
from calmotion.multibody.model.model import Model, rigid_model
from calmotion.multibody.model.moving_markers import rooted
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.solver.preconditioner import RigidPreconditioner
from calmotion.simulation.inputs.curves import Curves
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.intended_motion import rigid_motion


class RigidRobot:
    """Motion of the targets and efforts of the motors of the rigid robot, by the motors that may change.

    Args:
        model: The flexible character.
        grid: Its time grid.
        curves: The animator's curves.
        world: Moving roots, or None.
        coupling: By how much each motor changes with each that may change, shape [M, m].
    """

    STRIDE = 8  # instants from one response to the next

    def __init__(self, model: Model, grid: TimeGrid, curves: Curves, world: Array | None, coupling: Array):
        self.model, self.grid, self.curves, self.world, self.coupling = model, grid, curves, world, coupling
        self._preconditioner: tuple[OffsetSpace, RigidPreconditioner] | None = None

    @cached_property
    def response(self) -> RigidResponse:
        """Along the curves."""
        rigid, curves, grid = rigid_model(self.model), self.curves, self.grid
        motion = rigid_motion(rigid, curves.angles, curves.rates, grid.h, self.world, grid.cyclic)
        angles = rigid.joint_angles(curves.angles)
        roots = rooted(self.world, len(motion.c))
        moved = np.flatnonzero(np.any(self.coupling, axis=1)).astype(np.int32)
        times = grid.h * np.arange(len(angles), dtype=np.float64)
        response = RigidResponse.along(rigid, motion.c, motion.q, angles, moved, roots, times, self.STRIDE)
        return response.coupled(self.coupling[moved])

    def metric(self, weights: Array) -> Array:
        """Second derivatives of the objective by the angles of the unknowns' motors, shape [T, m, m]."""
        weighted = self.response.targets * weights[..., None]
        return np.asarray(np.einsum("nkia,nkib->nab", weighted, weighted))

    def preconditioner(self, space: OffsetSpace, weights: Array) -> RigidPreconditioner:
        """Of the objective; made once for the unknowns that were asked last."""
        if self._preconditioner is None or self._preconditioner[0] is not space:
            made = RigidPreconditioner(self.response, weights, space.basis, space.penalty)
            self._preconditioner = space, made
        return self._preconditioner[1]
