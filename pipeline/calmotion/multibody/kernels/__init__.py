"""Compiled kernels: rotations, markers, joint rows, inertia, elastic forces, assembly."""
