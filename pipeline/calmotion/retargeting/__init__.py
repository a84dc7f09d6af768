"""The optimiser: motor offsets that remove the vibration."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
