import os
from dataclasses import dataclass

import pytest
from calmotion.errors import ShotError
from calmotion.host import Outcome, Plan, PluginError, Property, Run
from calmotion.host.properties import values_of
from fakes import Coal, Iron, Ore, Steel, host_of, operator

DIG = operator("mine.dig", provides=[Ore])
MELT = operator("smithy.melt", requires=[Ore], provides=[Iron])


def outcomes(run):
    return {result.idname: result.outcome for result in run.results}


def test_a_run_gives_one_result_an_operator_as_it_goes():
    run = host_of(DIG, MELT).run([], [Iron])
    steps = iter(run)
    first = next(steps)
    assert (first.idname, first.plugin, first.success) == ("mine.dig", "smithy", True)
    assert run.get(Ore) == Ore() and run.get(Iron) is None
    assert [result.idname for result in steps] == ["smithy.melt"]
    assert run.get(Iron) == Iron()


def test_an_operator_sees_its_inputs_its_properties_and_reports():
    seen = {}

    def execute(context):
        seen.update(ore=context.get(Ore), coal=context.get(Coal), heat=context.properties.heat)
        context.report("warning", "the fire is low")
        context.progress(0.5, "halfway")
        return (Iron(2),)

    calls = []
    heat = Property("heat", float, 1.0, unit="m")
    melt = operator("smithy.melt", requires=[Ore], uses=[Coal], provides=[Iron], execute=execute, properties=[heat])
    run = host_of(DIG, melt).run(
        [], [Iron], settings={"smithy.melt": {"heat": "5mm"}}, progress=lambda *call: calls.append(call)
    )
    result = run.finish().results[-1]
    assert seen == {"ore": Ore(), "coal": None, "heat": 0.005}
    assert [(record.level, record.text) for record in result.records] == [("warning", "the fire is low")]
    assert ("smithy melt", 0.5, "halfway") in calls and calls[-1] == ("smithy melt", 1.0, "")
    assert result.duration > 0.0


@pytest.mark.parametrize("error", [ZeroDivisionError("no fire"), SystemExit(7)])
def test_an_operator_that_raises_is_named_with_its_traceback_while_others_go_on(error):
    def explode(context):
        raise error

    melt = operator("smithy.melt", requires=[Ore], provides=[Iron], execute=explode)
    sell = operator("smithy.sell", requires=[Iron], provides=[Steel])
    burn = operator("wood.burn", requires=[Ore], provides=[Coal])
    run = host_of(DIG, melt, sell, burn).run([], [Steel, Coal]).finish()
    assert outcomes(run) == {
        "mine.dig": Outcome.DONE,
        "smithy.melt": Outcome.FAILED,
        "smithy.sell": Outcome.BLOCKED,
        "wood.burn": Outcome.DONE,
    }
    (failure,) = run.failures()
    assert failure.error is error and "in explode" in failure.traceback
    assert run.get(Coal) == Coal()


def test_the_working_folder_stays_whatever_an_operator_does(tmp_path, monkeypatch):
    def wander(context):
        os.chdir(os.sep)
        return (Iron(),)

    monkeypatch.chdir(tmp_path)
    melt = operator("smithy.melt", requires=[Ore], provides=[Iron], execute=wander)
    assert host_of(DIG, melt).run([], [Iron]).finish().get(Iron) == Iron()
    assert os.getcwd() == os.path.realpath(tmp_path)


def test_a_shot_error_passes_through_as_it_is():
    error = ShotError("has no mass", path="/Robot/Arm", remedy="Author a density.")

    def refuse(context):
        raise error

    run = host_of(operator("mine.dig", provides=[Ore], execute=refuse)).run([], [Ore]).finish()
    assert run.failures()[0].error is error


@pytest.mark.parametrize("returned", [Iron(), (Ore(),), (Iron(), Iron()), None, ()])
def test_a_wrong_return_value_is_refused(returned):
    melt = operator("smithy.melt", requires=[Ore], provides=[Iron], execute=lambda context: returned)
    run = host_of(DIG, melt).run([], [Iron]).finish()
    assert isinstance(run.results[-1].error, PluginError) and "Iron" in str(run.results[-1].error)
    assert run.get(Iron) is None


def test_reading_a_type_that_is_not_declared_is_refused():
    melt = operator("smithy.melt", requires=[], provides=[Iron], execute=lambda context: (context.get(Ore),))
    run = host_of(DIG, melt).run([], [Ore, Iron]).finish()
    assert "does not declare" in str(run.failures()[0].error)


def test_what_a_poll_refuses_is_left_out_with_the_reason_and_its_users_run_without_it():
    burn = operator("wood.burn", provides=[Coal], poll=lambda data: "the wood is wet")
    alloy = operator("smithy.alloy", requires=[Ore], uses=[Coal], provides=[Steel])
    run = host_of(DIG, burn, alloy).run([], [Steel]).finish()
    assert run.get(Steel) == Steel()
    assert [(row.what, row.why, row.skipped) for row in run.left_out()] == [("wood burn", "the wood is wet", True)]


