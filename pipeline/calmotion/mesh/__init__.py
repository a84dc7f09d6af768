"""From what a link is made of to tetrahedra with interface patches."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
