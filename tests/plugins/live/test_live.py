"""A robot that is streamed to, played back by the full simulation, and the command."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.model import Follows, Rotor, RunSettings, Track, TurnsWith
from calmotion.model.animation import Schedule
from calmotion.multibody import Workspace
from calmotion.simulation import Curves, best_delay, compile_shot, modes_of, prepare, rigid_motion, run_forward, shaped
from calmotion.simulation.forward import PerformedCurves
from calmotion.testing import small_shot
from calmotion_plugins.live import Live, LiveSettings, worth_of_lookahead
from scipy.interpolate import CubicSpline

RATE = 250.0
GIVES = {"model": "drive", "position_gain": 180.0, "velocity_gain": 0.4}


def robot(motor=GIVES, **limits):
    """The arm of two beams without gravity, on compliant motors: it swings at about 5 and 17 Hz."""
    character, animation = small_shot()
    motors = tuple(replace(item, **motor, **limits) for item in character.motors)
    return compile_shot(replace(character, motors=motors, gravity=np.zeros(3)), animation)


def moves(seconds, seed=0):
    """Angles of both motors over time [rad]: moves of 0.3 to 0.6 s within half a radian, and a second of rest."""
    random, ends = np.random.default_rng(seed), [(0.2, np.zeros(2))]
    while ends[-1][0] < seconds - 2.0:
        ends.append((ends[-1][0] + random.uniform(0.3, 0.6), random.uniform(-0.5, 0.5, 2)))

    def at(time):
        found = np.zeros(2)
        for (begin, pose), (end, to) in zip(ends, ends[1:], strict=False):
            s = np.clip((time - begin) / (end - begin), 0.0, 1.0)
            found = found + (to - pose) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
        return found

    return at


def streamed(shot, motion, seconds, **settings):
    """Commands, shape [T, M], at the ticks of a stream of a motion."""
    with Live(shot, LiveSettings(rate=RATE, background=False, **settings)) as live:
        live.reset(motion(0.0))
        found = np.array([live.step(k / RATE, motion(k / RATE)) for k in range(round(seconds * RATE))])
        return found, live.latency_s, live.report()


def left(shot, curve, intended, times, delay=None):
    """Root of the mean square distance of the target from the delayed intended motion [m], in a simulation.

    Args:
        delay: [s]; None: the one that leaves least.
    """
    h, model = times[1] - times[0], shot.model
    run = run_forward(model, Workspace.for_system(model.system), curve(times), curve(times, 1), h)
    wanted = rigid_motion(model, intended(times), intended(times, 1), h, None, False).target_positions
    if delay is None:
        distances = best_delay(run.target_positions, wanted, slice(0, None), h)[1]
    else:
        late = np.maximum(np.arange(len(times)) - round(delay / h), 0)
        distances = np.linalg.norm(run.target_positions - wanted[late], axis=2)
    return float(np.sqrt(np.mean(distances**2)))


@pytest.fixture(scope="module")
def stream():
    """Six seconds of motion: commands at the ticks, the motion, and instants of a simulation."""
    motion, ticks, times = moves(6.0), np.arange(1500) / RATE, np.arange(12_000) * 5e-4
    intended = CubicSpline(ticks, np.array([motion(t) for t in ticks]))
    return motion, intended, ticks, times


def test_a_stream_leaves_a_quarter_of_what_the_best_shaper_does(stream):
    motion, intended, ticks, times = stream
    shot = robot()
    frequencies, ratios = modes_of(prepare(shot, RunSettings(pre_roll=0.0)))
    lookahead = 0.4 / frequencies[0]
    commands, latency, _ = streamed(shot, motion, 6.0, lookahead=lookahead, uncertainty=0.0)
    assert latency <= lookahead + 0.5 / RATE
    live = left(shot, CubicSpline(ticks, commands), intended, times, latency)
    long = replace(shot.animation, frame_times=np.arange(0.0, 6.0, 1.0 / 24.0))
    grid = prepare(compile_shot(shot.character, long), RunSettings(step=5e-4, pre_roll=0.0)).grid
    curves, shapers = Curves(tuple(intended(grid.times, k) for k in range(4))), []
    for kind in ("zv", "zvd", "zv2", "zvd2"):
        made = shaped(curves, grid, kind, frequencies, ratios)
        shapers.append(left(shot, CubicSpline(grid.times, made.angles), intended, grid.times))
    assert live <= 0.25 * min(shapers), (live, shapers)


def test_the_table_of_look_aheads_tells_what_a_simulation_finds(stream):
    motion, intended, ticks, times = stream
    shot = robot()
    tracks = tuple(Track(ticks, intended(ticks)[:, k]) for k in range(2))
    frames, times = np.arange(0.0, 2.99, 1.0 / 24.0), times[:6000]
    shot = compile_shot(shot.character, replace(shot.animation, frame_times=frames, tracks=tracks, current=tracks))
    rows, _ = worth_of_lookahead(shot, LiveSettings(rate=RATE))
    assert rows[0].lookahead_s is None and rows[-1].lookahead_s > 0.15, "from none to a period"
    assert rows[0].rms_m == pytest.approx(left(shot, intended, intended, times), rel=0.02)
    row = next(row for row in rows if row.lookahead_s and row.lookahead_s > 0.06)
    commands, latency, _ = streamed(shot, motion, 6.0, lookahead=row.lookahead_s)
    assert latency == row.latency_s
    found = left(shot, CubicSpline(ticks, commands), intended, times, latency)
    assert row.rms_m == pytest.approx(found, abs=0.01 * rows[0].rms_m) and found < 0.1 * rows[0].rms_m


@pytest.mark.parametrize("motor", [{}, GIVES])
def test_efforts_that_a_motor_does_not_have_are_told(stream, motor):
    motion, _, ticks, times = stream
    shot = robot(motor, max_torque=10.0)
    commands, _, report = streamed(shot, motion, 6.0, lookahead=0.08)
    curve, model = CubicSpline(ticks, commands), shot.model
    h = times[1] - times[0]
    run = run_forward(model, Workspace.for_system(model.system), curve(times), curve(times, 1), h)
    largest = np.abs(PerformedCurves(model, Curves((curve(times),)), run).efforts).max(axis=0)
    told = [report["too_weak"].get(motor.path, 0.0) for motor in shot.character.motors]
    assert largest[0] > 10.0 > largest[1], "one motor is too weak"
    assert told == [pytest.approx(largest[0] / 10.0, rel=0.05), 0.0]
    assert list(report["limited"]) == [shot.character.motors[0].path]


def test_after_the_stream_rests_the_commands_are_its_own(stream):
    motion, *_ = stream
    commands, _, report = streamed(robot(), motion, 8.5, lookahead=0.08)
    np.testing.assert_allclose(commands[-1], motion(8.5), atol=1e-9)
    assert not report["events"] and report["ticks"] == 2125 and report["renewals"] > 10


def test_a_rigid_robot_gets_the_stream_as_it_is(stream):
    motion, *_ = stream
    commands, latency, _ = streamed(robot({}), motion, 4.0, lookahead=0.06)
    late = round(latency * RATE)
    np.testing.assert_allclose(commands[late:], [motion(k / RATE) for k in range(1000 - late)], atol=1e-12)


@pytest.mark.parametrize("jerk", [np.inf, 2000.0])
@pytest.mark.parametrize("ticks", [1500, pytest.param(round(3600 * RATE), marks=pytest.mark.long)])
def test_no_command_is_beyond_a_limit_whatever_arrives(ticks, jerk):
    random = np.random.default_rng(5)
    shot = robot(max_velocity=3.0, max_acceleration=60.0, max_jerk=jerk)
    with Live(shot, LiveSettings(rate=RATE, lookahead=0.06, background=False)) as live:
        live.reset(np.zeros(2))
        found, value = [np.zeros(2)], np.zeros(2)
        for k in range(ticks):
            value = value + 0.02 * random.normal(size=2) + (random.random() < 5e-3) * random.normal(size=2)
            arrived = random.random() > 0.1
            sample = np.where(random.random(2) < 0.01, np.nan, value)
            found.append(live.step(k / RATE + 1e-3 * random.normal(), sample if arrived else None))
        report = live.report()
    found = np.array(found)
    speed = np.diff(found, axis=0) * RATE
    assert np.all(np.abs(found[:, 1]) <= 2.0 + 1e-9)
    assert np.abs(speed).max() <= 3.0 + 1e-9
    assert np.abs(np.diff(speed, axis=0)).max() * RATE <= 60.0 * (1.0 + 1e-6)
    assert np.abs(np.diff(speed, 2, axis=0)).max() * RATE**2 <= jerk * (1.0 + 1e-6)
    assert report["limited"] and report["events"]["late"] and report["events"]["not finite"]


def test_joints_are_named_by_their_paths_and_geared_ones_follow():
    character, animation = small_shot()
    leader, follower = character.motors
    motors = (leader, replace(follower, follows=Follows(0, -2.0, 0.1)))
    with Live(compile_shot(replace(character, motors=motors), animation), LiveSettings(background=False)) as live:
        for k in range(400):
            commands = live.step(k / RATE, {leader.path: 0.2})
        assert commands == pytest.approx({leader.path: 0.2, follower.path: -0.3})
        with pytest.raises(SettingError, match="no motor of this name"):
            live.step(2.0, {"/Arm/Elbo": 0.0})
        with pytest.raises(SettingError, match="another number of values"):
            live.step(2.0, np.zeros(3))


@pytest.mark.parametrize("tolerance", [None, 1e-6])
def test_motors_that_lag_far_behind_are_led_while_the_pose_turns(stream, tolerance):
    """A tenth of a second; a tolerance finer than what a linear model knows does not let commands grow."""
    motion, intended, ticks, times = stream
    shot = robot({"model": "drive", "position_gain": 200.0, "velocity_gain": 20.0, "damping_on": "joint"})
    commands, latency, _ = streamed(shot, motion, 6.0, lookahead=0.14, tolerance=tolerance, uncertainty=0.0)
    live = left(shot, CubicSpline(ticks, commands), intended, times, latency)
    assert live <= 0.02 * left(shot, intended, intended, times, 0.0)


def test_friction_of_servos_is_led():
    """A servo with Coulomb and viscous friction lags; commands lead it."""
    motion = moves(6.0, seed=2)
    rotor = Rotor(armature=0.01, viscous_friction=0.5, friction=0.1)
    shot = robot({"model": "servo", "position_gain": 180.0, "rotor": rotor})
    ticks, times = np.arange(1500) / RATE, np.arange(12_000) * 5e-4
    intended = CubicSpline(ticks, np.array([motion(t) for t in ticks]))
    commands, latency, _ = streamed(shot, motion, 6.0, lookahead=0.1)
    live = left(shot, CubicSpline(ticks, commands), intended, times, latency)
    assert live <= 0.1 * left(shot, intended, intended, times, 0.0)


@pytest.mark.parametrize("settings, found", [({"rate": 3.0}, "rate"), ({"lookahead": 9.0}, "look-ahead")])
def test_settings_that_do_not_fit_are_refused(settings, found):
    with pytest.raises(SettingError, match=found):
        Live(robot(), LiveSettings(**settings))


def test_a_thread_renews_the_gains(stream):
    motion, *_ = stream
    with Live(robot(), LiveSettings(rate=RATE, lookahead=0.08)) as live:
        for k in range(1500):
            commands = live.step(k / RATE, motion(k / RATE))
        assert live.report()["renewals"] >= 1
    np.testing.assert_allclose(commands, motion(6.0), atol=1e-2)


def test_motors_that_two_joints_turn_are_refused_and_those_that_are_switched_off_stay_on():
    with pytest.raises(ShotError, match="no motor that two joints turn"):
        Live(robot({"turns_with": TurnsWith(0, 1.0)}))
    servo = GIVES | {"model": "servo", "rotor": Rotor(armature=0.01)}
    switched = Schedule(np.array([0.0, 0.5]), np.array([True, False]))
    with Live(robot(servo | {"powered": switched})) as live:
        (note,) = [note for note in live.notes if "calm:motor:powered" in note]
        assert "stay on: " in note
        live.step(0.0, live.start)
