"""Growth of the run time with bodies, duration and modes.

`calmotion bench scaling [--quick]` measures, in one run and with one thread,

- time per step of chains of 4 to 128 flexible links, of 1,000 to 100,000 steps, and of 4 to 64 modes in a link, with
  the exponents of their growth;
- a step of a tree of 14 flexible bodies of 10 modes.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np
from calmotion.arrays import Array
from calmotion.linear_algebra import one_blas_thread
from calmotion.model import Character
from calmotion.multibody import (
    Model,
    ReducedBody,
    Workspace,
    compile_model,
    equilibrium,
    rigid_state,
    simulate_on,
    span_tree,
)
from calmotion.testing import branched_links, link_chain

from ..common.reporting import bench_parser, keep, show
from ..common.timing import median_time

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
    angles, rates = motion(model, steps)
    ws = Workspace.for_system(model.system)
    start, _ = equilibrium(model.system, rigid_state(model, angles[0]), angles[0], ws)
    simulate_on(model.system, start, start, angles[:3], rates[:3], STEP, ws)  # compiles
    run = partial(simulate_on, model.system, start, start, angles, rates, STEP, ws)
    return median_time(run, repeats, warm=True) / (steps - 1)


def growths(
    bodies: Sequence[int] = BODIES, durations: Sequence[int] = DURATIONS, modes: Sequence[int] = MODES
) -> list[Growth]:
    """The three laws of growth; that of the duration is of the whole time."""
    chains = [step_time(prepared(*link_chain(count, 4)), 300) for count in bodies]
    one = prepared(*link_chain(1, 4))
    lasting = [steps * step_time(one, steps, 3 if steps < 50_000 else 1) for steps in durations]
    rich = [step_time(prepared(*link_chain(1, count, 12)), 400) for count in modes]
    return [
        Growth("bodies", tuple(bodies), tuple(chains)),
        Growth("steps", tuple(durations), tuple(lasting)),
        Growth("modes in a body", tuple(modes), tuple(rich)),
    ]


@one_blas_thread()
def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("scaling", __doc__)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller sizes")
    options = parser.parse_args(arguments)
    measured = growths((4, 8, 16, 32), (1_000, 5_000), (4, 8, 16, 32)) if options.quick else growths()
    tree = step_time(prepared(*branched_links()), 400)
    keep(options, Growth, measured)
    if options.json:
        rows = [asdict(growth) | {"exponent": growth.exponent} for growth in measured]
        print(json.dumps({"growth": rows, "tree_step_s": tree}))
        return 0
    for growth in measured:
        cells = [[str(v), f"{1e6 * seconds:.0f}"] for v, seconds in zip(growth.values, growth.seconds, strict=True)]
        show(f"{growth.name}: exponent {growth.exponent:.2f}", [growth.name, "time [us]"], cells)
    print(f"a step of 14 bodies of 10 modes: {1e6 * tree:.0f} us")
    return 0
