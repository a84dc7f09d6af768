"""From finite elements to a reduced flexible body (`reduce.reduce_body` -> `reduced_body.ReducedBody`)."""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
