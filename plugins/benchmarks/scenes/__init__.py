"""Characters that benchmarks build or read."""
