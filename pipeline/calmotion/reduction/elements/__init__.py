"""Quadratic tetrahedra: assembly, embedding of points, strains, second-order forces."""
