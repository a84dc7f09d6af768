"""Maps of stability: every cell runs or is refused with a reason, and the boundary of an integrator is where it is."""

import pytest
from calmotion.model.run import INTEGRATORS
from calmotion_plugins.benchmarks.integrators.stability import MAPS, REFUSED, RUNS, STEPS, Cell, cells_of, largest_steps


def rows_of(name, *values):
    quantity, _, scene = MAPS[name]
    return quantity, values, scene


def cell(value, step, outcome, integrator="bdf2"):
    return Cell("load", value, step, integrator, outcome, "" if outcome == RUNS else "why", None, 0.1)


def test_every_integrator_has_steps():
    assert tuple(STEPS) == INTEGRATORS


LONG = dict.fromkeys(("load", "speed"), pytest.mark.long)


@pytest.mark.parametrize("name", [pytest.param(name, marks=LONG.get(name, ())) for name in MAPS])
def test_cells_run_or_are_refused_with_a_reason(name):
    values = MAPS[name][1]
    steps = {integrator: own[1:2] for integrator, own in STEPS.items()}
    cells = cells_of(name, rows_of(name, values[0], values[-1]), steps)
    assert [(c.value, c.integrator) for c in cells] == [(v, i) for v in (values[0], values[-1]) for i in INTEGRATORS]
    for c in cells:
        assert c.outcome in (RUNS, REFUSED), c
        assert (c.error_m is None and c.why.endswith(".")) if c.outcome == REFUSED else (0.0 < c.error_m < 2.0)


def test_the_explicit_integrator_needs_tiny_steps_and_the_default_does_not():
    steps = {"bdf2": (1 / 24,), "rk4": (1 / 24000, 1 / 7200000)}
    coarse, blown, fine = cells_of("stiffness", rows_of("stiffness", 1e9), steps)
    assert coarse.outcome == RUNS and blown.outcome == REFUSED and "diverges" in blown.why
    assert fine.outcome == RUNS and fine.error_m is None, "only its beginning is run"


def test_a_boundary_is_the_largest_step_below_which_all_run():
    cells = [cell(1.0, 1 / 24, RUNS), cell(1.0, 1 / 48, REFUSED), cell(1.0, 1 / 120, RUNS), cell(1.0, 1 / 240, RUNS)]
    cells += [cell(2.0, 1 / 24, RUNS), cell(2.0, 1 / 240, REFUSED)]
    assert largest_steps(cells) == {1.0: 1 / 120, 2.0: None}
