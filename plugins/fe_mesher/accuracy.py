"""Accuracy of the first frequencies of a mesh, and the element size that is accurate enough."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from calmotion.accuracy.element_size import ACCURACY, MAX_NODES, Shape, smallest_size
from calmotion.errors import ShotError
from calmotion.shot import Body, Character, Frame

if TYPE_CHECKING:
    from calmotion.reduction.elements.assembly import QuadraticMesh

_COUNT = 3  # frequencies that a motion excites
_APART, _RESERVE = 1.15, 2.0  # least ratio of element sizes of compared meshes; safety factor of the result
# The estimate is 1.2 to 3 times the true error of clamped beams and plates on meshes that are nearly fine enough, and
# larger for links with many edges (see `calmotion bench meshing`). Twice the wanted error is therefore accepted.
_ENOUGH = 2.0 * ACCURACY


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Accuracy of a mesh.

    Attributes:
        error: Estimated relative error of its first frequency, or of a higher one weighted by its flexibility.
        nodes: Number of nodes of its quadratic tetrahedra.
        frequencies: [Hz], shape [3]; empty where only the error is known.
    """

    error: float
    nodes: int
    frequencies: np.ndarray = field(default_factory=lambda: np.zeros(0))


def carrier_of(character: Character, index: int) -> Frame | None:
    """Frame on a body of the joint to its parent, body frame; None without a joint."""
    return next((joint.frame1 for joint in character.joints if joint.body1 == index), None)


def estimate(points: np.ndarray, tets: np.ndarray, body: Body, carrier: Frame | None) -> Accuracy:
    """Estimated error of the first frequencies of a body that is clamped at its parent joint.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4].
        body: With `flexible` settings.
        carrier: Frame of this joint; None for a free body.
    """
    from calmotion.reduction.discretization_error import frequency_errors
    from calmotion.reduction.elements.assembly import assemble

    assert body.flexible is not None
    model = assemble(points, tets, body.flexible.material)
    clamped = _clamped_nodes(model.mesh, body, carrier)
    frequencies, errors = frequency_errors(model, body.flexible.material, _COUNT, clamped)
    return Accuracy(_weighted(errors, frequencies), len(model.mesh.nodes), frequencies)


def compared(coarse: Accuracy, fine: Accuracy) -> Accuracy:
    """The accuracy of the finer of two meshes, from its own estimate or, if that is smaller, from their difference.

    Recovered strains overestimate the error at kinks of thin shells. With a ratio r of element sizes, an error of
    second order is (f1 - f2) / (r^2 - 1) on the finer mesh; twice that is used.
    """
    ratio = (fine.nodes / coarse.nodes) ** (1.0 / 3.0)
    if ratio < _APART:
        return fine
    change = _weighted(np.abs(coarse.frequencies / fine.frequencies - 1.0), fine.frequencies)
    return replace(fine, error=min(fine.error, _RESERVE * change / (ratio**2 - 1.0)))


def finer(size: float, accuracy: Accuracy, shape: Shape) -> float | None:
    """Element size that is accurate enough within the limit of nodes [m]; None where a finer mesh is not needed or not
    allowed.

    Args:
        size: Of the mesh [m].
        accuracy: Of the mesh.
        shape: Of the body.
    """
    if accuracy.error <= _ENOUGH:
        return None
    # at a clamp or a reentrant corner the error is of second order
    wanted = size * max(np.sqrt(0.8 * _ENOUGH / accuracy.error), 0.5)
    least = max(smallest_size(shape, MAX_NODES), size * (accuracy.nodes / MAX_NODES) ** 0.4)
    smaller = max(float(wanted), least)
    return smaller if smaller < 0.95 * size else None


def remark(accuracy: Accuracy) -> tuple[str, ...]:
    """Message about a mesh that is less accurate than wanted."""
    if accuracy.error <= _ENOUGH:
        return ()
    return (
        f"estimated error of the first frequencies: {100.0 * accuracy.error:.2g}% ({accuracy.nodes} nodes), "
        f"more than {100.0 * ACCURACY:.2g}%: author a smaller calm:flexible:elementSize to reduce it",
    )


def _weighted(errors: np.ndarray, frequencies: np.ndarray) -> float:
    """The largest error of a mode times its flexibility relative to the first mode."""
    return float((errors * (frequencies[0] / frequencies) ** 2).max())


def _clamped_nodes(mesh: QuadraticMesh, body: Body, carrier: Frame | None) -> np.ndarray | None:
    from calmotion.reduction.interfaces.interface_patches import AttachmentFrame, interface_patches

    assert body.flexible is not None
    if carrier is None:
        return None
    try:
        attachment = AttachmentFrame(body.path, carrier, "interface")
        return interface_patches(mesh, [attachment], body.flexible.interface_radius, body.path)[0].nodes
    except ShotError:
        return None  # the reduction reports the error with the joint
