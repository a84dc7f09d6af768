"""Gradients, Gauss-Newton against L-BFGS, and input shapers as baselines."""
