"""Commands of motor controllers, as data, and the curves that players make of them."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
