"""Where the time of a run goes."""

import numpy as np
import pytest
from calmotion.host import open_host
from calmotion.support.compilation import kernel
from calmotion_plugins.benchmarks.speed.stages import OPERATORS, STAGES, Stages, main, measure, table
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


def test_compiling_is_counted_by_itself():
    from calmotion_plugins.benchmarks.speed.stages import _Compiling
    from numba.core import event

    @kernel
    def inner(x):
        return 2.0 * x

    @kernel
    def outer(x):
        return inner(x) + x

    counted = _Compiling()
    event.register("numba:compile", counted)
    try:
        assert outer(np.float64(1.0)) == 3.0
        once = counted.seconds
        assert outer(np.float64(2.0)) == 6.0
    finally:
        event.unregister("numba:compile", counted)
    assert counted.seconds == once >= 0.0 and counted._depth == 0


def test_the_table_has_a_row_for_each_shot():
    text = table([Stages("one", {"read": 1.0, "search": 2.0, "other": 0.5}, 4.0, 7, 0.05)])
    assert "| one | 1.00 | 0.00 | 0.00 | 0.00 | 2.00 | 0.00 | 0.00 | 0.50 | 3.50 | 4.00 | 7 | 40 |" in text


def test_a_shot_that_cannot_be_read_ends_with_its_error(capsys):
    with pytest.raises(SystemExit) as end:
        main(["no_such_shot.usda"])
    assert end.value.code == 1 and "no_such_shot.usda" in capsys.readouterr().err
