"""A reduced body of another stiffness, such as the one that a finer mesh would give, or of another density."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from calmotion.reduction.reduced_body import Elasticity, Invariants, ReducedBody
from calmotion.reduction.subspace import projected_body


def with_scaled_stiffness(body: ReducedBody, factor: float) -> ReducedBody:
    """The body with all elastic forces multiplied by a factor; its mass, modes and damping are the same."""
    return replace(
        body,
        stiffness=factor * body.stiffness,
        elasticity=None if body.elasticity is None else _scaled(body.elasticity, len(body.stiffness), factor),
    )


def with_scaled_density(body: ReducedBody, factor: float) -> ReducedBody:
    """The body with its mass multiplied by a factor, its elastic forces unchanged; its modes have unit mass again.

    The damping is that of the same body without more mass; who knows its material sets it anew.
    """
    if factor == 1.0:
        return body
    given = body.invariants
    heavier = Invariants(
        factor * given.mass, factor * given.s, factor * given.Z, factor * given.M, factor * given.M3,
        factor * given.M4, factor * given.S,
    )  # fmt: skip
    body = replace(body, invariants=heavier)
    return projected_body(body, np.eye(len(body.stiffness)) / np.sqrt(factor)) if len(body.stiffness) else body


def _scaled(law: Elasticity, r: int, factor: float) -> Elasticity:
    if law.law == "stvk":
        return replace(law, data=factor * law.data)
    # the correction of the stiffness; the cubature points follow from Lame's constants
    data = law.data.copy()
    data[: r * r] *= factor
    return replace(law, data=data, lame=(factor * law.lame[0], factor * law.lame[1]))
