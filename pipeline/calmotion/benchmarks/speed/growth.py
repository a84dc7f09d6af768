"""Growth of the run time of a step with the number of links and modes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.benchmarks.scenes.beam_arm import beam_arm
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
        single, meshes = beam_arm(links=1, cells=cells, **made)  # type: ignore[arg-type]
        return single, reduce_bodies(single, span_tree(single), meshes)
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
    simulate(model.system, start, angles[:3], rates[:3], STEP, ws, from_equilibrium=False)
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        simulate(model.system, start, angles, rates, STEP, ws, from_equilibrium=False)
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
