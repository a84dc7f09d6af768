"""Growth of the run time with bodies, duration and modes, and comparison with a sparse solver, Exudyn and MuJoCo.

`calmotion bench scaling [--quick] [--figures DIR] [--json]` measures, in one run and with one thread,

- time per step of chains of 4 to 128 flexible links, of 1,000 to 100,000 steps, and of 4 to 64 modes in a link, with
  the exponents of their growth;
- for a tree of 14 flexible bodies of 10 modes, a step against SuperLU (scipy's `splu`) of the same matrix;
- where they are installed (the optional extra `bench`), the swung arm against Exudyn's reduced flexible bodies and
  against a chain of as many rigid segments in MuJoCo, at equal error.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.timing import median_time
from calmotion.benchmarks.speed.growth import STEP, Growth, branches, growths, motion, prepared, step_time
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.multibody.integrators.workspace import Workspace

NAMES = {"exudyn": "Exudyn's reduced body", "mujoco": "MuJoCo's chain"}
INSIDE = 20  # solutions in one call of the kernel, as many steps are taken in one call of a simulation


@dataclass(frozen=True)
class Sparse:
    """A step of the tree of 14 bodies against SuperLU of the same matrix.

    Attributes:
        unknowns, entries: Of the matrix.
        step_s: A whole step of ours: assembly, factorisation, all solutions.
        ours_s: Factorisation and one solution.
        splu_s: The same by SuperLU, the matrix given.
        difference: Largest relative difference of the two solutions.
    """

    unknowns: int
    entries: int
    step_s: float
    ours_s: float
    splu_s: float
    difference: float


def against_splu(repeats: int = 200) -> Sparse:
    """Measure `Sparse`."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    from calmotion.benchmarks.speed.step_matrix import dense_step_matrix, flat, solve_again, split
    from calmotion.multibody.analysis.kinematics import rigid_state
    from calmotion.multibody.integrators.coefficients import bdf2_integrator
    from calmotion.multibody.kernels.assembly import assemble

    model = prepared(*branches())
    system, ws = model.system, Workspace.for_system(model.system)
    angles, rates = motion(model, 5)
    state, integrator = rigid_state(model, angles[0]), bdf2_integrator(STEP)
    Hv = np.zeros((len(system.parent), 4, 4))
    Hv[:, 0, 0] = integrator.velocity
    Hv[:, 1:, 1:] = integrator.velocity * np.eye(3)
    Vd = np.zeros_like(state.V)
    assemble(system, integrator, state, Vd, angles[3], rates[3], Hv, True, ws.work, ws.blocks)
    matrix = csc_matrix(dense_step_matrix(system, ws.blocks))
    right = np.random.default_rng(0).normal(size=matrix.shape[0])
    K = ws.blocks.K.copy()
    rows = split(system, right)
    x, lam = (np.zeros_like(part) for part in rows)

    def ours() -> None:
        solve_again(system, ws.blocks, ws.matrix, K, *rows, x, lam, ws.scratch.solution.block, INSIDE)

    theirs = splu(matrix).solve(right)
    ours()
    difference = float(np.abs(flat(system, x, lam) - theirs).max() / np.abs(theirs).max())
    return Sparse(
        matrix.shape[0], matrix.nnz, step_time(model, 400), median_time(ours, max(5, repeats // INSIDE)) / INSIDE,
        median_time(lambda: splu(matrix).solve(right), max(5, repeats // 10)), difference,
    )  # fmt: skip


@one_blas_thread()
def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("scaling", __doc__)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller sizes")
    output_options(parser)
    parser.add_argument("--figures", metavar="DIR", help="also draw the laws of growth, to this folder")
    options = parser.parse_args(arguments)
    measured = growths((4, 8, 16, 32), (1_000, 5_000), (4, 8, 16, 32)) if options.quick else growths()
    sparse = against_splu()
    peers = [] if options.quick else _peers()
    figures = []
    if options.figures:
        from calmotion.benchmarks.speed.scaling_figure import draw

        figures.append(draw(options.figures, measured, peers))
    if options.json:
        print(json.dumps(_report(measured, sparse, peers) | {"figures": figures}))
        return 0
    _print(measured, sparse, peers)
    for figure in figures:
        print(f"wrote {figure}")
    return 0


def _peers() -> list[Any]:
    """The swung arm by the codes that are installed, and by ours."""
    from calmotion.benchmarks.scenes import exudyn_arm, mujoco_arm

    codes: dict[str, Any] = {}
    if exudyn_arm.installed():
        codes["exudyn"] = exudyn_arm.Exudyn()
    if mujoco_arm.installed():
        codes["mujoco"] = mujoco_arm.MujocoChain()
    return exudyn_arm.compare(codes)


def _times_faster(peers: list[Any], peer: str) -> list[dict[str, Any]]:
    """Run time of a peer over that of each of our integrators, at equal errors; empty without the peer."""
    from calmotion.benchmarks.scenes.exudyn_arm import LEVELS, time_at

    codes = list(dict.fromkeys(run.code for run in peers))
    return [
        {"code": code, "error_m": level, "ratio": time_at(peers, peer, level) / time_at(peers, code, level)}
        for code in codes
        if code not in NAMES and peer in codes
        for level in LEVELS
    ]


def _report(measured: Sequence[Growth], sparse: Sparse, peers: list[Any]) -> dict[str, Any]:
    return {
        "growth": [asdict(growth) | {"exponent": growth.exponent} for growth in measured],
        "sparse": asdict(sparse) | {"times_faster": sparse.splu_s / sparse.ours_s},
        "exudyn": [asdict(run) for run in peers if run.code != "mujoco"],
        "times_faster_than_exudyn": _times_faster(peers, "exudyn"),
        "mujoco": [asdict(run) for run in peers if run.code == "mujoco"],
        "times_faster_than_mujoco": _times_faster(peers, "mujoco"),
    }


def _print(measured: Sequence[Growth], sparse: Sparse, peers: list[Any]) -> None:
    from calmotion.cli.tables import console_on, print_table

    report = _report(measured, sparse, peers)
    console = console_on(sys.stdout)
    for growth in measured:
        shown = [
            [f"{value:,}", f"{1e6 * seconds:,.0f}"]
            for value, seconds in zip(growth.values, growth.seconds, strict=True)
        ]
        title = f"{growth.name}: exponent {growth.exponent:.2f}"
        print_table(console, title, [growth.name, "time [us]"], shown, texts=0)
    console.print(
        f"14 bodies of 10 modes ({sparse.unknowns} unknowns): factorisation and solution {1e6 * sparse.ours_s:.0f} us, "
        f"SuperLU {1e6 * sparse.splu_s:.0f} us ({sparse.splu_s / sparse.ours_s:.1f} times as long; solutions agree to "
        f"{sparse.difference:.0e}); a whole step {1e6 * sparse.step_s:.0f} us"
    )
    missing = [title for code, title in NAMES.items() if code not in {run.code for run in peers}]
    if missing:
        console.print(f"not compared: {', '.join(missing)}; install the extra `bench`, and leave out --quick")
    if not peers:
        return
    shown = [[run.code, str(run.steps), f"{run.error:.1e}", f"{run.wall_s:.4f}"] for run in peers]
    print_table(console, "The swung arm, 14 coordinates", ["code", "steps", "error [m]", "time [s]"], shown)
    for code, title in NAMES.items():
        for row in report[f"times_faster_than_{code}"]:
            console.print(
                f"{row['code']}: {row['ratio']:.3g} times as fast as {title} at an error of {row['error_m']:.0e} m"
            )


if __name__ == "__main__":
    sys.exit(main())
