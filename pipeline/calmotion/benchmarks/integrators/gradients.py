"""Accuracy and run time of the gradients of both adjoints, against central differences.

`calmotion bench gradients [SHOT ...]` computes the gradient of each shot's objective by the discrete and by the
continuous adjoint at decreasing steps. It compares them with central differences of the whole simulation along random
directions, at the same step (error of the discrete objective) and at a quarter of the smallest step (error of the
continuous objective).
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict

from calmotion.benchmarks.common.parsers import shots_parser
from calmotion.benchmarks.common.shots import load
from calmotion.benchmarks.integrators.gradient_error import GradientError, errors


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = shots_parser("gradients", __doc__)
    parser.add_argument("--figures", metavar="DIR", help="also draw error against run time, to this folder")
    options = parser.parse_args(arguments)
    measured: list[GradientError] = []
    for name in options.shots:
        measured += errors(load(name))
        if not options.json:
            print_gradients(measured, measured[-1].shot)
    figures = []
    if options.figures:
        from calmotion.benchmarks.integrators.gradient_figure import draw

        figures.append(draw(options.figures, measured))
    if options.json:
        print(json.dumps({"gradients": [asdict(row) for row in measured], "figures": figures}))
        return 0
    for figure in figures:
        print(figure)
    return 0


def print_gradients(measured: Sequence[GradientError], name: str) -> None:
    """The table of one shot for a person."""
    from calmotion.cli.tables import console_on, print_table

    heads = ["adjoint", "step", "simulation", "gradient", "error, same step", "floor", "error, finest step"]
    rows = [
        [
            row.adjoint, f"1/{1.0 / row.step_s:.0f} s", f"{row.forward_s:.3f} s", f"{row.gradient_s:.3f} s",
            f"{row.same_step:.1e}", f"{row.floor:.1e}", f"{row.fine:.1e}",
        ]
        for row in measured if row.shot == name
    ]  # fmt: skip
    print_table(console_on(sys.stdout), f"{name}: gradients against central differences", heads, rows)


if __name__ == "__main__":
    sys.exit(main())
