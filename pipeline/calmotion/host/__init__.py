"""The host of plugins: it finds and registers them, orders their operators by data, and runs those that are needed."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
