"""Where the time of a run goes."""

import pytest
from calmotion.host import open_host
from calmotion_plugins.benchmarks.speed.stages import OPERATORS, STAGES, main, measure
from one_hinge import ONE_HINGE


def test_stages_name_operators_that_exist():
    assert set(OPERATORS) <= open_host().operators.keys() and set(OPERATORS.values()) <= set(STAGES)


def test_the_stages_of_a_run_are_all_of_it(tmp_path):
    path = tmp_path / "hinge.usda"
    path.write_text(ONE_HINGE)
    run = measure(str(path))
    assert run.shot == "hinge" and run.used["read"] > 0.0 and run.used["search"] > 0.0 and run.simulations > 0
    assert run.single_s > 0.0 and run.singles == run.used["search"] / run.single_s
    assert min(run.used.values()) > -0.05


def test_a_shot_that_cannot_be_read_ends_with_its_error(capsys):
    with pytest.raises(SystemExit) as end:
        main(["no_such_shot.usda"])
    assert end.value.code == 1 and "no_such_shot.usda" in capsys.readouterr().err
