"""Tetrahedra of regular grids."""
