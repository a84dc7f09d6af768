"""A small flexible system in motion, for the tests of integrators."""

import numpy as np
import pytest
from calmotion.multibody.analysis.kinematics import system_poses
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.system import allocate_state
from particles import particle_system


@pytest.fixture(scope="session")
def flexible_tree():
    """Four bodies, three of them flexible, motors and a free hinge, moved for 0.4 s in as many steps as one asks for.

    The motors follow a polynomial of degree 5, so that what looks between instants is not exact there.
    """
    rng = np.random.default_rng(0)
    system, _ = particle_system(rng, [-1, 0, 1, 0], [2, 0, 3, 2], [6, 6, 5, 6], 3000.0)
    reach, duration = 6.0 * rng.normal(size=4), 0.4

    def drive(t):
        t = np.asarray(t)
        powers = (t**4 * (3.0 - t), 12.0 * t**3 - 5.0 * t**4, 36.0 * t**2 - 20.0 * t**3)
        return tuple(np.outer(power, reach) for power in powers)

    def run(steps, integrator):
        times = np.linspace(0.0, duration, steps + 1)
        angles, rates, _ = drive(times)
        start = allocate_state(system)
        c, q = system_poses(system, angles[:1])
        start.c[:], start.q[:] = c[0], q[0]
        workspace = Workspace.for_system(system)
        return integrate(system, start, angles, rates, duration / steps, workspace, integrator=integrator)

    run.system, run.drive, run.duration = system, drive, duration
    return run
