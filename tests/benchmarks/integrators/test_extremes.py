"""Physics at the edge: verdicts, and balances of energy and momentum."""

import json

import numpy as np
import pytest
from calmotion.benchmarks.integrators import extremes
from calmotion.benchmarks.integrators.audits import audit
from calmotion.benchmarks.integrators.extremes import Verdict, _audited, _wave, euler_load, verdicts
from calmotion.benchmarks.integrators.outcomes import FAILED, REFUSED, RUNS, Outcome, run_case
from calmotion.benchmarks.speed.growth import links, prepared
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.simulation.forward import run_forward

ALL = {f"{one.case.group}, {one.case.name}": one for one in verdicts()}


def test_a_linkage_that_is_driven_past_its_dead_centre_is_refused():
    """The failure of the rigid robot was looked at for deflections, which was a traceback."""
    one = ALL["dead centre, rocker drives past its range"]
    outcome = run_case(one.case)
    assert one.fault(outcome) == "" and "closed chains can reach" in outcome.why


@pytest.mark.long
@pytest.mark.parametrize("name", ALL)
def test_every_verdict_is_right(name):
    assert ALL[name].fault(run_case(ALL[name].case)) == ""


def test_a_wrong_verdict_is_seen():
    case = ALL["column, 0.3 of the Euler load"].case
    one = Verdict(case, (RUNS, REFUSED), "/Arm", (0.0, 0.1))
    assert one.fault(Outcome("a", "b", RUNS, error_m=0.05)) == ""
    assert "error of 0.2" in one.fault(Outcome("a", "b", RUNS, error_m=0.2))
    assert "not a number" in one.fault(Outcome("a", "b", FAILED, "not a number"))
    assert "does not say" in one.fault(Outcome("a", "b", REFUSED, "no reason"))
    assert one.fault(Outcome("a", "b", REFUSED, "/Arm/Link0: it buckles")) == ""
    assert euler_load() == pytest.approx(np.pi**2 * 24.0 / (4 * 0.36) / 9.81)


def test_balances_hold_and_wrong_ones_are_seen():
    run = _audited("short", 2, 1.0 / 480.0, 200, _wave)
    assert run.fault == "" and run.bodies == 3 and run.audit.momentum < 1e-3
    model = prepared(*links(2, 4))
    driven = model.system.rows[model.motor >= 0]
    angles, rates = (np.outer(values, np.ones(len(driven))) for values in _wave(np.arange(201) / 480.0))
    found = run_forward(model, Workspace.for_system(model.system), angles, rates, 1.0 / 480.0)
    lighter = model.system._replace(gravity=0.99 * model.system.gravity)
    assert audit(model.system, found).energy < 1e-2
    assert audit(lighter, found).momentum > 5e-3, "a hundredth of the weight is missing"


def test_the_command_ends_with_its_verdicts(capsys, monkeypatch):
    one = ALL["nearly redundant, axis tilted by 0 rad"]
    monkeypatch.setattr(
        extremes, "run_case", lambda case: Outcome(case.group, case.name, RUNS, error_m=1e-4, gap_m=0.0)
    )
    assert extremes.main(["--json", "--only", one.case.name]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["verdicts"][0]["fault"] == "" and report["runs"] == []
    monkeypatch.setattr(extremes, "run_case", lambda case: Outcome(case.group, case.name, FAILED, "NaN"))
    assert extremes.main(["--only", one.case.name]) == 1
    assert "WRONG" in capsys.readouterr().out
