"""Error control: what may be left out, reduction, time step, integrator, and verification of the result."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
