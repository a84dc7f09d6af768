"""The reduced basis: Craig-Bampton modes, residual vectors, modal derivatives, quadratic-strain subspace."""
