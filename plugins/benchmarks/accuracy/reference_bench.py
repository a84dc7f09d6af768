"""A shot, its reference, the points that are measured against it, and how these compare."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from calmotion import ShotError
from calmotion.arrays import Array
from calmotion.mesh import quadratic_mesh
from calmotion.model import Animation, RunSettings, with_settings
from calmotion.multibody import ReducedBody
from calmotion.simulation import MAX_STEP, BodyReduction, CompiledShot, compile_shot, reduction_for
from calmotion.tolerance import ProjectedShot, ReferenceRun, StepRun, distance, mesh_error, reference_run, simulate_at

from ..common.reporting import say
from ..common.shots import Unreduced
from ..common.timing import median_time

TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5)
REFERENCE_STEP, SMALLEST_STEP = 1 / 3840, 1 / 30720  # of the reference: at most, and where it ends
BASE, FINEST = 1e-5, 1e-7  # reductions: of the runs that vary something else, and of the reference [m]
REPEATS = 3
ENOUGH_TIME = 10.0  # of runs that are timed [s]: longer ones are run once
TIMES = 8.0  # nodes of a reference over those of what is measured


@dataclass(frozen=True)
class Point:
    """One setting of one shot.

    Attributes:
        shot, series, setting: Names; series `default` and `tolerance` are what the program chooses.
        step_s: [s].
        coordinates: Elastic ones.
        wall_s: Median time of the simulation alone [s].
        error_m: Against the reference [m]; NaN where the simulation failed.
        why: The reason of a failure.
    """

    shot: str
    series: str
    setting: str
    step_s: float
    coordinates: int
    wall_s: float
    error_m: float
    why: str = ""


@dataclass(frozen=True)
class Reference:
    """Where the targets are at the frames [m], shape [f, K, 3], and how far that may be from its limit [m]."""

    positions: Array
    bar_m: float


class Bench:
    """One shot, its reductions kept.

    Args:
        repeats: Runs of which the median time counts.
        nodes: Nodes of its meshes over those of the shot's.
        finer: Meshes with so many nodes, where they are known.
    """

    def __init__(self, shot: Unreduced, repeats: int = REPEATS, nodes: float = 1.0, finer: BodyReduction | None = None):
        self.repeats, self._nodes, self._given = repeats, nodes, shot
        self._coarse = reduction_for(shot.character, shot.animation, shot.meshes, RunSettings())
        if finer is not None:
            self._reduction = BodyReduction(shot.character, finer.meshes, self._coarse.loads)
        else:
            # to a fine tolerance, since a link that hardly bends has no modes by which its mesh would be refined
            self._reduction = with_more_nodes(self._coarse, nodes, BASE)
        self.shot = replace(shot, meshes=self._reduction.meshes or shot.meshes)
        self._finer = self._reduction is not self._coarse
        self._known: ReferenceRun | None = None

    def of(self, animation: Animation) -> Bench:
        """That of other curves of the shot, on the same meshes, which take most of the time."""
        shot = replace(self._given, animation=animation)
        return Bench(shot, self.repeats, self._nodes, self._reduction if self._finer else None)

    def bodies(self, tolerance: float, **settings: Any) -> list[ReducedBody]:
        """The shot's bodies, reduced to a tolerance [m] with some of their `FlexibleSettings` changed."""
        character = with_settings(self.shot.character, lambda own: replace(own, **settings))
        return BodyReduction(character, self.shot.meshes, self._reduction.loads).bodies(tolerance)

    def compiled(self, bodies: Sequence[ReducedBody]) -> CompiledShot:
        """The shot with some bodies."""
        return compile_shot(self.shot.character, self.shot.animation, bodies)

    def run(self, bodies: Sequence[ReducedBody], step: float, integrator: str = "bdf2") -> StepRun:
        """One simulation of the shot as animated."""
        return simulate_at(self.compiled(bodies), RunSettings(integrator=integrator), step)

    def _whole_run(self, bodies: Sequence[ReducedBody]) -> ReferenceRun:
        """The same with its elastic coordinates, by which bodies are held to directions."""
        return reference_run(self.compiled(bodies), RunSettings(integrator="bdf2"), MAX_STEP)

    def held(self, bodies: Sequence[ReducedBody], allowed: float) -> Sequence[ReducedBody]:
        """Bodies of the reduction `BASE` held to directions, which may change this much [m]."""
        self._known = self._known or self._whole_run(bodies)
        return ProjectedShot(self.compiled(bodies), RunSettings(), lambda item: allowed, [self._known]).shot.bodies

    def reference(self, finest: float = FINEST) -> Reference:
        """The finest run, its step extrapolated to zero, from steps as small as it takes.

        Its bar is what is left of the step's error, which falls by eight where that is halved, what its meshes are
        estimated to cost where they are finer than the shot's, what another tolerance of the reduction changes (ten
        times its own, or on the meshes of the shot, where it costs little, a tenth of it), what quadratic strain does
        not see, as estimated (to see more takes most of the time), and what holding its bodies to the directions that
        the shot needs does.

        Args:
            finest: Tolerance of the reduction [m].
        """
        bodies = self.bodies(finest, pairs_share=10.0)
        known = self._whole_run(bodies)
        if self._finer:
            runs = [self.run(self._coarse.bodies(part * finest, 10.0), MAX_STEP) for part in (1.0, 0.1)]
        else:
            runs = [self.run(self.bodies(10.0 * finest), MAX_STEP), known.run]
        held = ProjectedShot(self.compiled(bodies), RunSettings(), lambda item: finest, [known])
        limit, left = self._limit(held.shot.bodies, 10.0 * finest)
        unseen = sum(body.elasticity.strain_error_m for body in bodies if body.elasticity is not None)
        reduced = distance(runs[0].positions, runs[1].positions) + unseen
        meshes = (mesh_error(self.compiled(bodies), RunSettings(), known.run) or 0.0) if self._finer else 0.0
        return Reference(limit, left + reduced + held.error_m + meshes)

    def _limit(self, bodies: Sequence[ReducedBody], allowed: float) -> tuple[Array, float]:
        """Positions of the targets as the step goes to zero [m], and what is left of its error there [m]."""
        step, left = 4.0 * REFERENCE_STEP, np.inf
        coarse = limit = self.run(bodies, step).positions
        while step > REFERENCE_STEP or (left > allowed and step > SMALLEST_STEP):
            step *= 0.5
            fine = self.run(bodies, step).positions
            last, limit = limit, fine + (fine - coarse) / 3.0
            coarse, left = fine, distance(limit, last) / 7.0
        return limit, left

    def measure(
        self, reference: Reference, series: str, setting: str, bodies: Sequence[ReducedBody], step: float,
        integrator: str = "bdf2",
    ) -> Point:  # fmt: skip
        """Error and time of one setting."""
        coordinates = sum(len(body.stiffness) for body in bodies)
        named = partial(Point, self.shot.name, series, setting, step, coordinates)
        begin = time.perf_counter()
        try:
            error = distance(self.run(bodies, step, integrator).positions, reference.positions)
        except ShotError as failed:
            return named(float("nan"), float("nan"), str(failed))
        took = time.perf_counter() - begin
        if took < ENOUGH_TIME:
            again = partial(self.run, bodies, step, integrator)
            took = median_time(again, self.repeats, warm=True, enough=ENOUGH_TIME)
        point = named(took, error)
        say(f"{point.shot}, {series}, {setting}: {1e3 * error:.2g} mm off in {took:.3g} s")
        return point


