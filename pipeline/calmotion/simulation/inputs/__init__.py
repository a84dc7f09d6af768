"""Inputs of a simulation: time grid, motor curves, moving roots, gears, input shapers."""
