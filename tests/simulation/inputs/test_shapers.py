"""Input shapers against what defines them: a mode of their frequency keeps no vibration."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import Track
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.inputs.shapers import best_delay, delay, impulses, shaped
from calmotion.simulation.inputs.time_grid import make_grid
from scipy.signal import lsim

FRAMES = np.arange(73) / 24.0
FREQUENCIES, DAMPING = np.array([3.0, 5.0]), 0.02
RATIOS = np.full(2, DAMPING)


def left_over(times, amplitudes, frequency):
    """Amplitude of a mode after impulses, over that after a single one at the last of them (Singer and Seering)."""
    w = 2 * np.pi * frequency
    rotating = amplitudes * np.exp((DAMPING + 1j * np.sqrt(1 - DAMPING**2)) * w * (times - times[-1]))
    return abs(rotating.sum())


@pytest.mark.parametrize(("kind", "modes"), [("zv", 1), ("zvd", 1), ("zv2", 2), ("zvd2", 2)])
def test_a_shaper_cancels_its_modes(kind, modes):
    times, amplitudes = impulses(kind, FREQUENCIES, RATIOS)
    assert amplitudes.sum() == pytest.approx(1.0) and np.all(amplitudes > 0.0)
    for frequency in FREQUENCIES[:modes]:
        assert left_over(times, amplitudes, frequency) < 1e-12
    assert left_over(times, amplitudes, 1.7 * FREQUENCIES[-1]) > 1e-2
    assert delay(kind, FREQUENCIES, RATIOS) == pytest.approx(times @ amplitudes)


def test_zvd_forgives_an_error_of_the_frequency_that_zv_does_not():
    zv, zvd = (left_over(*impulses(kind, FREQUENCIES, RATIOS), 1.05 * FREQUENCIES[0]) for kind in ("zv", "zvd"))
    assert zvd < 0.15 * zv


def residual(kind, frequencies):
    """Vibration of modes of other frequencies after a shaper for an undamped one of 1 Hz, over that without."""
    times, amplitudes = impulses(kind, np.ones(1), np.zeros(1))
    return abs(np.exp(2j * np.pi * np.outer(frequencies, times)) @ amplitudes)


def test_ei_leaves_its_tolerance_at_most_over_the_band_that_is_published():
    """Singhose, Seering, Singer: 5% at the frequency, none on both sides, and at most 5% from 0.80 to 1.20 of it."""
    assert residual("ei", [1.0])[0] == pytest.approx(0.05)
    assert residual("ei", np.linspace(0.8012, 1.1988, 200)).max() < 0.0501
    assert residual("ei", [0.79, 1.21]).min() > 0.05
    assert residual("ei", np.linspace(0.85, 1.0, 200)).min() < 1e-3
    assert residual("ei", [0.9, 1.1]).max() < residual("zvd", [0.9, 1.1]).max() + 0.03


def test_mzv_cancels_its_mode_within_three_quarters_of_a_period_and_forgives_more_than_zv():
    times, amplitudes = impulses("mzv", np.ones(1), np.zeros(1))
    np.testing.assert_allclose(times, [0.0, 0.375, 0.75])
    np.testing.assert_allclose(amplitudes, [1.0 - 2**-0.5, 2**0.5 - 1.0, 1.0 - 2**-0.5])
    assert residual("mzv", [1.0])[0] < 1e-12
    assert np.all(residual("mzv", [0.9, 1.1]) < residual("zv", [0.9, 1.1]))


def test_with_damping_ei_and_mzv_leave_little_of_their_mode():
    """Klipper's amplitudes for damped modes, which keep nearly what they keep without damping."""
    assert left_over(*impulses("ei", FREQUENCIES, RATIOS), FREQUENCIES[0]) < 0.06
    assert left_over(*impulses("mzv", FREQUENCIES, RATIOS), FREQUENCIES[0]) < 0.01


@pytest.fixture
def parts():
    grid = make_grid(FRAMES, 1 / 480, 0.0)
    step = np.clip((FRAMES - 0.3) / 0.35, 0.0, 1.0)
    return sample_curves([Track(FRAMES, step**2 * (3 - 2 * step))], grid), grid


