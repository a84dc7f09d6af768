"""A reduced body of another stiffness, such as the one that a finer mesh would give, or of another density."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.reduction.reduced_body import Elasticity, Invariants, ReducedBody
from calmotion.reduction.subspace import projected_body, projected_law

_SOFTEST = 0.1  # share of a stiffness: a mesh that is off by more is of no use


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


def with_interface_stiffness(body: ReducedBody, patches: Sequence[int], own: Array, finer: Array) -> ReducedBody:
    """The body with the static stiffness of its interfaces that a finer mesh has.

    Coarse elements are too stiff by another share in bending than in twist, so that no common factor is right. The
    energy E(q) of the body becomes E(S q), where S stretches the static response q to wrenches on the interfaces, by
    the root of the share of each. Terms that cancel in a bent body, such as those of its stretching, still do; a change
    of the linear stiffness alone would leave a part of them.

    Args:
        body: With diagonal mass and stiffness.
        patches: A marker of each of the p moving interfaces.
        own: Static stiffness of the interfaces on its mesh, shape [6p, 6p].
        finer: The same of the finer mesh.
    """
    from scipy.linalg import eigh

    if not len(body.stiffness) or not len(patches):
        return body
    shares, wrenches = eigh(_symmetric(finer), _symmetric(own))
    # response of the coordinates to the wrenches own @ wrenches, of energy one half each
    response = (_motion(body, patches) / body.stiffness).T @ (own @ wrenches)
    stretch = np.sqrt(np.maximum(shares, _SOFTEST)) - 1.0
    S = np.eye(len(response)) + (response * stretch) @ (response.T * body.stiffness)
    values, T = _modes(S.T @ (body.stiffness[:, None] * S), body.invariants.M)
    law = None if body.elasticity is None else projected_law(body.elasticity, S @ T)
    return replace(projected_body(replace(body, elasticity=None), T), stiffness=values, elasticity=law)


def _motion(body: ReducedBody, patches: Sequence[int]) -> Array:
    """Motions of interfaces by the coordinates, shape [6p, r]."""
    return np.vstack([np.vstack([body.markers[i].Phi, body.markers[i].Psi]) for i in patches])


def _modes(K: Array, M: Array) -> tuple[Array, Array]:
    """Squares of the frequencies of a body, and its modes, of unit mass and a sign that rounding does not decide."""
    from scipy.linalg import eigh

    values, T = eigh(_symmetric(K), _symmetric(M))
    return values, T * np.where(T[np.abs(T).argmax(axis=0), np.arange(len(T))] < 0.0, -1.0, 1.0)


def _symmetric(A: Array) -> Array:
    return np.asarray(0.5 * (A + A.T))


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
