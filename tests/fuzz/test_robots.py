"""Random robots are written, simulated and compared; a difference between two tellings is seen.

`make fuzz RUNS=50 SEED=1 FUZZED=` goes on.
"""

import copy
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parent / "robots"))

import robot_campaign  # noqa: E402
from oracles import compared, quantities  # noqa: E402
from robots import KINDS, draw  # noqa: E402
from stages import write  # noqa: E402
from tellings import CHANGES, Telling, any_telling, changed  # noqa: E402


@pytest.mark.parametrize("kind", robot_campaign.CAMPAIGNS)
def test_a_run_of_each_kind_finds_nothing(kind, tmp_path):
    where, found = robot_campaign.judged(kind, 41 if kind == "commands" else 40, tmp_path)
    assert found == [] and where not in ("raises", "slow")


def test_every_robot_is_written_in_every_telling(tmp_path):
    for seed, kind in enumerate(KINDS):
        robot = draw(seed, wild=True, kind=kind, dense=True)
        for telling in (any_telling(seed), *(changed(name, seed) for name in CHANGES)):
            assert write(robot, telling, tmp_path).exists()


def test_a_mass_that_differs_by_a_hundredth_is_seen(tmp_path):
    robot = draw(40, wild=False, kind="stiff chain")
    heavier = copy.deepcopy(robot)
    for solid in heavier.solids:
        solid.density *= 1.01
    one, same, other = (
        quantities(write(r, Telling(), tmp_path / name), Telling(), r)
        for name, r in (("a", robot), ("b", robot), ("c", heavier))
    )
    assert compared(robot, one, same) == []
    assert any("effort" in fault for fault in compared(robot, one, other))
