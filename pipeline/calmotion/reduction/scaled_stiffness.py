"""A reduced body of another stiffness, or of another density."""

from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.reduced_body import Elasticity, Invariants, ReducedBody
from calmotion.reduction.subspace import projected_body


def with_scaled_stiffness(body: ReducedBody, factor: float) -> ReducedBody:
    """The body with all elastic forces multiplied by a factor; its mass, modes and damping are the same."""
    return replace(
        body,
        stiffness=factor * body.stiffness,
        elasticity=None if body.elasticity is None else _scaled(body.elasticity, len(body.stiffness), factor),
    )


def with_graded_stiffness(body: ReducedBody, exponent: float) -> ReducedBody:
    """The body with the stiffness of each mode multiplied by (its frequency over the lowest)^exponent.

    A mesh is the stiffer the higher the mode, and so are a model of the material and of what it leaves out: an exponent
    of 0.01 makes a mode of e times the lowest frequency one per cent stiffer.
    """
    if exponent == 0.0 or not len(body.stiffness) or body.stiffness.min() <= 0.0:
        return body
    return with_mode_stiffness(body, (body.stiffness / body.stiffness.min()) ** (0.5 * exponent))


def with_mode_stiffness(body: ReducedBody, factors: Array) -> ReducedBody:
    """The body with the stiffness of each coordinate multiplied by a factor of its own, shape [r]; its damping is the
    same."""
    law = body.elasticity
    if law is not None and law.law == "stvk":
        # the strain of each mode grows, that of pairs of modes does not: the energy is still a sum of squares
        law = _with_strains(law, np.sqrt(factors), 1.0)
    elif law is not None:
        data, r = law.data.copy(), len(factors)
        data[: r * r] += np.diag((factors - 1.0) * body.stiffness).ravel()
        law = replace(law, data=data)
    return replace(body, stiffness=factors * body.stiffness, elasticity=law)


def with_scaled_strain(body: ReducedBody, factor: float) -> ReducedBody:
    """The body with the part of its strain that is quadratic in the coordinates multiplied by a factor.

    Bodies of another law than `stvk` stay as they are.
    """
    law = body.elasticity
    if law is None or law.law != "stvk" or factor == 1.0:
        return body
    return replace(body, elasticity=_with_strains(law, np.ones(len(body.stiffness)), factor))


def _with_strains(law: Elasticity, linear: Array, quadratic: float) -> Elasticity:
    """A `stvk` law with the strain of each coordinate multiplied by a factor, shape [r], and that of pairs by one."""
    size = round(np.sqrt(len(law.data)))
    scale = np.concatenate([linear, np.full(size - len(linear), quadratic)])
    return replace(law, data=(law.data.reshape(size, size) * np.outer(scale, scale)).ravel())


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
