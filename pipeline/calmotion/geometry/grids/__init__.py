"""Tetrahedra of a regular grid, and their fit to a surface."""
