"""The border to USD: only this package and plugins import pxr, and nothing imports this package before it is used.

Shared by reading and writing: `stages` opens a shot and refuses a broken one, `gf` crosses between Gf/Vt and NumPy,
`units` between stage units and SI, `clock` between time codes and seconds, `layers` writes atomically. `reading` turns
a shot into a Character and an Animation, `writing` turns a Result into a layer.
"""

from calmotion.public_names import public_names
from calmotion.support import interrupts
from calmotion.support.memory import require_address_space

_LIBRARIES = 1.15e9  # address space of the libraries of USD, and of its threads on two cores [bytes]

require_address_space(_LIBRARIES, "USD")  # which would crash
with interrupts.deferred():  # USD goes on with half of its modules when the import of one is interrupted
    from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdShade, UsdSkel, UsdUtils, Vt  # noqa: F401

__getattr__, __dir__ = public_names(__name__)