def test_a_used_value_whose_making_failed_stops_its_users():
    def explode(context):
        raise RuntimeError("no match")

    burn = operator("wood.burn", provides=[Coal], execute=explode)
    bake = operator("wood.bake", uses=[Coal], provides=[Iron])
    alloy = operator("smithy.alloy", uses=[Iron], provides=[Steel])
    run = host_of(burn, bake, alloy).run([], [Steel]).finish()
    assert list(outcomes(run).values()) == [Outcome.FAILED, Outcome.BLOCKED, Outcome.BLOCKED]


def test_no_step_is_done_for_what_cannot_be_made_any_more_and_others_are():
    def explode(context):
        raise RuntimeError("no match")

    burn = operator("wood.burn", provides=[Coal], execute=explode)
    alloy = operator("smithy.alloy", requires=[Iron], uses=[Coal], provides=[Steel])
    run = host_of(DIG, burn, MELT, alloy).run([], [Steel]).finish()
    assert outcomes(run)["wood.burn"] is Outcome.FAILED and outcomes(run)["smithy.melt"] is Outcome.BLOCKED
    assert "there is no Coal" in [step.reason for step in run.results]
    run = host_of(DIG, burn, MELT, alloy).run([], [Steel, Iron]).finish()
    assert run.get(Iron) is not None and run.get(Steel) is None, "what else was asked for is made"


def test_a_poll_sees_what_is_known_and_an_alternative_is_not_left_out():
    def when(amount):
        return lambda data: None if data[Ore].amount == amount else f"there are {data[Ore].amount}"

    one = operator("smithy.one", requires=[Ore], provides=[Iron], poll=when(1), execute=lambda context: (Iron(1),))
    two = operator("smithy.two", requires=[Ore], provides=[Iron], poll=when(2), execute=lambda context: (Iron(2),))
    for amount in (1, 2):
        run = host_of(one, two).run([Ore(amount)], [Iron]).finish()
        assert run.get(Iron) == Iron(amount)
        assert run.left_out() == ()


def test_two_operators_that_both_want_to_make_a_value_are_refused_and_named():
    again = operator("smithy.again", requires=[Ore], provides=[Iron])
    run = host_of(DIG, MELT, again).run([], [Iron]).finish()
    assert run.get(Iron) is None and len(run.failures()) == 2
    assert "smithy.melt" in str(run.failures()[0].error) and "smithy.again" in str(run.failures()[0].error)


def test_conflicting_operators_are_refused_before_any_costly_one_runs():
    executed = []

    def dig(context):
        executed.append("dig")
        return (Ore(),)

    def willing(data):
        return None if Coal in data else "there is no coal"

    again = operator("smithy.again", requires=[Ore], provides=[Iron], poll=willing)
    costly = operator("mine.dig", provides=[Ore], execute=dig)
    run = host_of(costly, MELT, again).run([Coal()], [Iron]).finish()
    assert executed == [] and run.results[0].outcome is Outcome.BLOCKED
    assert "more than one operator makes Iron" in run.results[0].reason


def test_an_answer_that_may_change_is_not_a_conflict_yet():
    """The poll asks for coal, which is made later and makes it decline."""
    late = operator("smithy.late", requires=[Ore], uses=[Coal], provides=[Iron],
                    poll=lambda data: "there is coal" if data.get(Coal) else None)  # fmt: skip
    burn = operator("wood.burn", provides=[Coal])
    run = host_of(DIG, burn, MELT, late).run([], [Iron, Coal]).finish()
    assert run.get(Iron) is not None and outcomes(run)["smithy.late"] is Outcome.LEFT_OUT


def test_a_rival_that_comes_too_late_does_not_take_the_value_away():
    """Its poll declines until there is coal; by then the value is made, and others use it."""
    late = operator("smithy.late", requires=[Ore], uses=[Coal], provides=[Iron],
                    poll=lambda data: None if data.get(Coal) else "there is no coal")  # fmt: skip
    burn = operator("wood.burn", requires=[Iron], provides=[Coal])
    alloy = operator("smithy.alloy", requires=[Iron, Coal], provides=[Steel])
    plan = Plan((DIG, MELT, burn, alloy, late), (Steel,), (Iron,))
    properties = {cls.idname: values_of((), {}, cls.idname) for cls in plan.operators}
    run = Run(plan, {}, properties, {cls.idname: "smithy" for cls in plan.operators}).finish()
    assert run.get(Steel) is not None and outcomes(run)["smithy.late"] is Outcome.FAILED


def test_a_poll_that_raises_or_answers_nonsense_is_a_failure():
    for answer in (lambda data: data["nothing"], lambda data: True):
        run = host_of(operator("mine.dig", provides=[Ore], poll=answer)).run([], [Ore]).finish()
        assert run.results[0].outcome is Outcome.FAILED


def test_an_interruption_ends_the_run_and_keeps_what_is_there():
    def interrupt(context):
        raise KeyboardInterrupt

    run = host_of(DIG, operator("smithy.melt", requires=[Ore], provides=[Iron], execute=interrupt)).run([], [Iron])
    with pytest.raises(KeyboardInterrupt):
        run.finish()
    assert run.get(Ore) == Ore()


