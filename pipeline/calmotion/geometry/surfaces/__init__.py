"""Surfaces of triangles."""
