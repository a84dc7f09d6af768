"""From a skinned character to a robot: hinges that perform a skeleton's rotations, bodies cut from the skin.

Arrays alone; `usd.rigging` reads the skeleton and writes the layer.
"""

from .cutting import cut_skin
from .hinge_rows import HingeRow, follow, hinges_for

__all__ = ["HingeRow", "cut_skin", "follow", "hinges_for"]
