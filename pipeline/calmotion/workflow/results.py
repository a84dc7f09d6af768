"""Results of a run: arrays by prim path, the report, and the files that can be made of them."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character, Result, Simulation
from calmotion.model.outputs import (
    CsvFile,
    Figures,
    HtmlPage,
    PageContent,
    Recording,
    Verification,
    Video,
    WrittenLayer,
)
from calmotion.model.run import OutputPaths, Source
from calmotion.model.table import columns, read_only
from calmotion.workflow.problems import Problem
from calmotion.workflow.report import plain, run_report, verdict_of
from calmotion.workflow.run import Outcome, again, no_input
from calmotion.workflow.shot import Path, Shot


@dataclass(frozen=True, eq=False)
class TargetMotion:
    """The motion of one target, T time steps, world axes of the stage; copy an array to change it.

    Attributes:
        path: Prim path.
        position: [m], shape [T, 3].
        orientation: Unit quaternions (w, x, y, z), shape [T, 4].
        intended_position, intended_orientation: The same of the intended motion: the animation on a rigid robot.
        error: Distance to the intended position [m], shape [T].
        rotation_error: Angle to the intended orientation [rad], shape [T].
    """

    path: str
    position: Array
    orientation: Array
    intended_position: Array
    intended_orientation: Array
    error: Array
    rotation_error: Array

    @property
    def max_error(self) -> float:
        """Largest error [m]."""
        return float(self.error.max(initial=0.0))

    @property
    def rms_error(self) -> float:
        """Root mean square of the error over time [m]."""
        return float(np.sqrt(np.mean(self.error**2)))


@dataclass(frozen=True, eq=False)
class MotorMotion:
    """The curve of one motor, T time steps; [rad] and [N m], or [m] and [N] of a prismatic joint.

    Attributes:
        path: Prim path of the motor's joint.
        input: The animator's curve, shape [T].
        output: The curve that was simulated: the input, or the optimised curve, shape [T].
        effort: Torque or force that the motor needs, shape [T].
    """

    path: str
    input: Array
    output: Array
    effort: Array


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """A simulated motion during the shot, without the pre-roll.

    Attributes:
        times: [s] after the first frame, shape [T].
        targets: By prim path.
        motors: By prim path of the joint.
    """

    times: Array
    targets: Mapping[str, TargetMotion]
    motors: Mapping[str, MotorMotion]


class SimulationResult:
    """A simulated shot. `report()` is the object that `--json` prints.

    Attributes:
        shot: The shot.
        result: Everything that the engine computed, see `calmotion.model.Result`.
        interrupted: Whether the user or `cancel` stopped the run.
        problems: Outputs that failed although the result is there.
    """

    _command = "simulate"

    def __init__(self, outcome: Outcome):
        """
        Raises:
            RunError: The run made no result.
            Cancelled: The run was cancelled before it had one.
        """
        self._outcome = outcome
        self.result: Result = outcome.require(Result)
        self._character: Character = outcome.require(Character)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.shot.path}: largest error {self.max_error:.3g} m>"

    @property
    def shot(self) -> Shot:
        """The shot."""
        return self._outcome.shot

    @property
    def outcome(self) -> Outcome:
        """The run that made it."""
        return self._outcome

    @property
    def interrupted(self) -> bool:
        """Whether the user or `cancel` stopped the run; the result is the best until then."""
        return self._outcome.interrupted or self.result.interrupted

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What went wrong beside the result, such as an output that could not be written."""
        return self._outcome.problems

    @cached_property
    def motion(self) -> RobotMotion:
        """The simulated motion that counts: with the optimised curves where there are some."""
        return self._motion_of(self.result.after or self.result.before)

    @property
    def times(self) -> Array:
        """[s] after the first frame, shape [T]."""
        return self.motion.times

    @property
    def targets(self) -> Mapping[str, TargetMotion]:
        """The targets' motions, by prim path."""
        return self.motion.targets

    @property
    def motors(self) -> Mapping[str, MotorMotion]:
        """The motors' curves, by prim path of the joint."""
        return self.motion.motors

    @property
    def max_error(self) -> float:
        """Largest error of any target [m]."""
        return max((target.max_error for target in self.targets.values()), default=0.0)

    @property
    def rms_error(self) -> float:
        """Root mean square of the errors over time and targets [m]."""
        squares = [target.rms_error**2 for target in self.targets.values()]
        return float(np.sqrt(np.mean(squares))) if squares else 0.0

    @property
    def tolerance_kept(self) -> bool:
        """Whether the error of the simulation, estimated or measured by `verify`, is within the tolerance."""
        return verdict_of(self._outcome.run, self.result).kept

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints: plain values, keys as in the USD contract."""
        report: dict[str, Any] = plain(
            run_report(self._outcome.run, self._character, self.result, self._command, self._outcome.total_wall_s)
        )
        return report

    def columns(self) -> dict[str, Array]:
        """The columns of `--csv` by name, each of shape [T]; see `calmotion.model.table.columns`."""
        return columns(self._character, self.result)

    def table(self) -> Any:
        """The columns of `--csv` as a pandas frame; without pandas as a NumPy structured array of the same names."""
        values = self.columns()
        try:
            import pandas
        except ImportError:
            table = np.zeros(len(values["time_s"]), dtype=[(name, float) for name in values])
            for name, column in values.items():
                table[name] = column
            return table
        return pandas.DataFrame(values)

    def write_table(self, path: Path) -> str:
        """Write the table as CSV; returns the path.

        Raises:
            ShotError: It cannot be written, or the shot is read from this file.
        """
        return again(self._outcome, CsvFile, OutputPaths(csv=no_input(self._outcome, path))).path

    def record(self, path: Path) -> str:
        """Write a recording for the rerun viewer; returns the path.

        Raises:
            ShotError: It cannot be written, or the shot is read from this file.
        """
        return again(self._outcome, Recording, OutputPaths(rrd=no_input(self._outcome, path))).path

    def draw(self, folder: Path) -> tuple[str, ...]:
        """Draw the figures into a folder; returns their paths.

        Raises:
            RunError: They cannot be written.
        """
        return again(self._outcome, Figures, OutputPaths(figures=os.fspath(folder))).paths

    def film(self, path: Path) -> str:
        """Write a video (.webp, or .mp4 where ffmpeg is installed); returns the path.

        Raises:
            ShotError: It cannot be written, or the shot is read from this file.
        """
        return again(self._outcome, Video, OutputPaths(video=no_input(self._outcome, path))).path

    def write_page(self, path: Path, content: PageContent) -> str:
        """Write a page for browsers; returns the path.

        Args:
            content: Its words; motions, curves and frequencies are those of the result.

        Raises:
            ShotError: It cannot be written, or the shot is read from this file.
        """
        return again(self._outcome, HtmlPage, OutputPaths(html=no_input(self._outcome, path)), content).path

    def write(
        self,
        layer: Path,
        *,
        bake: str = "none",
        samples_per_second: float | None = None,
        splines: bool = False,
    ) -> WrittenLayer:
        """Write the motor curves as a layer of overs, and beside it a root layer that opens it with the shot.

        Args:
            layer: USD layer to write; the layers of the shot are refused.
            bake: `motors` or `simulated` to write body transforms as well.
            samples_per_second: Density of the samples [Hz]; None: the frames of the shot.
            splines: Write splines with the optimiser's knots, not samples.

        Raises:
            RunError: It cannot be written.
        """
        options: dict[str, object] = {"bake": bake, "splines": splines}
        if samples_per_second is not None:
            options["samples_per_second"] = samples_per_second
        return again(self._outcome, WrittenLayer, OutputPaths(layer=os.fspath(layer)), settings={"usd.write": options})

    def verify(self) -> Verification:
        """Measure the error of the result against a finer run of the same curves: takes several times as long.

        Raises:
            RunError: The finer run failed.
        """
        from dataclasses import replace

        return again(self._outcome, Verification, replace(self._outcome.require(Source), verify=True))

    def _motion_of(self, simulation: Simulation) -> RobotMotion:
        motion, reference, rows = simulation.motion, self.result.reference, simulation.motion.judged
        targets = {
            target.path: TargetMotion(
                target.path,
                read_only(motion.target_positions[rows, k]),
                read_only(motion.target_rotations[rows, k]),
                read_only(reference.target_positions[rows, k]),
                read_only(reference.target_rotations[rows, k]),
                read_only(simulation.position_errors[rows, k]),
                read_only(simulation.rotation_errors[rows, k]),
            )
            for k, target in enumerate(self._character.targets)
        }
        motors = {
            motor.path: MotorMotion(
                motor.path,
                read_only(reference.motor_values[rows, m]),
                read_only(motion.motor_values[rows, m]),
                read_only(motion.motor_efforts[rows, m]),
            )
            for m, motor in enumerate(self._character.motors)
        }
        return RobotMotion(read_only(motion.times[rows]), targets, motors)


class OptimizationResult(SimulationResult):
    """An optimised shot: `motion`, `targets` and `motors` are those with the optimised curves.

    Attributes:
        before: The animation before the optimisation, simulated.
    """

    _command = "optimize"

    @cached_property
    def before(self) -> RobotMotion:
        """The animation before the optimisation, simulated."""
        return self._motion_of(self.result.before)

    @property
    def improved(self) -> bool:
        """Whether the curves leave no larger error than the animation."""
        return bool(self.result.improved)

    @property
    def stopped(self) -> str:
        """Why the optimiser stopped: `converged`, `interrupted`, ..."""
        return self.result.search.stopped
