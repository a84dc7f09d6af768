"""An interrupt after a search keeps what the search found, on a small arm."""

import pytest
from calmotion.errors import IntegrationError
from calmotion.model.run import RunSettings
from calmotion.retargeting import to_tolerance
from calmotion.retargeting.to_tolerance import optimize_to_tolerance
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.support import interrupts
from posed import ignore_progress

OPTIONS = RunSettings(step=1 / 120)


@pytest.mark.parametrize("where", ["with_accuracy", "_is_accurate"])
def test_an_interrupt_after_the_search_keeps_its_curves(arm, animation, bodies, monkeypatch, where):
    monkeypatch.setattr(to_tolerance, where, lambda *args: interrupts.request())
    found = optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    assert found.interrupted and found.search.stopped == "interrupted"
    assert found.objective_after < 0.1 * found.objective_before
    interrupts.check()  # it was answered


def test_an_interrupt_of_a_second_search_keeps_the_curves_of_the_first(arm, animation, bodies, monkeypatch):
    searched, searches = to_tolerance._searched, []

    def once(*args):
        if searches:
            interrupts.request()
        searches.append(searched(*args))
        return searches[-1]

    monkeypatch.setattr(to_tolerance, "_searched", once)
    monkeypatch.setattr(to_tolerance, "_is_accurate", lambda *args: False)
    found = optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    assert len(searches) == 1 and found.interrupted
    assert found.objective_after == searches[0].objective_after


def test_an_interrupt_before_there_is_a_result_ends_the_run(arm, animation, bodies, monkeypatch):
    def interrupt(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(to_tolerance, "_searched", interrupt)
    with pytest.raises(KeyboardInterrupt):
        optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)


def test_a_search_that_begins_where_only_shorter_steps_can_simulate_takes_these():
    tried = []

    def search(options):
        tried.append(options.step)
        if options.step is None or options.step > 0.003:
            raise IntegrationError("the simulation can only go on with smaller steps")
        return "found"

    assert to_tolerance._by_steps(0.01, True, search, RunSettings()) == ("found", 0.0025)
    assert tried == [0.01, 0.005, 0.0025]
    with pytest.raises(IntegrationError):  # the step that the user chose is kept
        to_tolerance._by_steps(0.01, False, search, RunSettings(step=0.01))
    with pytest.raises(IntegrationError):  # and a hundred times shorter ones are not tried
        to_tolerance._by_steps(1.0, True, search, RunSettings())
    assert tried[3:] == [0.01, 1.0, 0.5, 0.25, 0.125, 0.0625]


def test_curves_that_were_found_stay_where_no_further_search_can_be_simulated(arm, animation, bodies, monkeypatch):
    searched, searches = to_tolerance._searched, []

    def once(*args):
        if searches:
            raise IntegrationError("the simulation can only go on with smaller steps")
        searches.append(searched(*args))
        return searches[-1]

    monkeypatch.setattr(to_tolerance, "_searched", once)
    monkeypatch.setattr(to_tolerance, "_is_accurate", lambda *args: False)
    found = optimize_to_tolerance(compile_shot(arm, animation, bodies), OPTIONS, ignore_progress)
    assert not found.interrupted and found.objective_after == searches[0].objective_after
