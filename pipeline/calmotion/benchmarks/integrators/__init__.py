"""Comparison and stability of integrators, accuracy of gradients."""
