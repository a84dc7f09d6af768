"""The settings whose error and run time `calmotion bench work-precision` compares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from calmotion.model import RunSettings, tolerance_of
from calmotion.simulation import MAX_STEP, CompiledShot, reduction_for
from calmotion.tolerance import by_fast_scheme, chosen_step, converged_reduction, project_to_tolerance

from .reference_bench import BASE, TOLERANCES, Bench, Point, Reference, setting_of

STEPS = (1 / 60, 1 / 120, 1 / 240, 1 / 480, 1 / 960, 1 / 1920)
FINER_STEPS = (1 / 3840, 1 / 7680)  # too, where directions are fine enough: the tightest tolerances ask for them
MODES = (1, 2, 4, 8, 16)
LEVELS = (5e-4, 5e-6)  # what holding bodies to directions may change in the runs that vary step and integrator [m]
DIRECTIONS = (1e-3, 1e-4, 1e-5, 1e-6)  # and in those that vary it
CUBATURE = 1e-3  # the reduction of Neo-Hookean bodies: their cubature takes minutes for finer ones [m]
REDUCTIONS = (1e-2, 1e-3, 1e-4, BASE, 1e-6)


def forward_points(bench: Bench, reference: Reference) -> list[Point]:
    """Steps and integrators, reductions, pairs, directions, modes, laws."""
    base = bench.bodies(BASE)
    held = [bench.held(base, allowed) for allowed in LEVELS]
    points = [
        bench.measure(reference, integrator, f"1/{1 / step:.0f} s", bodies, step, integrator)
        for bodies, steps in zip(held, [*[STEPS] * (len(held) - 1), STEPS + FINER_STEPS], strict=True)
        for integrator in ("bdf2", "newmark", "generalized-alpha")
        for step in steps
    ]
    fine = 0.5 * MAX_STEP
    for allowed in DIRECTIONS:
        points.append(
            bench.measure(reference, "directions", f"to {1e3 * allowed:g} mm", bench.held(base, allowed), fine)
        )
    every = bench.measure(reference, "directions", "all", base, fine)
    points.append(every)
    for tolerance in REDUCTIONS:
        series, setting = "reduction", f"to {1e3 * tolerance:g} mm"
        if tolerance == BASE:  # the same simulation
            points.append(replace(every, series=series, setting=setting))
        else:
            points.append(bench.measure(reference, series, setting, bench.bodies(tolerance), fine))
    points.append(bench.measure(reference, "pairs", "all", bench.bodies(BASE, pairs_share=0.0), fine))
    for count in MODES:
        points.append(bench.measure(reference, "modes", f"{count} modes", bench.bodies(BASE, mode_count=count), fine))
    for law, tolerance in (("linear", BASE), ("stvk", BASE), ("neohookean", CUBATURE)):
        points.append(bench.measure(reference, "law", law, bench.bodies(tolerance, elasticity=law), fine))
    return points


def chosen_points(bench: Bench, reference: Reference, tolerances: Sequence[float] = TOLERANCES) -> list[Point]:
    """The choices of the program, without a tolerance and with several."""
    shot = bench.shot
    default = bench.bodies(tolerance_of(shot.character))
    points = [bench.measure(reference, "default", "default", default, MAX_STEP)]
    for tolerance in tolerances:
        options = RunSettings(tolerance=tolerance)
        reduction = reduction_for(shot.character, shot.animation, shot.meshes, options, repeats=True)
        converged = converged_reduction(bench.compiled(reduction.bodies(tolerance)), reduction, options)
        held = project_to_tolerance(converged.shot, options, converged.known)
        choice = partial(_step_and_integrator, held.shot, converged.error_m + held.error_m)
        step, integrator = by_fast_scheme(options, choice)
        setting = setting_of(tolerance)
        points.append(bench.measure(reference, "tolerance", setting, held.shot.bodies, step, integrator))
    return points


def _step_and_integrator(shot: CompiledShot, left_out: float, options: RunSettings) -> tuple[float, str]:
    return chosen_step(shot, options, left_out)[0], options.scheme