def with_more_nodes(reduction: BodyReduction, times: float = TIMES, tolerance: float | None = None) -> BodyReduction:
    """The reduction on meshes with so many times the nodes, refined for the loads of the shot; the same for 1 or less.

    Their stiffness is that of ever finer meshes, or it would be known less well than that of a result.

    Args:
        reduction: With meshes and loads.
        times: Nodes of the largest mesh over those that it has; smaller meshes get at least as many more.
        tolerance: As of `BodyReduction.bodies` [m].

    Raises:
        ShotError: A body that cannot be reduced.
    """
    if times <= 1.0 or reduction.meshes is None:
        return reduction
    meshes = reduction.meshes.meshes
    most = max(len(quadratic_mesh(mesh.points, mesh.tets).nodes) for mesh in meshes)
    wanted = {mesh.body: 0.0 for mesh in meshes}
    return reduction.with_finer_meshes(tolerance, wanted, int(times * most), keeps="finer")


def front(points: Sequence[Point]) -> list[Point]:
    """Those than which none is both faster and better, by run time."""
    front: list[Point] = []
    done = [point for point in points if np.isfinite(point.error_m)]  # a run that failed has no time by which to sort
    for point in sorted(done, key=lambda p: (p.wall_s, p.error_m)):
        if not front or point.error_m < front[-1].error_m:
            front.append(point)
    return front


def over_fastest(points: Sequence[Point], tolerances: Sequence[float]) -> dict[float, tuple[float, Point]]:
    """How much longer the choice for each tolerance [m] takes than the fastest setting that keeps it, and that."""
    ratios = {}
    chosen = {p.setting: p for p in points if p.series == "tolerance"}
    for tolerance in tolerances:
        choice = chosen.get(setting_of(tolerance))
        if choice is not None:
            keeping = [p for p in points if p.error_m <= tolerance]
            fastest = min(keeping, key=lambda p: p.wall_s, default=choice)
            ratios[tolerance] = choice.wall_s / fastest.wall_s, fastest
    return ratios


def setting_of(tolerance: float) -> str:
    """Name of what is chosen for a tolerance [m]."""
    return f"{1e3 * tolerance:g} mm"
