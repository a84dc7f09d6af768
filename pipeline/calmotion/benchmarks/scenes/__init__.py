"""Characters and mechanisms that benchmarks build."""
