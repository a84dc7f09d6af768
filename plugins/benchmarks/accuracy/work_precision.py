"""Error against run time for all settings of the simulation, against a reference with a measured error.

`calmotion bench work-precision [SHOT ...] [--csv FILE] [--figures DIR]` simulates each shot as animated with many
settings: step and integrator, reduction, POD subspace, elastic law, and the choices of `--tolerance`. The
error is the largest distance of any target, at any frame, to a reference with a much smaller step and many more
coordinates. The error of the reference is shown as its error bar; smaller errors cannot be compared. Times are medians
of the simulation. The choices for each tolerance are compared with the fastest setting that keeps the tolerance.
All settings have the first meshes of the shot: what meshes cost is measured by `calmotion bench tolerances`.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial

from calmotion.model import FEMeshes, RunSettings, tolerance_of
from calmotion.simulation import MAX_STEP, CompiledShot, reduction_for
from calmotion.tolerance import by_fast_scheme, chosen_step, converged_reduction, project_to_tolerance

from ..common.reporting import bench_parser, cells_of, heads_of, keep, show
from ..common.shots import SAMPLES, load_unreduced
from ..common.timing import machine
from .reference_bench import BASE, REPEATS, TOLERANCES, Bench, Point, Reference, over_fastest, setting_of

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
    """The choices of the program, without a tolerance and with several, all on the meshes of the reference."""
    shot = bench.shot
    meshes = FEMeshes(tuple(replace(mesh, given=True) for mesh in shot.meshes.meshes))  # or they would be refined
    default = bench.bodies(tolerance_of(shot.character))
    points = [bench.measure(reference, "default", "default", default, MAX_STEP)]
    for tolerance in tolerances:
        options = RunSettings(tolerance=tolerance)
        reduction = reduction_for(shot.character, shot.animation, meshes, options, repeats=True)
        converged = converged_reduction(bench.compiled(reduction.bodies(tolerance)), reduction, options)
        held = project_to_tolerance(converged.shot, options, converged.known)
        choice = partial(_step_and_integrator, held.shot, converged.error_m + held.error_m)
        step, integrator = by_fast_scheme(options, choice)
        setting = setting_of(tolerance)
        points.append(bench.measure(reference, "tolerance", setting, held.shot.bodies, step, integrator))
    return points


def _step_and_integrator(shot: CompiledShot, left_out: float, options: RunSettings) -> tuple[float, str]:
    return chosen_step(shot, options, left_out)[0], options.scheme


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("work-precision", __doc__, SAMPLES)
    parser.add_argument("--figures", metavar="DIR", help="also draw error against run time, to this folder")
    parser.add_argument("--repeats", type=int, default=REPEATS, help="repetitions; times are medians")
    options = parser.parse_args(arguments)
    points: list[Point] = []
    bars: dict[str, float] = {}
    ratios: dict[str, dict[float, float]] = {}
    figures: list[str] = []
    for path in options.shots:
        bench = Bench(load_unreduced(path), options.repeats)
        reference, name = bench.reference(), bench.shot.name
        own = forward_points(bench, reference) + chosen_points(bench, reference)
        points += own
        keep(options, Point, points)
        bars[name], fastest = reference.bar_m, over_fastest(own, TOLERANCES)
        ratios[name] = {tolerance: ratio for tolerance, (ratio, _) in fastest.items()}
        if options.figures:
            from .figure import draw_work_precision

            figures.append(draw_work_precision(options.figures, own, bars[name]))
        if not options.json:
            title = f"{name}: against a reference that is known to {1e3 * bars[name]:.2g} mm"
            show(title, heads_of(Point), [cells_of(point) for point in own])
            for tolerance, (ratio, best) in fastest.items():
                print(
                    f"{setting_of(tolerance)}: {ratio:.2f} times the run time of the fastest setting that keeps it "
                    f"({best.series}, {best.setting}, {best.coordinates} coordinates)"
                )
    if options.json:
        report = {"machine": machine(), "reference_error_m": bars, "points": [asdict(point) for point in points]}
        print(json.dumps(report | {"figures": figures, "over_fastest": ratios}))
    else:
        for figure in figures:
            print(f"wrote {figure}")
    return 0
