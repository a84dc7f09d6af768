"""What shakes? The command `diagnose`, and the same in Python."""

from calmotion.host import registration
from calmotion.public_names import public_names

register, unregister = registration()

__getattr__, __dir__ = public_names(__name__)
