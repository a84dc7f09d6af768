"""What the mesher of a body is told: settings of the user, and the solid."""

from dataclasses import dataclass

from calmotion.mesh.element_sizes import Shape
from calmotion.mesh.repair.closed_solid import Solid
from calmotion.mesh.tetrahedralize.tetwild import TIME_LIMIT


@dataclass(frozen=True)
class MeshOptions:
    """Settings of the user.

    Attributes:
        element_size: [m]; negative: that of the shot.
        time_limit: Of the processor time of the meshes of one body [s].
        cache: Whether the cache is used.
    """

    element_size: float = -1.0
    time_limit: float = TIME_LIMIT
    cache: bool = True


@dataclass(frozen=True, eq=False)
class Volume:
    """A solid to be meshed, its dimensions, and the requested size of its elements [m] (not positive: automatic)."""

    solid: Solid
    shape: Shape
    size: float
