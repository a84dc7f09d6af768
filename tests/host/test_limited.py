"""Calls that must end in time."""

from __future__ import annotations

import threading
import time

import pytest
from calmotion.host import Outcome, PluginError
from calmotion.host.limited import call_within
from fakes import Coal, Iron, Ore, host_of, operator


def test_a_call_in_time_gives_its_value():
    assert call_within(5.0, lambda: 3, "mine.dig") == 3


def test_what_it_raises_is_raised():
    with pytest.raises(ZeroDivisionError):
        call_within(5.0, lambda: 1 // 0, "mine.dig")


def test_a_call_that_hangs_is_left_behind_and_ended_where_that_is_possible():
    ended = threading.Event()

    def hang():
        try:
            while True:
                time.sleep(0.01)
        finally:
            ended.set()

    with pytest.raises(PluginError, match="did not end within 0.2 s") as refused:
        call_within(0.2, hang, "mine.dig")
    assert "mine.dig" in refused.value.path and "plugins disable" in refused.value.remedy
    assert ended.wait(5.0)


def test_an_operator_that_hangs_fails_by_name_and_the_others_go_on():
    def hang(context):
        context.progress(0.3, "digging deep")
        time.sleep(60.0)

    slow = operator("mine.dig", provides=[Ore], execute=hang)
    slow.timeout = 0.2
    burn = operator("wood.burn", provides=[Coal])
    melt = operator("smithy.melt", requires=[Ore], provides=[Iron])
    run = host_of(slow, burn, melt).run([], [Iron, Coal]).finish()
    results = {result.idname: result for result in run.results}
    assert results["mine.dig"].outcome is Outcome.FAILED and "did not end" in results["mine.dig"].reason
    assert results["mine.dig"].plugin == "smithy" and results["mine.dig"].progress == 0.3
    assert results["wood.burn"].outcome is Outcome.DONE and results["wood.burn"].progress == 1.0
    assert results["smithy.melt"].outcome is Outcome.BLOCKED


def test_users_set_the_limit_of_any_operator():
    slow = operator("mine.dig", provides=[Ore], execute=lambda context: time.sleep(60.0))
    run = host_of(slow).run([], [Ore], settings={"mine.dig": {"timeout": "200ms"}}).finish()
    assert "within 0.2 s" in run.results[0].reason


def test_an_operator_cannot_take_the_name_of_the_limit():
    from calmotion.host import Property
    from calmotion.host.operators import check_operator

    with pytest.raises(PluginError, match="property of every operator"):
        check_operator(operator("mine.dig", provides=[Ore], properties=[Property("timeout", float, 1.0)]))


def test_operators_see_what_became_of_those_before_them():
    seen = []
    dig = operator("mine.dig", provides=[Ore])
    melt = operator(
        "smithy.melt", requires=[Ore], provides=[Iron], execute=lambda c: seen.extend(c.results) or (Iron(),)
    )
    host_of(dig, melt).run([], [Iron]).finish()
    assert [(result.idname, result.outcome) for result in seen] == [("mine.dig", Outcome.DONE)]
