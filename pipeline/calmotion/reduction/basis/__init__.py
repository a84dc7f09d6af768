"""Reduced bases: Craig-Bampton modes, residual vectors, modal derivatives, quadratic-strain subspace."""