def vibration(curves, grid, frequency):
    """Largest swing of a mode, excited by the motor's acceleration, in the last second."""
    w = 2 * np.pi * frequency
    response = lsim(([-1.0], [1.0, 2 * DAMPING * w, w * w]), curves.accelerations[:, 0], grid.times)[1]
    return np.abs(response[grid.times > 2.0]).max()


def test_shaped_curves_arrive_later_and_leave_the_mode_at_rest(parts):
    curves, grid = parts
    found = shaped(curves, grid, "zvd", FREQUENCIES, RATIOS)
    assert vibration(found, grid, FREQUENCIES[0]) < 0.02 * vibration(curves, grid, FREQUENCIES[0])
    assert found.angles[-1, 0] == pytest.approx(curves.angles[-1, 0])
    middle = [np.interp(0.5, c.angles[:, 0], grid.times) for c in (curves, found)]
    assert middle[1] - middle[0] == pytest.approx(delay("zvd", FREQUENCIES, RATIOS), rel=0.1)
    rates = np.gradient(found.angles[:, 0], grid.h)
    assert np.abs(rates - found.rates[:, 0]).max() < 0.02 * np.abs(rates).max()


def test_a_low_pass_filter_takes_the_mode_out_of_the_motion_without_delay(parts):
    curves, grid = parts
    found = shaped(curves, grid, "lowpass", FREQUENCIES, RATIOS)
    assert vibration(found, grid, FREQUENCIES[0]) < 0.5 * vibration(curves, grid, FREQUENCIES[0])
    middle = [np.interp(0.5, c.angles[:, 0], grid.times) for c in (curves, found)]
    assert abs(middle[1] - middle[0]) < 0.02 and delay("lowpass", FREQUENCIES, RATIOS) == 0.0
    lower = shaped(curves, grid, "lowpass", FREQUENCIES, RATIOS, 0.2)
    assert vibration(lower, grid, FREQUENCIES[0]) < vibration(found, grid, FREQUENCIES[0])


def test_what_cannot_be_shaped_is_refused(parts):
    damped = np.full(len(FREQUENCIES), 1.5)
    for kind, modes in (("zvx", (FREQUENCIES, RATIOS)), ("zv", (np.zeros(0),) * 2), ("zv", (FREQUENCIES, damped))):
        with pytest.raises(ShotError) as error:
            shaped(*parts, kind, *modes)
        assert error.value.remedy and error.value.found == kind


def test_the_cutoff_of_a_filter_is_of_the_lowest_mode_that_is_no_free_motion(parts):
    with_spin = np.array([0.0, *FREQUENCIES]), np.array([0.0, *RATIOS])
    np.testing.assert_array_equal(
        shaped(*parts, "lowpass", *with_spin).angles, shaped(*parts, "lowpass", FREQUENCIES, RATIOS).angles
    )


def test_a_cutoff_that_the_steps_do_not_hold_is_refused(parts):
    highest = 240.0 / FREQUENCIES[0]
    shaped(*parts, "lowpass", FREQUENCIES, RATIOS, 0.99 * highest)
    for cutoff in (highest, 1e9):
        with pytest.raises(ShotError, match="too high for the time step") as error:
            shaped(*parts, "lowpass", FREQUENCIES, RATIOS, cutoff)
        assert f"less than {highest:.3g}" in error.value.remedy


@pytest.mark.parametrize("late", [0.0, 0.1, 0.31])
def test_the_best_delay_is_the_one_by_which_a_motion_is_late(late):
    h = 1 / 500
    times = h * np.arange(-100, 1001)

    def motion(t):
        return np.stack([np.sin(3.0 * t), np.cos(2.0 * t), 0.2 * t], axis=-1)[:, None]

    found, left = best_delay(motion(np.maximum(times - late, times[0])), motion(times), times >= 0.0, h)
    assert found == pytest.approx(late, abs=0.003) and left.shape == (1001, 1)
    assert left.max() < 0.01


def test_modes_that_do_not_vibrate_are_not_shaped_for():
    """The lowest that does is taken, also where heavier damped ones are lower, or a ball joint spins freely."""
    found = impulses("zv2", np.array([0.0, 1e-5, 1.0, *FREQUENCIES]), np.array([0.0, 0.0, 1.2, *RATIOS]))
    for part, alone in zip(found, impulses("zv2", FREQUENCIES, RATIOS), strict=True):
        np.testing.assert_array_equal(part, alone)
