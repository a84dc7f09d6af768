"""Benchmarks of watched shots."""
