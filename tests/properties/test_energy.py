"""Energy comes from the motors and from nowhere else.

BDF2 has errors of second order in what it leaves of the energy, of either sign; they are compared with the largest
energy that moves about in the shot.
"""

import numpy as np
from calmotion import ShotError
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.integrate import integrate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.forward import run_forward
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.preparation import prepare
from energies import energy, reach, work
from hypothesis import assume, given
from hypothesis import strategies as st
from random_shots import beams, lumps, shots

H = 1.0 / 960.0
RELEASED = round(0.3 / H)
SLACK = 4e-3  # the fastest of the moves takes 150 steps, whose velocities are off by half a thousandth
SHAKY = 1e-12  # of the weight times the reach: energies below this are rounding
# A release starts from two instants that are a parabola apart, which vibrations faster than the steps are not: they
# begin with an energy that is none of the robot's. Compared with this share of the weight times the reach, it is slack.
UNRESOLVED = 1e-3


def prepared_for(shot, pre_roll):
    bodies = reduce_bodies(shot.character, span_tree(shot.character), shot.meshes)
    return prepare(compile_shot(shot.character, shot.animation, bodies), RunSettings(step=H, pre_roll=pre_roll))


def scale(shot, system, kinetic, total, done=0.0, share=SHAKY):
    """The largest energy that moves about, at least a share of the weight times the reach [J]."""
    rounding = share * np.sum(system.mass) * np.linalg.norm(system.gravity) * reach(shot.character)
    return max(kinetic.max(), np.ptp(total - kinetic), np.ptp(done), rounding)


def forward(shot):
    """The system of a driven shot, its energies, and the work of its motors; leaves out what is refused."""
    try:
        prepared = prepared_for(shot, 0.25)
        system = prepared.model.system
        angles, rates = sample_tracks(shot.animation.tracks, prepared.grid)
        run = run_forward(prepared.model, Workspace.for_system(system), angles, rates, H, prepared.world)
    except (ShotError, SimulationFailure):
        assume(False)
    return system, *energy(system, run.trajectory.states), work(system, run)


@given(shots(kinds=("fixed", "hinge", "ball", "slider")))
def test_a_robot_without_drives_never_gains_energy(shot):
    prepared = prepared_for(shot, 0.0)
    system, rest = prepared.model.system, prepared.model.rest_angles
    angles = np.tile(rest, (RELEASED + 1, 1))
    try:
        run = integrate(
            system, rigid_state(prepared.model, rest), angles, 0.0 * angles, H, Workspace.for_system(system),
            from_equilibrium=False,
        )  # fmt: skip
    except SimulationFailure:
        assume(False)
    kinetic, total = energy(system, run.states)
    assert np.all(total - total[0] <= SLACK * scale(shot, system, kinetic, total, share=UNRESOLVED))


@given(shots(kinds=("fixed", "revolute motor", "prismatic motor", "hinge"), stuff=st.one_of(lumps(), beams())))
def test_what_is_driven_gains_no_more_than_the_work_of_its_motors(shot):
    system, kinetic, total, done = forward(shot)
    assert np.all(total - total[0] - done <= SLACK * scale(shot, system, kinetic, total, done))


@given(shots(kinds=("fixed", "revolute motor", "prismatic motor", "hinge"), stuff=lumps()))
def test_a_rigid_robot_has_all_the_work_of_its_motors(shot):
    system, kinetic, total, done = forward(shot)
    assert np.all(np.abs(total - total[0] - done) <= SLACK * scale(shot, system, kinetic, total, done))
