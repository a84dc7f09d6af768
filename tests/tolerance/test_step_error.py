"""The error of a step, from two of them: on a motion that is known, and on the arm against a far finer one; joints stay
closed."""

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import IntegrationError, ShotError
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.step_error import (
    CLOSED_GAP,
    StepRun,
    distance,
    effort_errors,
    largest_step,
    observed_order,
    order_of,
    simulate_at,
    step_error,
    step_gaps,
)
from steppers import LEGS, ROBOT, STRIDE, giving, walk, write_stepper


def of_second_order(step):
    """A target that is off by 3 step^2 in x."""
    return StepRun(step, np.array([[[1.0 + 3.0 * step**2, 2.0, 0.0]]]))


@pytest.mark.parametrize("ratio", [2.0, 1.5])
def test_the_error_of_a_method_of_second_order_is_found(ratio):
    assert step_error(of_second_order(0.1 * ratio), of_second_order(0.1)) == pytest.approx(0.03, rel=1e-9)


@pytest.mark.parametrize("allowed", [1.0, 0.02, 0.0076, 0.0075, 0.0074, 1e-4])
def test_the_largest_step_that_is_allowed_is_chosen(allowed):
    step, error = largest_step(of_second_order, 0.1, 1e-3, lambda run: allowed)
    best = min(0.1, np.sqrt(allowed / 3.0))
    assert 0.85 * best < step <= best * (1.0 + 1e-9) and error == pytest.approx(3.0 * step**2, rel=1e-9)


def vibrating(step):
    """A target on a decaying vibration, whose period is off as that of generalised-alpha, at a dozen frames."""
    t = np.linspace(0.0, 0.5, 13)
    phase = 2.0 * np.arctan(np.pi * 30.0 * step) / step * t
    places = np.exp(-8.0 * t)[:, None] * np.stack([np.sin(phase), np.cos(phase), 0.0 * t], axis=1)
    return StepRun(step, places[:, None])


def test_the_order_is_that_which_three_steps_show():
    runs = [of_second_order(h) for h in (0.1, 0.06, 0.03)]
    assert observed_order(*runs) == pytest.approx(2.0) and observed_order(None, *runs[1:]) == 2.0
    linear = [StepRun(h, np.array([[[h**1.5, 0.0, 0.0]]])) for h in (0.1, 0.06, 0.03)]
    assert observed_order(*linear) == pytest.approx(1.5, abs=0.01)
    flat = [StepRun(h, np.array([[[x, 0.0, 0.0]]])) for h, x in ((0.1, 0.0), (0.06, 0.1), (0.03, 0.5))]
    assert observed_order(*flat) == 1.0


def test_an_estimate_of_steps_that_do_not_resolve_the_vibration_is_not_too_small():
    exact = vibrating(1e-7).positions
    for allowed in (0.3, 0.1, 0.03, 0.01):
        step, estimate = largest_step(vibrating, 1 / 60, 1e-5, lambda run, allowed=allowed: allowed)
        error = distance(vibrating(step).positions, exact)
        assert 0.5 * estimate <= error <= 1.5 * estimate and estimate <= allowed


def test_the_error_of_efforts_goes_with_the_step():
    fine, coarse = (StepRun(h, np.zeros((1, 1, 3)), efforts=np.array([[100.0 + 50.0 * h, 7.0]])) for h in (0.1, 0.2))
    assert effort_errors(fine, coarse) == pytest.approx([5.0, 0.0])
    assert effort_errors(coarse, fine) == pytest.approx([10.0, 0.0])
    assert effort_errors(fine, fine) is None and effort_errors(fine, of_second_order(0.2)) is None


def test_steps_are_those_that_were_taken():
    def of_frames(step):
        return of_second_order(min(0.02, step))

    assert largest_step(of_frames, 0.1, 1e-3, lambda run: 1.0) == (0.02, pytest.approx(3.0 * 0.02**2))
    step, _ = largest_step(of_frames, 0.1, 1e-3, lambda run: 3.0 * 0.01**2)
    assert 0.0085 < step <= 0.01


def test_steps_that_fail_are_too_large_and_the_last_one_ends_the_search():
    def fragile(step):
        if step > 0.03:
            raise IntegrationError("diverges")
        return of_second_order(step)

    assert largest_step(fragile, 0.1, 1e-3, lambda run: 1.0)[0] == 0.025
    step, error = largest_step(of_second_order, 0.1, 0.025, lambda run: 0.0)
    assert step == 0.025 and error == pytest.approx(3.0 * 0.025**2, rel=1e-9)

    def never(step):
        raise IntegrationError("diverges")

    assert largest_step(never, 0.1, 0.025, lambda run: 1.0) == (0.025, np.inf)


def opening(gap, order=3, floor=0.0, integrator="generalized-alpha"):
    """A target without error, and joints that open by a gap at a step of 0.1, and by a floor at any step [m]."""

    def run(step):
        opens = floor + gap * (step / 0.1) ** order
        return StepRun(step, np.zeros((1, 1, 3)), integrator=integrator, gap=opens)

    return run


@pytest.mark.parametrize("integrator", ["bdf2", "newmark", "generalized-alpha"])
def test_a_step_by_which_joints_come_apart_is_too_large(integrator):
    for gap, step in ((0.9, 0.1), (1.1, 0.05), (7.9, 0.05)):
        assert largest_step(opening(gap * CLOSED_GAP, integrator=integrator), 0.1, 1e-3, lambda run: 1.0)[0] == step


