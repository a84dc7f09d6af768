"""How run time grows: with bodies, with duration, with modes; and against a sparse solver and against Exudyn.

`calmotion bench scaling [--quick] [--figures DIR] [--json]` measures, in one run and with one thread,

- time per step of chains of 4 to 128 flexible links, of 1,000 to 100,000 steps, and of 4 to 64 modes in a link, with
  the exponents of their growth;
- for a tree of 14 flexible bodies of 10 modes, a step against SuperLU (scipy's `splu`) of the same matrix;
- where `exudyn` is installed (the optional extra `bench`), the swung arm against its reduced flexible bodies at equal
  error.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from calmotion.benchmarks.common.timing import median_time
from calmotion.benchmarks.scenes.beam_arm import beam_arm
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.shot import Body, Character
from calmotion.shot.character import Array
from calmotion.simulation.bodies import reduce_bodies

STEP = 1.0 / 480.0
BODIES, DURATIONS, MODES = (4, 8, 16, 32, 64, 128), (1_000, 10_000, 100_000), (4, 8, 16, 32, 64)


@dataclass(frozen=True)
class Growth:
    """A quantity, times of a step for its values [s], and the exponent of a power law through them."""

    name: str
    values: tuple[int, ...]
    seconds: tuple[float, ...]

    @property
    def exponent(self) -> float:
        """Slope of log(seconds) over log(values)."""
        return float(np.polyfit(np.log(self.values), np.log(self.seconds), 1)[0])


def links(count: int, modes: int, cells: int = 4) -> tuple[Character, list[ReducedBody]]:
    """A chain of steel links that are all the same reduced body, with a load; every joint has a motor."""
    made = {"length": 0.1, "youngs_modulus": 2.1e11, "density": 7800.0, "elasticity": "linear", "modes": modes}
    short, meshes = beam_arm(links=2, cells=cells, **made)  # type: ignore[arg-type]
    bodies = reduce_bodies(short, span_tree(short), meshes)
    if count == 1:
        single, own = beam_arm(links=1, cells=cells, **made)  # type: ignore[arg-type]
        return single, reduce_bodies(single, span_tree(single), own)
    chain, _ = beam_arm(links=count, cells=cells, **made)  # type: ignore[arg-type]
    load = body_anchors(chain, span_tree(chain))[-1]
    return chain, [bodies[0]] * count + [rigid_body(chain.bodies[-1], load)]


def branches() -> tuple[Character, list[ReducedBody]]:
    """A tree of 14 links with 10 modes each: a trunk of 2 and four limbs of 3, no loads."""
    chain, bodies = links(14, 10)
    parents = [-1, 0] + [1 if k % 3 == 0 else k + 1 for k in range(12)]
    moved = [replace(joint, body0=p) for joint, p in zip(chain.joints[:14], parents, strict=True)]
    moved[0] = chain.joints[0]
    items: tuple[Body, ...] = chain.bodies[:14]
    target = replace(chain.targets[0], body=13)
    tree = replace(chain, bodies=items, joints=tuple(moved), motors=chain.motors[:14], targets=(target,))
    # all joints beyond a link's root sit on its end, so that one reduced body with one moving interface serves them all
    root, end = bodies[0].markers[:2]
    shared = []
    for anchors in body_anchors(tree, span_tree(tree)):
        beyond = len(anchors.joints) - 1 + len(anchors.targets)
        shared.append(replace(bodies[0], markers=(root, *[end] * beyond)))
    return tree, shared


def prepared(character: Character, bodies: Sequence[ReducedBody]) -> Model:
    """The compiled model."""
    return compile_model(character, span_tree(character), bodies)


def motion(model: Model, steps: int) -> tuple[Array, Array]:
    """Angles and rates of all joints in a gentle wave."""
    t = STEP * np.arange(steps + 1)
    driven = (model.motor >= 0).astype(float)
    return np.outer(2e-3 * (1.0 - np.cos(6.0 * t)), driven), np.outer(12e-3 * np.sin(6.0 * t), driven)


def step_time(model: Model, steps: int, repeats: int = 3) -> float:
    """Median time of a step [s], without the static start."""
    from calmotion.multibody.analysis.kinematics import rigid_state
    from calmotion.multibody.statics.equilibrium import equilibrium

    angles, rates = motion(model, steps)
    ws = Workspace.for_system(model.system)
    start, _ = equilibrium(model.system, rigid_state(model, angles[0]), angles[0], ws)
    simulate(model.system, start, angles[:3], rates[:3], STEP, ws, settled=False)
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        simulate(model.system, start, angles, rates, STEP, ws, settled=False)
        times.append(time.perf_counter() - begin)
    return float(np.median(times)) / steps


def growths(
    bodies: Sequence[int] = BODIES, durations: Sequence[int] = DURATIONS, modes: Sequence[int] = MODES
) -> list[Growth]:
    """The three laws of growth; that of the duration is of the whole time."""
    chains = [step_time(prepared(*links(count, 4)), 300) for count in bodies]
    one = prepared(*links(1, 4))
    lasting = [steps * step_time(one, steps, 3 if steps < 50_000 else 1) for steps in durations]
    rich = [step_time(prepared(*links(1, count, 12)), 400) for count in modes]
    return [
        Growth("bodies", tuple(bodies), tuple(chains)), Growth("steps", tuple(durations), tuple(lasting)),
        Growth("modes in a body", tuple(modes), tuple(rich)),
    ]  # fmt: skip


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
    from calmotion.multibody.integrators.schemes import bdf2_scheme
    from calmotion.multibody.kernels.assembly import assemble

    model = prepared(*branches())
    system, ws = model.system, Workspace.for_system(model.system)
    angles, rates = motion(model, 5)
    state, scheme = rigid_state(model, angles[0]), bdf2_scheme(STEP)
    Hv = np.zeros((len(system.parent), 4, 4))
    Hv[:, 0, 0] = scheme.velocity
    Hv[:, 1:, 1:] = scheme.velocity * np.eye(3)
    assemble(
        system, scheme, state.c, state.q, state.u, state.V, np.zeros_like(state.V), state.lam, angles[3], rates[3], Hv,
        True, ws.work, ws.blocks,
    )  # fmt: skip
    matrix = csc_matrix(dense_step_matrix(system, ws.blocks))
    right = np.random.default_rng(0).normal(size=matrix.shape[0])
    K, factors = ws.blocks.K.copy(), ws.factors
    rows = split(system, right)
    x, lam = (np.zeros_like(part) for part in rows)

    def ours() -> None:
        solve_again(system, ws.blocks, factors, K, *rows, x, lam, ws.scratch.block, INSIDE)

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
    parser = argparse.ArgumentParser(prog="calmotion bench scaling", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller sizes")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout, and nothing else there")
    parser.add_argument("--figures", metavar="DIR", help="also draw the laws of growth, to this folder")
    options = parser.parse_args(arguments)
    found = growths((4, 8, 16, 32), (1_000, 5_000), (4, 8, 16, 32)) if options.quick else growths()
    sparse = against_splu()
    from calmotion.benchmarks.scenes import exudyn_arm

    peers = exudyn_arm.compare() if exudyn_arm.installed() and not options.quick else []
    figures = []
    if options.figures:
        from calmotion.benchmarks.speed.scaling_figure import draw

        figures.append(draw(options.figures, found, peers))
    if options.json:
        print(json.dumps(_report(found, sparse, peers) | {"figures": figures}))
        return 0
    _print(found, sparse, peers)
    for figure in figures:
        print(f"wrote {figure}")
    return 0


def _report(found: Sequence[Growth], sparse: Sparse, peers: list[Any]) -> dict[str, Any]:
    from calmotion.benchmarks.scenes.exudyn_arm import LEVELS, time_at

    codes = [code for code in dict.fromkeys(run.code for run in peers) if code != "exudyn"]
    return {
        "growth": [asdict(item) | {"exponent": item.exponent} for item in found],
        "sparse": asdict(sparse) | {"times_faster": sparse.splu_s / sparse.ours_s},
        "exudyn": [asdict(run) for run in peers],
        "times_faster_than_exudyn": [
            {"code": code, "error_m": level, "ratio": time_at(peers, "exudyn", level) / time_at(peers, code, level)}
            for code in codes
            for level in LEVELS
        ],
    }


def _print(found: Sequence[Growth], sparse: Sparse, peers: list[Any]) -> None:
    from calmotion.cli.tables import console_on, print_table

    report = _report(found, sparse, peers)
    console = console_on(sys.stdout)
    for item in found:
        shown = [
            [f"{value:,}", f"{1e6 * seconds:,.0f}"] for value, seconds in zip(item.values, item.seconds, strict=True)
        ]
        print_table(console, f"{item.name}: exponent {item.exponent:.2f}", [item.name, "time [us]"], shown, texts=0)
    console.print(
        f"14 bodies of 10 modes ({sparse.unknowns} unknowns): factorisation and solution {1e6 * sparse.ours_s:.0f} us, "
        f"SuperLU {1e6 * sparse.splu_s:.0f} us ({sparse.splu_s / sparse.ours_s:.1f} times as long; solutions agree to "
        f"{sparse.difference:.0e}); a whole step {1e6 * sparse.step_s:.0f} us"
    )
    if not peers:
        console.print("Exudyn is not compared: install the extra `bench`, and leave out --quick")
        return
    shown = [[run.code, str(run.steps), f"{run.error:.1e}", f"{run.wall_s:.4f}"] for run in peers]
    print_table(console, "The swung arm, 14 modes", ["code", "steps", "error [m]", "time [s]"], shown)
    for row in report["times_faster_than_exudyn"]:
        console.print(
            f"{row['code']}: {row['ratio']:.1f} times faster than Exudyn at an error of {row['error_m']:.0e} m"
        )


if __name__ == "__main__":
    sys.exit(main())
