"""One run of the plugins on a shot: what is wanted, where files go, progress, interruption."""

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

from calmotion.errors import ShotError
from calmotion.host import Host, OperatorResult, Run, SettingError, Settings, merge, nearest
from calmotion.model import Animation, Character, MotorTracks, Provenance
from calmotion.model.run import INTEGRATORS, SHAPERS, OutputPaths, Source
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.support import interrupts
from calmotion.support.foreign_files import remedy_for
from calmotion.tolerance.reduced_bodies import ConvergedReduction
from calmotion.workflow.outputs import (
    files_of,
    prepare_outputs,
    refuse_layers,
    refuse_other_types,
    refuse_overwriting,
    requested_files,
)
from calmotion.workflow.problems import Cancelled, Problem, problems_of, value_of
from calmotion.workflow.shot import Shot

T = TypeVar("T")


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        stage: Label of the operator that runs.
        fraction: How far it is, 0..1.
        message: What it does now, or empty.
        time_left_s: Estimate of what this operator still takes [s], from its pace so far; None before it has one.
    """

    stage: str
    fraction: float
    message: str
    time_left_s: float | None = None


@dataclass(frozen=True)
class Hooks:
    """Callbacks of a run, and how the caller stops it. What one of them raises ends the run, and reaches the caller.

    Attributes:
        progress: Called often with a `Progress`.
        on_operator: Called after each operator with its outcome, duration and notes.
        cancel: Called as often as `progress`; the run stops when it returns True.
    """

    progress: Callable[[Progress], None] | None = None
    on_operator: Callable[[OperatorResult], None] | None = None
    cancel: Callable[[], bool] | None = None

    def tell(self, stage: str, fraction: float, message: str = "") -> None:
        """Say how far a stage that is not of the run has come.

        Raises:
            Cancelled: The caller wants it to stop.
        """
        if self.cancel is not None and self.cancel():
            raise Cancelled(f"{stage}: cancelled")
        if self.progress is not None:
            self.progress(Progress(stage, fraction, message))


class _Stop(KeyboardInterrupt):
    """The caller's `cancel`, in the form in which the optimiser keeps its best curves."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The outcome of a run.

    Attributes:
        shot: The shot.
        run: The host's run: every value by its type, and the outcome of each operator.
        problems: What went wrong.
        interrupted: Whether the user interrupted it, or the caller cancelled it.
        cancelled: Whether the caller did.
        total_wall_s: Time of all of it [s].
        settings: Settings of operators that were given.
    """

    shot: Shot
    run: Run
    problems: tuple[Problem, ...]
    interrupted: bool
    cancelled: bool
    total_wall_s: float
    settings: Settings = field(default_factory=dict)

    def require(self, kind: type[T]) -> T:
        """The value of a type.

        Raises:
            RunError: The run did not make it.
            Cancelled: The caller stopped the run before.
            KeyboardInterrupt: The user interrupted the run before.
        """
        if self.interrupted and self.run.get(kind) is None:
            if self.cancelled:
                raise Cancelled(f"{self.shot.path}: cancelled before there was a result")
            raise KeyboardInterrupt
        return value_of(self.run, kind, self.problems)


def carry_out(
    shot: Shot,
    command: str,
    *,
    wanted: Sequence[type] = (),
    optional: Sequence[type] = (),
    operators: Sequence[str] = (),
    source: Source | None = None,
    outputs: OutputPaths | None = None,
    known: Sequence[object] | None = None,
    settings: Settings | None = None,
    hooks: Hooks | None = None,
) -> Outcome:
    """Run the operators that are needed for what is wanted.

    Args:
        shot: The shot; what a run reads of it is kept there.
        command: `inspect`, `check`, `simulate`, `optimize` or `rig`.
        wanted: Types that must come out.
        optional: Types that are made where an operator can.
        operators: Idnames of operators to run as well.
        source: Settings of the simulation; path, command and motion are filled in.
        outputs: Files to write.
        known: Values that exist already; the shot's when None.
        settings: Settings of operators, stronger than the shot's.
        hooks: Progress, notes, cancelling.

    Raises:
        SettingError: A setting, an operator's name or an output does not fit.
        PlanError: The operators cannot make what is wanted.
        Exception: What a hook raised.
    """
    start, host, hooks = time.perf_counter(), shot.host, hooks or Hooks()
    source = replace(source or Source("", ""), path=shot.path, command=command, motion=shot.motion)
    outputs = outputs or OutputPaths()
    refuse_other_types(outputs)
    known = shot.known if known is None else known
    writes = command in ("simulate", "optimize")
    kinds = [*wanted, *(requested_files(host, outputs) if writes else ()), *_made_by(host, operators)]
    _refuse_unknown_methods(source)
    _refuse_unreadable_motion(source, host)
    given = merge([shot.settings, settings or {}])
    raised: list[BaseException] = []
    run = host.run(
        [*known, source, outputs], kinds, optional=optional, settings=given, progress=_listener(hooks, raised),
        reuse=shot.reuse,
    )  # fmt: skip
    prepare_outputs(shot.inputs, outputs)
    interrupted = cancelled = False
    unread = True
    try:
        for result in run:
            if unread and (provenance := run.get(Provenance)) is not None:
                unread = False
                refuse_layers(shot.path, provenance, run.get(Character), files_of(outputs))
            if hooks.on_operator:
                hooks.on_operator(result)
    except _Stop:
        interrupted = cancelled = True
    except KeyboardInterrupt:
        interrupts.answer()
        interrupted = True
    if raised:
        raise raised[0]
    if writes:  # other commands also accept a shot in which nothing moves
        shot.keep(run.data)
    problems = [Problem(ShotError("interrupted"))] if interrupted else problems_of(run, kinds)
    return Outcome(shot, run, tuple(problems), interrupted, cancelled, time.perf_counter() - start, given)


def compiled_run(shot: Shot, source: Source, settings: Settings | None = None, hooks: Hooks | None = None) -> Outcome:
    """A run that compiles a shot as `simulate` does, with reductions that do for it; `tolerance.compiled_in` has it.

    Args:
        source, settings, hooks: As of `carry_out`.

    Raises:
        RunError: It cannot be compiled.
    """
    outcome = carry_out(
        shot, "simulate", wanted=(Character, Animation, Provenance, CompiledShot), optional=(ConvergedReduction,),
        source=source, settings=settings, hooks=hooks,
    )  # fmt: skip
    outcome.require(CompiledShot)
    return outcome


def _listener(hooks: Hooks, raised: list[BaseException]) -> Callable[[str, float, str], None]:
    """The host's progress callback that asks `cancel` and estimates the time left.

    What a callback of the caller raises is no fault of a plugin: it is added to `raised`, and the run stops.
    """
    began: dict[str, float] = {}

    def listen(stage: str, fraction: float, message: str) -> None:
        interrupts.check()
        if raised:
            raise _Stop
        try:
            tell(stage, fraction, message)
        except (Exception, SystemExit) as error:
            raised.append(error)
            raise _Stop from error

    def tell(stage: str, fraction: float, message: str) -> None:
        if hooks.cancel and hooks.cancel():
            raise _Stop
        now = time.perf_counter()
        elapsed = now - began.setdefault(stage, now)
        left = elapsed * (1.0 - fraction) / fraction if fraction > 0.0 and elapsed > 0.0 else None
        if hooks.progress:
            hooks.progress(Progress(stage, fraction, message, left))

    return listen


def _made_by(host: Host, operators: Sequence[str]) -> list[type]:
    """The types that the named operators make.

    Raises:
        SettingError: There is no such operator.
    """
    kinds: list[type] = []
    for idname in (operators,) if isinstance(operators, str) else operators:
        if idname not in host.operators:
            known = ", ".join(host.operators)
            raise SettingError(
                "there is no such operator",
                path="--run",
                found=idname,
                remedy=f"{nearest(idname, host.operators)}The operators are {known}",
            )
        kinds += host.operators[idname].provides
    return kinds


def _refuse_unknown_methods(source: Source) -> None:
    """Refuse an integrator or an input shaper that the command does not have, before anything costly."""
    integrators = ("bdf2",) if source.command == "optimize" else INTEGRATORS
    for option, found, known in (
        ("--integrator", source.settings.integrator, integrators),
        ("--shaper", source.shaper, SHAPERS),
    ):
        if found is not None and found not in known:
            raise SettingError(
                f"{source.command} supports only {', '.join(known)}",
                path=option,
                found=found,
                remedy=f"{nearest(str(found), known)}Remove the option, or use one of these.",
            )


def _refuse_unreadable_motion(source: Source, host: Host) -> None:
    """Refuse a motion that no plugin reads, before anything costly."""
    readers = host.providers(MotorTracks)
    if source.motion is not None and all(cls.poll({Source: source}) is not None for cls in readers):
        raise SettingError(
            "no plugin reads this motion",
            path="--motion",
            found=source.motion,
            remedy=remedy_for(source.motion, "bvh")
            or "Name a .csv, .npz or .bvh file, or a plugin that provides MotorTracks with --plugins",
        )


def again(outcome: Outcome, wanted: type[T], *values: object, settings: Settings | None = None) -> T:
    """One more value from what a run has made.

    Args:
        wanted: Type of the value; it is made anew, also where the run had made one.
        values: Given instead of the run's values of the same types.
        settings: Settings of operators, stronger than the shot's.

    Raises:
        RunError: No operator made it.
        SettingError: A setting does not fit.
    """
    host, given = outcome.shot.host, {kind: value for kind, value in outcome.run.data.items() if kind is not wanted}
    given |= {type(value): value for value in values}
    given |= {kind: _found_again(value, outcome.shot) for kind, value in given.items() if kind in (Source, Provenance)}
    data: list[Any] = list(given.values())
    run = host.run(data, [wanted], settings=merge([outcome.shot.settings, settings or {}])).finish()
    return value_of(run, wanted)


def _found_again(value: object, shot: Shot) -> object:
    """A value that names the shot by its path of now: the working folder may be another one."""
    if isinstance(value, Source):
        return replace(value, path=shot.path, motion=shot.motion)
    return replace(value, shot=shot.path) if isinstance(value, Provenance) else value


def no_input(outcome: Outcome, path: str | os.PathLike[str]) -> str:
    """The path of a file, unless the run of a result read it.

    Raises:
        SettingError: It did.
    """
    files = {"path": os.fspath(path)}
    refuse_overwriting(outcome.shot.inputs, files)
    refuse_layers(outcome.shot.path, outcome.require(Provenance), outcome.require(Character), files)
    return files["path"]
