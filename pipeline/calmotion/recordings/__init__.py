"""What sensors recorded of a robot: its values, the base of its readers, which plugins bring, and reading by them."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
