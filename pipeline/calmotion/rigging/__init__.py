"""From a skinned character to a robot: hinges that perform a skeleton's rotations, bodies cut from the skin.

Arrays alone; `usd.rigging` reads the skeleton and writes the layer. From the outside: `links.make_links`,
`hinge_rows.hinges_for`, `cutting.cut_skin`, `materials.MATERIALS`. Importing the package alone loads nothing.
"""
