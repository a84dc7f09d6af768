"""How far bodies bend: what tells a user why a simulation went wrong, or how far a robot sags."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from calmotion.multibody.model.system import State, System


class Bend(NamedTuple):
    """Deflection of one component.

    Attributes:
        component: Which.
        distance: Largest displacement of one of its joints against the one that carries it [m].
        length: Distance of these two, undeformed [m].
    """

    component: int
    distance: float
    length: float

    @property
    def share(self) -> float:
        """Deflection over length."""
        return self.distance / self.length if self.length > 0.0 else 0.0


def bends(system: System, state: State) -> list[Bend]:
    """Deflection of every component that has elastic coordinates and joints beyond the one that carries it."""
    found = []
    for b, r in enumerate(system.elastic):
        markers = [(j, k) for j, pair in enumerate(system.side) for k in (0, 1) if pair[k] == b and (j, k) != (b, 1)]
        if not r or not markers:
            continue
        root = system.position[b, 1]
        moved = [float(np.linalg.norm(system.Phi[j, k] @ state.u[b])) for j, k in markers]
        worst = int(np.argmax(moved))
        length = float(np.linalg.norm(system.position[markers[worst]] - root))
        found.append(Bend(b, moved[worst], length))
    return found


def most_bent(system: System, state: State) -> Bend | None:
    """The component that bends most for its length, None where nothing can bend."""
    return max(bends(system, state), key=lambda bend: bend.share, default=None)
