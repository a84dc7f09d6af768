"""Failures of a simulation in the user's words."""

from dataclasses import replace

import numpy as np
import pytest
from arms import frame
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Body, Character, Joint, MassProperties, Motor
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.inputs.open_chains import open_joints
from calmotion.simulation.preparation import failure_error, pose_modes, prepare
from calmotion.testing import quintic, shot_of
from calmotion.tolerance.simulation import intended_positions


@pytest.fixture(scope="module")
def prepared(arm, animation, bodies):
    return prepare(compile_shot(arm, animation, bodies), RunSettings(step=1 / 240))


@pytest.mark.parametrize("reason", Reason)
def test_only_failures_that_depend_on_the_step_may_be_tried_again(prepared, reason):
    error = failure_error(prepared, SimulationFailure(0.0, 0, reason))
    static = reason in (Reason.NO_EQUILIBRIUM, Reason.OPEN)
    assert type(error) is (ShotError if static else IntegrationError)
    assert error.path and error.remedy


def test_joints_that_come_apart_by_any_integrator_are_not_blamed_on_it():
    assert "bdf2" in open_joints(1e-3, "newmark", 0.01, "/Arm").remedy
    own = open_joints(1e-3, "bdf2", 0.01, "/Arm")
    assert "contradict" in own.remedy and "--step" not in own.remedy and "1 mm" in own.problem


def test_a_missing_equilibrium_names_the_joint_and_what_would_hold_the_body(prepared, arm):
    tree = prepared.model.tree
    for component in range(len(tree.joint)):
        error = failure_error(prepared, SimulationFailure(0.0, component, Reason.NO_EQUILIBRIUM, None, 0.4))
        joint, body = arm.joints[tree.joint[component]], arm.bodies[tree.body[component]]
        assert joint.path in str(error) and body.path == error.path and "40% of gravity" in str(error)
        assert "--step" not in error.remedy
        driven = any(motor.joint == tree.joint[component] for motor in arm.motors)
        assert ("a motor" in error.remedy) == (not driven and joint.kind != "fixed")
        assert ("physics:youngsModulus" in error.remedy) == (body.flexible is not None)


def test_a_motor_that_cannot_hold_its_load_is_named_with_its_force():
    """A lift: a hinge would let its load hang. The static reference has the same error as the frequencies."""
    bodies = (Body("/C/A", frame(), MassProperties(2.0, np.zeros(3), 0.01 * np.eye(3))),)
    joints = (Joint("/C/J", "prismatic", -1, 0, frame(), frame()),)
    motors = (Motor(0, "/C/J", "linear", linear=True, model="servo", position_gain=500.0, max_torque=0.02),)
    lift = Character("/C", bodies, joints, motors, (), np.array([0.0, 0.0, -9.81]))
    lift = replace(lift, retarget=replace(lift.retarget, reference="static"))
    shot = compile_shot(lift, shot_of(quintic(0.1, 0.3, 0.1), 0.5), None)
    for fails in (pose_modes, lambda shot: intended_positions(shot, RunSettings())):
        with pytest.raises(ShotError) as refused:
            fails(shot)
        assert refused.value.problem.endswith("under less than 1% of gravity it fails, first at the joint /C/J")
        assert refused.value.remedy.startswith("Raise calm:motor:maxTorque of /C/J, whose 0.02 N cannot hold it")
