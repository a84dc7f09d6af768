"""What gains would do to a shot, what motors and links have in its error, and a search whose curve is the command."""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain
from calmotion.model import Animation, Track
from calmotion.model.character import motors_give, with_ideal_motors
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.failure import Reason, SimulationFailure
from calmotion.multibody.model.model import rigid_model
from calmotion.retargeting.optimize import optimize_shot
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.tolerance.motors import motor_effects
from calmotion.tolerance.motors.motor_effects import effects_of_gains, with_error_shares
from made_shots import plastic_shot

K, D = 400.0, 8.0
FRAMES = np.arange(31) / 30.0
OPTIONS = RunSettings(step=1 / 240)
IDEAL = chain(2, driven=(0, 1), length=0.3)


def with_gains(model):
    changes = {"model": model, "position_gain": K, "velocity_gain": D}
    if model == "servo":
        changes |= {"rotor": Rotor(0.02, 4e3, 2.0, 0.05, 0.1), "delay": 0.012, "max_torque": 80.0}
    motors = tuple(replace(m, **changes) for m in IDEAL.motors)
    return replace(IDEAL, motors=motors)


def shot(character, cyclic=False):
    if cyclic:
        character = replace(character, retarget=replace(character.retarget, cyclic=True))
    wave = 1.0 - np.cos(2 * np.pi * FRAMES)
    tracks = (Track(FRAMES, 0.3 * wave), Track(FRAMES, -0.5 * wave))
    return compile_shot(character, Animation(FRAMES, tracks, tracks))


@pytest.fixture(scope="module")
def flexible_arm():
    return plastic_shot()


def errors(simulation):
    """Of the instants that count, shape [T, K]."""
    return simulation.position_errors[simulation.motion.judged]


def quiet(fraction, message):
    pass


def test_gains_that_are_not_used_tell_what_they_would_do_as_the_simulation_with_drives_does():
    assert effects_of_gains(shot(IDEAL), OPTIONS).motors == ()
    found = effects_of_gains(shot(with_gains("prescribed")), OPTIONS)
    same = replace(OPTIONS, integrator="generalized-alpha")
    simulated = simulate_shot(shot(with_gains("drive")), same, quiet).before
    assert found.motors == ("/C/J0", "/C/J1")
    assert found.lag == pytest.approx(errors(simulated).max(axis=0), rel=1e-9)
    assert found.ideal_lag == pytest.approx([0.0], abs=1e-6) and found.ideal_droop == pytest.approx([0.0], abs=1e-9)
    # weights of 1 kg at 0.3 m and 0.6 m: moments m g (0.9, 0.3), and the tip moves by 0.6 and 0.3 m per angle
    droop = 9.81 / K * np.hypot(0.9 * 0.6 + 0.3 * 0.3, 0.0)
    assert found.droop == pytest.approx([droop], rel=0.02) and found.droop == pytest.approx(simulated.sag, rel=1e-9)


@pytest.mark.parametrize("gain", [30.0, *(pytest.param(k, marks=pytest.mark.long) for k in (150.0, 600.0))])
def test_on_flexible_links_the_effect_of_gains_is_that_of_a_finer_simulation_with_drives(flexible_arm, gain):
    """Drives shift the frequencies of the links, so that their errors do not add up."""
    motors = tuple(replace(m, position_gain=gain, velocity_gain=gain / 50.0) for m in flexible_arm.character.motors)
    given = compile_shot(replace(flexible_arm.character, motors=motors), flexible_arm.animation, flexible_arm.bodies)
    found = effects_of_gains(given, RunSettings())
    drives = replace(given.character, motors=tuple(replace(m, model="drive") for m in motors))
    for character, lag, droop in (
        (drives, found.lag, found.droop),
        (given.character, found.ideal_lag, found.ideal_droop),
    ):
        shot = compile_shot(character, flexible_arm.animation, flexible_arm.bodies)
        finer = simulate_shot(shot, RunSettings(step=1 / 1920), quiet).before
        assert lag == pytest.approx(errors(finer).max(axis=0), rel=0.05)
        assert droop == pytest.approx(finer.sag, rel=1e-3)


def test_motors_cause_all_of_the_error_of_rigid_links_and_ideal_ones_none():
    simulated = shot(with_gains("drive"))
    result = simulate_shot(simulated, OPTIONS, quiet)
    shares = with_error_shares(simulated, result, OPTIONS, quiet).error_shares
    assert shares.motors_m == pytest.approx(errors(result.before).max(axis=0), rel=0.02)
    assert shares.links_m[0] < 1e-3 * shares.motors_m[0]
    ideal = shot(with_ideal_motors(with_gains("drive")))
    assert with_error_shares(ideal, result, OPTIONS, quiet) is result and not motors_give(ideal.character)


def test_where_rigid_links_cannot_be_simulated_the_result_is_told_without_these_parts(flexible_arm, monkeypatch):
    """Their last state has no elastic coordinates, as that of the robot has."""
    motors = tuple(replace(m, model="drive", position_gain=K, velocity_gain=D) for m in flexible_arm.character.motors)
    drives = compile_shot(replace(flexible_arm.character, motors=motors), flexible_arm.animation, flexible_arm.bodies)
    result = simulate_shot(drives, OPTIONS, quiet)

    def failing(model, *given, **options):
        raise SimulationFailure(0.1, 0, Reason.DIVERGED, rigid_state(rigid_model(model), np.zeros(len(motors))))

    monkeypatch.setattr(motor_effects, "run_forward", failing)
    assert with_error_shares(drives, result, OPTIONS, quiet) is result
    assert effects_of_gains(drives, OPTIONS).motors == ()


@pytest.mark.parametrize("model", ["drive", "servo"])
@pytest.mark.parametrize("cyclic", [False, True], ids=["once", "loop"])
def test_a_search_finds_commands_with_which_giving_motors_do_what_was_intended(cyclic, model):
    result = optimize_shot(shot(with_gains(model), cyclic), OPTIONS, quiet)
    before, after = errors(result.before), errors(result.after)
    assert before.max() > 0.01 and after.max() < 0.1 * before.max()
    middle, h = np.argmin(np.abs(result.after.motion.times - 0.5)), result.step_s
    lead = result.after.motion.motor_values - result.reference.motor_values
    given = K * lead + D * np.gradient(lead, h, axis=0)
    effort = result.after.motion.motor_efforts[middle]
    if model == "drive":
        assert given[middle] == pytest.approx(effort, rel=0.05), (
            "the command leads by what its drive needs for the effort"
        )
