"""Rigging of a skinned character as a robot: hinges for the rotations of its skeleton, bodies cut from its skin.

This package computes with arrays; `usd.rigging` reads the skeleton and writes the layer. Its interface:
`links.make_links`, `hinge_rows.hinges_for`, `cutting.cut_skin`.
"""
