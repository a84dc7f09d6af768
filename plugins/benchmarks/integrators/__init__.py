"""Comparison of integrators, and where each is stable."""
