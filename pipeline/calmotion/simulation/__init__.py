"""A shot simulated: inputs over a time grid, the forward run, cyclic shots, the report."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