def test_the_integrator_gives_way_where_joints_stay_open_by_half_the_step_that_the_error_allows():
    with pytest.raises(IntegrationError, match="come apart"):
        largest_step(opening(9.0 * CLOSED_GAP), 0.1, 1e-3, lambda run: 1.0)
    assert largest_step(opening(9.0 * CLOSED_GAP, integrator="bdf2"), 0.1, 1e-3, lambda run: 1.0)[0] == 0.025


def test_a_gap_that_no_step_closes_is_not_charged_to_the_step():
    floor = 20.0 * CLOSED_GAP
    for order in (2, 3, 5):
        run = opening(1e-5, order, floor)
        coarse, fine = step_gaps(run(0.1), run(0.05))
        assert 1e-5 * 0.5**order <= fine * (1.0 + 1e-9) and coarse >= 1e-5 * (1.0 - 1e-9)
        assert fine <= 1e-5 / 3.0 and coarse <= 1.34e-5
    assert largest_step(opening(0.0, floor=floor), 0.1, 1e-3, lambda run: 1.0) == (0.1, 0.0)
    assert largest_step(opening(3.0 * CLOSED_GAP, floor=floor), 0.1, 1e-3, lambda run: 1.0)[0] == 0.05


def test_between_two_steps_only_where_joints_stay_closed_by_both():
    allowed = 3.0 * 0.09**2  # 0.09 is as accurate
    for gap, step in ((0.9, 0.081), (2.0, 0.05)):

        def run(step, gap=gap * CLOSED_GAP):
            opens = gap * (step / 0.1) ** 3
            return StepRun(step, of_second_order(step).positions, integrator="generalized-alpha", gap=opens)

        assert largest_step(run, 0.1, 1e-3, lambda run: allowed)[0] == pytest.approx(step, rel=1e-6)


def steps_tried(places, gaps, refused):
    """The step that is found with an allowed error of 0.1 m, and those that were tried, by functions of the step."""
    tried = []

    def run(step):
        tried.append(step)
        return StepRun(step, np.array([[[places(step), 0.0, 0.0]]]), gap=gaps(step))

    return largest_step(run, 0.1, 1e-3, lambda run: 0.1, refused)[0], tried


@pytest.mark.parametrize("gaps", [lambda h: 0.3, lambda h: 0.3 - 0.1 * h**2, lambda h: 0.3 + 1e-3 * h])
def test_gaps_that_do_not_fall_with_the_step_end_the_search_after_three_runs(gaps):
    step, tried = steps_tried(lambda h: 1.0 / h, gaps, 1e-4)  # the motion does not converge either
    assert tried == [0.1, 0.05, 0.025] and step == 0.025


@pytest.mark.parametrize(
    "gaps",
    [
        lambda h: 0.9e-4,  # links that do not fit together exactly, which is not refused
        lambda h: 1e-5 + 30.0 * h**2,
        lambda h: 3.0 * h,  # where contacts come and go
        lambda h: 0.02 * (1.0 + 0.05 * np.sin(1.0 / h)) if h > 0.01 else 1e-6,  # the motion is not resolved
    ],
)
def test_a_search_for_a_step_ends_early_for_no_other_gap(gaps):
    def places(h):
        return 3e3 * h**2

    assert steps_tried(places, gaps, 1e-4) == steps_tried(places, gaps, np.inf)
    assert len(steps_tried(places, gaps, 1e-4)[1]) > 4


def test_a_shot_that_no_step_can_simulate_is_tried_once():
    tried = []

    def unsupported(step):
        tried.append(step)
        raise ShotError("no static equilibrium")

    with pytest.raises(ShotError, match="equilibrium"):
        largest_step(unsupported, 0.1, 1e-3, lambda run: 1.0)
    assert tried == [0.1]


def test_the_estimate_is_near_the_error_against_a_far_finer_step(arm, animation, bodies):
    runs = {
        h: simulate_at(compile_shot(arm, animation, bodies), RunSettings(), h) for h in (1 / 480, 1 / 960, 1 / 7680)
    }
    error = np.linalg.norm(runs[1 / 960].positions - runs[1 / 7680].positions, axis=2).max()
    assert step_error(runs[1 / 480], runs[1 / 960]) == pytest.approx(error, rel=0.2)


def stamping(frames):
    torso, feet = walk(frames)
    s = np.clip(2.0 * np.asarray(frames) / 24.0, 0.0, 1.0)
    return torso, feet | {"right": (STRIDE * s, 0.12 * s * (1.0 - s))}


@pytest.mark.parametrize(("walking", "landing"), [(walk, 12), (stamping, 9)])
def test_the_error_of_feet_that_land_is_not_underestimated(tmp_path, walking, landing):
    path = write_stepper(tmp_path / "stepper.usda", giving, walking=walking, landing=landing)
    shot = compile_shot((opened := cm.open_shot(path)).character, opened.animation)
    coarse, fine, finest = (simulate_at(shot, RunSettings(), 1 / (96 * n)) for n in (1, 2, 16))
    # a twentieth of the steps' errors is left in the finest run
    error, estimate = distance(fine.positions, finest.positions), step_error(coarse, fine)
    assert order_of(shot.character) == 1 and error <= estimate < 4.0 * error


def test_the_error_of_feet_that_stay_goes_with_the_square_of_the_step(tmp_path):
    def standing(stage):
        giving(stage)
        for side in LEGS:
            active = stage.GetPrimAtPath(f"{ROBOT}/{side}/Foot/Sole").GetAttribute("calm:contact:active")
            active.Clear()
            active.Set(side == "left")

    assert order_of(cm.open_shot(write_stepper(tmp_path / "stepper.usda", standing)).character) == 2
