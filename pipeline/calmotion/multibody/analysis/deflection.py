"""Deflection of bodies: a cause of failed simulations, and the sag of a robot."""

from typing import NamedTuple

import numpy as np

from calmotion.multibody.model.system import State, System


class Deflection(NamedTuple):
    """Deflection of one component.

    Attributes:
        component: Its index.
        distance: Largest displacement of one of its joints relative to the joint that carries it [m].
        length: Undeformed distance of these two joints [m].
    """

    component: int
    distance: float
    length: float

    @property
    def share(self) -> float:
        """Deflection over length."""
        return self.distance / self.length if self.length > 0.0 else 0.0


def deflections(system: System, state: State) -> list[Deflection]:
    """Deflection of every component that has modes and joints beyond the one that carries it."""
    result = []
    for b, r in enumerate(system.modes):
        markers = [(j, k) for j, pair in enumerate(system.side) for k in (0, 1) if pair[k] == b and (j, k) != (b, 1)]
        if not r or not markers:
            continue
        root = system.position[b, 1]
        displaced = [float(np.linalg.norm(system.Phi[j, k, :, :r] @ state.u[b, :r])) for j, k in markers]
        worst = int(np.argmax(displaced))
        length = float(np.linalg.norm(system.position[markers[worst]] - root))
        result.append(Deflection(b, displaced[worst], length))
    return result


def largest_deflection(system: System, state: State) -> Deflection | None:
    """Deflection of the component with the largest ratio to its length; None for a rigid robot."""
    return max(deflections(system, state), key=lambda deflection: deflection.share, default=None)
