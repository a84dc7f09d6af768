"""Benchmarks of motors that give: what they cost, and what commands for them bring."""
