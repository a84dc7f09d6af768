"""What each export is said to cost, against an independent replay of its files on an independent model of the robot."""

import calmotion as cm
import numpy as np
import pytest
import replays
from calmotion_plugins.controller_export import export
from six_hinges import NAMES, TIP, six_hinges, smooth, tip_of

AT = np.arange(0.0, 1.0 + 1e-9, 2.5e-4)
TICKS = "[default]\nresolution = 4096\n"
# format, settings, rate: low enough that each costs something
COMMANDS = {
    "ros2 by lines": ("ros2", {"export.ros2.fields": "positions"}, 20, replays.replay_ros2),
    "ros2 by cubics": ("ros2", {"export.ros2.fields": "velocities"}, 5, replays.replay_ros2),
    "ros2 by quintics": ("ros2", {}, 5, replays.replay_ros2),
    "csv": ("csv", {}, 25, replays.replay_csv),
    "csv with few digits": ("csv", {"export.csv.digits": 2}, 200, replays.replay_csv),
    "csv held": ("csv", {"export.csv.player": "hold"}, 40, replays.replay_csv),
    "ticks": ("ticks", {}, 60, replays.replay_ticks),
    "ur": ("ur", {}, 125, replays.replay_ur),
    "ur that follows slowly": ("ur", {"export.ur.gain": 300.0, "export.ur.lookahead": 0.1}, 30, replays.replay_ur),
    "bottango": ("bottango", {}, 8, replays.replay_bottango),
}


@pytest.fixture(scope="module")
def shot(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.usda").write_text(six_hinges())
    (folder / "servos.toml").write_text(TICKS)
    return cm.open_shot(folder / "arm.usda")


@pytest.fixture
def exported(shot, tmp_path):
    def run(name, rate, settings):
        if name == "ticks":
            settings = {"export.ticks.motors": str(shot.path).replace("arm.usda", "servos.toml")}
        return export(shot, tmp_path / "show.out", to=name, rate=rate, search=False, settings=settings)

    return run


@pytest.mark.parametrize("name", COMMANDS)
def test_the_predicted_loss_is_that_of_a_replay(exported, name):
    name, settings, rate, replay = COMMANDS[name]
    made = exported(name, rate, settings)
    off = np.linalg.norm(tip_of(replay(made.files, NAMES, AT)) - tip_of(smooth(AT)), axis=1).max()
    assert off > 2e-5, "nothing to compare"
    assert made.loss_m[TIP] == pytest.approx(off, rel=0.1)
