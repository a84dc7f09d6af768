"""Surfaces and tetrahedra as geometry: closed surfaces, orientation, distances, solids."""
