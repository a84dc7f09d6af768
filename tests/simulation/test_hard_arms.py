"""Stiff, soft, heavy, fast and long arms: each runs to its end, or is refused with a reason."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import Body, Frame, Joint, MassProperties
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion.testing.beam_arms import IDENTITY
from made_shots import simulated

STEEL = {"youngs_modulus": 2.1e11, "density": 7800.0}
SWING = quintic(np.pi / 2, 0.5)


def spin(t):
    """100 rad/s after a second of constant acceleration."""
    return 100.0 * np.where(t < 1.0, 0.5 * t**2, t - 0.5)


def jump(t):
    """Half a turn from one frame to the next."""
    return np.where(t > 0.5 - 1e-9, np.pi, 0.0)


def wave(t):
    return 0.005 * (1.0 - np.cos(2.0 * np.pi * t))


def case(angle=SWING, seconds=1.0, rate=24.0, step=None, **arm):
    return beam_arm(**arm), shot_of(angle, seconds, arm.get("links", 1), rate), step


def nearly_massless():
    """A wrist of a billionth of a kilogram between the arm and its load, on a motor of its own."""
    character, meshes = beam_arm()
    link, load = character.bodies
    wrist = Body("/Arm/Wrist", load.rest, MassProperties(1e-9, np.zeros(3), 1e-15 * np.eye(3)))
    hinge = replace(character.joints[1], path="/Arm/Turn", kind="revolute", body0=0, body1=1)
    at = Frame(np.array([0.02, 0.0, 0.0]), IDENTITY)
    weld = Joint("/Arm/Weld", "fixed", 1, 2, at, Frame(np.zeros(3), IDENTITY))
    motors = (character.motors[0], replace(character.motors[0], joint=1, path="/Arm/Turn"))
    target = replace(character.targets[0], body=2)
    joints = (character.joints[0], hinge, weld)
    made = replace(character, bodies=(link, wrist, load), joints=joints, motors=motors, targets=(target,))
    return (made, meshes), shot_of(SWING, 1.0, 2), None


RUN = {
    "modulus of 1e9 Pa": lambda: case(youngs_modulus=1e9),
    "modulus of 1e10 Pa": lambda: case(youngs_modulus=1e10),
    "modulus of 1e11 Pa": lambda: case(youngs_modulus=1e11),
    "modulus of 1e12 Pa": lambda: case(youngs_modulus=1e12),
    "12 modes of 1e10 Pa": lambda: case(youngs_modulus=1e10, modes=12, elasticity="linear"),
    "12 modes of 1e12 Pa": lambda: case(youngs_modulus=1e12, modes=12, elasticity="linear"),
    "load of a millionth of the arm": lambda: case(payload=0.288e-6),
    "arm of a millionth of the load": lambda: case(density=1200.0 * 0.2e-6 / 0.288),
    "wrist of 1e-9 kg": nearly_massless,
    "step of 1e-4 s": lambda: case(seconds=0.75, step=1e-4),
    "step of 1/240 s": lambda: case(seconds=0.75, step=1 / 240),
    "step of 1/24 s": lambda: case(seconds=0.75, step=1 / 24),
    "no damping": lambda: case(damping=0.0, seconds=4.0),
    "no damping, stiff": lambda: case(damping=0.0, youngs_modulus=1e12, seconds=4.0),
    "half a turn in a frame, steel": lambda: case(jump, **STEEL),
    "spin of 100 rad/s": lambda: case(spin, 2.0, 480.0),
    "1:500, steel": lambda: case(thickness=0.6 / 500, cells=60, payload=1e-5, **STEEL),
    "gravity times 100": lambda: case(gravity=981.0),
    "gravity times 100, aluminium": lambda: case(gravity=981.0, youngs_modulus=7e10, density=2700.0),
    "no gravity": lambda: case(gravity=0.0),
    "100,000 steps": lambda: case(wave, 10.0, step=1e-4),
}
# what no set of reduced coordinates about a straight arm can follow, and what moves too fast for it
REFUSED = {
    "modulus of 1e4 Pa": lambda: case(youngs_modulus=1e4),
    "modulus of 1e6 Pa": lambda: case(youngs_modulus=1e6),
    "modulus of 1e8 Pa": lambda: case(youngs_modulus=1e8),
    "load of a million arms": lambda: case(payload=0.288e6),
    "1:500, plastic": lambda: case(thickness=0.6 / 500, cells=60),
    "spin of 100 rad/s in steps of 1/24 s": lambda: case(spin, 2.0, step=1 / 24),
}
LONG_RUN = {
    "modulus of 1e8 Pa, slow": lambda: case(quintic(0.1, 0.9), youngs_modulus=1e8),
    "step of 1e-5 s": lambda: case(seconds=0.75, step=1e-5),
    "64 flexible links": lambda: case(wave, links=64, length=0.05, cells=3, **STEEL),
}
LONG_REFUSED = {"half a turn in a frame, plastic": lambda: case(jump)}


def marked(cases, long):
    return [*cases.items(), *(pytest.param(*item, marks=pytest.mark.long) for item in long.items())]


@pytest.mark.parametrize("name, made", marked(RUN, LONG_RUN))
def test_it_runs_to_its_end(name, made):
    arm, animation, step = made()
    run = simulated(arm, animation, step=step)
    assert len(run.motion.times) > 10 and run.position_errors.max() < 2.0


@pytest.mark.parametrize("name, made", marked(REFUSED, LONG_REFUSED))
def test_it_is_refused_with_where_what_and_what_to_do(name, made):
    arm, animation, step = made()
    with pytest.raises(ShotError) as refused:
        simulated(arm, animation, step=step)
    why = str(refused.value)
    assert why.startswith("/Arm/") and why.endswith(".") and len(why) > 100
