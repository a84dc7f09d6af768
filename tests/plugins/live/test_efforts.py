"""Commands that keep the motors' efforts, against other ways to compute the same."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model import Rotor
from calmotion.multibody import Workspace
from calmotion.simulation import Curves, compile_shot, rigid_motion, run_forward
from calmotion.simulation.forward import PerformedCurves
from calmotion.testing import small_shot
from calmotion_plugins.live import Live, LiveSettings, Weighting, gains_at
from calmotion_plugins.live.regulation.efforts import Efforts, efforts_ahead, multipliers
from hinges import two_hinges
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

TICK, TICKS = 1.0 / 250.0, 30


@pytest.fixture(scope="module")
def arm():
    """Two links on drives, whose first motor has a limit: gains with a window of 0.12 s."""
    pose, targets = two_hinges(), np.tile([1.0] * 3 + [0.0] * 3, (1, 1))
    weighting = Weighting(TICK, TICKS, targets, np.full(2, 1e-4 / TICK), 1e-2, limited=np.array([True, False]))
    return gains_at(pose, np.eye(2), weighting)


@pytest.fixture
def moving(arm):
    """A state and the impulses and efforts of an intended motion."""
    random = np.random.default_rng(3)
    known = 5.0 + np.cumsum(random.normal(size=(TICKS, 1)), axis=0)
    return 1e-3 * random.normal(size=len(arm.transition)), 1e-2 * random.normal(size=(TICKS, 2)), known


def ahead_of(gains, x, impulses, known):
    loop = gains.efforts
    return efforts_ahead(
        loop.closed,
        loop.by_change,
        loop.by_impulse,
        loop.answer,
        loop.ahead,
        loop.before,
        loop.after,
        x,
        impulses,
        known,
    )


def played(gains, x, impulses, known, changes=None):
    """Efforts tick by tick, with the preview's changes and others on top, shape [T, 1]."""
    found, n = [], len(gains.pose.omega)
    inertia = np.concatenate([gains.pose.inertia, -gains.pose.by_acceleration.T], axis=1)[0]
    for k in range(TICKS):
        v = -gains.feedback @ x - np.einsum("kmi,ki->m", gains.preview[: TICKS - k], impulses[k:])
        after = gains.transition @ x + gains.by_change @ (v + (0.0 if changes is None else changes[k]))
        after += gains.by_impulse @ impulses[k]
        rates, before = (np.concatenate([s[2:4], s[4 + n :]]) for s in (after, x))
        found.append(inertia @ (rates - before) / TICK + gains.pose.resistance[0] @ rates + known[k, 0])
        x = after
    return np.array(found)[:, None]


def test_efforts_ahead_are_those_of_the_regulator_with_preview(arm, moving):
    np.testing.assert_allclose(ahead_of(arm, *moving), played(arm, *moving), rtol=1e-9, atol=1e-9)


def test_the_response_is_that_of_changes_that_multipliers_pull(arm, moving):
    z, pulls = np.random.default_rng(1).normal(size=TICKS), arm.efforts.pulls
    changes = np.array([-np.einsum("kma,k->m", pulls[: TICKS - k], z[k:]) for k in range(TICKS)])
    x, impulses, known = moving
    moved = played(arm, x, impulses, known) - played(arm, x, impulses, known, changes)
    soft = Efforts.SOFTNESS / (1.0 + Efforts.SOFTNESS) * np.trace(arm.efforts.response) / TICKS
    response = arm.efforts.response - soft * np.eye(TICKS)
    np.testing.assert_allclose(response, response.T, atol=1e-9 * np.abs(response).max())
    np.testing.assert_allclose(response @ z, moved[:, 0], atol=1e-9 * np.abs(moved).max())


@pytest.mark.parametrize("most", [4.0, 6.0, 50.0])
def test_multipliers_solve_the_dual(arm, moving, most):
    free, response, most = ahead_of(arm, *moving).ravel(), arm.efforts.response, np.full(TICKS, most)
    found, scale = multipliers(response, free, most, np.zeros(TICKS)), np.trace(response) / TICKS

    def cost(parts):
        up, down = parts.reshape(2, -1) / scale
        z = up - down
        slope = free - response @ z
        return scale * (z @ response @ z / 2 - z @ free + most @ (up + down)), np.concatenate(
            [most - slope, most + slope]
        )

    best = minimize(
        cost, np.zeros(2 * TICKS), jac=True, bounds=[(0.0, None)] * (2 * TICKS), options={"maxiter": 20_000}
    )
    up, down = best.x.reshape(2, -1) / scale
    own = cost(scale * np.concatenate([np.maximum(found, 0.0), np.maximum(-found, 0.0)]))[0]
    assert own <= best.fun + 1e-6 * abs(best.fun)
    assert (np.abs(free).max() > most[0]) == bool(np.any(found))
    assert np.abs(free - response @ found).max() <= most[0] * (1.0 + 1e-6)
    np.testing.assert_allclose(response @ found, response @ (up - down), atol=2e-2 * np.abs(free).max())


def servos(most):
    """The arm of two beams on servos, the first of which has so much torque [N m]."""
    character, animation = small_shot()
    servo = {"model": "servo", "position_gain": 180.0, "velocity_gain": 0.4, "rotor": Rotor(armature=0.01)}
    motors = [replace(motor, **servo) for motor in character.motors]
    motors[0] = replace(motors[0], max_torque=most)
    return compile_shot(replace(character, motors=tuple(motors), gravity=np.zeros(3)), animation)


def test_a_motor_that_is_a_little_too_weak_costs_little():
    """Commands for a strong motor ask it for a tenth more than it has."""
    ticks, times = np.arange(900) * TICK, np.arange(7200) * 5e-4
    s = np.clip((ticks - 0.4) / 0.45, 0.0, 1.0)
    motion = np.outer(s**3 * (10.0 - 15.0 * s + 6.0 * s * s), [0.9, -0.4])

    def streamed(shot):
        with Live(shot, LiveSettings(lookahead=0.1, uncertainty=0.0, background=False)) as live:
            live.reset(np.zeros(2))
            return np.array([live.step(k * TICK, row) for k, row in enumerate(motion)]), live.report()

    def left(shot, commands, latency):
        """Largest distance of the target from the delayed motion [m], and effort of the first motor [N m]."""
        curve, model = CubicSpline(ticks, commands), shot.model
        run = run_forward(model, Workspace.for_system(model.system), curve(times), curve(times, 1), 5e-4)
        intended = CubicSpline(ticks, motion)(np.maximum(times - latency, 0.0))
        wanted = rigid_motion(model, intended, np.zeros_like(intended), 5e-4, None, False).target_positions
        efforts = PerformedCurves(model, Curves((curve(times),)), run).efforts
        return np.linalg.norm(run.target_positions - wanted, axis=2).max(), np.abs(efforts[:, 0]).max()

    strong = servos(1e3)
    blind, report = streamed(strong)
    least, largest = left(strong, blind, report["latency_s"])
    weak = servos(largest / 1.1)
    kept, report = streamed(weak)
    assert list(report["limited"]) == [weak.character.motors[0].path]
    error, effort = left(weak, kept, report["latency_s"])
    assert effort < largest / 1.1
    assert error < 0.3 * left(weak, blind, report["latency_s"])[0], (error, least)
    np.testing.assert_allclose(kept[-1], motion[-1], atol=1e-9)
