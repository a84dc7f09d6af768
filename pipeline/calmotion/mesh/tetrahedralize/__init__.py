"""Tetrahedra that fill a closed solid."""
