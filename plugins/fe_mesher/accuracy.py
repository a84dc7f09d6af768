"""How accurate the first frequencies of a mesh are, and with which elements they would be accurate enough."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from calmotion.accuracy.element_size import ACCURACY, MAX_NODES, Shape, smallest_size
from calmotion.errors import ShotError
from calmotion.shot import Body, Character, Frame

_COUNT = 3  # frequencies: those that a motion excites
_APART, _RESERVE = 1.15, 2.0  # least ratio of element sizes of two meshes that are compared; factor on what they tell
# The estimate is 1.2 to 3 times the true error of clamped beams and plates on meshes that are nearly fine enough, and
# more on links with many edges (`calmotion bench meshing` shows both), so up to twice the wanted error it
# counts as reached.
_ENOUGH = 2.0 * ACCURACY


@dataclass(frozen=True, eq=False)
class Accuracy:
    """Of a mesh.

    Attributes:
        error: Estimated relative error of its first frequency, or of a higher one weighed by what it adds to a
            deflection.
        nodes: Of its ten-node tetrahedra.
        frequencies: [Hz], shape [3]; empty where only the error is known.
    """

    error: float
    nodes: int
    frequencies: np.ndarray = field(default_factory=lambda: np.zeros(0))


def carrier_of(character: Character, index: int) -> Frame | None:
    """Where the joint towards the world takes hold of a body, in its frame; None without one."""
    return next((joint.frame1 for joint in character.joints if joint.body1 == index), None)


def estimate(points: np.ndarray, tets: np.ndarray, body: Body, carrier: Frame | None) -> Accuracy:
    """The error of the first frequencies, the body held where its parent holds it.

    Args:
        points: [m], shape [n, 3].
        tets: Shape [m, 4].
        body: With `flexible` settings.
        carrier: Where that is; None leaves the body free.
    """
    from calmotion.reduction.discretization_error import frequency_errors
    from calmotion.reduction.elements.assembly import assemble

    assert body.flexible is not None
    model = assemble(points, tets, body.flexible.material)
    found, errors = frequency_errors(model, body.flexible.material, _COUNT, _held(model.mesh, body, carrier))
    return Accuracy(_weighed(errors, found), len(model.mesh.nodes), found)


def compared(coarse: Accuracy, fine: Accuracy) -> Accuracy:
    """The accuracy of the finer of two meshes, which the difference between them may show to be better than estimated.

    Recovered strains see kinks in thin shells as errors that they are not. Where elements shrink by r, an error that
    falls with their square is (f1 - f2) / (r^2 - 1) on the finer mesh; twice that is believed.
    """
    ratio = (fine.nodes / coarse.nodes) ** (1.0 / 3.0)
    if ratio < _APART:
        return fine
    change = _weighed(np.abs(coarse.frequencies / fine.frequencies - 1.0), fine.frequencies)
    return replace(fine, error=min(fine.error, _RESERVE * change / (ratio**2 - 1.0)))


def finer(size: float, found: Accuracy, shape: Shape) -> float | None:
    """Element size [m] that should be accurate enough, within the limit of nodes; None where this one is, or is least.

    Args:
        size: Of the mesh that was judged [m].
        found: The judgement.
        shape: Of the body.
    """
    if found.error <= _ENOUGH:
        return None
    # next to a clamp or an inner corner the error falls with the square of the size
    wanted = size * max(np.sqrt(0.8 * _ENOUGH / found.error), 0.5)
    least = max(smallest_size(shape, MAX_NODES), size * (found.nodes / MAX_NODES) ** 0.4)
    smaller = max(float(wanted), least)
    return smaller if smaller < 0.95 * size else None


def remark(found: Accuracy) -> tuple[str, ...]:
    """What the user must know of a mesh that is less accurate than wanted."""
    if found.error <= _ENOUGH:
        return ()
    return (
        f"its first frequencies are estimated to be up to {100.0 * found.error:.2g}% too high ({found.nodes} nodes), "
        f"where {100.0 * ACCURACY:.2g}% are wanted: author a smaller calm:flexible:elementSize for more",
    )


def _weighed(errors: np.ndarray, frequencies: np.ndarray) -> float:
    """The largest error of a mode times its flexibility, relative to the first one's."""
    return float((errors * (frequencies[0] / frequencies) ** 2).max())


def _held(mesh, body: Body, carrier: Frame | None) -> np.ndarray | None:
    from calmotion.reduction.interfaces.interface_patches import AttachmentFrame, interface_patches

    assert body.flexible is not None
    if carrier is None:
        return None
    try:
        anchor = AttachmentFrame(body.path, carrier, "interface")
        return interface_patches(mesh, [anchor], body.flexible.interface_radius, body.path)[0].nodes
    except ShotError:
        return None  # the reduction, which knows the joint, refuses it
