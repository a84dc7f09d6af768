"""What robots are made of: the tables of materials and of real motors, to which users add their own."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
