"""Tetrahedra on a grid, for solids that TetWild does not fill."""
