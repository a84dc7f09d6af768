"""Offsets and motors that the optimiser leaves unchanged."""
