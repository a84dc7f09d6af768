"""Starting in motion: consistent accelerations at the first instant, and the instant before it.

BDF2 needs two earlier instants. From rest in equilibrium the one before the start is the start itself. Otherwise it is
continued backwards to second order, x(-h) = x - h V + h^2/2 a, V(-h) = V - h a, which keeps the integrator's order; a
follows from the equations of motion with the constraints differentiated once more.
"""

from calmotion.arrays import Array
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.so3 import turn
from calmotion.multibody.linear_solver.index1 import accelerations
from calmotion.multibody.model.system import State, System


def initial_acceleration(
    system: System, state: State, angle: Array, rate: Array, acceleration: Array, ws: Workspace
) -> tuple[Array, Array]:
    """Accelerations (c'', alpha in body axes, u'') and multipliers that the equations ask for at a state.

    Args:
        state: Positions and velocities that satisfy the constraints; its multipliers are not used.
        angle, rate, acceleration: Of each joint's motor, shape [J].

    Returns:
        Accelerations, shape [B, N], and multipliers, shape [J, 6].

    Raises:
        SimulationFailure: A singular system.
    """
    here = State(*[part.copy() for part in state])
    bad = accelerations(system, here, angle, rate, acceleration, 0.0, ws)
    if bad >= 0:
        raise SimulationFailure(0.0, bad, Reason.SINGULAR)
    return ws.scratch.Vd.copy(), here.lam


def instant_before(system: System, state: State, acceleration: Array, h: float) -> tuple[State, Array]:
    """The state a step earlier, to second order, and the turn from it to the given one, shape [B, 3]."""
    before = State(*[part.copy() for part in state])
    back = h * state.V - 0.5 * h * h * acceleration
    before.c[:] = state.c - back[:, :3]
    before.u[:] = state.u - back[:, 6:]
    before.V[:] = state.V - h * acceleration
    for b in range(len(system.parent)):
        turn(state.q[b], -back[b, 3:6], before.q[b])
    return before, back[:, 3:6]
