"""Where the time of a run goes."""

from dataclasses import fields

from calmotion.host import open_host
from calmotion_plugins.benchmarks.speed.stages import OPERATORS, measure
from one_hinge import ONE_HINGE


def test_stages_name_operators_that_exist():
    assert set(OPERATORS) <= open_host().operators.keys()


def test_the_stages_of_a_run_are_all_of_it(tmp_path):
    path = tmp_path / "hinge.usda"
    path.write_text(ONE_HINGE)
    run = measure(str(path))
    assert run.shot == "hinge" and run.read_s > 0.0 and run.search_s > 0.0
    assert run.sweeps > 0 and run.single_simulations > 0.0
    assert min(getattr(run, field.name) for field in fields(run) if field.name.endswith("_s")) > -0.05
