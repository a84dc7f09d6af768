"""The border to USD: only this package and plugins import pxr, and they import it only when called.

Shared by reading and writing: `stages` opens a shot and refuses a broken one, `gf` crosses between Gf/Vt and NumPy,
`units` between stage units and SI, `clock` between time codes and seconds, `layers` writes atomically. `reading` turns
a shot into a Character and an Animation, `writing` turns a Result into a layer.
"""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
