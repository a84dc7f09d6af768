"""What a grid or its points tell of a solid and of the tetrahedra that fill it."""
