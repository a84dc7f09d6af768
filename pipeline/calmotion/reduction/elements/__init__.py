"""Quadratic tetrahedra: assembly, embedding of points, strains, forces of second order."""
