"""Comparison of the integrators: orders, a stiff nonlinear scene, and the numerical damping of BDF2.

`calmotion bench integrators [--json]` measures

- errors of positions and velocities against the step, on a flexible arm with a driven joint and on a four-bar with a
  flexible coupler, against Radau IIA at a fine step;
- the outcome for two thin steel links in a fast motion at the working step: RK4 fails at once, even
  with steps thousands of times smaller, Newmark fails later, BDF2 runs to the end;
- the numerical damping of an undamped vibration by BDF2, for several numbers of steps in a period.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import asdict

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import show
from calmotion.benchmarks.integrators.integrator_errors import (
    Fate,
    Measured,
    Scene,
    arm_scene,
    damping,
    fates,
    four_bar_scene,
    order_of,
    orders,
    stiff_scene,
)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("integrators", __doc__)
    output_options(parser)
    options = parser.parse_args(arguments)
    scenes: dict[str, Callable[[], Scene]] = {"flexible arm": arm_scene, "four-bar, flexible coupler": four_bar_scene}
    measured = {name: orders(make()) for name, make in scenes.items()}
    outcomes, damped = fates(stiff_scene()), damping()
    if options.json:
        report: dict[str, object] = {name: [asdict(row) for row in rows] for name, rows in measured.items()}
        columns = ("steps_in_a_period", "measured", "of_the_root")
        ratios = [dict(zip(columns, row, strict=True)) for row in damped]
        print(json.dumps({"orders": report, "stiff": [asdict(fate) for fate in outcomes], "bdf2_damping": ratios}))
    else:
        print_tables(measured, outcomes, damped)
    return 0


def print_tables(
    measured: dict[str, list[Measured]], outcomes: list[Fate], damped: list[tuple[int, float, float]]
) -> None:
    """The tables for a person."""
    for name, rows in measured.items():
        shown = [
            [
                row.integrator, f"{1e3 * row.step_s:.3g}", f"{row.position_error:.1e}", f"{row.velocity_error:.1e}",
                f"{row.wall_s:.3f}",
            ]
            for row in rows
        ]  # fmt: skip
        show(f"Errors: {name}", ["integrator", "step [ms]", "position [m]", "velocity", "time [s]"], shown)
        found = [
            [one, *(f"{order_of(rows, one, error):.2f}" for error in ("position_error", "velocity_error"))]
            for one in dict.fromkeys(row.integrator for row in rows)
        ]
        show(f"Orders: {name}", ["integrator", "position", "velocity"], found)
    fated = [[f.integrator, f"{f.step_s:.2g}", f.outcome, f"{f.ends_s:.4g}", f"{f.wall_s:.2f}"] for f in outcomes]
    show("Two thin steel links", ["integrator", "step [s]", "outcome", "at [s]", "time [s]"], fated)
    ratios = [[str(count), f"{100 * one:.3g} %", f"{100 * other:.3g} %"] for count, one, other in damped]
    show("Damping of BDF2", ["steps in a period", "measured", "of the root"], ratios, texts=0)


if __name__ == "__main__":
    sys.exit(main())
