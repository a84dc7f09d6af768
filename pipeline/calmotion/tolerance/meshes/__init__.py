"""Meshes that are as fine as the tolerance asks for."""
