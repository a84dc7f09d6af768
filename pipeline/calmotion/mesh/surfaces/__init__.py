"""Closed surfaces of triangles: distances, sides, slits, likeness, decimation."""
