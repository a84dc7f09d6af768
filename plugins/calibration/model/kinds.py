"""Kinds of parameters that recordings tell: their names, groups and priors."""

from collections.abc import Mapping

import numpy as np

# kinds of parameters of the robot
MODULUS, DAMPING, DENSITY, MASS, CENTRE = "modulus", "damping", "density", "mass", "centre"
POSITION_GAIN, VELOCITY_GAIN, GEAR_STIFFNESS = "position_gain", "velocity_gain", "gear_stiffness"
ARMATURE, FRICTION, VISCOUS_FRICTION, DELAY = "armature", "friction", "viscous_friction", "delay"
LOAD_FRICTION = "load_friction"  # at rest, over the mean of the torques on both sides of the gear
MAX_TORQUE = "max_torque"  # of a servo, at rest
ENCODER_OFFSET = "encoder_offset"
# what the model of the robot has wrong, and no attribute of a shot takes
HIGHER_MODES = "higher_modes"
# kinds of parameters of a measurement
CLOCK_OFFSET, CLOCK_DRIFT, BIAS, PLACE = "clock_offset", "clock_drift", "bias", "place"
GAIN, OFFSET = "gain", "offset"  # of a strain gauge
FILTER = FILTER_FREQUENCY, FILTER_DAMPING = "filter_frequency", "filter_damping"  # of a sensor's low-pass
START = "start"  # free motion in which a shot begins, of a sensor's signal

MATERIAL_KINDS = (MODULUS, DAMPING, DENSITY)
BODY_KINDS = (MASS, CENTRE)
MOTOR_KINDS = (
    POSITION_GAIN, VELOCITY_GAIN, GEAR_STIFFNESS, ARMATURE, FRICTION, VISCOUS_FRICTION, LOAD_FRICTION, MAX_TORQUE,
    DELAY, ENCODER_OFFSET,
)  # fmt: skip
ROBOT_KINDS = (*MATERIAL_KINDS, *BODY_KINDS, *MOTOR_KINDS)
MODEL_KINDS = (HIGHER_MODES,)
MEASUREMENT_KINDS = (CLOCK_OFFSET, CLOCK_DRIFT, BIAS, PLACE, GAIN, OFFSET, FILTER_FREQUENCY, FILTER_DAMPING, START)

# Standard deviations of the priors: of logarithms as ln(1 + s), of the others in SI.
PRIORS: Mapping[str, float] = {
    MODULUS: 0.3, DAMPING: 1.0, DENSITY: 0.05, MASS: 0.1, CENTRE: 0.01, POSITION_GAIN: 0.3, VELOCITY_GAIN: 0.5,
    GEAR_STIFFNESS: 0.5, ARMATURE: 0.5, FRICTION: 1.0, VISCOUS_FRICTION: 1.0, LOAD_FRICTION: 1.0,
    MAX_TORQUE: 0.3, DELAY: 0.005,
    ENCODER_OFFSET: float(np.radians(1.0)), HIGHER_MODES: 0.01, CLOCK_OFFSET: 0.05, CLOCK_DRIFT: 1e-4,
    BIAS: 0.3, PLACE: 0.002, GAIN: 1.0, OFFSET: 1.0, FILTER_FREQUENCY: 0.1, FILTER_DAMPING: 0.3,
}  # fmt: skip
DEFAULT = (
    MODULUS, DAMPING, MASS, POSITION_GAIN, VELOCITY_GAIN, GEAR_STIFFNESS, ARMATURE, FRICTION, VISCOUS_FRICTION,
    LOAD_FRICTION, MAX_TORQUE, DELAY,
)  # fmt: skip
LOGARITHMIC = (
    MODULUS, DAMPING, DENSITY, MASS, POSITION_GAIN, VELOCITY_GAIN, GEAR_STIFFNESS, ARMATURE, FRICTION, VISCOUS_FRICTION,
    LOAD_FRICTION, MAX_TORQUE,
)  # fmt: skip

OF_ROTOR = (ARMATURE, FRICTION, VISCOUS_FRICTION, LOAD_FRICTION)  # what the effort of an ideal motor tells
