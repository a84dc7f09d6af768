"""A reduced body of another stiffness, such as the one that a finer mesh would give."""

from __future__ import annotations

from dataclasses import replace

from calmotion.reduction.reduced_body import Elasticity, ReducedBody


def with_scaled_stiffness(body: ReducedBody, factor: float) -> ReducedBody:
    """The body with all elastic forces multiplied by a factor; its mass, modes and damping are the same."""
    return replace(
        body,
        stiffness=factor * body.stiffness,
        elasticity=None if body.elasticity is None else _scaled(body.elasticity, len(body.stiffness), factor),
    )


def _scaled(law: Elasticity, r: int, factor: float) -> Elasticity:
    if law.law == "stvk":
        return replace(law, data=factor * law.data)
    # the correction of the stiffness; the cubature points follow from Lame's constants
    data = law.data.copy()
    data[: r * r] *= factor
    return replace(law, data=data, lame=(factor * law.lame[0], factor * law.lame[1]))
