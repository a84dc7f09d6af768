"""The scaling benchmark: its numbers on small sizes, and what it says without Exudyn. Nothing here is about seconds."""

import numpy as np
from calmotion_plugins.benchmarks.speed import exudyn_arm


def test_the_simulated_arm_converges_at_second_order():
    code = exudyn_arm.Ours("bdf2")
    exact, _ = code.run(3840)
    errors = [np.abs(code.run(steps)[0] - exact).max() for steps in (240, 480)]
    assert 1.7 < np.log2(errors[0] / errors[1]) < 2.3
