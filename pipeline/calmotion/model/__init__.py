"""What a shot is, as plain data in SI units: read by plugins, solved by the engine, written by plugins."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
