"""What is estimated of a servo that the model does not explain hangs on the recordings, not on rounding."""

import numpy as np
import pytest
from calmotion.model import RunSettings
from calmotion.recordings import ANGLE, Channel, SensorRecording
from calmotion_plugins.calibration import (
    CalibrationSettings,
    calibrate_shots,
    read_performed,
    robot_with,
    signals_of,
)
from calmotion_plugins.calibration.identification import search

SHOT = """#usda 1.0
(
    defaultPrim = "Robot"
    metersPerUnit = 1
    kilogramsPerUnit = 1
    upAxis = "Z"
    timeCodesPerSecond = 50
    endTimeCode = 100
)

def PhysicsScene "Physics"
{
    vector3f physics:gravityDirection = (0, 0, -1)
    float physics:gravityMagnitude = 9.80665
}

def Xform "Robot" (prepend apiSchemas = ["PhysicsArticulationRootAPI", "CalmRetargetAPI"])
{
    def Xform "Arm" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 0.5
        point3f physics:centerOfMass = (0, 0, -0.1)
        float3 physics:diagonalInertia = (1e-6, 1e-6, 1e-6)

        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])
        {
            double3 xformOp:translate = (0, 0, -0.1)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    }

    def PhysicsRevoluteJoint "Servo" (prepend apiSchemas = ["PhysicsDriveAPI:angular", "CalmMotorAPI"])
    {
        uniform token physics:axis = "Y"
        rel physics:body1 = </Robot/Arm>
        uniform token calm:motor:model = "servo"
        uniform token calm:motor:type = "xl330-m288"
        uniform float calm:motor:maxTorque = 0.8
        uniform float calm:motor:positionGain = 0.01745
        float drive:angular:physics:targetPosition.timeSamples = { TRACK }
    }
}
"""
MOTOR = "/Robot/Servo"
TRUE = (
    {"position_gain": 0.85, "friction": 0.005, "viscous_friction": 0.001, "load_friction": 0.4, "max_torque": 0.6},
    {"position_gain": 0.95, "friction": 0.04, "viscous_friction": 0.006, "load_friction": 0.2, "max_torque": 0.75},
)
SETTINGS = CalibrationSettings(
    ("position_gain", "armature", "friction", "viscous_friction", "load_friction", "max_torque", "delay"),
    {"clock_offset": 1e-3}, halvings=0, after=0.5,
)  # fmt: skip


@pytest.fixture(scope="module")
def performed(tmp_path_factory):
    """Swings of two servos that are not quite the same, taken for one."""
    found, folder = [], tmp_path_factory.mktemp("swings")
    times = np.arange(101) / 50
    begun = np.clip(times / 0.4, 0.0, 1.0)
    for k, (hertz, true) in enumerate(zip((0.9, 1.3), TRUE, strict=True)):
        angles = 60.0 * begun**2 * (3.0 - 2.0 * begun) * np.sin(2.0 * np.pi * hertz * times * (0.6 + 0.4 * times))
        file = folder / f"{k}.usda"
        file.write_text(SHOT.replace("TRACK", ", ".join(f"{n}: {angle:.5f}" for n, angle in enumerate(angles))))
        shot, _ = read_performed(str(file), [], None)
        robot = robot_with(shot, {(kind, MOTOR, -1): value for kind, value in true.items()})
        read = np.arange(0.1, 2.0, 0.01)
        noise = 2e-3 * np.random.default_rng(k).standard_normal((len(read), 1))
        values = signals_of(robot, RunSettings(step=1 / 4800)).at(ANGLE, 0, read) + noise
        found.append((shot, [SensorRecording(f"{k}.csv", "", (Channel(ANGLE, MOTOR, read, values),))]))
    return found


def test_the_derivative_of_a_motion_with_turns_of_friction_is_that_of_far_smaller_steps(performed):
    """A step that leaps over a turn of friction is off by up to half of it, as it happens to fall."""
    shot, _ = performed[1]

    def derivative(gain, step, divided=None):
        options = RunSettings(step=step, integrator="generalized-alpha")
        here = signals_of(robot_with(shot, {("position_gain", MOTOR, -1): gain}), options, divided=divided)
        ahead = robot_with(shot, {("position_gain", MOTOR, -1): gain + 1e-5})
        return (signals_of(ahead, options, divided=here.divided).angles - here.angles)[:: round(0.02 / step)] / 1e-5

    for gain in np.linspace(0.85, 0.95, 5):
        exact, found = derivative(gain, 1 / 6400), derivative(gain, 1 / 200)
        assert np.abs(found - exact).max() < 0.05 * np.abs(exact).max()


@pytest.mark.long
def test_searches_from_starts_that_hardly_differ_end_at_the_same_estimates(performed, monkeypatch):
    """Where a step leaps over the turns of friction, they end up to 1.3 standard deviations apart."""
    starts, found = search._starts, []
    for seed in range(2):
        random = np.random.default_rng(seed)
        monkeypatch.setattr(
            search, "_starts",
            lambda *given, random=random: [z + 1e-3 * random.standard_normal(len(z)) for z in starts(*given)],
        )  # fmt: skip
        found.append(
            [e for e in calibrate_shots(performed, SETTINGS, RunSettings(step=1 / 200)).estimates if e.of_robot]
        )
    for one, other in zip(*found, strict=True):
        assert abs(one.value - other.value) < 0.1 * min(one.standard_deviation, other.standard_deviation), one.name