def refusing(*kinds):
    """A check that refuses and records the values that it was given."""

    def check(context):
        seen.append([context.get(kind) for kind in kinds])
        raise ShotError("the fire is too low", attribute="heat", remedy="Raise it.")

    seen = []
    return check, seen


def test_settings_are_refused_before_work_that_only_they_would_use():
    check, seen = refusing(Ore)
    burn = operator("wood.burn", requires=[Ore], provides=[Coal])
    melt = operator("smithy.melt", requires=[Ore, Coal], provides=[Iron], checks=[Ore], check=check)
    sell = operator("smithy.sell", requires=[Iron], provides=[Steel])
    run = host_of(DIG, burn, melt, sell).run([], [Steel]).finish()
    assert [(result.idname, result.outcome) for result in run.results] == [
        ("mine.dig", Outcome.DONE),
        ("smithy.melt", Outcome.FAILED),
        ("wood.burn", Outcome.BLOCKED),
        ("smithy.sell", Outcome.BLOCKED),
    ]
    assert seen == [[Ore()]] and [failure.error.attribute for failure in run.failures()] == ["heat"]


def test_nothing_runs_where_a_wanted_value_is_refused():
    check, _ = refusing(Ore)
    write = operator("smithy.write", requires=[Iron], uses=[Ore], provides=[Steel], checks=[Ore], check=check)
    run = host_of(DIG, MELT, write).run([], [Iron, Steel]).finish()
    assert outcomes(run) == {"mine.dig": Outcome.DONE, "smithy.write": Outcome.FAILED, "smithy.melt": Outcome.BLOCKED}


def test_work_that_others_use_goes_on_where_settings_of_optional_values_are_refused():
    check, _ = refusing(Ore)
    burn = operator("wood.burn", requires=[Ore], provides=[Coal])
    melt = operator("smithy.melt", requires=[Ore, Coal], provides=[Iron], checks=[Ore], check=check)
    run = host_of(DIG, burn, melt).run([], [Coal], optional=[Iron]).finish()
    assert outcomes(run)["wood.burn"] == Outcome.DONE and run.get(Coal) == Coal()


def test_every_operator_that_refuses_its_settings_is_reported():
    melt = operator("smithy.melt", requires=[Ore], provides=[Iron], checks=[Ore], check=refusing(Ore)[0])
    burn = operator("wood.burn", requires=[Ore], provides=[Coal], checks=[Ore], check=refusing(Ore)[0])
    run = host_of(DIG, melt, burn).run([], [Iron, Coal]).finish()
    assert [failure.idname for failure in run.failures()] == ["smithy.melt", "wood.burn"]


def test_settings_are_checked_once_and_only_of_operators_that_run():
    calls = []
    check = calls.append
    wood = operator(
        "wood.burn", requires=[Ore], provides=[Coal], checks=[Ore], check=check, poll=lambda data: "no wood"
    )
    melt = operator("smithy.melt", requires=[Ore], uses=[Coal], provides=[Iron], checks=[Ore, Coal], check=check)
    run = host_of(DIG, wood, melt).run([], [Iron]).finish()
    assert [context.operator.idname for context in calls] == ["smithy.melt"]
    assert calls[0].get(Coal) is None and run.get(Iron) == Iron()


def test_a_check_sees_only_the_values_that_it_names():
    check, seen = refusing(Ore, Coal)
    burn = operator("wood.burn", provides=[Coal])
    melt = operator("smithy.melt", requires=[Ore, Coal], provides=[Iron], checks=[Ore], check=check)
    host_of(burn, DIG, melt).run([], [Iron]).finish()
    assert seen == [[Ore(), None]]


def test_settings_are_not_checked_where_a_value_for_it_could_not_be_made():
    def explode(context):
        raise ZeroDivisionError("no fire")

    check, seen = refusing(Ore)
    burn = operator("wood.burn", requires=[Ore], provides=[Coal], execute=explode)
    melt = operator("smithy.melt", requires=[Ore], uses=[Coal], provides=[Iron], checks=[Ore, Coal], check=check)
    run = host_of(DIG, burn, melt).run([], [Iron]).finish()
    assert not seen and [failure.idname for failure in run.failures()] == ["wood.burn"]


def test_values_that_add_up_come_from_several_operators_and_none_is_lost():
    @dataclass(frozen=True)
    class Logs:
        names: tuple[str, ...] = ()

        @classmethod
        def joined(cls, parts):
            return cls(sum((part.names for part in parts), ()))

    def cut(name, fails=False):
        return lambda context: [Logs((name,))] if not fails else 1 / 0

    saw = operator("mill.saw", requires=[Logs], provides=[Coal])
    oak, elm = (operator(f"wood.{name}", provides=[Logs], execute=cut(name)) for name in ("oak", "elm"))
    run = host_of(oak, saw, elm).run([], [Coal]).finish()
    assert run.get(Logs) == Logs(("oak", "elm")) and run.results[-1].idname == "mill.saw"
    broken = operator("wood.ash", provides=[Logs], execute=cut("ash", fails=True))
    assert outcomes(host_of(oak, broken, saw).run([], [Coal]).finish())["mill.saw"] == Outcome.BLOCKED
