"""Bodies: mass, shapes, materials, interfaces, flexible settings."""
