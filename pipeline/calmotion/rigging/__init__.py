"""Rigging of a skinned character as a robot: hinges for the rotations of its skeleton, bodies cut from its skin.

Beside it stand the tables of what robots are made of: materials and real motors.

This package computes with arrays; `usd.rigging` reads the skeleton and writes the layer. Its interface:
`links.make_links`, `hinge_rows.hinges_for`, `cutting.cut_skin`, `materials.MATERIALS`, `motor_types.motor_types`.
"""

from calmotion.public_names import public_names

__getattr__, __dir__ = public_names(__name__)
