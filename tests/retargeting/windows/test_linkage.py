"""A closed chain in windows: passive joints go on in motion, and the damped problems of each window begin there too."""

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.windows.optimize import optimize_windows
from made_shots import soft_linkage_shot
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 120, knot_spacing=1 / 12)


@pytest.mark.long
def test_a_linkage_that_shakes_by_a_quarter_of_a_metre_is_calmed_in_windows():
    shot = soft_linkage_shot()
    length = 0.5 * float(shot.animation.frame_times[-1])
    result = optimize_windows(shot, OPTIONS, length, ignore_progress)
    one = optimize_shot(shot, OPTIONS, ignore_progress)
    assert len(result.windows) == 2 and result.stopped == "converged"
    judged = result.after.motion.judged
    np.testing.assert_allclose(one.before.position_errors, result.before.position_errors, atol=1e-7)
    before, *after = (
        simulation.position_errors[judged][:, 1].max() for simulation in (one.before, one.after, result.after)
    )
    assert before > 0.2 and after[1] < 0.01 and after[1] < after[0] + 1e-3
    assert result.objective_after < 1.02 * one.objective_after
    assert max(result.before.max_joint_gap, result.after.max_joint_gap) < 1e-6
