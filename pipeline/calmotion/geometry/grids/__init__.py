"""Tetrahedra of a regular grid, and what meshes made for a surface need: the fit of their boundary, no contacts."""
