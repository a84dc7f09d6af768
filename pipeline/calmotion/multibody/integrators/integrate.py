"""All integrators behind one interface.

`bdf2` (the default, and the one with derivatives), `newmark` and `generalized-alpha` are implicit, on the index-2 form;
`rk4` is explicit, on the index-1 form.
"""

import time
from collections.abc import Callable

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.errors import IntegrationError
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.integrators import runge_kutta
from calmotion.multibody.integrators.coefficients import IMPLICIT
from calmotion.multibody.integrators.simulation import largest_gap, simulate
from calmotion.multibody.integrators.trajectory import Inputs, Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.moving_markers import rooted
from calmotion.multibody.model.phases import has_phases
from calmotion.multibody.model.system import BEYOND_COULOMB, State, System
from calmotion.multibody.motors.between_instants import hermite_drive, stage_inputs
from calmotion.multibody.statics.equilibrium import equilibrium

DIVERGED = 1e6  # velocity [m/s, rad/s]


def follows_roots(integrator: str) -> bool:
    """Whether an integrator supports moving roots."""
    return integrator in IMPLICIT


def integrate(
    system: System, start: State, angles: Array, rates: Array, h: float, workspace: Workspace,
    progress: Callable[[float], None] | None = None, from_equilibrium: bool = True, integrator: str = "bdf2",
    world: Array | None = None, divides: bool = True, divided: IntArray | None = None,
) -> Trajectory:  # fmt: skip  # parameters: those of `simulate`
    """`simulation.simulate` by any integrator of `INTEGRATORS`; same arguments, results and errors.

    Between instants `rk4` uses cubics through angles and rates, which is exact for a cubic spline with
    knots on instants.

    Raises:
        IntegrationError: Contacts or switched motors, by another integrator than BDF2; friction that depends on
            accelerations, by RK4.
    """
    if has_phases(system) and integrator != "bdf2":
        raise IntegrationError(
            "only bdf2 simulates contacts and motors that are switched off",
            attribute="--integrator",
            found=integrator,
            remedy="Leave it out.",
        )
    if integrator == "rk4" and np.any(system.servo[:, BEYOND_COULOMB]):
        raise IntegrationError(
            "rk4 simulates no friction of motors but Coulomb's",
            attribute="--integrator",
            found=integrator,
            remedy="Leave it out, or set calm:motor:frictionModel to coulomb.",
        )
    if integrator in IMPLICIT:
        try:
            return simulate(
                system, start, angles, rates, h, workspace, progress, from_equilibrium, integrator, world, divides,
                divided,
            )  # fmt: skip
        except ZeroDivisionError:  # of a kernel, whose numbers have left all bounds: it does not tell where
            raise SimulationFailure(float("nan"), 0, Reason.DIVERGED) from None
    if np.any(system.moving >= 0):
        raise ValueError(f"{integrator} does not support moving roots")
    begin, ws, total = time.perf_counter(), workspace, len(angles)
    first, solved = equilibrium(system, start, angles[0], ws) if from_equilibrium else (start, 0)
    times: Array = h * np.arange(total, dtype=np.float64)
    drive = hermite_drive(times, angles, rates)
    states = State(*[np.zeros((total,) + part.shape) for part in first])
    for part, value in zip(states, first, strict=True):
        part[0] = value
    inputs = stage_inputs(drive, times, runge_kutta.STAGES)
    slopes = runge_kutta.allocate_slopes(system)
    instant, component = runge_kutta.advance(system, h, states, inputs, ws, slopes, DIVERGED)
    if component >= 0:
        raise SimulationFailure(instant * h, component, Reason.DIVERGED, copy_of_instant(states, instant - 1))
    world = rooted(None, total)
    gap = largest_gap(system, Inputs(angles, rates, world), states, ws.work)
    if progress is not None:
        progress(1.0)
    return Trajectory(h, states, world, solved, 0, gap, time.perf_counter() - begin, integrator)
