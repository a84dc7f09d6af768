"""A run: the command, its settings, the files to write, and the work of its search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from calmotion.arrays import Array
from calmotion.model.tempo import TempoSettings
from calmotion.model.tolerance import SEARCH_SHARE
from calmotion.model.uncertainty import RobustSettings


@dataclass(frozen=True)
class RunSettings:
    """What the user chose for simulations and searches; None leaves a choice to the shot or to the program.

    Attributes:
        tolerance: Accuracy of the simulation at the targets [m].
        goal: Error at the targets that is accepted after optimising [m]; a search ends where it is reached.
        step: Time step [s].
        pre_roll: Length of the pre-roll [s].
        integrator: Name of the integrator.
        knot_spacing: Distance of the knots of the offsets [s].
        smoothness: Weight of the second derivative of the offsets.
        max_iterations: Largest number of Gauss-Newton iterations.
        least_gain: A smaller predicted gain ends the search, a part of the tolerance.
        adjoint: `discrete` or `continuous`.
        motors: `auto`, `on` (every motor may change) or `off` (idle motors are not checked at the end).
        ideal_motors: Whether joints follow their curves exactly, whatever the models of their motors say.
        directions: `auto`, `on` (bodies keep all coordinates) or `off` (the smallest POD subspaces at any error).
        retime: How the tempo may change; None: not at all.
        limited_by_tempo: Whether a tempo keeps the limits that it can, so that a search need not.
        narrowed: Shares of the limits within which a search keeps each motor, by the name of the quantity; those of
            others are kept as they are.
        between: By how much efforts are more near each judged instant than there [N m] or [N], shape [T, M], as finer
            steps have them; None: not known.
        robust: Settings of an optimisation for a set of robots; None: for the nominal robot alone.
        terms: Residuals and limits of plugins, `retargeting.SearchTerm`.
    """

    tolerance: float | None = None
    step: float | None = None
    pre_roll: float | None = None
    integrator: str | None = None
    knot_spacing: float | None = None
    smoothness: float | None = None
    max_iterations: int = 30
    least_gain: float = SEARCH_SHARE
    adjoint: str = "discrete"
    motors: str = "auto"
    ideal_motors: bool = False
    directions: str = "auto"
    robust: RobustSettings | None = None
    retime: TempoSettings | None = None
    limited_by_tempo: bool = False
    narrowed: tuple[tuple[str, tuple[float, ...]], ...] = ()
    between: Array | None = field(default=None, compare=False, repr=False)
    goal: float | None = None
    terms: tuple[Any, ...] = ()

    @property
    def scheme(self) -> str:
        """The integrator of a simulation for which none is chosen."""
        return self.integrator or "bdf2"


LONG_SHOT = 30.0  # of a longer one, an inspection simulates its busiest part of this length [s]
INTEGRATORS = ("bdf2", "newmark", "generalized-alpha", "rk4")
SHAPERS = ("zv", "zvd", "ei", "mzv", "zv2", "zvd2", "ei2", "mzv2", "lowpass")  # input shapers and a filter


@dataclass(frozen=True)
class Source:
    """The shot and what is to be done with it.

    Attributes:
        path: The shot.
        command: `inspect`, `simulate` or `optimize`.
        settings: Of simulations and searches.
        shaper: Input shaper or filter through which `simulate` passes the motors' tracks first, or None.
        motion: File with a motion that replaces tracks of motors, or None.
        verify: Whether the result is to be compared with a finer run.
        meshes: Whether an inspection meshes flexible bodies; else their beams are told, which takes seconds.
        measured: Prims at which sensors measured, which are targets as well.
    """

    path: str
    command: str
    settings: RunSettings = field(default_factory=RunSettings)
    shaper: str | None = None
    motion: str | None = None
    verify: bool = False
    measured: tuple[str, ...] = ()
    meshes: bool = True

    @property
    def refines(self) -> bool:
        """Whether the reduction of the bodies is refined until the motion keeps the tolerance."""
        return self.command != "inspect"

    @property
    def by_sections(self) -> bool:
        """Whether flexible bodies are beams by their sections, and no mesh is made."""
        return self.command == "inspect" and not self.meshes


@dataclass(frozen=True)
class OutputPaths:
    """Where the results go; None: not requested."""

    layer: str | None = None
    rrd: str | None = None
    csv: str | None = None
    figures: str | None = None
    video: str | None = None
    modes: str | None = None
    html: str | None = None


@dataclass(frozen=True)
class InputLayer:
    """A layer that was read: its path as a person would give it, and the SHA-256 of its bytes."""

    path: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """Origin, units and range of the shot, for writing results.

    Attributes:
        shot: Path of the shot as given.
        layers: Every layer that was read, the shot first.
        meters_per_unit, kilograms_per_unit, up_axis: Of the stage, fallbacks applied.
        time_codes_per_second, frames_per_second, start_time_code, end_time_code: Of the stage.
        default_prim: Name of the default prim, or empty.
        earlier_layers: Layers of earlier results in the shot, which were muted to read the intended motion.
        names: Of prims whose names USD does not allow, as converters encode them, to what the author of the file wrote.
    """

    shot: str
    layers: tuple[InputLayer, ...]
    meters_per_unit: float
    kilograms_per_unit: float
    up_axis: str
    time_codes_per_second: float
    frames_per_second: float
    start_time_code: float
    end_time_code: float
    default_prim: str
    earlier_layers: tuple[str, ...] = ()
    names: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class OptimizerStep:
    """One iteration of the optimiser: objective, gradient norm (projected), products and simulations so far."""

    objective: float
    gradient_norm: float
    forward_simulations: int
    linearized_sweeps: int


@dataclass(frozen=True)
class SearchRecord:
    """One or several searches.

    Attributes:
        steps: Progress, first entry the start; empty without a search.
        parameters, iterations, forward_simulations, gradients, linearized_sweeps: Counts.
        processor_s: Processor time [s]; None: not measured.
        stopped: Why it ended.
        expected_gain_m: By how much the root-mean-square error was expected to fall in one more iteration [m].
        interrupted: Whether the user ended it.
        idle_gain_m: By how much the root-mean-square error would fall with the motors that were left out of the search
            since they move no target [m]; None where there are none.
        resumed_iterations: Iterations of an interrupted search from which this one resumed.
    """

    steps: tuple[OptimizerStep, ...] = ()
    parameters: int = 0
    iterations: int = 0
    forward_simulations: int = 0
    gradients: int = 0
    linearized_sweeps: int = 0
    processor_s: float | None = None
    stopped: str = ""
    expected_gain_m: float | None = None
    interrupted: bool = False
    idle_gain_m: float | None = None
    resumed_iterations: int = 0

    def after(self, first: SearchRecord) -> SearchRecord:
        """This search, with the work of the one before it."""
        simulations, sweeps = first.steps[-1].forward_simulations, first.steps[-1].linearized_sweeps
        steps = tuple(
            replace(
                step,
                forward_simulations=simulations + step.forward_simulations,
                linearized_sweeps=sweeps + step.linearized_sweeps,
            )
            for step in self.steps
        )
        return replace(
            self,
            steps=first.steps + steps,
            iterations=first.iterations + self.iterations,
            forward_simulations=first.forward_simulations + self.forward_simulations,
            gradients=first.gradients + self.gradients,
            linearized_sweeps=first.linearized_sweeps + self.linearized_sweeps,
            processor_s=(first.processor_s or 0.0) + (self.processor_s or 0.0),
            resumed_iterations=first.resumed_iterations + self.resumed_iterations,
        )
