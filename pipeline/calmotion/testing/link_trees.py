"""Chains and trees of many equal links: one reduced body serves them all, so that they are made in no time."""

from __future__ import annotations

from dataclasses import replace

from calmotion.model import Body, Character
from calmotion.multibody import ReducedBody
from calmotion.multibody.model.model import body_anchors, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.bodies import reduce_bodies
from calmotion.testing.beam_arms import beam_arm


def link_chain(count: int, modes: int, cells: int = 4) -> tuple[Character, list[ReducedBody]]:
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


def branched_links() -> tuple[Character, list[ReducedBody]]:
    """A tree of 14 links with 10 modes each: a trunk of 2 and four limbs of 3, no loads."""
    chain, bodies = link_chain(14, 10)
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
