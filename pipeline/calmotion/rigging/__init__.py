"""Rigging of a character as a robot: hinges for the rotations of its skeleton, bodies cut from its skin; joints and
trees for rigid parts from their motion.

This package computes with arrays; `usd.rigging` reads the skeleton and writes the layer. Its interface:
`links.make_links`, `hinge_rows.hinges_for`, `part_trees.seat_parts`.
"""
