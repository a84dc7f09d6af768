"""The commands as functions: simulate, optimise, verify, inspect, rig."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from calmotion.host import OperatorResult, SettingError, Settings, merge, quantity_of
from calmotion.model.model_choice import KINDS, OFF, ON
from calmotion.model.outputs import Rig, Verification
from calmotion.model.result import Result
from calmotion.model.run import OutputPaths, RunSettings, Source
from calmotion.workflow.inspection import Inspection, wanted_of
from calmotion.workflow.results import OptimizationResult, SimulationResult
from calmotion.workflow.run import Hooks, Progress, carry_out
from calmotion.workflow.shot import Given, Path, Shot, read_settings

AUTHORED, IDEAL = "authored", "ideal"  # motors
ProgressCallback = Callable[[Progress], None]
OperatorCallback = Callable[[OperatorResult], None]


# parameters: one for each option of the command, all but the shot by keyword
def simulate(
    shot: Shot | Path,
    *,
    tolerance: float | str | None = None,
    step: float | str | None = None,
    integrator: str | None = None,
    pre_roll: float | str | None = None,
    motors: str = AUTHORED,
    shaper: str | None = None,
    keep: Sequence[str] = (),
    leave_out: Sequence[str] = (),
    verify: bool = False,
    outputs: OutputPaths | None = None,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: ProgressCallback | None = None,
    on_operator: OperatorCallback | None = None,
    cancel: Callable[[], bool] | None = None,
) -> SimulationResult:
    """Simulate a shot as animated.

    Args:
        shot: The shot, or its USD file.
        tolerance: Accuracy of the simulation at the targets, [m] or text with a unit (`"1mm"`); None: the shot's own.
        step: Time step, [s] or text with a unit; None: from the tolerance.
        integrator: `bdf2`, `newmark`, `generalized-alpha` or `rk4`; None: automatic.
        pre_roll: Time that eases into the motion, [s] or text with a unit; None: automatic.
        motors: `authored`: as the models of the motors say; `ideal`: joints follow their curves exactly.
        shaper: One of `calmotion.model.SHAPERS` for the motors' tracks, to compare with.
        keep, leave_out: Kinds of simplification that are forbidden or forced (`bodies`, `turning`, `loops`, `modes`,
            `directions`, `elasticity`, `motors`, or `all`); the others follow from the tolerance.
        verify: Measure the error against a finer run as well.
        outputs: Files to write in the same run; the result's methods write them later as well.
        operators: Idnames of operators of plugins to run as well.
        settings: Settings of operators, stronger than those of the shot.
        progress: Called with a `Progress`.
        on_operator: Called after each operator with its outcome, duration and notes.
        cancel: Called often; the run stops when it returns True.

    Raises:
        ShotError: The shot cannot be processed; a `RunError` names the operators and plugins that failed.
        SettingError: An argument does not fit.
        Cancelled: `cancel` stopped the run.
    """
    source = _source(tolerance, step, integrator, pre_roll, motors, shaper=shaper, verify=verify)
    return SimulationResult(
        carry_out(
            _opened(shot), "simulate", wanted=_wanted(verify), operators=operators, source=source, outputs=outputs,
            settings=merge([_forced(keep, leave_out), read_settings(settings)]),
            hooks=Hooks(progress, on_operator, cancel),
        )
    )  # fmt: skip


# parameters: one for each option of the command, all but the shot by keyword
def optimize(
    shot: Shot | Path,
    *,
    tolerance: float | str | None = None,
    step: float | str | None = None,
    pre_roll: float | str | None = None,
    motors: str = AUTHORED,
    integrator: str | None = None,
    adjoint: str | None = None,
    goal: float | str | None = None,
    retime: bool | Mapping[str, Any] = False,
    keep: Sequence[str] = (),
    leave_out: Sequence[str] = (),
    verify: bool = False,
    outputs: OutputPaths | None = None,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: ProgressCallback | None = None,
    on_operator: OperatorCallback | None = None,
    cancel: Callable[[], bool] | None = None,
) -> OptimizationResult:
    """Find motor curves with which the flexible robot performs the intended motion.

    An interrupted or cancelled run that has curves already returns the best of them (`interrupted` is True). With
    `outputs.layer` a checkpoint is kept beside the layer, and the same call resumes from it.

    Args:
        shot: The shot, or its USD file.
        tolerance, step, pre_roll, motors, keep, leave_out, verify, outputs, operators, settings, progress,
            on_operator, cancel: As of `simulate`.
        integrator: `bdf2`, the only one for the optimiser.
        adjoint: `discrete` (None; exact gradients) or `continuous` (to compare with).
        goal: Error at the targets that is accepted, [m] or text with a unit (`"2mm"`): the search ends there; None:
            that of the shot, or none.
        retime: Whether parts may be slower where limits of motors ask for it, and how: `{"slowest": 1.5,
            "fastest": 0.9, "pin": (24, 48, 72)}` has the largest and the smallest stretch, and time codes whose
            distances stay.

    Raises:
        ShotError: The shot cannot be processed; a `RunError` names the operators and plugins that failed.
        SettingError: An argument does not fit.
        Cancelled: `cancel` stopped the run before it had curves.
    """
    source = _source(tolerance, step, integrator, pre_roll, motors, verify=verify)
    named: dict[str, object] = {"adjoint": adjoint, "goal": quantity_of(goal, "m", "goal")}
    given = {name: value for name, value in named.items() if value is not None}
    chosen: Settings = {"retarget.optimize": given} if given else {}
    outcome = carry_out(
        _opened(shot), "optimize", wanted=_wanted(verify), operators=operators, source=source, outputs=outputs,
        settings=merge([_forced(keep, leave_out), chosen, _tempo(retime), read_settings(settings)]),
        hooks=Hooks(progress, on_operator, cancel),
    )  # fmt: skip
    result = OptimizationResult(outcome)
    if outputs is not None and outputs.layer and not outcome.problems and not result.interrupted:
        from calmotion.retargeting.checkpoint import checkpoint_path, remove_checkpoint

        remove_checkpoint(checkpoint_path(outputs.layer))
    return result


def verify(result: SimulationResult) -> Verification:
    """Measure the error of a result against a finer run of the same curves: takes several times as long.

    Raises:
        RunError: The finer run failed.
    """
    return result.verify()


# parameters: one for each option of the command, all but the shot by keyword
def inspect(
    shot: Shot | Path,
    *,
    tolerance: float | str | None = None,
    step: float | str | None = None,
    integrator: str | None = None,
    pre_roll: float | str | None = None,
    motors: str = AUTHORED,
    keep: Sequence[str] = (),
    leave_out: Sequence[str] = (),
    strict: bool = False,
    meshes: bool = False,
    modes: Path | None = None,
    figures: Path | None = None,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: ProgressCallback | None = None,
    on_operator: OperatorCallback | None = None,
) -> Inspection:
    """The content of a shot, its natural frequencies, and the simplifications of its model with their reasons.

    Args:
        shot: The shot, or its USD file.
        tolerance, step, integrator, pre_roll, motors, keep, leave_out, operators, settings, progress,
            on_operator: As of `simulate`.
        strict: Check the shot instead, with USD's validators as well, and list all findings; nothing costly runs.
        meshes: Mesh the flexible bodies; else their frequencies are rough, from beams and sections.
        modes: Folder for the mode shapes of the flexible bodies, which are meshed.
        figures: Folder for the figure of the tempo, where limits of motors ask for another one.

    Raises:
        SettingError: An argument does not fit.
    """
    kinds, optional = wanted_of(strict, modes is not None, figures is not None)
    return Inspection(
        carry_out(
            _opened(shot), "check" if strict else "inspect", wanted=kinds, optional=optional, operators=operators,
            source=replace(_source(tolerance, step, integrator, pre_roll, motors), meshes=meshes or modes is not None),
            known=(),
            outputs=OutputPaths(
                modes=None if modes is None else os.fspath(modes),
                figures=None if figures is None else os.fspath(figures),
            ),
            settings=merge([_forced(keep, leave_out), read_settings(settings)]), hooks=Hooks(progress, on_operator),
        )
    )  # fmt: skip


def rig(
    shot: Shot | Path,
    layer: Path,
    *,
    operators: Sequence[str] = (),
    settings: Given = None,
    progress: ProgressCallback | None = None,
    on_operator: OperatorCallback | None = None,
) -> Rig:
    """Make a robot from a skinned character, or from animated parts: bodies, joints, motors and targets.

    Args:
        shot: USD file of a UsdSkel character, or of meshes below Xforms with keys.
        layer: USD layer to write; it opens the shot.
        operators, settings, progress, on_operator: As of `simulate`; see the properties of `rig.skeleton`.

    Raises:
        ShotError: The character cannot be rigged.
        SettingError: A setting does not fit.
    """
    outputs = OutputPaths(layer=os.fspath(layer))
    outcome = carry_out(
        _opened(shot), "rig", wanted=(Rig,), operators=operators, known=(), outputs=outputs,
        settings=read_settings(settings), hooks=Hooks(progress, on_operator),
    )  # fmt: skip
    return outcome.require(Rig)


def _opened(shot: Shot | Path) -> Shot:
    return shot if isinstance(shot, Shot) else Shot(shot)


def _wanted(verify: bool) -> tuple[type, ...]:
    from calmotion.model import Character

    return (Character, Result, *((Verification,) if verify else ()))


def _source(
    tolerance: float | str | None, step: float | str | None, integrator: str | None, pre_roll: float | str | None,
    motors: str, shaper: str | None = None, verify: bool = False,
) -> Source:  # fmt: skip
    """The settings of the user, in SI units."""
    if motors not in (AUTHORED, IDEAL):
        raise SettingError(f"motors is {motors!r}; it must be {AUTHORED!r} or {IDEAL!r}")
    return Source(
        path="",
        command="",
        settings=RunSettings(
            tolerance=quantity_of(tolerance, "m", "tolerance"),
            step=quantity_of(step, "s", "step"),
            integrator=integrator,
            pre_roll=quantity_of(pre_roll, "s", "pre_roll"),
            ideal_motors=motors == IDEAL,
        ),
        shaper=shaper,
        verify=verify,
    )


def _tempo(retime: bool | Mapping[str, Any]) -> Settings:
    """Settings of a search that may change the tempo.

    Raises:
        SettingError: It has a key that means nothing.
    """
    if isinstance(retime, bool):
        return {"retarget.optimize": {"retime": True}} if retime else {}
    given = dict(retime)
    pins = given.pop("pin", ())
    unknown = set(given) - {"slowest", "fastest"}
    if unknown:
        raise SettingError(
            "this is no setting of the tempo",
            path="retime",
            found=", ".join(sorted(unknown)),
            remedy="Use slowest, fastest and pin.",
        )
    pinned = {"pinned": ",".join(str(pin) for pin in pins)} if len(pins) else {}
    return {"retarget.optimize": {"retime": True} | given | pinned}


def _forced(keep: Sequence[str], leave_out: Sequence[str]) -> Settings:
    """Settings of the analysis for what is forced on or off; what is kept wins over `all`.

    Raises:
        SettingError: A kind is both.
    """
    keep, leave_out = ((kinds,) if isinstance(kinds, str) else kinds for kinds in (keep, leave_out))
    for kind in set(keep) & set(leave_out):
        raise SettingError(
            "simplifications of one kind cannot be both made and not made",
            path="--keep, --leave-out",
            found=kind,
            remedy="Leave one of them out.",
        )
    forced: dict[str, object] = {}
    for given, choice in ((leave_out, OFF), (keep, ON)):
        forced |= {kind: choice for name in given for kind in (KINDS if name == "all" else (name,))}
    return {"accuracy.analyse": forced} if forced else {}
