"""Offsets, intervals and motors that the optimiser leaves unchanged."""
